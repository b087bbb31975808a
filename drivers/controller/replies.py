"""What a Modbus reply must look like, judged on the bytes, before the library may decode them.

The library matches replies with requests by the transaction id alone, skips foreign units without a word, and throws
what it cannot decode into the event loop. Sources: MODBUS Application Protocol V1.1b3 (PDU), MODBUS Messaging on
TCP/IP V1.0b (MBAP header).
"""

from __future__ import annotations

import struct

from drivers.controller.errors import ControllerNonsense

READ_REGISTERS = 3
WRITE_REGISTER = 6
WRITE_REGISTERS = 16
EXCEPTION = 0x80
MBAP_HEADER = struct.Struct(">HHHB")  # transaction, protocol, bytes that follow (unit included), unit
_UP_TO_LENGTH = 6


def is_complete_tcp(request: bytes, received: bytes) -> bool:
    """True when `received` is the whole reply to `request`, False while it is the beginning of one.

    request: the frame that was sent, empty where none is pending. received: all bytes that came since.
    ControllerNonsense: it is not, and cannot become, the reply.
    """
    if not request:
        raise ControllerNonsense(f"{len(received)} bytes came though no request was pending")
    if len(received) <= MBAP_HEADER.size:
        return False
    transaction, protocol, length, unit = MBAP_HEADER.unpack_from(received)
    sent_transaction, _, _, sent_unit = MBAP_HEADER.unpack_from(request)
    _must_be("protocol identifier", protocol, 0)
    _must_be("transaction", transaction, sent_transaction)
    _must_be("device id", unit, sent_unit)
    asked = request[MBAP_HEADER.size :]
    _must_be("length", length, 1 + _pdu_length(asked, received[MBAP_HEADER.size]))
    if len(received) < _UP_TO_LENGTH + length:
        return False
    _must_be("frame's number of bytes", len(received), _UP_TO_LENGTH + length)
    _check_pdu(asked, received[MBAP_HEADER.size :])
    return True


def _pdu_length(asked: bytes, function_code: int) -> int:
    """Bytes of the reply's PDU, which the request and the reply's function code fix."""
    if function_code == asked[0] | EXCEPTION:
        return 2
    _must_be("function code", function_code, asked[0])
    if function_code == READ_REGISTERS:
        return 2 + 2 * _count(asked)
    return 5


def _check_pdu(asked: bytes, reply: bytes) -> None:
    """Compare what the reply repeats of the request; raise ControllerNonsense."""
    if reply[0] & EXCEPTION:
        return
    if reply[0] == READ_REGISTERS:
        _must_be("byte count", reply[1], 2 * _count(asked))
        return
    address, second = struct.unpack_from(">HH", reply, 1)
    asked_address, asked_second = struct.unpack_from(">HH", asked, 1)
    _must_be("address", address, asked_address)
    _must_be("value" if reply[0] == WRITE_REGISTER else "register count", second, asked_second)


def _count(asked: bytes) -> int:
    return int.from_bytes(asked[3:5], "big")


def _must_be(name: str, seen: int, expected: int) -> None:
    if seen != expected:
        raise ControllerNonsense(f"the reply's {name} is {seen}, expected {expected}")
