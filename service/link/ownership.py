"""Whether this service may write to the controller: the protocol's "One service per controller", as a state machine.

It is told every reading of the service block and every write of it, and says whether the next write is allowed; it does
no I/O.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from enum import Enum

from drivers.controller import ControllerError, ServiceBlock

WATCH_S = 3.0  # how long a foreign heartbeat must stand still, and then how long our own owner must stand
WATCH_OWN_S = 1.5  # how long a heartbeat beside our own number must stand still: a former life's does
SHORT_PAUSE_S = 1.0  # without readings: a service that lives has moved its heartbeat by then
NOBODY = 0  # in `owner`: registers that nobody has written yet
OWN_BEATS_KEPT = 256  # own writes of the last seconds: one without a reply may land late


class ForeignOwner(ControllerError):
    """Another service writes here, or may: nothing may be written."""


class _Phase(Enum):
    STARTING = "whose the controller is has not been read yet"
    WATCHING = "watching whether the other service still lives"
    WATCHING_OWN = "watching whether another service with our number lives"
    CLAIMING = "watching whether our own number stands"
    OURS = ""
    CONFLICT = "another service writes to this controller"


class Ownership:
    """The state of `owner` and `service_heartbeat`, reading by reading.

    At its start it watches what it finds. A heartbeat that moves is another service that lives: nothing is written. One
    that stands still is what a service left behind that runs no more, and is taken over. Later, another number, or a
    heartbeat that this service did not write, twice in a row, is another service too. Writing is resumed as at the
    start, on a person's word.
    """

    def __init__(self, owner: int, *, now: Callable[[], float] = time.monotonic) -> None:
        self.owner = owner
        self._now = now
        self._beats: deque[int] = deque(maxlen=OWN_BEATS_KEPT)  # that we may have written; one may land late
        self.epoch = 0  # starts of watching so far: what was confirmed in one says nothing in the next
        self.begin()

    def begin(self) -> None:
        """As at the start: at the start, and on a person's word."""
        self.epoch += 1
        self._phase = _Phase.STARTING
        self._other = NOBODY
        self._beat: int | None = None
        self._since_s: float | None = None
        self._seen_s = self._now()
        self._interrupted = False
        self._moved = False
        self._taken_over = False  # from a number that is not ours: our own must stand for a while
        self._doubted = False
        self._next_is_ours = False

    @property
    def ours(self) -> bool:
        """True while contours may be sent."""
        return self._phase is _Phase.OURS and not self._doubted

    @property
    def conflict(self) -> bool:
        """True from when another service was seen to write: nothing is written until a person says so."""
        return self._phase is _Phase.CONFLICT

    @property
    def begun(self) -> bool:
        """True from the first write on that was confirmed."""
        return self._phase in (_Phase.CLAIMING, _Phase.OURS)

    @property
    def decided(self) -> bool:
        """False while every look counts: the block is then read at each poll, not only before writes."""
        return self.conflict or (self.begun and not self._doubted)

    @property
    def foreign(self) -> bool:
        """True while another service is known to have written last, or is being watched."""
        return self._phase in (_Phase.WATCHING, _Phase.CLAIMING, _Phase.CONFLICT)

    def fault(self) -> str | None:
        """Why nothing may be sent, as a sentence; None where it may."""
        if self._phase in (_Phase.STARTING, _Phase.OURS):
            return self._phase.value or None
        if self._phase is _Phase.WATCHING_OWN:
            return f"{self._phase.value} (owner {self.owner}), {WATCH_OWN_S:g} s"
        other = f"another service (owner {self._other}, this one is {self.owner})"
        if self._other == self.owner:
            other = f"another service with the same number (owner {self.owner}: a copied journal, or card)"
        if self.conflict:
            return f"{other} writes to this controller. Stop one of the two, then `combtrace confirm`"
        return f"{other} was the last to write to this controller: {self._phase.value}, {WATCH_S:g} s"

    def is_foreign(self, block: ServiceBlock) -> bool:
        """True where another service's number stands in the block."""
        return block.owner not in (NOBODY, self.owner)

    def check(self) -> None:
        """Raise ForeignOwner where no contour may be written now."""
        if not self.ours:
            raise ForeignOwner(self.fault() or "another service's mark was read once in the service block")

    def disconnected(self) -> None:
        """A pause without readings is no time of watching; a long one has it begin anew, see `saw`."""
        self._interrupted = True

    def controller_restarted(self) -> None:
        """Its registers may show what was there at any time before: the next heartbeat beside our number is ours."""
        self._next_is_ours = True

    def writing(self, beat: int) -> None:
        """The block is being written with this heartbeat: from here on it may be found."""
        self._beats.append(beat)

    def wrote(self) -> None:
        """A write was confirmed."""
        if not self.begun and not self.conflict:
            self._phase = _Phase.CLAIMING if self._taken_over else _Phase.OURS
            self._since_s = None

    def saw(self, block: ServiceBlock) -> bool:
        """Take note of the service block as the controller holds it; True where the block may be written now."""
        if self.conflict:
            return False
        self._take_pause()
        return self._saw_later(block) if self.begun else self._watch(block)

    def _take_pause(self) -> None:
        """After lost replies go on watching, without the pause; else a poor line would have it begin anew for ever."""
        pause_s, self._seen_s = self._now() - self._seen_s, self._now()
        if not self._interrupted:
            return
        self._interrupted = False
        if pause_s <= SHORT_PAUSE_S:
            self._since_s = None if self._since_s is None else self._since_s + pause_s
            return
        if self._phase is _Phase.CLAIMING:
            self._phase = _Phase.WATCHING
        self._beat = self._since_s = None

    def _saw_later(self, block: ServiceBlock) -> bool:
        if self._next_is_ours and block.owner == self.owner:
            self._beats.append(block.service_heartbeat)
            self._next_is_ours = False
        strange = block.owner != NOBODY and (self.is_foreign(block) or block.service_heartbeat not in self._beats)
        if strange and self._doubted:
            self._phase, self._other = _Phase.CONFLICT, block.owner
            return False
        self._doubted = strange
        if self._phase is _Phase.CLAIMING and not strange:
            self._since_s = self._now() if self._since_s is None else self._since_s
            if self._now() - self._since_s >= WATCH_S:
                self._phase = _Phase.OURS
        return not strange

    def _watch(self, block: ServiceBlock) -> bool:
        """At the start: True where what stands there has stood still for as long as it must."""
        if block.owner == NOBODY:
            self._other = NOBODY
            return True
        now = self._now()
        if block.owner != self._other:
            self._other, self._beat, self._moved = block.owner, None, False
        if self._beat is None or self._since_s is None:
            self._beat, self._since_s = block.service_heartbeat, now
        foreign = self.is_foreign(block)
        self._phase = _Phase.WATCHING if foreign else _Phase.WATCHING_OWN
        if block.service_heartbeat != self._beat:
            # Beside our own number once may be a write of our former life that came late; a service moves it again.
            if foreign or self._moved:
                self._phase = _Phase.CONFLICT
                return False
            self._beat, self._since_s, self._moved = block.service_heartbeat, now, True
        if now - self._since_s < (WATCH_S if foreign else WATCH_OWN_S):
            return False
        self._taken_over = self._taken_over or foreign
        self._beats.append(block.service_heartbeat)
        return True
