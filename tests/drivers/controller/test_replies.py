"""The judgement of replies, on bytes alone."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.controller import ControllerNonsense
from drivers.controller.replies import is_complete_tcp
from tests.drivers.controller.misbehaving_server import exception_reply, right_reply

U16 = st.integers(0, 0xFFFF)


@st.composite
def requests(draw: st.DrawFn) -> bytes:
    """Any request of the three kinds that the driver sends."""
    function_code = draw(st.sampled_from([3, 6, 16]))
    address = draw(U16)
    if function_code == 3:
        pdu = struct.pack(">BHH", 3, address, draw(st.integers(1, 125)))
    elif function_code == 6:
        pdu = struct.pack(">BHH", 6, address, draw(U16))
    else:
        count = draw(st.integers(1, 123))
        pdu = struct.pack(">BHHB", 16, address, count, 2 * count) + bytes(2 * count)
    return struct.pack(">HHHB", draw(U16), 0, len(pdu) + 1, draw(st.integers(1, 255))) + pdu


@given(requests(), st.data())
def test_every_beginning_of_the_right_reply_is_waited_with_and_the_whole_is_taken(
    request: bytes, data: st.DataObject
) -> None:
    reply = data.draw(st.sampled_from([right_reply(request), exception_reply(request, 2)]))
    assert not any(is_complete_tcp(request, reply[:length]) for length in range(len(reply)))
    assert is_complete_tcp(request, reply)


@given(requests(), st.data())
def test_a_reply_with_one_bit_wrong_is_never_taken_unless_it_is_content(request: bytes, data: st.DataObject) -> None:
    reply = bytearray(right_reply(request))
    content = range(9, len(reply)) if request[7] == 3 else range(0)
    position = data.draw(st.integers(0, len(reply) - 1).filter(lambda at: at not in content))
    reply[position] ^= 1 << data.draw(st.integers(0, 7))
    with pytest.raises(ControllerNonsense, match="the reply's"):
        is_complete_tcp(request, bytes(reply))


@given(requests(), st.binary(min_size=1, max_size=300))
def test_bytes_after_the_reply_are_never_taken(request: bytes, surplus: bytes) -> None:
    with pytest.raises(ControllerNonsense, match="number of bytes"):
        is_complete_tcp(request, right_reply(request) + surplus)


@given(requests(), st.binary(max_size=300))
def test_garbage_is_waited_with_or_refused_and_nothing_else_happens(request: bytes, garbage: bytes) -> None:
    try:
        complete = is_complete_tcp(request, garbage)
    except ControllerNonsense:
        return
    assert not complete or garbage[:2] == request[:2]


def test_bytes_without_a_request_are_nonsense() -> None:
    with pytest.raises(ControllerNonsense, match="3 bytes came though no request was pending"):
        is_complete_tcp(b"", b"abc")
