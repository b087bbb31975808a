"""Faults of the line and of the server behind it, scripted: which requests they strike, and what they do to them."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.simulated.received import READ, WRITE_MANY, WRITE_ONE

FaultKind = Literal[
    "lost-request",
    "lost-reply",
    "late-reply",
    "repeated-reply",
    "garbled-request",
    "garbled-reply",
    "foreign-reply",
    "exception",
    "reset-before",
    "reset-after",
    "half-open",
    "late-write",
]
Target = Literal["any", "read", "write", "link", "owner", "readback", "service", "clear", "page", "part", "commit"]

FAULT_KINDS: dict[FaultKind, str] = {
    "lost-request": "never done, never answered",
    "lost-reply": "done, the reply is lost",
    "late-reply": "done, answered only after delay_s; on a line, all that follows waits too",
    "repeated-reply": "done, answered twice, the second time after delay_s; on a line at once",
    "garbled-request": "arrives with a wrong byte, so on RTU it is not done and not answered; on TCP it is lost",
    "garbled-reply": "done, the reply leaves with a wrong byte: on RTU its CRC is wrong; on TCP it is lost",
    "foreign-reply": "done, answered with the reply to another request: wrong address or count",
    "exception": "not done, answered with exception `code`; code 5 (acknowledge) is done after delay_s",
    "reset-before": "not done, the connection is reset; on a serial line it is lost",
    "reset-after": "done, the connection is reset before the reply; on a serial line the reply is lost",
    "half-open": "the connection stays open and never says anything again; a serial line is dead for delay_s",
    "late-write": "done only after delay_s, though the client may have long gone, and never answered; a read is lost",
}
TARGETS: dict[Target, str] = {
    "any": "every request",
    "read": "every FC3",
    "write": "every FC6 and FC16",
    "link": "reading the controller's block",
    "owner": "reading the service block back",
    "readback": "reading header or payload back",
    "service": "writing the service block",
    "clear": "writing transfer = 0",
    "page": "writing header or payload",
    "part": "writing the part block",
    "commit": "writing transfer, not 0",
}
assert set(FAULT_KINDS) == set(get_args(FaultKind))
assert set(TARGETS) == set(get_args(Target))


@dataclass(frozen=True)
class LineFault:
    """One rule: what befalls which of the requests that `request` names.

    chance: of each such request, 0 to 1. every: each n-th of them. at: the n-th ones, counted from 1.
    times: at most so often, 0 = no limit. after_s, before_s: only so long after the start; before_s 0 = no end.
    """

    kind: FaultKind
    request: Target = "any"
    chance: float = 0.0
    every: int = 0
    at: tuple[int, ...] = ()
    times: int = 0
    after_s: float = 0.0
    before_s: float = 0.0
    delay_s: float = 0.2
    code: int = 4

    @property
    def name(self) -> str:
        """The kind, with an exception's code."""
        return f"exception {self.code}" if self.kind == "exception" else self.kind


class FaultPlan:
    """Rules, in order: the first that strikes a request counts. Random ones depend on the seed and the requests alone.

    struck: how often each kind struck, exceptions by their code.
    """

    def __init__(self, faults: Iterable[LineFault] = (), seed: int = 0) -> None:
        self.struck: Counter[str] = Counter()
        self.enabled = True
        self._faults = tuple(faults)
        self._chance = random.Random(seed)
        self._seen = [0] * len(self._faults)
        self._done = [0] * len(self._faults)

    def strike(self, targets: frozenset[str], since_start_s: float) -> LineFault | None:
        """The fault that befalls a request that is of `targets`, if one does."""
        if not self.enabled:
            return None
        for number, fault in enumerate(self._faults):
            if fault.request not in targets or (fault.times and self._done[number] >= fault.times):
                continue
            if since_start_s < fault.after_s or (fault.before_s and since_start_s >= fault.before_s):
                continue
            self._seen[number] += 1
            seen = self._seen[number]
            if (
                seen in fault.at
                or (fault.every and seen % fault.every == 0)
                or (fault.chance and self._chance.random() < fault.chance)
            ):
                self._done[number] += 1
                self.struck[fault.name] += 1
                return fault
        return None

    def garbled(self, frame: bytes) -> bytes:
        """The frame with one byte changed."""
        place = self._chance.randrange(len(frame))
        wrong = frame[place] ^ self._chance.randrange(1, 256)
        return frame[:place] + bytes([wrong]) + frame[place + 1 :]


def targets_of(pdu: bytes, layout: MailboxLayout) -> frozenset[str]:
    """The names under which a fault may strike the request."""
    code, address = pdu[0], int.from_bytes(pdu[1:3], "big")
    if code == READ:
        return frozenset({"any", "read", _block_of(address, layout, _READ_FROM)})
    if code not in (WRITE_ONE, WRITE_MANY):
        return frozenset({"any"})
    if address == layout.contour_address:  # by FC16 the value stands behind the count and the length
        return frozenset({"any", "write", "commit" if any(pdu[3:5] if code == WRITE_ONE else pdu[6:8]) else "clear"})
    return frozenset({"any", "write", _block_of(address, layout, _WRITTEN_TO)})


_READ_FROM = {
    "link_address": "link",
    "service_address": "owner",
    "contour_address": "readback",
    "part_address": "readback",
}
_WRITTEN_TO = {"service_address": "service", "contour_address": "page", "part_address": "part"}


def _block_of(address: int, layout: MailboxLayout, names: dict[str, str]) -> str:
    """What a fault calls the block that has the address; "" = it calls it nothing."""
    found = (name for name, (start, end) in layout.blocks.items() if start <= address < end)
    return names.get(next(found, ""), "")


def foreign(pdu: bytes) -> bytes:
    """The reply as if to another request of the same kind: one register fewer, or the next address."""
    if pdu[0] == READ and len(pdu) >= 6:
        return bytes([pdu[0], pdu[1] - 2]) + pdu[2:-2]
    if pdu[0] in (WRITE_ONE, WRITE_MANY):
        address = (int.from_bytes(pdu[1:3], "big") + 1) & 0xFFFF
        return pdu[:1] + address.to_bytes(2, "big") + pdu[3:]
    return pdu
