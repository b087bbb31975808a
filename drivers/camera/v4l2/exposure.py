"""When a frame's exposure began, from the stamp that the driver put on it."""

from __future__ import annotations

from dataclasses import dataclass

# Drivers that flag their stamps as the start of exposure and yet stamp the arrival of a frame's first byte, which the
# sensor has been exposed and read out before: uvcvideo, unless it uses the camera's own clock, which few keep well.
STAMP_ARRIVAL = frozenset({"uvcvideo"})


@dataclass(frozen=True)
class FrameTiming:
    """What is known of a stream's timing, seconds.

    period_s: from frame to frame. exposure_s: how long the sensor gathers light; None = not known, then it is taken as
    one period, the longest that a free-running sensor has. latency_s: how long the camera keeps a frame beyond exposure
    and reading out before it sends it.
    """

    period_s: float
    exposure_s: float | None
    latency_s: float = 0.0

    def earliest_start_s(self, stamp_s: float, *, at_start_of_exposure: bool) -> float:
        """The earliest time at which the frame's exposure can have begun, on the stamp's clock.

        A stamp at the start of exposure is that time. One at the end of the frame, or as it arrives, comes after the
        exposure, after reading out, at most one period long, and after what the camera itself waits.
        """
        if at_start_of_exposure:
            return stamp_s
        exposure_s = self.period_s if self.exposure_s is None else self.exposure_s
        return stamp_s - self.latency_s - self.period_s - exposure_s
