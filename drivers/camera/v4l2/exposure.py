"""When a frame's exposure began, from the stamp that the driver put on it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FrameTiming:
    """What is known of a stream's timing, seconds.

    period_s: from frame to frame. exposure_s: how long the sensor gathers light; None = not known, then it is taken as
    one period, the longest that a free-running sensor has.
    """

    period_s: float
    exposure_s: float | None

    def earliest_start_s(self, stamp_s: float, *, at_start_of_exposure: bool) -> float:
        """The earliest time at which the frame's exposure can have begun, on the stamp's clock.

        A stamp at the start of exposure is that time. One at the end of the frame comes after reading out, at most one
        period long, and after the exposure.
        """
        if at_start_of_exposure:
            return stamp_s
        return stamp_s - self.period_s - (self.period_s if self.exposure_s is None else self.exposure_s)
