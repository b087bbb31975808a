"""The table's own light, followed from the picture's border in under the block."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Gray = NDArray[np.uint8]

OUTLIER = 4.0
"""Spreads of the table's light beyond which something is not the table."""

_BORDER_SHARE = 0.015
_ROUNDS = 6
_GRID = 48
# Of the way from cells to walls: a table as light as this lies near the mask's threshold.
_LIGHT_TABLE = 0.1
# Squares of this side that are covered so far (of 255) are wider than dim walls.
_PATCH_PITCHES = 0.35
_PATCH_COVER = 160
# Area in square pitches: a wall of usual width has an eighth.
_DIM_WALLS = 0.25
_SQUARE_PITCHES = 1.5
# Standard deviation, of the contrast of walls, below which a square is smooth.
_SMOOTH = 0.12
# Of the way from table to walls.
_CLEAR = 0.25


def table_surface(small: NDArray[np.float64], texture: Gray) -> tuple[NDArray[np.float64], float]:
    """The table's light under the block too, shape of `small` (h, w, channels), and its spread: a surface of second
    order.

    First through the picture's border, then through all that lies near it and is as smooth as most of the border, so
    that vignetting is followed inwards while a board whose mean colour is the table's stays out.
    """
    height, width, _ = small.shape
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=2).reshape(-1, 6)
    values = small.reshape(len(terms), -1)
    rim = np.maximum(np.abs(x), np.abs(y)).ravel() > 1 - 2 * _BORDER_SHARE
    smooth = texture.ravel() <= 2 * max(1.0, float(np.median(texture.ravel()[rim])))
    rim &= smooth
    used = rim
    fitted = np.broadcast_to(np.median(values[rim], axis=0), values.shape)
    spread = 1.0
    for _ in range(_ROUNDS):
        off = np.abs(values - fitted).max(axis=1)
        spread = max(1.4826 * float(np.median(off[used])), 1.0)
        # Weights that fall with the distance: a block that touches the border must not bend the table.
        root = np.sqrt(used / (1 + (off / spread) ** 4))[:, None]
        factors, *_ = np.linalg.lstsq(terms * root, values * root, rcond=None)
        fitted = terms @ factors
        off = np.abs(values - fitted).max(axis=1)
        near = smooth & (off < OUTLIER * spread)
        used = near if np.count_nonzero(near) > 0.3 * np.count_nonzero(rim) else rim
    return fitted.reshape(small.shape), spread


def without_light_table(mask: Gray, light: Gray, pitch: float, level: float, floor: float) -> Gray:
    """The mask (H, W) of bright walls in `light` (H, W) without what is no lighter than the table.

    `level` and `floor` are the grey levels of walls and of the cells between them. A table darker than its cells
    are cannot be taken for walls. Walls as dim as the table stay where one or two go on from a lighter one; `pitch`
    is that of the cells.
    """
    height, width = light.shape
    grid = (min(_GRID, width), max(1, min(_GRID * height // width, height)))
    small = cv2.resize(light, grid, interpolation=cv2.INTER_AREA).astype(np.float64)
    surface, spread = table_surface(small[:, :, None], np.zeros((grid[1], grid[0]), np.uint8))
    table = float(np.median(surface))
    if not floor + _LIGHT_TABLE * (level - floor) < table < level:
        return mask
    # Where light falls off, walls and table get darker together.
    smooth = np.maximum(surface[:, :, 0], _glare(light, pitch, level - floor, grid))
    clear = smooth * (1 + max(_CLEAR * (level - table), 2 * spread) / max(table, 1.0))
    limit = cv2.resize(np.clip(np.rint(clear), 0, 255).astype(np.uint8), (width, height))
    like = cv2.bitwise_and(mask, cv2.compare(cv2.GaussianBlur(light, (3, 3), 0), limit, cv2.CMP_LE))
    side = max(2, round(_PATCH_PITCHES * pitch))
    patches = cv2.resize(like, (max(1, width // side), max(1, height // side)), interpolation=cv2.INTER_AREA)
    if patches.max() < _PATCH_COVER:
        return mask
    _, labels, stats, _ = cv2.connectedComponentsWithStats(like, connectivity=4)
    kept = np.zeros(len(stats), np.bool_)
    kept[labels[cv2.dilate(cv2.subtract(mask, like), np.ones((3, 3), np.uint8)) > 0]] = True
    kept &= stats[:, cv2.CC_STAT_AREA] < _DIM_WALLS * pitch * pitch
    kept[0] = True
    return np.where(kept[labels], mask, np.uint8(0))


def _glare(light: Gray, pitch: float, contrast: float, grid: tuple[int, int]) -> NDArray[np.float64]:
    """The light of what is smooth and near, on a grid (columns, rows); 0 where nothing is: a lamp's spot on the table.

    Squares of one and a half pitches hold walls and cells alike where they lie on the block; smooth ones are table.
    """
    side = max(1, round(_SQUARE_PITCHES * pitch))
    squares = (max(1, light.shape[1] // side), max(1, light.shape[0] // side))
    part = light[::2, ::2].astype(np.float32)
    mean = cv2.resize(part, squares, interpolation=cv2.INTER_AREA)
    square = cv2.resize(part * part, squares, interpolation=cv2.INTER_AREA)
    smooth = (square - mean * mean < (_SMOOTH * contrast) ** 2).astype(np.float32)
    near = cv2.blur(smooth, (3, 3))
    around = np.where(near > 0, cv2.blur(mean * smooth, (3, 3)) / np.maximum(near, 1e-3), 0.0)
    return np.asarray(cv2.resize(around, grid, interpolation=cv2.INTER_LINEAR), np.float64)
