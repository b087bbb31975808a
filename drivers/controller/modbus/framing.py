"""PDUs in frames, TCP's and RTU's: what is sent for a request, and which bytes are its reply.

Of the Modbus library only the CRC is used; the reply is judged on its bytes in `replies.py`.
"""

from __future__ import annotations

from typing import Protocol

from pymodbus.framer import FramerRTU

from drivers.controller.errors import MailboxError
from drivers.controller.modbus.replies import MBAP_HEADER, check_rtu, check_tcp
from drivers.controller.modbus.requests import Request

LAST_TRANSACTION = 0xFFFF
RTU_OVERHEAD = 3  # bytes: unit and CRC


class Framing(Protocol):
    """One connection's frames, to one device; one request at a time."""

    def request(self, request: Request) -> bytes:
        """The frame to send; from here on `reply` judges what comes by this request."""

    def reply(self, received: bytes) -> bytes | None:
        """The reply's PDU, None while `received` is the beginning of it; raise ControllerNonsense."""

    def wire_length(self, request: Request) -> int:
        """Bytes of the request's frame and of its reply's."""


class TcpFraming:
    """Modbus TCP: the MBAP header in front, a new transaction for each request."""

    def __init__(self, device_id: int, transaction: int = 0) -> None:
        """transaction: the number before the first one's."""
        self._device_id = _checked(device_id, 0)
        self._transaction = transaction
        self._request = NOTHING
        self._head = b""
        self._length = 0

    def request(self, request: Request) -> bytes:
        """The frame to send."""
        self._transaction = self._transaction % LAST_TRANSACTION + 1
        length = 1 + request.reply_length
        self._request = request
        self._head = MBAP_HEADER.pack(self._transaction, 0, length, self._device_id) + request.reply_head
        self._length = MBAP_HEADER.size - 1 + length
        return MBAP_HEADER.pack(self._transaction, 0, 1 + len(request.pdu), self._device_id) + request.pdu

    def reply(self, received: bytes) -> bytes | None:
        """The reply's PDU; see `Framing`."""
        if len(received) == self._length and received.startswith(self._head):
            return received[MBAP_HEADER.size :]
        return check_tcp(self._request, self._transaction, self._device_id, received)

    def wire_length(self, request: Request) -> int:
        """Bytes of the request's frame and of its reply's."""
        return 2 * MBAP_HEADER.size + len(request.pdu) + request.reply_length


class RtuFraming:
    """Modbus RTU: the device id in front, a CRC behind. Nothing says which request a reply belongs to."""

    def __init__(self, device_id: int) -> None:
        self._device_id = _checked(device_id, 1)
        self._request = NOTHING

    def request(self, request: Request) -> bytes:
        """The frame to send."""
        self._request = request
        frame = bytes((self._device_id,)) + request.pdu
        return frame + FramerRTU.compute_CRC(frame).to_bytes(2, "big")

    def reply(self, received: bytes) -> bytes | None:
        """The reply's PDU; see `Framing`."""
        return check_rtu(self._request, self._device_id, received)

    def wire_length(self, request: Request) -> int:
        """Bytes of the request's frame and of its reply's."""
        return 2 * RTU_OVERHEAD + len(request.pdu) + request.reply_length


NOTHING = Request(b"\0", b"\0", 1)


def _checked(device_id: int, lowest: int) -> int:
    if not lowest <= device_id <= 255:
        why = " (0 is a broadcast, which is never answered)" if lowest else ""
        raise MailboxError(f"device_id is {device_id}, expected {lowest} to 255{why}")
    return device_id
