"""The baseline that fails: OpenCV's largest external contour of the wall mask, which wanders into the open cells."""

from __future__ import annotations

import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bytes, Float64s
from contour.image.opencv import enclosed_area, outer_contours


def largest_contour(mask: Bytes) -> Float64s:
    """The external contour that encloses most, through pixel centres, (x, y), shape (N, 2). Raises NoBlockFound."""
    ring = max(outer_contours(mask), key=enclosed_area, default=None)
    if ring is None or enclosed_area(ring) == 0:
        raise NoBlockFound("No block found: the wall mask has no white area. Check the light and the polarity.")
    return ring.astype(np.float64)
