"""A pinhole camera with a lens (plumb_bob) over a work plane: millimetres to pixels, and pixels back to a plane."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour, densified


@dataclass(frozen=True)
class CameraModel:
    """Intrinsics, lens and pose of a camera; the pose maps work to camera millimetres (OpenCV's convention).

    `distortion` is k1, k2, p1, p2, k3. Pixel (0, 0) is the centre of the top-left pixel.
    """

    width: int
    height: int
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, float, float, float, float]
    rotation: tuple[tuple[float, float, float], ...]
    translation_mm: tuple[float, float, float]

    @property
    def matrix(self) -> Float64s:
        """The camera matrix, shape (3, 3)."""
        return np.array(
            [[self.focal_px[0], 0.0, self.centre_px[0]], [0.0, self.focal_px[1], self.centre_px[1]], [0.0, 0.0, 1.0]]
        )

    @property
    def position_mm(self) -> Float64s:
        """The optical centre in the work frame, shape (3,), millimetres."""
        return np.asarray(-np.array(self.rotation).T @ np.array(self.translation_mm), dtype=np.float64)

    @property
    def rotation_vector(self) -> tuple[float, float, float]:
        """The rotation work -> camera as axis times angle, radians."""
        x, y, z = cv2.Rodrigues(np.array(self.rotation))[0].ravel().tolist()
        return (x, y, z)

    def project(self, points_mm: Float64s, z_mm: float) -> Float64s:
        """Pixels of work points at height z, shape (N, 2), float64."""
        rotation, shift = np.array(self.rotation), np.array(self.translation_mm)
        ray = points_mm @ rotation[:, :2].T + (rotation[:, 2] * z_mm + shift)
        return self.distort(ray[:, :2] / ray[:, 2:3])

    def distort(self, normal: Float64s) -> Float64s:
        """Pixels of undistorted normalised image coordinates, shape (N, 2)."""
        x, y = normal[:, 0], normal[:, 1]
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return np.column_stack((xd * self.focal_px[0] + self.centre_px[0], yd * self.focal_px[1] + self.centre_px[1]))

    def undistort(self, pixels: Float64s) -> Float64s:
        """Normalised image coordinates without the lens, shape (N, 2): fixed-point inverse of `distort`, to 1e-10."""
        k1, k2, p1, p2, k3 = self.distortion
        xd = (pixels[:, 0] - self.centre_px[0]) / self.focal_px[0]
        yd = (pixels[:, 1] - self.centre_px[1]) / self.focal_px[1]
        x, y = xd.copy(), yd.copy()
        for _ in range(60):
            r2 = x * x + y * y
            radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
            nx = (xd - 2.0 * p1 * x * y - p2 * (r2 + 2.0 * x * x)) / radial
            ny = (yd - p1 * (r2 + 2.0 * y * y) - 2.0 * p2 * x * y) / radial
            step = max(float(np.abs(nx - x).max(initial=0.0)), float(np.abs(ny - y).max(initial=0.0)))
            x, y = nx, ny
            if step < 1e-11:
                break
        return np.column_stack((x, y))

    def back_project(self, pixels: Float64s, z_mm: float) -> Float64s:
        """Work points at height z that are seen at these pixels, shape (N, 2), millimetres."""
        rotation, position = np.array(self.rotation), self.position_mm
        rays = np.column_stack((self.undistort(pixels), np.ones(len(pixels)))) @ rotation
        scale = (z_mm - position[2]) / rays[:, 2]
        return np.asarray(position[:2] + rays[:, :2] * scale[:, None], dtype=np.float64)

    def mm_per_px(self, point_mm: tuple[float, float], z_mm: float) -> float:
        """Millimetres per pixel around a work point at height z (root of the area ratio)."""
        around = np.array(point_mm) + np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        seen = self.project(around, z_mm)
        (a, b), (c, d) = seen[1] - seen[0], seen[2] - seen[0]
        return float(1.0 / np.sqrt(abs(a * d - b * c)))

    def project_contour(self, contour: Contour, z_mm: float, step_mm: float = 1.0) -> Contour:
        """The contour as seen at height z, in pixels: straight edges in millimetres are densified first."""
        return Contour.of(self.project(densified(ring, step_mm), z_mm) for ring in contour.rings)


def camera_above(
    width: int,
    height: int,
    mm_per_px: float,
    *,
    distance_mm: float = 1200.0,
    plane_mm: float = 20.0,
    target_mm: tuple[float, float] | None = None,
    tilt_deg: tuple[float, float] = (0.0, 0.0),
    roll_deg: float = 0.0,
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0),
) -> CameraModel:
    """A camera that looks down at `target_mm` on the plane z = plane_mm from `distance_mm`, with the given scale there.

    Without a target the picture's lower-left corner lies near the work origin. Tilt is about the image's x and y axes.
    """
    if width < 1 or height < 1 or mm_per_px <= 0.0 or distance_mm <= 0.0:
        raise ParameterError(
            f"width {width}, height {height}, mm_per_px {mm_per_px}, distance_mm {distance_mm}: all must be positive"
        )
    target = target_mm if target_mm is not None else (0.5 * width * mm_per_px, 0.5 * height * mm_per_px)
    about_x, about_y, about_z = np.radians([tilt_deg[0], tilt_deg[1], roll_deg])
    rotation = _turn_x(about_x) @ _turn_y(about_y) @ _turn_z(about_z) @ np.diag([1.0, -1.0, -1.0])
    translation = np.array([0.0, 0.0, distance_mm]) - rotation @ np.array([*target, plane_mm])
    focal = distance_mm / mm_per_px
    rows = tuple((float(r[0]), float(r[1]), float(r[2])) for r in rotation)
    tx, ty, tz = translation.tolist()
    return CameraModel(
        width, height, (focal, focal), ((width - 1) / 2.0, (height - 1) / 2.0), distortion, rows, (tx, ty, tz)
    )


def _turn_x(angle: float) -> Float64s:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _turn_y(angle: float) -> Float64s:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _turn_z(angle: float) -> Float64s:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
