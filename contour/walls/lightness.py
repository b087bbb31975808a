"""The picture as one channel in which the walls stand out: lightness, or the colour direction where lightness does
not separate.
"""

from __future__ import annotations

import cv2
import numpy as np

from contour.errors import PictureError
from contour.geometry.arrays import Bytes, Float64s, median, medians

LUMA = np.array([0.114, 0.587, 0.299])
"""Weights of blue, green and red in lightness (ITU-R BT.601)."""

_SAMPLE_ROWS = 96
_HIGH_PASS_PX = 12
# Lightness is preferred: it averages three channels' noise and keeps grey table dirt grey. Colour takes over
# where its best direction carries this many times the local variance that lightness does.
_COLOUR_GAIN = 4.0
# Grey differences weigh 0.58 in lightness for their length; less than two thirds of that, and lightness wastes colour.
_LUMA_SERVES = 0.4
_LEAST_COLOUR = 25.0
_CELLS_NEAR = 12


def wall_light(picture: Bytes) -> Bytes:
    """One channel, shape (H, W), uint8, linear in the picture's channels so that edges stay where they are.

    A grey picture is returned as it is. For BGR the direction with the most local contrast is compared with lightness.
    Raises PictureError for any other shape or type.
    """
    if picture.dtype != np.uint8 or picture.ndim not in (2, 3) or (picture.ndim == 3 and picture.shape[2] != 3):
        raise PictureError(
            f"the picture is {picture.dtype} of shape {picture.shape}, expected uint8 (H, W) or (H, W, 3)"
        )
    if min(picture.shape[:2]) < 16:
        raise PictureError(f"the picture is {picture.shape[1]} × {picture.shape[0]} px, expected at least 16 × 16")
    if picture.ndim == 2:
        return picture
    direction = _contrast_direction(picture)
    if direction is None:
        return np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
    return _projected(picture, direction)


def light_from_table(picture: Bytes, light: Bytes, mask: Bytes, hop: int) -> Bytes | None:
    """A channel in which walls stand out from the table as well as from cells; None where `light` already serves.

    `mask`, 255 on walls, was seen in `light`, both every `hop`-th pixel of the picture both ways; cells are what it
    leaves free nearby, the table is the picture's border. Of all channels the one is taken in which the nearer of
    both is farthest: the point of the segment between the two colour differences that lies nearest to the origin.
    """
    if picture.ndim == 2:
        return None
    wide = cv2.boxFilter(mask, -1, (31, 31))
    step = max(1, round(np.sqrt(mask.size / 2e5)))
    colours, walls, near = (
        picture[:: hop * step, :: hop * step],
        mask[::step, ::step] > 0,
        wide[::step, ::step] > _CELLS_NEAR,
    )
    rim = np.ones(walls.shape, np.bool_)
    margin = max(1, min(walls.shape) // 50)
    rim[margin:-margin, margin:-margin] = False
    free = near & ~walls
    parts = walls & near, free, rim & ~near | rim & walls
    if not all(part.any() for part in parts):
        return None
    wall, cell, table = (medians(colours[part], axis=0) for part in parts)
    from_table, from_cell = wall - table, wall - cell
    across = from_cell - from_table
    share = float(np.clip(-(from_table @ across) / max(float(across @ across), 1e-9), 0.0, 1.0))
    direction = from_table + share * across
    length = float(np.linalg.norm(direction))
    sign = 1.0 if median(light[::step, ::step][walls]) > median(light[::step, ::step][free]) else -1.0
    served = sign * min(float(from_table @ LUMA), float(from_cell @ LUMA), key=lambda gap: sign * gap)
    if length < _LEAST_COLOUR or served > _LUMA_SERVES * length:
        return None
    return _projected(picture, direction / length)


def _projected(picture: Bytes, direction: Float64s) -> Bytes:
    """Weighted sum of the channels, scaled and shifted so that every colour fits into a byte."""
    low, high = 255.0 * np.minimum(direction, 0).sum(), 255.0 * np.maximum(direction, 0).sum()
    gain = 255.0 / (high - low)
    weights = np.append(direction * gain, -low * gain).astype(np.float32)[None]
    return np.asarray(cv2.transform(picture, weights), np.uint8)


def _contrast_direction(picture: Bytes) -> Float64s | None:
    """Unit weights of B, G, R with the most local contrast, or None where lightness has nearly as much."""
    # Means over 3 × 3 pixels: noise, which lightness has much of in a JPEG and colours little, counts a ninth.
    first = np.arange(0, picture.shape[0] - 2, max(3, picture.shape[0] // _SAMPLE_ROWS))
    rows = cv2.blur(picture[first[:, None] + np.arange(3)].astype(np.float32).mean(axis=1), (3, 1))
    local = rows - cv2.blur(rows, (2 * _HIGH_PASS_PX + 1, 1))
    flat = local.reshape(-1, 3)
    covariance = (flat.T @ flat / len(flat)).astype(np.float64)
    values, vectors = np.linalg.eigh(covariance)
    luma = LUMA / np.linalg.norm(LUMA)
    if values[-1] < _COLOUR_GAIN * float(luma @ covariance @ luma):
        return None
    best: Float64s = vectors[:, -1]
    return best if best @ LUMA >= 0 else -best
