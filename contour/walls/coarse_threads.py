"""The coarse block without threads that hang on it: scratches of the table, fibres."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes

# Cells make a block a pitch wide at the least; a horn with an angle of 25 degrees is thinner over 1.8 pitches, and
# strands of broken cells lie along the block.
_THIN_PITCHES = 0.8
_OUT_PITCHES = 2.3


def without_threads(filled: Bytes, samples: float) -> Bytes:
    """The filled block on the coarse grid, 1 inside, without what is thinner than a cell, reaches more than two cells
    away from the block and ends on the table; `samples` is the pitch on that grid.

    Threads that lead from the block to the block again stay: they are the rim of an opening.
    """
    size = 2 * round(0.5 * _THIN_PITCHES * samples) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    wide = np.asarray(cv2.morphologyEx(filled, cv2.MORPH_OPEN, disc), np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(filled & ~wide, connectivity=8)
    length = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    long = length > _OUT_PITCHES * samples
    long[0] = False
    if not long.any() or not wide.any():
        return filled
    away = cv2.distanceTransform(1 - wide, cv2.DIST_L2, 3)
    kept = filled.copy()
    for number in np.flatnonzero(long):
        thread = (labels == number).astype(np.uint8)
        root = cv2.bitwise_and(cv2.dilate(thread, np.ones((3, 3), np.uint8)), wide)
        roots, _ = cv2.connectedComponents(root, connectivity=8)
        if roots == 2 and float(away[thread > 0].max()) > _OUT_PITCHES * samples:
            kept[thread > 0] = 0
    return kept
