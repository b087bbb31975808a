"""What a Modbus reply must look like, judged on its bytes: unit, function, address, count, value, length, CRC.

Sources: MODBUS Application Protocol V1.1b3 (PDU), MODBUS Messaging on TCP/IP V1.0b (MBAP header), MODBUS over Serial
Line V1.02 (RTU frame).
"""

from __future__ import annotations

import struct

from pymodbus.framer import FramerRTU

from drivers.controller.errors import ControllerNonsense
from drivers.controller.modbus.requests import (
    EXCEPTION,
    EXCEPTION_LENGTH,
    READ_REGISTERS,
    WRITE_REGISTER,
    Request,
)

MBAP_HEADER = struct.Struct(">HHHB")  # transaction, protocol, bytes that follow (unit included), unit
_UP_TO_LENGTH = 6
_CRC_LENGTH = 2
_THE_DEVICE_ITSELF = frozenset({0, 255})  # behind no gateway: V1.0b, 4.4.2.2; some answer one as the other


def check_tcp(request: Request, transaction: int, device_id: int, received: bytes) -> bytes | None:
    """The PDU of the reply to `request`; None while `received` is the beginning of its frame.

    ControllerNonsense: it is not, and cannot become, the reply.
    """
    if len(received) <= MBAP_HEADER.size:
        return None
    seen_transaction, protocol, length, unit = MBAP_HEADER.unpack_from(received)
    _must_be("protocol identifier", protocol, 0)
    _must_be("transaction", seen_transaction, transaction)
    if unit != device_id and not {unit, device_id} <= _THE_DEVICE_ITSELF:
        raise ControllerNonsense(f"the reply's device id is {unit}, expected {device_id}", unit)
    _must_be("length", length, 1 + _pdu_length(request, received[MBAP_HEADER.size]))
    if len(received) < _UP_TO_LENGTH + length:
        return None
    _must_be("frame's number of bytes", len(received), _UP_TO_LENGTH + length)
    pdu = received[MBAP_HEADER.size :]
    _check_repeated(request, pdu)
    return pdu


def check_rtu(request: Request, device_id: int, received: bytes) -> bytes | None:
    """The PDU of the reply to `request`; None while `received` is the beginning of its frame.

    ControllerNonsense: it is not, and cannot become, the reply. An RTU frame does not say which request it answers:
    the reply to an earlier one of the same kind passes, so none may be under way (see `late_replies.py`).
    """
    if not received:
        return None
    _must_be("device id", received[0], device_id)
    if len(received) < 2:
        return None
    end = 1 + _pdu_length(request, received[1])
    if received[1] == READ_REGISTERS and len(received) > 2:  # a shorter reply would be waited for until the time-out
        _must_be("byte count", received[2], request.reply_head[1])
    if len(received) < end + _CRC_LENGTH:
        return None
    _must_be("frame's number of bytes", len(received), end + _CRC_LENGTH)
    crc = FramerRTU.compute_CRC(received[:end])
    if crc != int.from_bytes(received[end:], "big"):
        raise ControllerNonsense(
            f"the reply's CRC is {received[end:].hex()}, its bytes give {crc:04x}: noise on the line"
        )
    pdu = received[1:end]
    _check_repeated(request, pdu)
    return pdu


def _pdu_length(request: Request, function_code: int) -> int:
    """Bytes of the reply's PDU, which the request and the reply's function code fix."""
    if function_code == request.pdu[0] | EXCEPTION:
        return EXCEPTION_LENGTH
    _must_be("function code", function_code, request.pdu[0])
    return request.reply_length


def _check_repeated(request: Request, reply: bytes) -> None:
    """Compare what the reply repeats of the request; raise ControllerNonsense."""
    if reply.startswith(request.reply_head) or reply[0] & EXCEPTION:
        return
    if reply[0] == READ_REGISTERS:
        _must_be("byte count", reply[1], request.reply_head[1])
    address, second = struct.unpack_from(">HH", reply, 1)
    asked_address, asked_second = struct.unpack_from(">HH", request.reply_head, 1)
    _must_be("address", address, asked_address)
    _must_be("value" if reply[0] == WRITE_REGISTER else "register count", second, asked_second)


def _must_be(name: str, seen: int, expected: int) -> None:
    if seen != expected:
        raise ControllerNonsense(f"the reply's {name} is {seen}, expected {expected}")
