"""Whether this service may write to the controller: the protocol's "One service per controller", as a state machine.

It is told every reading of the service block and says whether the next write is allowed; it does no I/O.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from enum import Enum

from drivers.controller import ControllerError, ServiceBlock

WATCH_S = 3.0  # how long a foreign heartbeat must stand still, and then how long our own owner must stand
NOT_ANOTHERS = 0  # registers that nobody has written yet


class ForeignOwner(ControllerError):
    """Another service's number stands in `owner`: nothing may be written."""


class _Phase(Enum):
    UNKNOWN = "whose the controller is has not been read yet"
    OURS = ""
    SUSPECT = "another service's number was read once in `owner`"
    WATCHING = "watching whether the other service still lives"
    CLAIMING = "watching whether our own number stands"
    CONFLICT = "another service writes to this controller"


class Ownership:
    """The state of `owner`, reading by reading.

    A foreign owner whose heartbeat moves is another service that lives: nothing is written from then on, until this
    service is started again, which is a person's decision. One whose heartbeat stands still is what a service left
    behind that runs no more, and is taken over.
    """

    def __init__(self, owner: int, *, now: Callable[[], float] = time.monotonic) -> None:
        self.owner = owner
        self._now = now
        self._phase = _Phase.UNKNOWN
        self._was_ours = False
        self._other = 0
        self._beat: int | None = None
        self._since: float | None = None

    @property
    def ours(self) -> bool:
        """True while contours may be sent."""
        return self._phase is _Phase.OURS

    @property
    def conflict(self) -> bool:
        """True from when another service was seen alive: nothing is written any more."""
        return self._phase is _Phase.CONFLICT

    @property
    def decided(self) -> bool:
        """False while every look counts: the block is then read at each poll, not only before writes."""
        return self._phase in (_Phase.OURS, _Phase.CLAIMING, _Phase.CONFLICT)

    @property
    def foreign(self) -> bool:
        """True while another service's number is known to stand in `owner`, or stood there a moment ago."""
        return self._phase in (_Phase.WATCHING, _Phase.CLAIMING, _Phase.CONFLICT)

    @property
    def lost(self) -> bool:
        """True where the job in flight fails with 155: another lives, or came while the controller was ours."""
        return self._phase is _Phase.CONFLICT or (self._was_ours and self._phase is _Phase.WATCHING)

    def fault(self) -> str | None:
        """Why nothing may be sent, as a sentence; None where it may."""
        if self._phase in (_Phase.OURS, _Phase.UNKNOWN, _Phase.SUSPECT):
            return self._phase.value or None
        other = f"another service (owner {self._other}, this one is {self.owner})"
        if self._phase is _Phase.CONFLICT:
            return f"{other} writes to this controller. Stop one of the two, then start this one again"
        return f"{other} was the last to write to this controller: {self._phase.value}, {WATCH_S:g} s"

    def is_foreign(self, block: ServiceBlock) -> bool:
        """True where another service's number stands in the block."""
        return block.owner not in (NOT_ANOTHERS, self.owner)

    def check(self) -> None:
        """Raise ForeignOwner where no contour may be written now."""
        if not self.ours:
            raise ForeignOwner(self.fault() or "")

    def disconnected(self) -> None:
        """A pause without readings is no time of watching: begin it anew."""
        self._beat = self._since = None

    def saw(self, block: ServiceBlock) -> bool:
        """Take note of the service block as the controller holds it; True where the block may be written now."""
        if self._phase is _Phase.CONFLICT:
            return False
        if not self.is_foreign(block):
            return self._saw_ours()
        if self._phase in (_Phase.SUSPECT, _Phase.WATCHING) and block.owner == self._other:
            return self._watch(block)
        # Once is not enough: either side acts on the other's block only when two reads in a row show the same.
        self._phase, self._other = _Phase.SUSPECT, block.owner
        self.disconnected()
        return False

    def _saw_ours(self) -> bool:
        if self._phase is _Phase.CLAIMING:
            self._since = self._now() if self._since is None else self._since
            if self._now() - self._since < WATCH_S:
                return True
        self._phase, self._was_ours = _Phase.OURS, True
        return True

    def _watch(self, block: ServiceBlock) -> bool:
        self._phase = _Phase.WATCHING
        now = self._now()
        if self._beat is None or self._since is None:
            self._beat, self._since = block.service_heartbeat, now
        if block.service_heartbeat != self._beat:
            self._phase = _Phase.CONFLICT
        elif now - self._since >= WATCH_S:
            self._phase, self._since = _Phase.CLAIMING, now
            return True
        return False
