"""Values in registers."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.controller import MailboxError
from drivers.controller.mailbox.words import Unpacking, fields, pack, words32

TABLE = fields((0, "short", "u16"), (1, "long", "u32"), (4, "signed", "i32"))
ORDERS = st.sampled_from(["big", "little"])


@given(st.integers(0, 0xFFFF), st.integers(0, 2**32 - 1), st.integers(-(2**31), 2**31 - 1), ORDERS)
def test_what_is_packed_is_unpacked(short: int, long: int, signed: int, order: str) -> None:
    values = {"short": short, "long": long, "signed": signed}
    registers = pack(TABLE, values, 7, order)
    assert len(registers) == 7
    assert registers[3] == registers[6] == 0
    assert Unpacking(TABLE)(registers, order) == values


@given(st.lists(st.integers(-(2**31), 2**32 - 1), max_size=20))
def test_big_word_order_is_the_order_of_network_bytes(values: list[int]) -> None:
    stream = b"".join(struct.pack(">I", value & 0xFFFFFFFF) for value in values)
    registers = words32(values, "big")
    assert struct.pack(f">{len(registers)}H", *registers) == stream
    assert words32(values, "little") == tuple(registers[at ^ 1] for at in range(len(registers)))


@pytest.mark.parametrize(
    ("name", "value"),
    [("short", 65536), ("short", -1), ("long", 2**32), ("long", -1), ("signed", 2**31), ("signed", -(2**31) - 1)],
)
def test_a_value_out_of_its_range_is_refused_by_name(name: str, value: int) -> None:
    with pytest.raises(MailboxError, match=f"{name} is {value}, expected"):
        pack(TABLE, {"short": 0, "long": 0, "signed": 0, name: value}, 7, "big")
