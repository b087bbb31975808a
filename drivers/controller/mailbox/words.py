"""Registers and the values in them: 16- and 32-bit integers at the offsets of a block, in either word order."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import index
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from drivers.controller.errors import MailboxError

WordOrder = Literal["big", "little"]
"""`big`: the register with the higher half comes first (ABCD). `little`: it comes second (CDAB)."""

Kind = Literal["u16", "u32", "i32"]
BOUNDS: dict[Kind, tuple[int, int]] = {"u16": (0, 0xFFFF), "u32": (0, 0xFFFFFFFF), "i32": (-(2**31), 2**31 - 1)}


@dataclass(frozen=True)
class Field:
    """One value of a block: the offset of its first register, its name, its type."""

    offset: int
    name: str
    kind: Kind

    @property
    def width(self) -> int:
        """Registers it takes."""
        return 1 if self.kind == "u16" else 2


def fields(*rows: tuple[int, str, Kind]) -> tuple[Field, ...]:
    """A block's table, from rows of offset, name, type."""
    return tuple(Field(*row) for row in rows)


def pack(table: Sequence[Field], values: Mapping[str, int], size: int, word_order: WordOrder) -> list[int]:
    """The block's `size` registers; the unnamed ones 0. MailboxError: a value out of its range."""
    registers = [0] * size
    for field in table:
        value = index(values[field.name])
        low, high = BOUNDS[field.kind]
        if not low <= value <= high:
            raise MailboxError(f"{field.name} is {value}, expected {low} to {high} ({field.kind})")
        if field.width == 1:
            registers[field.offset] = value
            continue
        words = (value >> 16 & 0xFFFF, value & 0xFFFF)
        registers[field.offset : field.offset + 2] = words if word_order == "big" else words[::-1]
    return registers


class Unpacking:
    """Takes a block apart in one step, since the controller's is read twenty times a second for ever."""

    def __init__(self, table: Sequence[Field]) -> None:
        codes = {"u16": "H", "u32": "I", "i32": "i"}
        self._names = tuple(field.name for field in table)
        layout = ">"
        places: list[int] = []
        for field in table:
            layout += "2x" * (field.offset - len(places)) + codes[field.kind]
            places += range(len(places), field.offset)
            places += range(field.offset, field.offset + field.width)[:: 1 - 2 * (field.width - 1)]
        self._struct = struct.Struct(layout)
        self._registers = struct.Struct(f">{len(places)}H")
        self._little = tuple(places)  # where the halves of 32-bit values change places

    def __call__(self, registers: Sequence[int], word_order: WordOrder) -> dict[str, int]:
        """The block's values by name; struct.error: a register beyond 16 bits."""
        count = len(self._little)
        words = registers[:count] if word_order == "big" else [registers[place] for place in self._little]
        return dict(zip(self._names, self._struct.unpack(self._registers.pack(*words)), strict=True))


def words32(values: Sequence[int] | NDArray[np.integer], word_order: WordOrder) -> tuple[int, ...]:
    """Two registers for each 32-bit value, in the values' order; negative ones as two's complement.

    The values are known to fit (i32 or u32): what does not fit would be cut.
    """
    stream = np.asarray(values, dtype=np.int64).astype(">u4").tobytes()
    words = np.frombuffer(stream, dtype=">u2").reshape(-1, 2)
    return tuple((words if word_order == "big" else words[:, ::-1]).ravel().tolist())
