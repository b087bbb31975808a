"""Threads that hang on a block and are no walls of it."""

from __future__ import annotations

import numpy as np

from contour.walls.coarse_block import without_threads


def filled() -> np.ndarray:
    grid = np.zeros((120, 160), np.uint8)
    grid[30:80, 30:120] = 1
    return grid


def test_a_scratch_that_hangs_on_the_block_is_no_part_of_it() -> None:
    scratched = filled()
    scratched[80:110, 60:62] = 1
    kept = without_threads(scratched, 6.5)
    assert not kept[84:].any()
    assert kept[30:80, 30:120].sum() > 0.98 * 50 * 90


def test_a_strand_along_the_block_and_the_rim_of_an_opening_stay() -> None:
    grid = filled()
    grid[20:22, 40:80], grid[22:30, 40:42] = 1, 1
    assert (without_threads(grid, 6.5) == grid).all()
    rim = filled()
    rim[80:110, 60:62], rim[80:110, 98:100], rim[108:110, 60:100] = 1, 1, 1
    assert (without_threads(rim, 6.5) == rim).all()
