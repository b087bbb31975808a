"""Tables lighter than the cells, and openings behind thin strands: what is no wall, and what is a hole."""

from __future__ import annotations

import cv2
import numpy as np

from contour.coarse_block import coarse_block
from contour.table_surface import without_light_table


def comb(table: float) -> tuple[np.ndarray, np.ndarray]:
    """A square grid of bright walls on black cells amid a table, and where the block lies."""
    light = np.full((300, 400), table)
    block = np.zeros(light.shape, np.bool_)
    block[60:243, 80:323] = True
    light[block] = 10.0
    for start in range(60, 243, 20):
        light[start : start + 3, 80:323] = 120.0
    for start in range(80, 323, 20):
        light[60:243, start : start + 3] = 120.0
    return np.rint(cv2.GaussianBlur(light, (0, 0), 0.8)).astype(np.uint8), block


def test_a_table_lighter_than_the_cells_is_taken_out_of_the_mask() -> None:
    light, block = comb(60.0)
    mask = np.where(light > 45, np.uint8(255), np.uint8(0))
    cleared = without_light_table(mask, light, 20.0, 120.0, 10.0)
    inside = cv2.erode(block.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert (cleared[inside] == mask[inside]).all()
    assert np.count_nonzero(cleared[~block]) < 0.03 * np.count_nonzero(~block)


def test_a_table_darker_than_the_cells_leaves_the_mask_as_it_is() -> None:
    light, _ = comb(5.0)
    mask = np.where(light > 45, np.uint8(255), np.uint8(0))
    assert (without_light_table(mask, light, 20.0, 120.0, 10.0) == mask).all()


def test_an_opening_behind_a_broken_strand_of_walls_is_a_hole() -> None:
    light, _ = comb(5.0)
    light[63:140, 240:320] = 5
    light[85:105, 318:326] = 5
    mask = np.where(light > 45, np.uint8(255), np.uint8(0))
    rings = coarse_block(mask, light, 20.0, 3.0).rings
    assert [ring.is_hole for ring in rings] == [False, True]


def test_an_opening_with_a_wide_way_out_is_a_bay() -> None:
    light, _ = comb(5.0)
    light[63:140, 240:330] = 5
    mask = np.where(light > 45, np.uint8(255), np.uint8(0))
    rings = coarse_block(mask, light, 20.0, 3.0).rings
    assert [ring.is_hole for ring in rings] == [False]
