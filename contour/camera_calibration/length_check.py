"""A length that a person measured beside the same length by the calibration: alike, doubtful, or a contradiction.

Corners of a board cannot tell its size: squares said to be 5/6 of what they are put the camera at 5/6 of its height,
with residuals as small as ever. Only a length from elsewhere shows it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, floor, log10

import numpy as np

from contour.calibration.calibration import Calibration
from contour.errors import CalibrationFailed
from contour.geometry.arrays import Float64s

WARN_SHARE = 0.03
"""A tape is read to the front of the lens, the camera's centre lies 10 to 50 mm off it: up to 3 % from 1.2 m on."""

REFUSE_SHARE = 0.08
"""Beyond what tape and lens explain. Boards' sizes lie farther apart: 20, 25 and 30 mm by a fifth or more."""

SHORTEST_PX = 50.0
"""Two ends pointed at within a pixel each are off by 1.4 px together: 2.8 % of that, within what is warned of."""


@dataclass(frozen=True, eq=False)
class KnownLength:
    """A length on the calibrated plane, measured by hand, and the pixels of its two ends, shape (2, 2)."""

    length_mm: float
    ends_px: Float64s

    def check(self, size: tuple[int, int]) -> None:
        """Raise CalibrationFailed where an end lies outside a picture of (width, height) px, or both too near."""
        for x, y in self.ends_px:
            if not (-0.5 <= x <= size[0] - 0.5 and -0.5 <= y <= size[1] - 0.5):
                raise CalibrationFailed(
                    f"--between: pixel ({x:g}, {y:g}) lies outside the picture of {size[0]} x {size[1]} px. Point at "
                    "the length's ends in a picture of that size"
                )
        apart = float(np.linalg.norm(self.ends_px[1] - self.ends_px[0]))
        if not apart >= SHORTEST_PX:
            raise CalibrationFailed(
                f"--between: the ends lie {apart:.0f} px apart, {SHORTEST_PX:g} or more are needed to tell "
                f"{100 * WARN_SHARE:g} %. Take a longer length"
            )


@dataclass(frozen=True)
class LengthCheck:
    """One length twice, by the calibration and by hand, mm. `cause` is the likely one where they contradict."""

    what: str
    solved_mm: float
    measured_mm: float
    cause: str

    @property
    def apart(self) -> float:
        """The difference as a share of what was measured."""
        return abs(self.solved_mm / self.measured_mm - 1)

    @property
    def needed_percent(self) -> float:
        """The least whole number of percent that, allowed, takes it."""
        return float(floor(100 * self.apart + 1e-9) + 1)

    def __str__(self) -> str:
        return (
            f"{self.what} {self.solved_mm:.{decimals(self.solved_mm)}f} mm by the calibration, {self.measured_mm:g} mm "
            f"measured: {100 * self.apart:.1f} % apart"
        )

    def fault(self, accept_share: float) -> str | None:
        """Why the calibration may not be used; None where the lengths are less than that share apart."""
        if self.apart < accept_share:
            return None
        return f"{self}, less than {100 * accept_share:g} % is allowed. {self.cause}"

    def warning(self, accept_share: float) -> str | None:
        """What to look at from 3 % apart on, None where it is nearer, or a fault."""
        if self.apart < WARN_SHARE or self.fault(accept_share) is not None:
            return None
        return f"{self}; from {100 * WARN_SHARE:g} % on something is wrong. {self.cause}"


def camera_height_check(solved_mm: float, measured_mm: float, square_mm: float, board_mm: float) -> LengthCheck:
    """The camera's height above the table, by views of a board whose pattern lay `board_mm` above it, and by tape."""
    fitting = _rounded(square_mm * max(measured_mm - board_mm, 1.0) / (solved_mm - board_mm))
    would_be = board_mm + (solved_mm - board_mm) * fitting / square_mm
    cause = (
        f"{_squares(fitting, would_be, square_mm)}. If ten squares measure what --square-mm says, measure again from "
        "the table to the lens, in millimetres"
    )
    return LengthCheck("camera above the table", solved_mm, measured_mm, cause)


def board_length_check(calibration: Calibration, known: KnownLength, square_mm: float) -> LengthCheck:
    """A known length on the table, in a picture of the calibrated camera."""
    solved_mm = span_mm(calibration, known, 0.0)
    fitting = _rounded(square_mm * known.length_mm / solved_mm)
    cause = (
        f"{_squares(fitting, solved_mm * fitting / square_mm, square_mm)}. If ten squares measure what --square-mm "
        "says, check the length, that it lies on the table, and --between"
    )
    return LengthCheck("known length on the table", solved_mm, known.length_mm, cause)


def span_mm(calibration: Calibration, known: KnownLength, height_mm: float) -> float:
    """The known length by the calibration, on the plane z = `height_mm`."""
    ends = calibration.to_work(known.ends_px, height_mm)
    return float(np.linalg.norm(ends[1] - ends[0]))


def decimals(value: float) -> int:
    """Digits behind the point that make three significant ones, for lengths from 100 on none."""
    return max(0, 2 - floor(log10(abs(value)))) if value else 0


def rounded_up(value: float, step: float) -> float:
    """The least multiple of a step that is not below the value."""
    return round(ceil(value / step - 1e-9) * step, 9)


def _rounded(value: float) -> float:
    """To three significant digits: as finely as a person tells the sizes of boards."""
    return round(value, 2 - floor(log10(value)))


def _squares(fitting: float, would_be_mm: float, told_mm: float) -> str:
    return (
        f"Check the squares' size: squares of {fitting:.{decimals(fitting)}f} mm would give "
        f"{would_be_mm:.{decimals(would_be_mm)}f} mm, --square-mm says {told_mm:g}"
    )
