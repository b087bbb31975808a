"""The picture as one channel in which the walls stand out: lightness, or the colour direction where lightness does not separate."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.errors import PictureError

LUMA = np.array([0.114, 0.587, 0.299])
"""Weights of blue, green and red in lightness (ITU-R BT.601)."""

_SAMPLE_ROWS = 96
_HIGH_PASS_PX = 12
# Lightness is preferred: it averages three channels' noise and keeps grey table dirt grey. Colour takes over
# where its best direction carries this many times the local variance that lightness does.
_COLOUR_GAIN = 4.0


def wall_light(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """One channel, shape (H, W), uint8, linear in the picture's channels so that edges stay where they are.

    A grey picture is returned as it is. For BGR the direction with the most local contrast is compared with lightness.
    Raises PictureError for any other shape or type.
    """
    if picture.dtype != np.uint8 or picture.ndim not in (2, 3) or (picture.ndim == 3 and picture.shape[2] != 3):
        raise PictureError(f"the picture is {picture.dtype} of shape {picture.shape}, expected uint8 (H, W) or (H, W, 3)")
    if min(picture.shape[:2]) < 16:
        raise PictureError(f"the picture is {picture.shape[1]} × {picture.shape[0]} px, expected at least 16 × 16")
    if picture.ndim == 2:
        return picture
    direction = _contrast_direction(picture)
    if direction is None:
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
    low, high = 255.0 * np.minimum(direction, 0).sum(), 255.0 * np.maximum(direction, 0).sum()
    gain = 255.0 / (high - low)
    weights = np.append(direction * gain, -low * gain).astype(np.float32)[None]
    return np.asarray(cv2.transform(picture, weights), np.uint8)


def _contrast_direction(picture: NDArray[np.uint8]) -> NDArray[np.float64] | None:
    """Unit weights of B, G, R with the most local contrast, or None where lightness has nearly as much."""
    rows = picture[:: max(1, picture.shape[0] // _SAMPLE_ROWS)].astype(np.float32)
    local = rows - cv2.blur(rows, (2 * _HIGH_PASS_PX + 1, 1))
    flat = local.reshape(-1, 3)
    covariance = (flat.T @ flat / len(flat)).astype(np.float64)
    values, vectors = np.linalg.eigh(covariance)
    luma = LUMA / np.linalg.norm(LUMA)
    if values[-1] < _COLOUR_GAIN * float(luma @ covariance @ luma):
        return None
    best: NDArray[np.float64] = vectors[:, -1]
    return best if best @ LUMA >= 0 else -best
