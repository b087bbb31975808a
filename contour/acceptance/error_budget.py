"""What a contour in millimetres may be off by: its parts, each a 95 % bound, and what they come to together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.calibration.calibration import Calibration
from contour.geometry.rings import Contour


@dataclass(frozen=True)
class ErrorBudget:
    """95 % bounds on the position of the polygon that is sent, millimetres, by cause.

    picture_mm: tracing and simplification. thickness_mm: the top's height off by its tolerance. calibration_mm: what
    the calibration states of itself; None where it states nothing, and then the total holds without it.
    """

    picture_mm: float
    thickness_mm: float
    calibration_mm: float | None

    @property
    def total_mm(self) -> float:
        """Root of the sum of squares: the causes know nothing of one another (GUM, JCGM 100:2008, 5.1.2)."""
        return float(np.hypot(np.hypot(self.picture_mm, self.thickness_mm), self.calibration_mm or 0.0))

    def __str__(self) -> str:
        calibration = "not stated" if self.calibration_mm is None else f"{self.calibration_mm:.2f}"
        return f"picture {self.picture_mm:.2f}, thickness {self.thickness_mm:.2f}, calibration {calibration}"


def error_budget(
    contour_px: Contour,
    calibration: Calibration,
    *,
    height_mm: float,
    thickness_tolerance_mm: float,
    uncertainty_px: float | None,
    mm_per_px: float,
) -> ErrorBudget | None:
    """The budget of a contour in pixels on the plane z = `height_mm`.

    None where its uncertainty in pixels is not known, or the scale at that height (more or less the tolerance) is not.
    Raises CalibrationError where a plane within the tolerance is not in view.
    """
    heights = [height_mm + thickness_tolerance_mm * sign for sign in (1.0, -1.0)]
    if uncertainty_px is None or not all(calibration.height_known(height) for height in heights):
        return None
    points = np.concatenate(contour_px.rings)
    thickness_mm = 0.0
    if thickness_tolerance_mm > 0.0:
        place = calibration.to_work(points, height_mm)
        shifts = [calibration.to_work(points, height) - place for height in heights]
        thickness_mm = float(np.hypot(*np.concatenate(shifts).T).max())
    sure = calibration.uncertainty
    calibration_mm = None if sure is None else float(sure.at(points, height_mm).max())
    return ErrorBudget(uncertainty_px * mm_per_px, thickness_mm, calibration_mm)
