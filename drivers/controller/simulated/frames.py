"""How the simulated controller reads requests off a wire and frames its replies: Modbus TCP and Modbus RTU.

Written from the Modbus specifications, so that the driver's library does not stand on both ends of a test.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

FramingName = Literal["tcp", "rtu"]

READ, WRITE_ONE, WRITE_MANY = 3, 6, 16
MBAP = 7  # transaction, protocol, length, unit
LONGEST_PDU = 253
# Requests of these function codes are 8 bytes long in RTU: unit, code, address, count or value, CRC.
SHORT_REQUESTS = frozenset({1, 2, 3, 4, 5, 6})
LONG_REQUESTS = frozenset({15, 16})
QUIET_S = 0.02  # a line silent for so long has ended its frame; t3.5 itself is below what an operating system can tell


@dataclass(frozen=True)
class Request:
    """One request: the device that it is for, function code and data, and the TCP transaction that its reply names."""

    unit: int
    pdu: bytes
    transaction: bytes = b"\0\0"


class BadFrame(Exception):
    """What came is no Modbus: the connection cannot be followed any further."""


class Framing(Protocol):
    """Bytes of one connection or line into requests, and replies into bytes."""

    def feed(self, data: bytes) -> list[Request]:
        """The requests that are complete with `data`; raise BadFrame."""

    def quiet(self) -> None:
        """The line has been silent for QUIET_S: what is half there will not be completed."""

    def frame(self, request: Request, pdu: bytes) -> bytes:
        """The reply `pdu` to `request` as it goes on the wire."""


class TcpFraming:
    """Modbus TCP: a header with a length, no checksum."""

    def __init__(self) -> None:
        self._held = b""

    def feed(self, data: bytes) -> list[Request]:
        """See Framing."""
        self._held += data
        requests = []
        while len(self._held) >= MBAP:
            length = int.from_bytes(self._held[4:6], "big")
            if self._held[2:4] != b"\0\0" or not 2 <= length <= LONGEST_PDU + 1 + 10:
                raise BadFrame(f"a header of {self._held[:MBAP].hex(' ')}")
            if len(self._held) < 6 + length:
                break
            requests.append(Request(self._held[6], self._held[MBAP : 6 + length], self._held[:2]))
            self._held = self._held[6 + length :]
        return requests

    def quiet(self) -> None:
        """Nothing: in TCP, silence ends no frame."""

    def frame(self, request: Request, pdu: bytes) -> bytes:
        """See Framing."""
        return request.transaction + b"\0\0" + (len(pdu) + 1).to_bytes(2, "big") + bytes([request.unit]) + pdu


class RtuFraming:
    """Modbus RTU: unit, PDU, CRC-16. After a frame whose CRC is wrong nothing counts until the line was silent."""

    def __init__(self) -> None:
        self._held = b""
        self._lost = False

    def feed(self, data: bytes) -> list[Request]:
        """See Framing."""
        if self._lost:
            return []
        self._held += data
        requests = []
        while (length := _rtu_length(self._held)) is not None and len(self._held) >= length:
            frame, self._held = self._held[:length], self._held[length:]
            if crc16(frame[:-2]) != frame[-2:]:
                self._held, self._lost = b"", True
                break
            requests.append(Request(frame[0], frame[1:-2]))
        return requests

    def quiet(self) -> None:
        """See Framing."""
        self._held, self._lost = b"", False

    def frame(self, request: Request, pdu: bytes) -> bytes:
        """See Framing."""
        frame = bytes([request.unit]) + pdu
        return frame + crc16(frame)


def _rtu_length(held: bytes) -> int | None:
    """Bytes of the request that begins `held`; None while that cannot be told."""
    if len(held) < 2:
        return None
    if held[1] in SHORT_REQUESTS:
        return 8
    if held[1] in LONG_REQUESTS:
        return 9 + held[6] if len(held) >= 7 else None
    # A function code of unknown length: as long as it is right so far.
    return len(held) if len(held) >= 4 and crc16(held[:-2]) == held[-2:] else None


def crc16(data: bytes) -> bytes:
    """The two bytes of CRC-16/MODBUS that follow `data` on the line, low byte first."""
    crc = 0xFFFF
    for byte in data:
        crc = crc >> 8 ^ CRC_TABLE[(crc ^ byte) & 0xFF]
    return crc.to_bytes(2, "little")


def _crc_of_byte(value: int) -> int:
    for _ in range(8):
        value = value >> 1 ^ 0xA001 if value & 1 else value >> 1
    return value


CRC_TABLE = tuple(_crc_of_byte(value) for value in range(256))


def new_framing(name: FramingName) -> Framing:
    """A framing with nothing held."""
    return TcpFraming() if name == "tcp" else RtuFraming()
