"""What of a chattering contact, a burst of bytes or a noisy line is one trigger. Times are seconds, of any clock."""

from __future__ import annotations

from typing import Literal

Edge = Literal["rising", "falling"]


class Burst:
    """Bytes that follow one another closely are one trigger, told at the first of them.

    silence_s: a silence from which on the next byte is a new trigger. A scanner sends its whole code as one burst; a
    device that babbles without a pause gives one trigger, not thousands.
    """

    def __init__(self, silence_s: float) -> None:
        self._silence_s = silence_s
        self._heard_at_s: float | None = None

    def heard(self, at_s: float) -> bool:
        """True where bytes that came at `at_s` begin a burst."""
        begins = self._heard_at_s is None or at_s - self._heard_at_s >= self._silence_s
        self._heard_at_s = at_s
        return begins


class SteadyEdge:
    """A change of level counts once the new level has been seen, and nothing else, for `hold_s`.

    So neither a bouncing contact nor an interference shorter than that is a trigger. The level at the beginning is no
    edge: a pedal that is held down while the port is opened triggers nothing.
    """

    def __init__(self, edge: Edge, hold_s: float) -> None:
        self._level_after = edge == "rising"
        self._hold_s = hold_s
        self._steady: bool | None = None
        self._seen: bool | None = None
        self._since_s = 0.0

    def level(self, level: bool, at_s: float) -> bool:
        """True where the level seen at `at_s` completes the edge that is waited for."""
        if level is not self._seen:
            self._seen, self._since_s = level, at_s
        if level is self._steady or at_s - self._since_s < self._hold_s:
            return False
        had_level, self._steady = self._steady is not None, level
        return had_level and level is self._level_after
