"""Whether two frames show the same still scene."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

# Tiles are large enough to hold a few cell walls and small enough that a finger fills one.
TILE_PX = 64
# A shift of the scene beyond this would blur the mean by as much as the contour is asked to be true to.
MOVED_PX = 0.2
# A change of grey beyond this is something that came or went. Smoothed by SMOOTH_PX, even the noise of a camera at its
# highest gain (12 levels) stays below half of it, and cells of 8 px still show.
CHANGED_GREY = 8.0
SMOOTH_PX = 1.5
CERTAIN = 6.0  # standard errors: of a hundred thousand tiles of pure noise none passes


def movement(before: NDArray[np.uint8], after: NDArray[np.uint8]) -> str | None:
    """What moved between two frames of the same shape, (H, W) grey or (H, W, 3) BGR, uint8; None for a still scene.

    In each tile the shift is the least-squares solution of the brightness constancy equation (Lucas and Kanade, 1981),
    told only where it stands out of the noise that this fit leaves. That sees small shifts; larger ones, and what comes
    or goes, show as a change of grey. A change of light as a whole is none.
    """
    first, second = _grey(before), _grey(after)
    light = float(np.mean(second)) / max(float(np.mean(first)), 1.0)
    difference = second - light * first
    shift_px, error_px = _shifts(light * first, difference)
    moved = (shift_px > MOVED_PX) & (shift_px > CERTAIN * error_px)
    smooth = np.asarray(cv2.GaussianBlur(difference, (0, 0), SMOOTH_PX), dtype=np.float32)
    changed = _tiles(smooth * smooth) > CHANGED_GREY**2
    if moved.any():
        far_px = float(np.median(shift_px[moved]))
        return f"the scene moved by {far_px:.1f} px in {int(moved.sum())} of {moved.size} places"
    if changed.any():
        return f"the picture changed in {int(changed.sum())} of {changed.size} places"
    return None


def _grey(pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Grey levels, lightly smoothed, so that gradients are those of the scene."""
    grey = pixels if pixels.ndim == 2 else cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY)
    return np.asarray(cv2.GaussianBlur(grey, (5, 5), 1.0), dtype=np.float32)


def _shifts(
    scene: NDArray[np.float32], difference: NDArray[np.float32]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Length of the shift and its standard error, px, for each tile."""
    across = cv2.Sobel(scene, cv2.CV_32F, 1, 0, scale=1 / 8)
    down = cv2.Sobel(scene, cv2.CV_32F, 0, 1, scale=1 / 8)
    gxx, gxy, gyy = _tiles(across * across), _tiles(across * down), _tiles(down * down)
    gxd, gyd, dd = _tiles(across * difference), _tiles(down * difference), _tiles(difference * difference)
    # A ridge far below a wall's gradient keeps tiles without walls at no shift.
    gxx, gyy = gxx + 0.05, gyy + 0.05
    determinant = gxx * gyy - gxy * gxy
    shift_x = -(gyy * gxd - gxy * gyd) / determinant
    shift_y = -(gxx * gyd - gxy * gxd) / determinant
    left = np.maximum(dd + shift_x * gxd + shift_y * gyd, 0.05)
    # The light smoothing leaves about one pixel in ten independent; the weaker direction decides.
    samples = TILE_PX * TILE_PX / 10
    weakest = determinant / (gxx + gyy)
    return np.hypot(shift_x, shift_y), np.sqrt(left / samples / weakest)


def _tiles(values: NDArray[np.float32]) -> NDArray[np.float64]:
    """The mean over each tile."""
    height, width = values.shape
    size = (max(1, width // TILE_PX), max(1, height // TILE_PX))
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_AREA), dtype=np.float64)
