"""A row of merged cells parts a block only where it leads from outline to outline."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.seams.openings import Openings
from contour.seams.parting import parted_by_row

PITCH = 10


def square_cells(merged_column: int, *, hole: bool) -> Openings:
    """A block of 24 × 18 square cells, those of a column merged by threes, with or without a hole in its middle."""
    high, wide = 18 * PITCH, 24 * PITCH
    block = np.ones((high, wide), np.uint8)
    block[[0, -1], :] = block[:, [0, -1]] = 0
    if hole:
        block[70:110, 80:160] = 0
    depth = cv2.distanceTransform(block, cv2.DIST_L2, 5).astype(np.float32) / PITCH
    free = np.kron(np.ones((18, 24), np.uint8), np.pad(np.ones((PITCH - 2, PITCH - 2), np.uint8), 1))
    left = merged_column * PITCH
    free[[row for row in range(high) if row % (3 * PITCH) not in (0, 29)], left + 4 : left + 6] = 1
    _, numbers, stats, centre = cv2.connectedComponentsWithStats(free * (depth > 0.9).astype(np.uint8), connectivity=4)
    long = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) / PITCH
    area = stats[:, cv2.CC_STAT_AREA].copy()
    long[0] = area[0] = 0
    return Openings(1, (0, 0), float(PITCH), depth, numbers, long, area, centre)


@pytest.mark.parametrize("column", [6, 11])
def test_a_row_from_edge_to_edge_parts_a_block_there(column: int) -> None:
    found = parted_by_row(square_cells(column, hole=False))
    assert found is not None
    assert min(found.part.mean(), 1 - found.part.mean()) == pytest.approx((column + 0.5) / 24, abs=0.04)


def test_a_row_between_a_hole_and_the_edge_parts_nothing() -> None:
    assert parted_by_row(square_cells(11, hole=True)) is None
