"""What speaks against using a calibration for a frame: its age, another camera, marks that are not where they were."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from contour.calibration.fixed_marks import SentinelCheck, check_sentinels
from service.measuring.calibration_file import CalibrationRecord
from service.reasons import Reason, Rejection

SECONDS_A_DAY = 86_400.0
CLOCK_SLACK_DAYS = 1.0
"""A file may have been written on a computer whose clock is set otherwise; a day is no such difference."""


def utc_now() -> datetime:
    """The time by this computer's clock."""
    return datetime.now(UTC)


@dataclass(frozen=True)
class GuardLimits:
    """max_age_days 0 = no limit. sentinels_required: refuse where the calibration has marks and none is seen."""

    max_age_days: float = 0.0
    sentinel_tolerance_px: float = 1.0
    sentinels_required: bool = True


class CalibrationGuard:
    """Says of each frame whether the calibration may still be used for it."""

    def __init__(
        self, record: CalibrationRecord, limits: GuardLimits, *, now: Callable[[], datetime] = utc_now
    ) -> None:
        self.record = record
        self.limits = limits
        self._now = now

    @property
    def age_days(self) -> float | None:
        """Days since the calibration was made; None where its file does not say when."""
        if self.record.created is None:
            return None
        return (self._now() - self.record.created).total_seconds() / SECONDS_A_DAY

    def findings(self, picture: NDArray[np.uint8], camera: str = "") -> tuple[Rejection, ...]:
        """Every reason not to use it for a frame of this camera ("" = not told), lowest code first."""
        found = [self.expired(), self.other_camera(camera)]
        calibration = self.record.calibration
        if picture.shape[1] == calibration.image_width and picture.shape[0] == calibration.image_height:
            found.append(self.moved(self.sentinels(picture)))
        return tuple(sorted((one for one in found if one is not None), key=lambda one: one[0]))

    def expired(self) -> Rejection | None:
        """141 where it is older than allowed, or does not say how old it is."""
        limit, age = self.limits.max_age_days, self.age_days
        if not limit:
            return None
        if age is None:
            text = f"The calibration does not say when it was made, {limit:g} days are allowed. Calibrate again."
        elif age < -CLOCK_SLACK_DAYS:
            text = f"The calibration was made {-age:.1f} days in the future. Set the clock, or calibrate again."
        elif age > limit:
            text = f"The calibration is {age:.1f} days old, {limit:g} are allowed. Calibrate again."
        else:
            return None
        return Reason.CALIBRATION_MISMATCH, text

    def other_camera(self, camera: str) -> Rejection | None:
        """141 where the calibration names another camera than the frame's; where one is not named, none."""
        own = self.record.camera_name
        if not own or not camera or own == camera:
            return None
        text = f"The frame is of camera {camera!r}, the calibration of {own!r}. Use that camera, or calibrate this one."
        return Reason.CALIBRATION_MISMATCH, text

    def sentinels(self, picture: NDArray[np.uint8]) -> SentinelCheck | None:
        """Where the fixed marks are in a picture; None where the calibration has none."""
        marks = self.record.sentinels
        return None if marks is None else check_sentinels(picture, marks)

    def moved(self, check: SentinelCheck | None) -> Rejection | None:
        """142 where a mark is off by more than the tolerance, or none is seen and one is required."""
        if check is None:
            return None
        tolerance = self.limits.sentinel_tolerance_px
        if check.largest_px is None:
            if not self.limits.sentinels_required:
                return None
            numbers = ", ".join(str(number) for number in check.missing)
            text = f"None of the fixed marks ({numbers}) is seen. Clear them; if the camera was moved, calibrate again."
        elif check.largest_px > tolerance:
            text = (
                f"The camera or a mark was moved: {check}; {tolerance:g} px are allowed. Calibrate again, or put the "
                "mark back."
            )
        else:
            return None
        return Reason.SENTINEL_MOVED, text
