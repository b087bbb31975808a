"""The machine frame against the work frame: a rigid fit in the plane through points that a person jogged to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contour.calibration import Alignment
from contour.errors import CalibrationFailed
from contour.point_calibration import FLAT_SHARE, flatness

Floats = NDArray[np.float64]

FEWEST_POINTS = 3


@dataclass(frozen=True, eq=False)
class AlignmentFit:
    """The alignment, each point's distance from it, shape (N,), mm, and the best scale: told, not applied."""

    alignment: Alignment
    residuals_mm: Floats
    scale: float


def fit_alignment(work_mm: Floats, machine_mm: Floats, bound_mm: float) -> AlignmentFit:
    """The turn and shift of least squares that take work points (N, 2) to machine points (N, 2) (Kabsch, 1976).

    Raises CalibrationFailed for fewer than three points, points on one line, and residuals above the bound.
    """
    _check(work_mm, machine_mm)
    middle, machine_middle = work_mm.mean(axis=0), machine_mm.mean(axis=0)
    one, other = work_mm - middle, machine_mm - machine_middle
    angle = float(np.arctan2(_cross(one, other), _dot(one, other)))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shift = machine_middle - turn @ middle
    alignment = Alignment(float(np.degrees(angle)), (float(shift[0]), float(shift[1])))
    residuals = np.linalg.norm(alignment.apply(work_mm) - machine_mm, axis=1)
    scale = float(np.hypot(_cross(one, other), _dot(one, other)) / (one**2).sum())
    fit = AlignmentFit(alignment, residuals, scale)
    if residuals.max() > bound_mm:
        raise CalibrationFailed(_too_far(fit, one, other, bound_mm))
    return fit


def _too_far(fit: AlignmentFit, one: Floats, other: Floats, bound_mm: float) -> str:
    worst = int(np.argmax(fit.residuals_mm))
    text = (
        f"point {worst + 1} lies {fit.residuals_mm[worst]:.3f} mm from the rigid fit, {bound_mm:g} are allowed; all: "
        + ", ".join(f"{value:.3f}" for value in fit.residuals_mm)
    )
    mirrored = one * np.array([1.0, -1.0])
    reach = np.hypot(_cross(one, other), _dot(one, other))
    if np.hypot(_cross(mirrored, other), _dot(mirrored, other)) > 1.05 * reach:
        return f"{text}. A mirrored fit is better: x and y are swapped, or one is reversed"
    if abs(fit.scale - 1) > 0.002:
        return f"{text}. The scale between both is {fit.scale:.5f}: check --square-mm of the calibration, and units"
    return f"{text}. Jog to that point again, or check its row"


def _check(work_mm: Floats, machine_mm: Floats) -> None:
    if len(work_mm) < FEWEST_POINTS:
        raise CalibrationFailed(
            f"{len(work_mm)} points, expected {FEWEST_POINTS} or more: two leave no residual to check by. Jog to more"
        )
    if not (np.isfinite(work_mm).all() and np.isfinite(machine_mm).all()):
        raise CalibrationFailed("a coordinate is not finite, expected numbers. Correct the file")
    for name, points in (("work", work_mm), ("machine", machine_mm)):
        if flatness(points) < FLAT_SHARE:
            raise CalibrationFailed(
                f"the {name} points lie on one line: a mirrored or turned axis would not be seen. Jog to points spread "
                "over the table, such as three of its corners"
            )


def _dot(one: Floats, other: Floats) -> float:
    return float((one * other).sum())


def _cross(one: Floats, other: Floats) -> float:
    return float((one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]).sum())
