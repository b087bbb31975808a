"""Openings part a block only where they lead from outline to outline."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.seams.openings import Openings
from contour.seams.parting import beside, parted_by_row, parted_strip

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
    return numbered(free, depth)


def numbered(free: NDArray[np.uint8], depth: NDArray[np.float32]) -> Openings:
    """What is free of walls as openings."""
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


def test_parts_that_touch_at_a_corner_are_one() -> None:
    deep = np.zeros((20, 20), np.float32)
    deep[:10, :10] = deep[10:, 10:] = 2.0
    free = replace(numbered(np.zeros((20, 20), np.uint8), deep), pitch=1.0)
    assert beside(free, 0.0, np.array([3.0, 16.0]), np.array([6.0, 16.0])) is None


def with_opening(first: int, last: int, column: int = 3) -> Openings:
    """A block of 30 × 12 square cells, those of one column one opening from one row to another."""
    high, wide = 12 * PITCH, 30 * PITCH
    depth = cv2.distanceTransform(np.pad(np.ones((high - 2, wide - 2), np.uint8), 1), cv2.DIST_L2, 5) / PITCH
    free = np.kron(np.ones((12, 30), np.uint8), np.pad(np.ones((PITCH - 2, PITCH - 2), np.uint8), 1))
    free[first * PITCH + 1 : last * PITCH - 1, column * PITCH + 4 : column * PITCH + 6] = 1
    return numbered(free, depth.astype(np.float32))


def test_a_strip_is_parted_by_an_opening_though_walls_of_both_touch_at_its_ends() -> None:
    found = parted_strip(with_opening(1, 11))
    assert found is not None
    assert found.part.mean() == pytest.approx(3.5 / 30, abs=0.02)
    assert parted_strip(with_opening(2, 10)) is not None
    assert parted_strip(with_opening(4, 9)) is None, "walls lead across beyond both of its ends"
    assert parted_strip(with_opening(1, 5)) is None, "it is no longer than those of single blocks"


@pytest.mark.parametrize("column", [4, 25])
def test_cells_that_merge_at_the_end_of_all_lines_are_no_row(column: int) -> None:
    """A line's sum took in the first of the next direction's, and no cell lay on it."""
    assert parted_by_row(with_opening(8, 11, column)) is None


def test_an_opening_between_the_samples_of_coarse_cells_parts_nothing() -> None:
    """A triangular lattice had one: its picture ended in an error of numpy's."""
    free = with_opening(1, 11)
    thin = free.numbers.copy()
    long = int(np.argmax(free.long))
    thin[:, ::3][thin[:, ::3] == long] = 0
    coarse = replace(free, numbers=thin, pitch=18.0, centre=free.centre)
    assert parted_strip(coarse) is None
