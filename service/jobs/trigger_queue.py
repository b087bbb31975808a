"""Triggers that wait for their turn, oldest first, as many as are allowed and no longer than is sensible.

They are in memory only: a job is durable, and its trigger acknowledged, when its turn has come. So job numbers follow
the order of execution, which the controller insists on, although its own trigger goes before those that wait.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from service.reasons import Reason
from service.records.job import Job, TriggerStamp


class TriggerRefused(Exception):
    """A trigger was not taken: `reason` as on the wire, and a sentence."""

    def __init__(self, reason: Reason, text: str) -> None:
        super().__init__(text)
        self.reason = reason

    @property
    def not_ready(self) -> bool:
        """True where no part of the job was begun because something did not work."""
        return self.reason is Reason.NOT_READY


@dataclass(frozen=True)
class Ticket:
    """A job that is durable in the journal, and its settled form once it has ended."""

    job: Job
    settled: asyncio.Future[Job]


@dataclass(frozen=True)
class Queued:
    """A trigger that waits: its place at first, 1 = next; its ticket once begun, or TriggerRefused."""

    trigger: TriggerStamp
    place: int
    since_s: float
    ticket: asyncio.Future[Ticket]

    def refuse(self, refused: TriggerRefused) -> None:
        """Tell whoever waits for it, if anybody still does."""
        if not self.ticket.done():
            self.ticket.set_exception(refused)
            self.ticket.exception()  # a pedal waits for nothing: nobody may ever ask


class TriggerQueue:
    """At most `depth` triggers, each for at most `expires_s`."""

    def __init__(self, depth: int, expires_s: float, *, now: Callable[[], float] = time.monotonic) -> None:
        self._depth = depth
        self._expires_s = expires_s
        self._now = now
        self._waiting: deque[Queued] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    @property
    def full(self) -> bool:
        """True where no trigger can be added; always, with depth 0."""
        return len(self._waiting) >= self._depth

    def add(self, trigger: TriggerStamp) -> Queued:
        """Let a trigger wait; there must be room."""
        queued = Queued(trigger, len(self._waiting) + 1, self._now(), asyncio.get_running_loop().create_future())
        self._waiting.append(queued)
        return queued

    def next(self) -> Queued | None:
        """The one whose turn it is, taken out; None where none waits."""
        return self._waiting.popleft() if self._waiting else None

    def take_expired(self) -> list[Queued]:
        """Those that have waited too long, taken out: what lies under the camera now is not what was asked for."""
        expired = []
        while self._waiting and self._now() - self._waiting[0].since_s > self._expires_s:
            expired.append(self._waiting.popleft())
        return expired

    def take_all(self) -> list[Queued]:
        """All, taken out."""
        waiting = list(self._waiting)
        self._waiting.clear()
        return waiting

    def refusal_of_expired(self) -> TriggerRefused:
        """What is told of one that has waited too long."""
        return TriggerRefused(Reason.EXPIRED, f"it waited for its turn for more than {self._expires_s:g} s")
