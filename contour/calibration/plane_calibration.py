"""A calibration from points alone: the homography between the picture and one plane, without lens or height."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.calibration.calibration import HEIGHT_BOUND_MM, Alignment, CalibrationBase, scales
from contour.calibration.position_uncertainty import PositionUncertainty
from contour.errors import CalibrationError
from contour.geometry.arrays import Float64s
from contour.geometry.rectifier import Rectifier

_HORIZON = 1e-3
"""A point whose homogeneous coordinate is under this share of the picture's middle lies at the plane's horizon."""


@dataclass(frozen=True, eq=False)
class PlaneCalibration(CalibrationBase):
    """Pixels to the plane z = `plane_height_mm` by a homography: a tilted camera, but no lens distortion.

    `homography`, shape (3, 3), takes pixels to work millimetres. At other heights the same map is applied, and
    `height_known` says False.
    """

    image_width: int
    image_height: int
    homography: Float64s
    plane_height_mm: float = 0.0
    alignment: Alignment | None = None
    uncertainty: PositionUncertainty | None = None

    def __post_init__(self) -> None:
        self._check_size()
        matrix = np.array(self.homography, dtype=np.float64)
        if matrix.size != 9 or not np.isfinite([*matrix.ravel(), self.plane_height_mm]).all():
            raise CalibrationError(
                f"homography holds {matrix.size} numbers and plane_height_mm {self.plane_height_mm}: expected 9 and 1, "
                "all finite. Calibrate again."
            )
        matrix = matrix.reshape(3, 3)
        middle = matrix @ [(self.image_width - 1) / 2, (self.image_height - 1) / 2, 1.0]
        # A view from above turns pixels, whose y runs down, into a plane whose y runs up: a negative determinant.
        if middle[2] == 0 or not np.linalg.det(matrix / middle[2]) < 0:
            raise CalibrationError(
                "The homography is degenerate, or mirrors the picture: expected a view from above, x right and y up. "
                "Check the points' order and signs."
            )
        matrix = matrix / middle[2]
        matrix.flags.writeable = False
        object.__setattr__(self, "homography", matrix)

    def height_known(self, height_mm: float) -> bool:
        """True within HEIGHT_BOUND_MM of the plane that the points lay on."""
        return abs(height_mm - self.plane_height_mm) <= HEIGHT_BOUND_MM

    def to_work(self, points_px: Float64s, height_mm: float) -> Float64s:
        """Work points of pixels; `height_mm` has no influence; CalibrationError at and beyond the plane's horizon."""
        return self._mapped(self.homography, np.asarray(points_px, dtype=np.float64), "Pixel")

    def to_pixels(self, points_machine: Float64s, height_mm: float) -> Float64s:
        """Pixels of machine points; `height_mm` has no influence."""
        work = self._to_work_frame(np.asarray(points_machine, dtype=np.float64))
        inverse = np.linalg.inv(self.homography)
        middle = self.to_work(self._middle(), 0.0)[0]
        return self._mapped(inverse / (inverse[2] @ [*middle, 1.0]), work, "Point")

    def rectifier(self, height_mm: float) -> Rectifier:
        """The plane, y turned down as in the picture, scaled to the pixels at the picture's middle."""
        return _HomographyRectifier(self, float(scales(self, self._middle(), height_mm)[0]))

    def _middle(self) -> Float64s:
        return np.array([[(self.image_width - 1) / 2, (self.image_height - 1) / 2]])

    @staticmethod
    def _mapped(matrix: Float64s, points: Float64s, kind: str) -> Float64s:
        third = points @ matrix[2, :2] + matrix[2, 2]
        if len(points) and not third.min() >= _HORIZON:
            x, y = points[int(np.argmin(third))]
            raise CalibrationError(
                f"{kind} ({x:.1f}, {y:.1f}) lies beyond the horizon of the calibrated plane. Check the calibration."
            )
        return np.asarray((points @ matrix[:2, :2].T + matrix[:2, 2]) / third[:, None])


@dataclass(frozen=True)
class _HomographyRectifier:
    calibration: PlaneCalibration
    mm_per_unit: float

    def rectify(self, points_px: Float64s) -> Float64s:
        return np.asarray(self.calibration.to_work(points_px, 0.0) * np.array([1, -1]) / self.mm_per_unit)

    def unrectify(self, points: Float64s) -> Float64s:
        work = points * np.array([1, -1]) * self.mm_per_unit
        return self.calibration.to_pixels(self.calibration.to_machine(work), 0.0)
