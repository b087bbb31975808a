"""Registers and the values in them: 16- and 32-bit integers at the offsets of a block, in either word order."""

from __future__ import annotations

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


def unpack(table: Sequence[Field], registers: Sequence[int], word_order: WordOrder) -> dict[str, int]:
    """The values of a block by name."""
    values = {}
    for field in table:
        words = registers[field.offset : field.offset + field.width]
        value = 0
        for word in words if word_order == "big" else reversed(words):
            value = value << 16 | word
        values[field.name] = value - (1 << 32) if field.kind == "i32" and value >> 31 else value
    return values


def words32(values: Sequence[int] | NDArray[np.integer], word_order: WordOrder) -> tuple[int, ...]:
    """Two registers for each 32-bit value, in the values' order; negative ones as two's complement.

    The values are known to fit (i32 or u32): what does not fit would be cut.
    """
    stream = np.asarray(values, dtype=np.int64).astype(">u4").tobytes()
    words = np.frombuffer(stream, dtype=">u2").reshape(-1, 2)
    return tuple((words if word_order == "big" else words[:, ::-1]).ravel().tolist())
