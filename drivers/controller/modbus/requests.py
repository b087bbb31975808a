"""The three requests of the protocol as PDUs, and what the reply to each must begin with.

Source: MODBUS Application Protocol V1.1b3, 6.3 (FC3), 6.6 (FC6), 6.12 (FC16).
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from drivers.controller.errors import MailboxError

READ_REGISTERS = 3
WRITE_REGISTER = 6
WRITE_REGISTERS = 16
EXCEPTION = 0x80
LONGEST_WRITE = 123  # registers in one FC16
LONGEST_READ = 125  # registers in one FC3
EXCEPTION_LENGTH = 2  # bytes of an exception's PDU
SingleWrite = Literal["fc6", "fc16"]
SHORTEST_LIMIT = 16  # a block of 16 goes in one request: the protocol has the service block written whole
SHORTEST_FOR_PACE = 32  # on however slow a line; shorter ones are mostly overhead
WRITE_OVERHEAD = 17  # bytes of an FC16 and its reply on RTU beside the registers: 9 and 8
READ_OVERHEAD = 13  # of an FC3 and its reply: 8 and 5


@dataclass(frozen=True)
class RequestLimits:
    """Registers that the controller takes in one FC16 and gives in one FC3; few take less than the standard's."""

    write: int = LONGEST_WRITE
    read: int = LONGEST_READ

    def __post_init__(self) -> None:
        for name, seen, largest in (("write", self.write, LONGEST_WRITE), ("read", self.read, LONGEST_READ)):
            if not SHORTEST_LIMIT <= seen <= largest:
                raise MailboxError(
                    f"longest_{name} is {seen}, expected {SHORTEST_LIMIT} to {largest} registers: "
                    f"blocks of {SHORTEST_LIMIT} go whole"
                )

    def within(self, line_bytes: float) -> RequestLimits:
        """These, or shorter ones, so that an RTU request and its reply together have at most `line_bytes`.

        Its pace alone makes none shorter than `SHORTEST_FOR_PACE`.
        """
        write, read = (int(line_bytes - overhead) // 2 for overhead in (WRITE_OVERHEAD, READ_OVERHEAD))
        return RequestLimits(
            min(self.write, max(write, SHORTEST_FOR_PACE)),
            min(self.read, max(read, SHORTEST_FOR_PACE)),
        )


@dataclass(frozen=True, slots=True)
class Request:
    """One request: its PDU, the bytes that its reply's PDU begins with, and how long that reply is, bytes.

    An FC6 and an FC16 repeat what they were asked, so there `reply_head` is the whole reply.
    """

    pdu: bytes
    reply_head: bytes
    reply_length: int

    @property
    def address(self) -> int:
        """The first register."""
        return int.from_bytes(self.pdu[1:3], "big")

    @property
    def count(self) -> int:
        """Registers read or written."""
        return 1 if self.pdu[0] == WRITE_REGISTER else int.from_bytes(self.pdu[3:5], "big")

    def __str__(self) -> str:
        return f"FC{self.pdu[0]} of register{'' if self.count == 1 else 's'} {people(self.address, self.count)}"


def read_registers(address: int, count: int) -> Request:
    """FC3 of `count` registers, 1 to 125."""
    return Request(
        struct.pack(">BHH", READ_REGISTERS, address, count), bytes((READ_REGISTERS, 2 * count)), 2 + 2 * count
    )


def write_register(address: int, value: int) -> Request:
    """FC6."""
    pdu = struct.pack(">BHH", WRITE_REGISTER, address, value)
    return Request(pdu, pdu, len(pdu))


def write_registers(address: int, stream: bytes) -> Request:
    """FC16 of the registers in `stream`, each big-endian, 1 to 123 of them."""
    head = struct.pack(">BHH", WRITE_REGISTERS, address, len(stream) // 2)
    return Request(head + bytes((len(stream),)) + stream, head, len(head))


def registers_of(reply: bytes) -> tuple[int, ...]:
    """The registers in the PDU of an FC3's reply."""
    return struct.unpack(f">{(len(reply) - 2) // 2}H", reply[2:])


def stream_of(registers: Sequence[int]) -> bytes:
    """Registers as they go on the wire, each big-endian; struct.error: one beyond 16 bits."""
    return struct.pack(f">{len(registers)}H", *registers)


def people(address: int, count: int) -> str:
    """Registers by PDU address, with the 4xxxxx form that PLC programmers use beside it."""
    if count == 1:
        return f"{address} ({400001 + address})"
    return f"{address} to {address + count - 1} ({400001 + address} to {400000 + address + count})"
