"""Pixels to millimetres at a height above the table, and on to the cutting machine's frame.

Work frame: millimetres, right-handed, x right and y up on the table, z towards the camera, the table is z = 0.
Machine frame: the work frame turned and moved by the alignment; the same where there is none.
Pixel (0, 0) is the centre of the top-left pixel, x right, y down.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from contour.calibration.position_uncertainty import PositionUncertainty
from contour.errors import CalibrationError
from contour.geometry.arrays import Float64s
from contour.geometry.rectifier import Rectifier
from contour.image.opencv import camera_rays, project, rotation_matrix

HEIGHT_BOUND_MM = 0.5
"""A plane within this of the simple form's own counts as known: under a camera 1 m up, 0.5 mm changes the scale by
0.05 %, a quarter of a millimetre on half a metre."""

_ROUND_TRIP_PX = 0.01
"""A ray that does not project back to its pixel comes from where the lens model folds over, outside its field."""

_GRAZING = 0.02
"""Least sine between a ray and the plane (1.1 degrees): nearer to the horizon a pixel covers 50 times its length."""


@dataclass(frozen=True)
class Alignment:
    """The machine frame seen from the work frame: machine = R(rotation) · work + translation."""

    rotation_deg: float = 0.0
    translation_mm: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not np.isfinite([self.rotation_deg, *self.translation_mm]).all():
            raise CalibrationError(
                f"Alignment with rotation_deg {self.rotation_deg} and translation_mm {self.translation_mm}: "
                "expected finite numbers. Run the alignment again."
            )

    def apply(self, points_mm: Float64s) -> Float64s:
        """Machine points of work points, shape (N, 2)."""
        return np.asarray(points_mm @ _turn(self.rotation_deg).T + np.asarray(self.translation_mm))

    def undo(self, points_mm: Float64s) -> Float64s:
        """Work points of machine points, shape (N, 2)."""
        return np.asarray((points_mm - np.asarray(self.translation_mm)) @ _turn(self.rotation_deg))


class Calibration(Protocol):
    """What both forms of calibration answer. Points are float64, shape (N, 2)."""

    @property
    def image_width(self) -> int: ...

    @property
    def image_height(self) -> int: ...

    @property
    def alignment(self) -> Alignment | None: ...

    @property
    def uncertainty(self) -> PositionUncertainty | None:
        """How sure it is, None where nobody found out."""
        ...

    @property
    def aligned(self) -> bool:
        """True where the calibration carries an alignment, be it the identity."""
        ...

    def check_fits(self, width: int, height: int) -> None:
        """Raise CalibrationError unless pictures of this size are the ones it was made for."""
        ...

    def height_known(self, height_mm: float) -> bool:
        """True where the scale at this height is known, not merely carried over from another height."""
        ...

    def to_work(self, points_px: Float64s, height_mm: float) -> Float64s:
        """Work points on the plane z = `height_mm`; CalibrationError where a pixel does not look at it."""
        ...

    def to_machine(self, points_work: Float64s) -> Float64s:
        """Machine points of work points."""
        ...

    def to_pixels(self, points_machine: Float64s, height_mm: float) -> Float64s:
        """Pixels of machine points on the plane z = `height_mm`; CalibrationError for points behind the camera."""
        ...

    def rectifier(self, height_mm: float) -> Rectifier:
        """The plane z = `height_mm` without lens distortion, in units of about a pixel."""
        ...


class CalibrationBase:
    """What both forms share: the alignment and the picture's size."""

    image_width: int
    image_height: int
    alignment: Alignment | None
    uncertainty: PositionUncertainty | None

    @property
    def aligned(self) -> bool:
        """True where the calibration carries an alignment, be it the identity."""
        return self.alignment is not None

    def check_fits(self, width: int, height: int) -> None:
        """Raise CalibrationError unless pictures of this size are the ones it was made for."""
        if (width, height) != (self.image_width, self.image_height):
            raise CalibrationError(
                f"The picture is {width} x {height} px, the calibration was made for "
                f"{self.image_width} x {self.image_height} px. Set the camera to that size, or calibrate again."
            )

    def to_machine(self, points_work: Float64s) -> Float64s:
        """Machine points of work points."""
        return self.alignment.apply(points_work) if self.alignment else points_work

    def _to_work_frame(self, points_machine: Float64s) -> Float64s:
        return self.alignment.undo(points_machine) if self.alignment else points_machine

    def _check_size(self) -> None:
        if self.image_width < 1 or self.image_height < 1:
            raise CalibrationError(
                f"Calibration for pictures of {self.image_width} x {self.image_height} px: expected at least 1 x 1."
            )
        sure = self.uncertainty
        if sure is not None and (sure.image_width, sure.image_height) != (self.image_width, self.image_height):
            raise CalibrationError(
                f"Its uncertainty is of pictures of {sure.image_width} x {sure.image_height} px, the calibration of "
                f"{self.image_width} x {self.image_height} px: expected the same. Calibrate again."
            )


@dataclass(frozen=True)
class SimpleCalibration(CalibrationBase):
    """One scale for the whole picture: a camera that looks straight down through a lens without distortion.

    `mm_per_pixel` holds on the plane z = `plane_height_mm`. How the scale changes with height depends on the
    camera's distance, which this form does not know: at other heights the same scale is applied, and
    `height_known` says False so that whoever uses the result can tell.
    """

    image_width: int
    image_height: int
    mm_per_pixel: float
    origin_px: tuple[float, float]
    plane_height_mm: float = 0.0
    rotation_deg: float = 0.0
    """Of the work x axis against the picture's x axis, counter-clockwise as seen."""
    alignment: Alignment | None = None
    uncertainty: PositionUncertainty | None = None

    def __post_init__(self) -> None:
        self._check_size()
        if not (np.isfinite(self.mm_per_pixel) and self.mm_per_pixel > 0):
            raise CalibrationError(f"mm_per_pixel is {self.mm_per_pixel}: expected a number above 0. Measure it again.")
        if not np.isfinite([*self.origin_px, self.plane_height_mm, self.rotation_deg]).all():
            raise CalibrationError(
                f"origin_px {self.origin_px}, plane_height_mm {self.plane_height_mm}, rotation_deg "
                f"{self.rotation_deg}: expected finite numbers. Correct the calibration."
            )

    def height_known(self, height_mm: float) -> bool:
        """True within HEIGHT_BOUND_MM of the plane that the scale was measured on."""
        return abs(height_mm - self.plane_height_mm) <= HEIGHT_BOUND_MM

    def to_work(self, points_px: Float64s, height_mm: float) -> Float64s:
        """Work points of pixels; `height_mm` has no influence (see the class)."""
        return np.asarray((points_px - np.asarray(self.origin_px)) @ self._axes().T * self.mm_per_pixel)

    def to_pixels(self, points_machine: Float64s, height_mm: float) -> Float64s:
        """Pixels of machine points; `height_mm` has no influence (see the class)."""
        work = self._to_work_frame(points_machine)
        return np.asarray(work @ self._axes() / self.mm_per_pixel + np.asarray(self.origin_px))

    def rectifier(self, height_mm: float) -> Rectifier:
        """Identity: this form's pixels are a plane without distortion already."""
        return _Identity()

    def _axes(self) -> Float64s:
        """The work axes x and y as rows, in pixel directions (y down)."""
        return np.asarray(_turn(self.rotation_deg).T * np.array([1.0, -1.0]))


@dataclass(frozen=True, eq=False)
class CameraCalibration(CalibrationBase):
    """A pinhole camera with lens distortion, and where the work frame lies before it (OpenCV's conventions).

    `camera_matrix` is (3, 3); `distortion_coefficients` hold 4, 5, 8, 12 or 14 numbers (plumb_bob: k1 k2 p1 p2 k3);
    `rotation_vector` (Rodrigues) and `translation_mm` take points of the work frame to the camera's.
    """

    image_width: int
    image_height: int
    camera_matrix: Float64s
    distortion_coefficients: Float64s
    rotation_vector: Float64s
    translation_mm: Float64s
    camera_name: str = ""
    alignment: Alignment | None = None
    uncertainty: PositionUncertainty | None = None

    def __post_init__(self) -> None:
        self._check_size()
        self._take("camera_matrix", {9}, (3, 3))
        self._take("distortion_coefficients", {4, 5, 8, 12, 14}, (-1,))
        self._take("rotation_vector", {3}, (3,))
        self._take("translation_mm", {3}, (3,))
        matrix = self.camera_matrix
        wrong = min(matrix[0, 0], matrix[1, 1]) <= 0 or matrix[2].tolist() != [0, 0, 1]
        if wrong or matrix[0, 1] != 0 or matrix[1, 0] != 0:
            raise CalibrationError(
                f"camera_matrix is {matrix.tolist()}: expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with fx, fy above "
                "0. Calibrate again."
            )
        if self.camera_position[2] <= 0:
            raise CalibrationError(
                f"The camera stands at z = {self.camera_position[2]:.0f} mm, under the table: the work frame's z axis "
                "must point towards the camera. Turn the board's axes and calibrate again."
            )

    def _take(self, name: str, sizes: set[int], shape: tuple[int, ...]) -> None:
        values = np.array(getattr(self, name), dtype=np.float64)
        if values.size not in sizes or not np.isfinite(values).all():
            wanted = " or ".join(str(size) for size in sorted(sizes))
            raise CalibrationError(
                f"{name} holds {values.size} numbers{'' if np.isfinite(values).all() else ', not all finite'}: "
                f"expected {wanted} finite ones. Calibrate again."
            )
        values = values.reshape(shape)
        values.flags.writeable = False
        object.__setattr__(self, name, values)

    @cached_property
    def camera_position(self) -> Float64s:
        """The camera's centre in the work frame, shape (3,), mm."""
        return np.asarray(-self._rotation.T @ self.translation_mm)

    @cached_property
    def _rotation(self) -> Float64s:
        return rotation_matrix(self.rotation_vector)

    def height_known(self, height_mm: float) -> bool:
        """True: the camera model holds at any height."""
        return True

    def to_work(self, points_px: Float64s, height_mm: float) -> Float64s:
        """Work points where the pixels' rays meet the plane z = `height_mm`.

        Raises CalibrationError where the camera is not above the plane, or a ray misses or only grazes it, or the
        lens model does not hold at a pixel.
        """
        position = self.camera_position
        if position[2] <= height_mm:
            raise CalibrationError(
                f"The plane at {height_mm:g} mm is not below the camera, which stands at {position[2]:.0f} mm. "
                "Check the thickness."
            )
        points_px = np.asarray(points_px, dtype=np.float64)
        rays = camera_rays(points_px, self.camera_matrix, self.distortion_coefficients)
        self._check_rays(rays, points_px)
        rays = rays @ self._rotation
        sine = -rays[:, 2] / np.linalg.norm(rays, axis=1)
        if len(rays) and not sine.min() >= _GRAZING:
            x, y = points_px[int(np.argmin(sine))]
            raise CalibrationError(
                f"Pixel ({x:.1f}, {y:.1f}) looks past the plane at {height_mm:g} mm (at or above the horizon). "
                "Check the calibration, or point the camera down."
            )
        reach = (height_mm - position[2]) / rays[:, 2]
        return np.asarray(position[:2] + rays[:, :2] * reach[:, None])

    def _check_rays(self, rays: Float64s, points_px: Float64s) -> None:
        again = project(rays, np.zeros(3), np.zeros(3), self.camera_matrix, self.distortion_coefficients)
        error = np.abs(again - points_px).max(axis=1, initial=0)
        if not (error <= _ROUND_TRIP_PX).all():
            x, y = points_px[int(np.argmax(np.nan_to_num(error, nan=np.inf)))]
            raise CalibrationError(
                f"The lens model does not hold at pixel ({x:.1f}, {y:.1f}): its ray misses it by more than "
                f"{_ROUND_TRIP_PX} px. Calibrate again with views that reach the picture's corners."
            )

    def to_pixels(self, points_machine: Float64s, height_mm: float) -> Float64s:
        """Pixels of machine points on the plane z = `height_mm`; CalibrationError for points behind the camera."""
        work = self._to_work_frame(np.asarray(points_machine, dtype=np.float64))
        points = np.column_stack([work, np.full(len(work), float(height_mm))])
        depth = points @ self._rotation[2] + self.translation_mm[2]
        if len(depth) and depth.min() <= 0:
            x, y = work[int(np.argmin(depth))]
            raise CalibrationError(
                f"Point ({x:.1f}, {y:.1f}, {height_mm:g}) mm lies behind the camera. Check the calibration."
            )
        return project(
            points, self.rotation_vector, self.translation_mm, self.camera_matrix, self.distortion_coefficients
        )

    def rectifier(self, height_mm: float) -> Rectifier:
        """The plane z = `height_mm`, y turned down as in the picture, scaled to the pixels at the picture's centre."""
        centre = np.array([[(self.image_width - 1) / 2, (self.image_height - 1) / 2]])
        return _PlaneRectifier(self, height_mm, float(scales(self, centre, height_mm)[0]))


class _Identity:
    def rectify(self, points_px: Float64s) -> Float64s:
        return points_px

    def unrectify(self, points: Float64s) -> Float64s:
        return points


@dataclass(frozen=True)
class _PlaneRectifier:
    calibration: CameraCalibration
    height_mm: float
    mm_per_unit: float

    def rectify(self, points_px: Float64s) -> Float64s:
        work = self.calibration.to_work(points_px, self.height_mm)
        return np.asarray(work * np.array([1, -1]) / self.mm_per_unit)

    def unrectify(self, points: Float64s) -> Float64s:
        work = points * np.array([1, -1]) * self.mm_per_unit
        return self.calibration.to_pixels(self.calibration.to_machine(work), self.height_mm)


def scales(calibration: Calibration, points_px: Float64s, height_mm: float) -> Float64s:
    """Millimetres a pixel at each point, shape (N,): the larger of the two where a tilted view has two.

    An uncertainty in pixels times this is one in millimetres that holds in every direction.
    """
    steps = [
        calibration.to_work(points_px + half, height_mm) - calibration.to_work(points_px - half, height_mm)
        for half in (np.array([0.5, 0.0]), np.array([0.0, 0.5]))
    ]
    jacobian = np.stack(steps, axis=2)
    return np.asarray(np.linalg.norm(jacobian, ord=2, axis=(1, 2)))


def _turn(degrees: float) -> Float64s:
    """Rotation matrix by an angle, counter-clockwise for axes x right, y up."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cosine, -sine], [sine, cosine]])
