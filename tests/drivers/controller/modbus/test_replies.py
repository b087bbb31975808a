"""The judgement of replies, on bytes alone."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.controller import ControllerNonsense
from drivers.controller.modbus.framing import Framing, RtuFraming, TcpFraming
from drivers.controller.modbus.requests import (
    Request,
    read_registers,
    registers_of,
    stream_of,
    write_register,
    write_registers,
)
from tests.support.controller.rtu_frames import crc16
from tests.support.controller.wire_fuzz import U16, requests, right_pdu

DEVICE = 7


class Tcp:
    """A conversation over TCP: the driver's frames, and the server's."""

    def __init__(self, earlier: int = 0) -> None:
        self.frames: Framing = TcpFraming(DEVICE, earlier)

    def ask(self, request: Request) -> None:
        self.head = self.frames.request(request)[:4]

    def frame(self, pdu: bytes) -> bytes:
        return self.head + struct.pack(">HB", len(pdu) + 1, DEVICE) + pdu

    @staticmethod
    def content(pdu: bytes) -> range:
        return range(9, 7 + len(pdu)) if pdu[0] == 3 else range(0)


class Rtu:
    """A conversation over RTU."""

    def __init__(self) -> None:
        self.frames: Framing = RtuFraming(DEVICE)

    def ask(self, request: Request) -> None:
        sent = self.frames.request(request)
        assert sent == bytes([DEVICE]) + request.pdu + crc16(bytes([DEVICE]) + request.pdu)

    @staticmethod
    def frame(pdu: bytes) -> bytes:
        return bytes([DEVICE]) + pdu + crc16(bytes([DEVICE]) + pdu)

    @staticmethod
    def content(pdu: bytes) -> range:
        return range(0)


WAYS = pytest.mark.parametrize("way", [Tcp, Rtu])


@WAYS
@given(request=requests(), data=st.data())
def test_every_beginning_of_the_right_reply_is_waited_with_and_the_whole_is_taken(
    way: type[Tcp | Rtu], request: Request, data: st.DataObject
) -> None:
    talk = way()
    talk.ask(request)
    pdu = data.draw(st.sampled_from([right_pdu(request), bytes([request.pdu[0] | 0x80, 2])]))
    frame = talk.frame(pdu)
    assert all(talk.frames.reply(frame[:length]) is None for length in range(len(frame)))
    assert talk.frames.reply(frame) == pdu


@WAYS
@given(request=requests(), data=st.data())
def test_a_reply_with_one_bit_wrong_is_never_taken_unless_only_its_content_could_tell(
    way: type[Tcp | Rtu], request: Request, data: st.DataObject
) -> None:
    talk = way()
    talk.ask(request)
    frame = bytearray(talk.frame(right_pdu(request)))
    content = talk.content(right_pdu(request))
    position = data.draw(st.integers(0, len(frame) - 1).filter(lambda at: at not in content))
    frame[position] ^= 1 << data.draw(st.integers(0, 7))
    with pytest.raises(ControllerNonsense, match="the reply's"):
        talk.frames.reply(bytes(frame))


@WAYS
@given(request=requests(), surplus=st.binary(min_size=1, max_size=300))
def test_bytes_after_the_reply_are_never_taken(way: type[Tcp | Rtu], request: Request, surplus: bytes) -> None:
    talk = way()
    talk.ask(request)
    with pytest.raises(ControllerNonsense, match="number of bytes"):
        talk.frames.reply(talk.frame(right_pdu(request)) + surplus)


@WAYS
@given(request=requests(), garbage=st.binary(max_size=300))
def test_garbage_is_waited_with_or_refused_and_nothing_else_happens(
    way: type[Tcp | Rtu], request: Request, garbage: bytes
) -> None:
    talk = way()
    talk.ask(request)
    try:
        assert talk.frames.reply(garbage) is None
    except ControllerNonsense:
        return


@WAYS
@given(asked=requests(), other=requests())
def test_the_right_reply_to_another_request_is_taken_only_where_it_reads_the_same(
    way: type[Tcp | Rtu], asked: Request, other: Request
) -> None:
    talk = way()
    talk.ask(asked)
    try:
        taken = talk.frames.reply(talk.frame(right_pdu(other)))
    except ControllerNonsense:
        assert right_pdu(other)[: len(asked.reply_head)] != asked.reply_head
    else:
        assert taken is None or taken == right_pdu(other)


def test_a_transaction_is_never_0_and_begins_again_after_65535() -> None:
    talk = Tcp(earlier=65534)
    request = read_registers(0, 1)
    talk.ask(request)
    assert talk.head == b"\xff\xff\0\0"
    talk.ask(request)
    assert talk.head == b"\0\1\0\0"


@given(st.lists(U16, min_size=1, max_size=125))
def test_registers_are_read_as_they_were_sent(registers: list[int]) -> None:
    assert list(registers_of(bytes([3, 2 * len(registers)]) + stream_of(registers))) == registers


def test_requests_are_told_to_people_by_both_numberings() -> None:
    assert str(read_registers(0, 16)) == "FC3 of registers 0 to 15 (400001 to 400016)"
    assert str(write_register(32, 5)) == "FC6 of register 32 (400033)"
    assert str(write_registers(33, bytes(4))) == "FC16 of registers 33 to 34 (400034 to 400035)"
