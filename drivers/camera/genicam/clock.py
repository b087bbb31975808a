"""The camera's clock on ours: between which bounds a frame's own time stamp lies on the monotonic clock."""

from __future__ import annotations

import math

# Quartz clocks keep to 100 millionths; two of them may run apart by twice that.
DRIFT = 2e-4


class CameraClock:
    """Bounds of (our clock − the camera's), seconds. They close in with what is known, and widen as clocks drift."""

    def __init__(self) -> None:
        self._low, self._high, self._at_s = -math.inf, math.inf, 0.0

    @property
    def known(self) -> bool:
        """True where both bounds are."""
        return math.isfinite(self._low) and math.isfinite(self._high)

    def latched(self, camera_s: float, before_s: float, after_s: float) -> None:
        """The camera's clock showed `camera_s` at some time between two of ours."""
        self._low, self._high, self._at_s = before_s - camera_s, after_s - camera_s, after_s

    def earliest_s(self, stamp_s: float) -> float:
        """The earliest time on our clock that a stamp can mean; −inf = not known."""
        return stamp_s + self._low

    def latest_s(self, stamp_s: float) -> float:
        """The latest time on our clock that a stamp can mean; inf = not known."""
        return stamp_s + self._high

    def frame_came(self, stamp_s: float, after_s: float, before_s: float) -> bool:
        """A frame stamped `stamp_s` came before `before_s`, and is to have been exposed after `after_s` (−inf = any).

        False where its stamp says that it was exposed earlier: it is none of that trigger's, and tells nothing.
        """
        drifted = DRIFT * max(0.0, before_s - self._at_s) if self.known else 0.0
        low, high = self._low - drifted, self._high + drifted
        if stamp_s + high < after_s:
            return False
        self._low, self._high = max(low, after_s - stamp_s), min(high, before_s - stamp_s)
        self._at_s = before_s
        if self._low > self._high:  # the camera's clock was set anew: this frame alone tells
            self._low, self._high = after_s - stamp_s, before_s - stamp_s
        return True
