"""The simulated controller's holding registers as requests see them: function codes 3, 6 and 16, and its refusals."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.simulated.received import READ, WRITE_MANY, WRITE_ONE
from drivers.controller.simulated.watch import LONGEST_WRITE, ClientWatch

LONGEST_READ = 125
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3


class ExceptionReply(Exception):
    """The request is answered with exception `code`."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


@dataclass(frozen=True)
class ServerLimits:
    """What the server takes. registers: most in one request. write_single: it knows FC6.

    answer_as: requests to every device id are answered, as from this one; None = only those to its own.
    """

    registers: int = LONGEST_READ
    write_single: bool = True
    answer_as: int | None = None


class RegisterWindow:
    """Reads and writes `registers` within the mailbox's blocks, and lets `watch` see what is written."""

    def __init__(
        self, registers: list[int], layout: MailboxLayout, watch: ClientWatch, limits: ServerLimits | None = None
    ) -> None:
        self._limits = limits or ServerLimits()
        self._registers = registers
        self._layout = layout
        self._watch = watch
        self._readable = _joined(layout)

    @property
    def trigger(self) -> tuple[int, int]:
        """`session` and `trigger_counter` as they stand."""
        link = self._layout.link_address
        return self._registers[link + 13], self._registers[link + 2]

    def answer(self, pdu: bytes, now: float) -> bytes:
        """The reply to a request, an exception's where it cannot be done."""
        try:
            if pdu[0] == READ:
                return self._read(pdu)
            address, values = self._writing(pdu)
        except ExceptionReply as refusal:
            return bytes([pdu[0] | 0x80, refusal.code])
        if not self._watch.write(pdu[0], address, values, self._registers, now):
            return bytes([pdu[0] | 0x80, ILLEGAL_ADDRESS])
        self._registers[address : address + len(values)] = values
        return pdu[:5]  # both writes echo address and value, or address and count

    def store_late(self, pdu: bytes) -> None:
        """Write without being seen by the watch; what could not be written at all is dropped."""
        try:
            address, values = self._writing(pdu)
        except ExceptionReply:
            return
        writable = [block for name, block in self._layout.blocks.items() if name != "link_address"]
        if any(start <= address and address + len(values) <= end for start, end in writable):
            self._registers[address : address + len(values)] = values

    def _read(self, pdu: bytes) -> bytes:
        if len(pdu) != 5:
            raise ExceptionReply(ILLEGAL_VALUE)
        address, count = struct.unpack(">HH", pdu[1:])
        if not 1 <= count <= self._limits.registers:
            raise ExceptionReply(ILLEGAL_VALUE)
        if not any(start <= address and address + count <= end for start, end in self._readable):
            raise ExceptionReply(ILLEGAL_ADDRESS)
        return struct.pack(f">BB{count}H", READ, 2 * count, *self._registers[address : address + count])

    def _writing(self, pdu: bytes) -> tuple[int, list[int]]:
        """Address and values of a write."""
        if pdu[0] == WRITE_ONE and not self._limits.write_single:
            raise ExceptionReply(ILLEGAL_FUNCTION)
        if pdu[0] == WRITE_ONE and len(pdu) == 5:
            address, value = struct.unpack(">HH", pdu[1:])
            return address, [value]
        if pdu[0] not in (WRITE_ONE, WRITE_MANY):
            self._watch.foreign_function(pdu[0])
            raise ExceptionReply(ILLEGAL_FUNCTION)
        if pdu[0] == WRITE_ONE or len(pdu) < 6:
            raise ExceptionReply(ILLEGAL_VALUE)
        address, count, length = struct.unpack(">HHB", pdu[1:6])
        if count > LONGEST_WRITE:
            self._watch.too_long(address, count)
        if (
            not 1 <= count <= min(LONGEST_WRITE, self._limits.registers)
            or length != 2 * count
            or len(pdu) != 6 + length
        ):
            raise ExceptionReply(ILLEGAL_VALUE)
        return address, list(struct.unpack(f">{count}H", pdu[6:]))


def _joined(layout: MailboxLayout) -> list[tuple[int, int]]:
    """Ranges that one request may read: the blocks, joined where they touch."""
    joined: list[tuple[int, int]] = []
    for start, end in sorted(layout.blocks.values()):
        if joined and joined[-1][1] == start:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((start, end))
    return joined
