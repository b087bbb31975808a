"""The table's own light, followed from the picture's border in under the block, and what differs from it."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float64s, median, medians
from contour.image.channels import largest

OUTLIER = 4.0
"""Spreads of the table's light beyond which something is not the table."""

_BORDER_SHARE = 0.015
_ROUNDS = 6
_GRID_PX = 4
# So many samples tell six unknowns; the picture's border holds some hundred of them then.
_SAMPLES = 10_000


def difference_from_table(picture: Bytes) -> tuple[Bytes, float]:
    """How far each pixel is from the table: largest difference over the channels, shape (H, W), uint8; the table's
    spread.
    """
    height, width = picture.shape[:2]
    channels = picture[:, :, None] if picture.ndim == 2 else picture
    grid = (max(8, width // _GRID_PX), max(8, height // _GRID_PX))
    small = cv2.resize(picture, grid, interpolation=cv2.INTER_AREA).reshape(grid[1], grid[0], -1).astype(np.float64)
    gray = channels[:, :, channels.shape[2] // 2]
    rough = cv2.absdiff(gray, cv2.blur(gray, (5, 5)))
    texture = np.asarray(cv2.resize(rough, grid, interpolation=cv2.INTER_AREA), np.uint8)
    surface, spread = _surface(small, texture)
    table = np.clip(np.rint(surface), 0, 255).astype(np.uint8)
    full = cv2.resize(table, (width, height), interpolation=cv2.INTER_LINEAR).reshape(channels.shape)
    apart = largest(np.asarray(cv2.absdiff(channels, full), np.uint8).reshape(height, width, -1))
    return np.asarray(cv2.GaussianBlur(apart, (3, 3), 0), np.uint8), spread


def _surface(small: Float64s, texture: Bytes) -> tuple[Float64s, float]:
    """The table's light under the block too, shape of `small` (h, w, channels), and its spread: a surface of second
    order.

    First through the picture's border, then through all that lies near it and is as smooth as most of the border, so
    that vignetting is followed inwards while a board whose mean colour is the table's stays out.
    """
    height, width, channels = small.shape
    y, x = np.linspace(-1.0, 1.0, height), np.linspace(-1.0, 1.0, width)
    hop = max(1, round(np.sqrt(height * width / _SAMPLES)))
    terms = second_order(x[::hop], y[::hop]).reshape(-1, 6)
    values = small[::hop, ::hop].reshape(len(terms), -1)
    rim = np.maximum(np.abs(terms[:, 1]), np.abs(terms[:, 2])) > 1 - 2 * _BORDER_SHARE
    roughness = texture[::hop, ::hop].ravel()
    smooth = roughness <= 2 * max(1.0, median(roughness[rim]))
    rim &= smooth
    used = rim
    fitted = np.broadcast_to(medians(values[rim], axis=0), values.shape)
    spread = 1.0
    for _ in range(_ROUNDS):
        off = np.abs(values - fitted).max(axis=1)
        spread = max(1.4826 * median(off[used]), 1.0)
        # Weights that fall with the distance: a block that touches the border must not bend the table.
        weighted = terms.T * (used / (1 + (off / spread) ** 4))
        # Normal equations: terms between -1 and 1 are far from alike, and a hundred thousand rows for six unknowns.
        found = np.linalg.solve(weighted @ terms, weighted @ values)
        fitted = terms @ found
        off = np.abs(values - fitted).max(axis=1)
        near = smooth & (off < OUTLIER * spread)
        used = near if np.count_nonzero(near) > 0.3 * np.count_nonzero(rim) else rim
    return (second_order(x, y) @ found).reshape(height, width, channels), spread


def second_order(x: Float64s, y: Float64s) -> Float64s:
    """What a surface of second order is made of at each place of a grid, (h, w, 6)."""
    across, down = np.meshgrid(x, y)
    return np.stack([np.ones_like(across), across, down, across**2, across * down, down**2], axis=2)
