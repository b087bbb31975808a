"""Which readings of the controller's clock count: one may be half written, so what jumps must hold before it is taken.

It is told every reading of the controller's block; it does no I/O and has no clock of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

from drivers.controller.mailbox.blocks import LinkBlock

TOLERANCE_MS = 1000  # protocol: a reading counts only if it fits the last one that counted within 1 s
MODULUS = 1 << 32
READINGS_TO_REPLACE = 3  # one that does not fit, and the two after it
BEATS_TO_HOLD = 2  # changes of the controller's heartbeat, which waits until no value is half written


@dataclass(frozen=True)
class Stamp:
    """What the controller's clock said, and in which session; clock_ms 0 where it has no clock."""

    session: int
    clock_ms: int


@dataclass(frozen=True)
class _Reading:
    session: int
    clock_ms: int
    read_at_s: float
    heartbeat: int

    def fits(self, before: _Reading) -> bool:
        """True where as much time passed on the controller's clock as on ours, within the tolerance."""
        if self.session != before.session:
            return False
        passed_ms = (self.clock_ms - before.clock_ms) % MODULUS
        off_ms = passed_ms - (self.read_at_s - before.read_at_s) * 1000
        off_ms = (off_ms + MODULUS / 2) % MODULUS - MODULUS / 2
        return abs(off_ms) <= TOLERANCE_MS


class ControllerClock:
    """The controller's clock, reading by reading."""

    def __init__(self) -> None:
        self._latest: _Reading | None = None
        self._counted: _Reading | None = None  # the last reading that counted
        self._doubted: list[_Reading] = []  # the first and the last of those after it that fit one another, not it
        self._doubted_number = self._doubted_beats = 0
        self._ran_in = 0  # the session in which the clock was seen at another value than 0
        self._zero: tuple[int, float] = (0, 0.0)  # session, and when its clock was first seen at 0

    def disconnected(self) -> None:
        """What comes next may be another controller's: it has to fit what counted, or to hold by itself."""
        self._latest, self._doubted = None, []

    def heard(self, block: LinkBlock, now_s: float) -> None:
        """Take note of a reading; `now_s` is monotonic."""
        if block.session == 0:  # being filled: disregarded
            return
        reading = _Reading(block.session, block.clock, now_s, block.controller_heartbeat)
        self._latest = reading
        if reading.clock_ms:
            self._ran_in = reading.session
        elif self._zero[0] != reading.session:
            self._zero = (reading.session, now_s)
        if (self._counted is not None and reading.fits(self._counted)) or self._holds(reading):
            self._counted, self._doubted = reading, []

    def _holds(self, reading: _Reading) -> bool:
        """True where what does not fit the last one that counted is the clock all the same."""
        if not all(reading.fits(doubted) for doubted in self._doubted):
            self._doubted = []
        if not self._doubted:
            self._doubted, self._doubted_number, self._doubted_beats = [reading], 1, 0
            return False
        self._doubted_number += 1
        self._doubted_beats += reading.heartbeat != self._doubted[-1].heartbeat
        self._doubted = [self._doubted[0], reading]
        return self._doubted_number >= READINGS_TO_REPLACE and self._doubted_beats >= BEATS_TO_HOLD

    def stamp(self, session: int) -> Stamp | None:
        """The clock as last read, None where that reading does not count, or not in this session."""
        latest = self._latest
        if latest is None or latest.session != session:
            return None
        runs = self._runs(latest)
        if not runs:
            return Stamp(session, 0) if runs is False else None
        # A running clock that wraps to 0 is told as 1 ms earlier: 0 would say that there is none.
        return Stamp(session, latest.clock_ms or MODULUS - 1) if latest is self._counted else None

    def fault(self, session: int) -> str | None:
        """Why no contour could be stamped in this session, as a sentence; a single reading that jumps is none."""
        latest = self._latest
        if latest is None or latest.session != session:
            return None
        runs = self._runs(latest)
        if runs is None:
            return "the controller's clock shows 0: whether it runs is not known yet"
        if runs and (self._counted is None or self._counted.session != session):
            return "the controller's clock has not held over two changes of its heartbeat yet"
        return None

    def _runs(self, reading: _Reading) -> bool | None:
        """True, False where it has shown 0 for longer than a clock can, None where that is not known yet."""
        if reading.clock_ms or reading.session == self._ran_in:
            return True
        return False if (reading.read_at_s - self._zero[1]) * 1000 > TOLERANCE_MS else None
