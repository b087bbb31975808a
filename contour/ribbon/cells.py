"""Where a block's cells lie, one place each."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float64s, median
from contour.geometry.rings import Contour
from contour.image.pixel_grid import fill_finely
from contour.walls.wall_mask import wall_mask

_AROUND_PITCHES = 4.0
_USUAL = (0.5, 1.6)
"""Of the median area: smaller ones are corners that walls leave over, larger ones merged where a wall is broken."""


def cell_centres(light: Bytes, block: Contour, pitch_px: float, *, bright: bool) -> Float64s:
    """Centroids of the cells of usual size that walls enclose in the block, (N, 2), pixels.

    light: (H, W), uint8, in which walls are bright, or dark; block: its outline in pixels; pitch_px: of its cells.
    """
    around = round(_AROUND_PITCHES * pitch_px)
    low = np.maximum(np.floor(block.exterior.min(axis=0)).astype(int) - around, 0)
    high = np.ceil(block.exterior.max(axis=0)).astype(int) + around + 1
    part = np.ascontiguousarray(light[low[1] : high[1], low[0] : high[0]])
    free = cv2.bitwise_not(wall_mask(part, pitch_px, bright=bright).mask)
    inside = np.zeros(part.shape, np.uint8)
    fill_finely(inside, [ring - low for ring in block.rings], 255)
    # What the outline cuts belongs to no whole cell: it hangs together with what lies outside.
    cv2.bitwise_or(free, cv2.bitwise_not(inside), dst=free)
    _, _, stats, centroids = cv2.connectedComponentsWithStats(free, connectivity=4, ltype=cv2.CV_32S)
    area = stats[1:, cv2.CC_STAT_AREA].astype(np.float64)
    left, top = stats[1:, cv2.CC_STAT_LEFT], stats[1:, cv2.CC_STAT_TOP]
    right, bottom = left + stats[1:, cv2.CC_STAT_WIDTH], top + stats[1:, cv2.CC_STAT_HEIGHT]
    whole = (left > 0) & (top > 0) & (right < part.shape[1]) & (bottom < part.shape[0]) & (area < 4 * pitch_px**2)
    large = whole & (area > 0.1 * pitch_px**2)
    if not large.any():
        return np.empty((0, 2))
    share = area / median(area[large])
    usual = large & (share > _USUAL[0]) & (share < _USUAL[1])
    return np.asarray(centroids[1:][usual] + low, np.float64)
