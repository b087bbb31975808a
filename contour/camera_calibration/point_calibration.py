"""A calibration without a board: pixels and millimetres of the same points give the homography of their plane."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contour.calibration.plane_calibration import PlaneCalibration
from contour.calibration.position_uncertainty import PositionUncertainty
from contour.camera_calibration.calibration_verdict import COLUMNS, ROWS, places
from contour.camera_calibration.student_t import two_sided_95
from contour.errors import CalibrationError, CalibrationFailed
from contour.geometry.arrays import Float64s

FEWEST_POINTS = 4
FLAT_SHARE = 0.05
"""Points whose spread across is under this share of that along lie on one line for all that a person can measure."""


@dataclass(frozen=True, eq=False)
class PointsResult:
    """A calibration from points, and how far each lies from where it puts it, shape (N,), mm."""

    calibration: PlaneCalibration
    residuals_mm: Float64s


def calibrate_points(
    pixels: Float64s, points_mm: Float64s, size: tuple[int, int], plane_height_mm: float = 0.0
) -> PointsResult:
    """The homography through 4 or more points, pixels (N, 2) and work millimetres (N, 2), of least squares in mm.

    With 4 points residuals are 0 and nothing is known of the uncertainty. Raises CalibrationFailed.
    """
    _check(pixels, points_mm, size)
    matrix = _homography(pixels, points_mm)
    try:
        calibration = PlaneCalibration(*size, matrix, plane_height_mm)
        misses = calibration.to_work(pixels, plane_height_mm) - points_mm
        sure = _uncertainty(calibration, pixels, misses, size)
        return PointsResult(replace(calibration, uncertainty=sure), np.linalg.norm(misses, axis=1))
    except CalibrationError as error:
        raise CalibrationFailed(f"the points give no usable map: {error}") from error


def flatness(points: Float64s) -> float:
    """Spread of points across their main direction as a share of that along it: 0 on one line, 1 all ways alike."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(spread[1] / spread[0]) if spread[0] > 0 else 0.0


def _check(pixels: Float64s, points_mm: Float64s, size: tuple[int, int]) -> None:
    if len(pixels) < FEWEST_POINTS:
        raise CalibrationFailed(
            f"{len(pixels)} points, expected {FEWEST_POINTS} or more, better 8. Measure more points"
        )
    if not (np.isfinite(pixels).all() and np.isfinite(points_mm).all()):
        raise CalibrationFailed("a coordinate is not finite, expected numbers. Correct the file")
    outside = (pixels < -0.5).any(axis=1) | (pixels > np.array(size) - 0.5).any(axis=1)
    if outside.any():
        x, y = pixels[int(np.argmax(outside))]
        raise CalibrationFailed(
            f"pixel ({x:g}, {y:g}) lies outside the picture of {size[0]} x {size[1]} px. Check the columns' order"
        )
    for name, points in (("pixels", pixels), ("millimetres", points_mm)):
        if _three_on_a_line(points):
            raise CalibrationFailed(
                f"the points' {name} lie on one line, all but one at most: expected points spread over the table, such "
                "as its four corners. Measure others"
            )


def _three_on_a_line(points: Float64s) -> bool:
    """True where no four of the points span a plane's map: all, or all but one, on one line."""
    if flatness(points) < FLAT_SHARE:
        return True
    return any(flatness(np.delete(points, index, axis=0)) < FLAT_SHARE for index in range(len(points)))


def _homography(pixels: Float64s, points_mm: Float64s) -> Float64s:
    """Direct linear transform on normalised points (Hartley, 1997), then Gauss-Newton on the distances in mm."""
    to_unit, unit = _normalised(pixels)
    from_unit, target = _normalised(points_mm)
    rows = []
    for (x, y), (u, v) in zip(unit, target, strict=True):
        rows += [[x, y, 1, 0, 0, 0, -u * x, -u * y, -u], [0, 0, 0, x, y, 1, -v * x, -v * y, -v]]
    matrix = np.linalg.svd(np.array(rows))[2][-1].reshape(3, 3)
    matrix = matrix / np.linalg.norm(matrix)
    for _ in range(20):
        value, slopes = _mapped(matrix, unit)
        step = np.linalg.lstsq(slopes, (target - value).ravel(), rcond=1e-9)[0]
        matrix = matrix + step.reshape(3, 3)
        if np.abs(step).max() < 1e-14:
            break
    return np.asarray(np.linalg.inv(from_unit) @ matrix @ to_unit)


def _normalised(points: Float64s) -> tuple[Float64s, Float64s]:
    """The map that puts points around 0 with mean distance 1, and the points through it."""
    middle = points.mean(axis=0)
    scale = 1.0 / max(float(np.linalg.norm(points - middle, axis=1).mean()), 1e-12)
    matrix = np.array([[scale, 0, -scale * middle[0]], [0, scale, -scale * middle[1]], [0, 0, 1]])
    return matrix, np.asarray((points - middle) * scale)


def _mapped(matrix: Float64s, points: Float64s) -> tuple[Float64s, Float64s]:
    """Points through a homography, (N, 2), and their derivatives by its nine numbers, (2 N, 9)."""
    lifted = np.column_stack([points, np.ones(len(points))])
    x, y, w = (lifted @ matrix.T).T
    slopes = np.zeros((len(points), 2, 9))
    slopes[:, 0, 0:3] = slopes[:, 1, 3:6] = lifted / w[:, None]
    slopes[:, 0, 6:9] = -lifted * (x / w**2)[:, None]
    slopes[:, 1, 6:9] = -lifted * (y / w**2)[:, None]
    return np.column_stack([x / w, y / w]), slopes.reshape(-1, 9)


def _uncertainty(
    calibration: PlaneCalibration, pixels: Float64s, misses: Float64s, size: tuple[int, int]
) -> PositionUncertainty | None:
    """95 % bounds by the residuals' spread, propagated; None where no residual tells it."""
    freedom = misses.size - 8
    if freedom < 2:
        return None
    variance = float((misses**2).sum()) / freedom
    _, slopes = _mapped(calibration.homography, pixels)
    spread = np.linalg.pinv(slopes.T @ slopes, rcond=1e-20, hermitian=True) * variance
    grid = places(size)
    _, reach = _mapped(calibration.homography, grid)
    reach = reach.reshape(-1, 2, 9)
    traces = np.einsum("nia,ab,nib->n", reach, spread, reach)
    bounds = two_sided_95(freedom) * np.sqrt(np.maximum(traces, 0.0))
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    inside = ((grid >= low) & (grid <= high)).all(axis=1)
    figure = float(np.percentile(bounds[inside], 95)) if inside.any() else float(bounds.max())
    height = np.array([calibration.plane_height_mm])
    return PositionUncertainty(*size, height, np.array([figure]), bounds.reshape(1, ROWS, COLUMNS))
