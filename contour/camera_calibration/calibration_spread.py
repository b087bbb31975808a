"""How far the noise of corners reaches: covariance of the camera and the work plane, and what it does to positions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contour.camera_calibration.lens_models import LensModel, Observed, residuals
from contour.geometry.arrays import Float64s
from contour.image import opencv_boards as cv
from contour.image.opencv import camera_rays, rotation_matrix

_STEP = 0.05
"""Steps of the derivatives, in standard deviations: small against any bend, large against rounding."""


def covariance(views: Sequence[Observed], solved: cv.Solved, model: LensModel, plane: int) -> Float64s:
    """Covariance of the model's free numbers and of the pose of view `plane`, shape (P + 6, P + 6).

    Order: fy (or fx, fy), cx, cy, free distortion coefficients; rotation vector, translation. Least squares with the
    poses of the other views eliminated (Schur); the noise is that of the residuals, degrees of freedom taken off.
    """
    count = model.parameter_count
    normal: Float64s = np.zeros((count, count))
    pose_part: Float64s = np.zeros((6, 6))
    link: Float64s = np.zeros((6, count))
    for index, view in enumerate(views):
        pose, camera = _jacobians(view, solved, index, model)
        inner: Float64s = np.asarray(np.linalg.inv(pose.T @ pose), np.float64)
        share: Float64s = inner @ pose.T @ camera
        normal += camera.T @ camera - camera.T @ pose @ share
        if index == plane:
            pose_part, link = inner, share
    camera_part = np.linalg.pinv(normal, hermitian=True)
    cross = -link @ camera_part
    whole = np.block([[camera_part, cross.T], [cross, pose_part + link @ camera_part @ link.T]])
    return np.asarray(whole * noise_px(views, solved, model) ** 2)


def noise_px(views: Sequence[Observed], solved: cv.Solved, model: LensModel) -> float:
    """Standard deviation of a corner's coordinate, from the residuals, degrees of freedom taken off."""
    rest = np.concatenate(residuals(views, solved)).ravel()
    freedom = max(rest.size - 6 * len(views) - model.parameter_count, 1)
    return float(np.sqrt((rest**2).sum() / freedom))


def _jacobians(view: Observed, solved: cv.Solved, index: int, model: LensModel) -> tuple[Float64s, Float64s]:
    rotation, translation = solved.rotations[index], solved.translations[index]
    _, whole = cv.projection_jacobian(view.points_mm, rotation, translation, solved.camera_matrix, solved.distortion)
    focal = whole[:, 6:8]
    if model.square_pixels:
        focal = focal.sum(axis=1, keepdims=True)
    lens = whole[:, [10 + free for free in model.free]]
    return whole[:, :6], np.hstack([focal, whole[:, 8:10], lens])


def on_plane(
    solved: cv.Solved, rotation: Float64s, translation: Float64s, pixels: Float64s, height_mm: float
) -> Float64s:
    """Work points, shape (N, 2), of pixels on the plane z = `height_mm`; no check that a ray meets it."""
    turn = rotation_matrix(rotation)
    position = -turn.T @ translation
    rays = camera_rays(pixels, solved.camera_matrix, solved.distortion) @ turn
    return np.asarray(position[:2] + rays[:, :2] * ((height_mm - position[2]) / rays[:, 2])[:, None])


def position_variances(
    solved: cv.Solved, model: LensModel, plane: int, spread: Float64s, pixels: Float64s, height_mm: float
) -> Float64s:
    """Covariance of the work position of each pixel, shape (N, 2, 2), mm², from that of the parameters."""
    steps = _STEP * np.sqrt(np.maximum(np.diag(spread), 0))
    columns = []
    for index, step in enumerate(steps):
        if step == 0:
            columns.append(np.zeros((len(pixels), 2)))
            continue
        ends = [on_plane(*_moved(solved, model, plane, index, sign * step), pixels, height_mm) for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1]) / (2 * step))
    jacobian = np.stack(columns, axis=2)
    return np.asarray(np.einsum("nia,ab,njb->nij", jacobian, spread, jacobian))


def _moved(
    solved: cv.Solved, model: LensModel, plane: int, index: int, step: float
) -> tuple[cv.Solved, Float64s, Float64s]:
    """The solution with one of the covariance's parameters moved."""
    matrix, distortion = solved.camera_matrix.copy(), solved.distortion.copy()
    rotation, translation = solved.rotations[plane].copy(), solved.translations[plane].copy()
    places = [(0, 0)] if model.square_pixels else [(0, 0), (1, 1)]
    places += [(0, 2), (1, 2)]
    count = model.parameter_count
    if index >= count + 3:
        translation[index - count - 3] += step
    elif index >= count:
        rotation[index - count] += step
    elif index >= len(places):
        distortion[model.free[index - len(places)]] += step
    else:
        matrix[places[index]] += step
        if model.square_pixels and index == 0:
            matrix[1, 1] += step
    return solved._replace(camera_matrix=matrix, distortion=distortion), rotation, translation
