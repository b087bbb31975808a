"""Anything at all, thrown at what reads from the wire: it is waited with, taken for what it is, or refused.

`fuzz(cases, seed)` runs as many cases as it is told; `make test` runs a few, the soak 100,000.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from hypothesis import Phase, given, seed, settings
from hypothesis import strategies as st

from drivers.controller import ControllerNonsense, MailboxError
from drivers.controller.mailbox.blocks import decode_link, decode_service, encode_link, encode_service
from drivers.controller.mailbox.page_spans import page_starts, spans
from drivers.controller.modbus.framing import Framing, RtuFraming, TcpFraming
from drivers.controller.modbus.requests import (
    LONGEST_READ,
    Request,
    read_registers,
    registers_of,
    stream_of,
    write_register,
    write_registers,
)
from tests.support.controller.rtu_frames import crc16

U16 = st.integers(0, 0xFFFF)
DEVICE = 17
WORD_ORDERS = st.sampled_from(["big", "little"])


@st.composite
def requests(draw: st.DrawFn) -> Request:
    """Any request of the three kinds that the driver sends."""
    function_code = draw(st.sampled_from([3, 6, 16]))
    if function_code == 3:
        return read_registers(draw(U16), draw(st.integers(1, 125)))
    if function_code == 6:
        return write_register(draw(U16), draw(U16))
    return write_registers(draw(U16), draw(st.binary(min_size=1, max_size=123)) * 2)


def right_pdu(request: Request) -> bytes:
    """The reply's PDU as the standard asks for it, from the request's bytes."""
    if request.pdu[0] == 3:
        count = int.from_bytes(request.pdu[3:5], "big")
        return bytes([3, 2 * count]) + stream_of([(number * 257) & 0xFFFF for number in range(count)])
    return request.pdu[:5]


def answers(pdu: bytes, request: Request) -> bool:
    """True where the standard lets `pdu` answer `request`; written from the standard, not from the driver."""
    function_code, asked = request.pdu[0], request.pdu
    if pdu[0] == function_code + 0x80:
        return len(pdu) == 2
    if pdu[0] != function_code:
        return False
    if function_code == 3:
        count = asked[3] << 8 | asked[4]
        return len(pdu) == 2 + 2 * count and pdu[1] == 2 * count
    return pdu == asked[:5]


def tcp_frame(sent: bytes, pdu: bytes) -> bytes:
    """A reply's frame to the request's frame `sent`."""
    return sent[:4] + struct.pack(">HB", len(pdu) + 1, sent[6]) + pdu


def rtu_frame(sent: bytes, pdu: bytes) -> bytes:
    """A reply's frame to the request's frame `sent`."""
    return sent[:1] + pdu + crc16(sent[:1] + pdu)


WAYS: tuple[tuple[type[TcpFraming | RtuFraming], Callable[[bytes, bytes], bytes]], ...] = (
    (TcpFraming, tcp_frame),
    (RtuFraming, rtu_frame),
)


@st.composite
def received(draw: st.DrawFn, sent: bytes, request: Request, frame: Callable[[bytes, bytes], bytes]) -> bytes:
    """Garbage, or a reply to this or another request, cut, repeated, or with bytes changed, put in or taken out."""
    pdus = st.one_of(
        st.just(right_pdu(request)),
        requests().map(right_pdu),
        st.binary(min_size=1, max_size=253),
        st.integers(0, 255).map(lambda code: bytes([request.pdu[0] | 0x80, code])),
    )
    another = bytes(byte ^ 1 for byte in sent)  # its transaction and device are others
    data = draw(
        st.one_of(
            st.binary(max_size=300),
            pdus.map(lambda pdu: frame(sent, pdu)),
            pdus.map(lambda pdu: frame(another, pdu)),
        )
    )
    for _ in range(draw(st.integers(0, 3))):
        at = draw(st.integers(0, len(data)))
        new = draw(st.binary(max_size=3))
        data = data[:at] + new + data[at + draw(st.integers(0, 3)) :]
    return data * draw(st.sampled_from([1, 1, 1, 2]))


def one_reply(data: st.DataObject) -> None:
    """A request, and whatever comes for it, in whatever pieces."""
    kind, frame = data.draw(st.sampled_from(WAYS))
    frames: Framing = kind(DEVICE)
    request = data.draw(requests())
    sent = frames.request(request)
    stream = data.draw(received(sent, request, frame))
    cuts = data.draw(st.lists(st.integers(0, len(stream)), max_size=3))
    for end in sorted({*cuts, len(stream)}):
        try:
            taken = frames.reply(stream[:end])
        except ControllerNonsense:
            assert not answered_by(stream, sent, request, frame)
            return
        if taken is not None:
            assert answers(taken, request), "nonsense was accepted"
            assert stream[:end] == frame(sent, taken), "a frame that is none was accepted"
            if taken[0] == 3:
                assert stream_of(registers_of(taken)) == taken[2:]
            return
    assert not answered_by(stream, sent, request, frame), "the right reply was not seen"


def answered_by(stream: bytes, sent: bytes, request: Request, frame: Callable[[bytes, bytes], bytes]) -> bool:
    """True where `stream` is, byte by byte, a right reply's frame."""
    pdu = stream[7:] if frame is tcp_frame else stream[1:-2]
    return bool(pdu) and answers(pdu, request) and stream == frame(sent, pdu)


def one_block(data: st.DataObject) -> None:
    """Registers, as many and as large as they like, read as either block."""
    registers = data.draw(
        st.lists(U16, min_size=16, max_size=16) | st.lists(st.integers(-2, 0x1FFFF), max_size=20), label="registers"
    )
    word_order = data.draw(WORD_ORDERS)
    right = len(registers) == 16 and all(0 <= register <= 0xFFFF for register in registers)
    try:
        link, service = decode_link(registers, word_order), decode_service(registers, word_order)
    except MailboxError:
        assert not right
        return
    assert right
    assert list(encode_link(link, word_order)) == registers
    assert list(encode_service(service, word_order)) == [*registers[:14], 0, 0]


def one_torn_page(data: st.DataObject) -> None:
    """A header of anything, read back with a payload: the requests end, cover it once, and are none too long."""
    header = data.draw(st.lists(U16, min_size=31, max_size=31))
    length = 2 * data.draw(st.integers(0, 32_000))
    requests_of = spans([start for start in page_starts(header, length) if start >= 32], LONGEST_READ)
    assert sum(count for _, count in requests_of) == length
    assert all(1 <= count <= LONGEST_READ for _, count in requests_of)


PROPERTIES = {"reply": one_reply, "block": one_block, "torn page": one_torn_page}
SHARES = {"reply": 0.8, "block": 0.19, "torn page": 0.01}


def fuzz(cases: int, seed_value: int = 0) -> dict[str, int]:
    """Cases run of each property, `cases` in all; raises what a property raises at the smallest case that does."""
    return {name: _run(check, max(1, round(cases * SHARES[name])), seed_value) for name, check in PROPERTIES.items()}


def _run(check: Callable[[st.DataObject], None], cases: int, seed_value: int) -> int:
    count = 0

    def counted(data: st.DataObject) -> None:
        nonlocal count
        count += 1
        check(data)

    bounds = settings(
        max_examples=cases, deadline=None, database=None, derandomize=False, phases=[Phase.generate, Phase.shrink]
    )
    bounds(seed(seed_value)(given(data=st.data())(counted)))()
    return count
