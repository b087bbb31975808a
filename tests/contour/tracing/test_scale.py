"""What is near the limits of a picture: cells of a few pixels, and blocks that fill it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.geometry.agreement import agreement
from contour.geometry.arrays import Bytes
from contour.geometry.rings import Contour
from contour.image.region import shifted
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from service.reasons import Reason
from tests.support.scenes.lattices import Border, Cells, Lattice, lattice

# Looked at while the rules were made; those of the report were not.
SEED = 1051003


def cropped(one: Lattice, margin_px: float) -> tuple[Bytes, Contour]:
    """The picture with so many pixels of table, or fewer than none, around the block, and the outline in it."""
    low, high = one.outline.exterior.min(axis=0), one.outline.exterior.max(axis=0)
    left, top = np.floor(low - margin_px).astype(int)
    right, bottom = np.ceil(high + margin_px).astype(int) + 1
    return np.ascontiguousarray(one.picture[top:bottom, left:right]), shifted(one.outline, np.array([-left, -top]))


@pytest.mark.parametrize("border", ["cut", "closed", "mixed"])
@pytest.mark.parametrize("cells", ["hexagonal", "square"])
def test_a_few_pixels_of_table_around_a_block_are_enough(cells: Cells, border: Border) -> None:
    one = lattice(SEED, cells, border)
    picture, outline = cropped(one, 3.5)
    found = Measurer(None).measure(picture, PlainRecipe(), 0.0)
    assert (found.reasons, found.edge) == ((), {"closed": "cells"}.get(border, border))
    assert found.pixels is not None
    assert agreement(found.pixels, outline).hausdorff_px < 0.3 * one.pitch_px


@pytest.mark.parametrize("cells", ["hexagonal", "square"])
def test_a_block_that_leaves_the_picture_on_all_sides_by_a_pixel_is_refused(cells: Cells) -> None:
    picture, _ = cropped(lattice(SEED, cells, "cut"), -1.0)
    found = Measurer(None).measure(picture, PlainRecipe(), 0.0)
    assert set(found.reasons) & {Reason.TOUCHES_BORDER, Reason.NO_BLOCK_FOUND}


def grid(pitch_px: float, wall_px: float, *, bright_table: bool) -> tuple[Bytes, Contour]:
    """Closed squares of such a pitch, 40 by 32 of them, turned by a little, and their outline."""
    finer, turn = 8, 0.3
    y, x = (np.mgrid[: 360 * finer, : 420 * finer] + 0.5) / finer - 0.5
    u = ((x - 210) * np.cos(turn) + (y - 180) * np.sin(turn)) / pitch_px
    v = ((y - 180) * np.cos(turn) - (x - 210) * np.sin(turn)) / pitch_px
    half = 0.5 * wall_px / pitch_px
    inside = (np.abs(u) < 20 + half) & (np.abs(v) < 16 + half)
    material = inside & ((np.abs(u - np.rint(u)) < half) | (np.abs(v - np.rint(v)) < half))
    table, walls = (200.0, 40.0) if bright_table else (40.0, 200.0)
    small = cv2.resize(np.where(material, walls, table), (420, 360), interpolation=cv2.INTER_AREA)
    noise = np.random.default_rng(7).normal(0.0, 1.0, small.shape)
    picture = np.clip(cv2.GaussianBlur(small, (0, 0), 0.4) + noise, 0, 255).astype(np.uint8)
    corners = pitch_px * np.array([[-1, -1], [-1, 1], [1, 1], [1, -1]]) * np.array([20 + half, 16 + half])
    turned = corners @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    return picture, Contour(turned + np.array([210.0, 180.0]))


@pytest.mark.parametrize("bright_table", [False, True])
@pytest.mark.parametrize("pitch_px", [4.3, 6.0])
def test_closed_cells_of_four_pixels_and_more_are_traced(pitch_px: float, bright_table: bool) -> None:
    picture, outline = grid(pitch_px, 1.2, bright_table=bright_table)
    found = Measurer(None).measure(picture, PlainRecipe(), 0.0)
    assert not found.reasons
    assert found.pixels is not None
    assert agreement(found.pixels, outline).hausdorff_px < 0.5 * pitch_px


@pytest.mark.parametrize(("seed", "pitch_px"), [(1051011, 8.0), (1051013, 9.5)])
def test_corners_of_fine_squares_are_no_ends_of_walls(seed: int, pitch_px: float) -> None:
    one = lattice(seed, "square", "closed")
    share = pitch_px / one.pitch_px
    small = np.asarray(cv2.resize(one.picture, None, fx=share, fy=share, interpolation=cv2.INTER_AREA), np.uint8)
    found = Measurer(None).measure(small, PlainRecipe(), 0.0)
    assert (found.reasons, found.edge) == ((), "cells")


def test_white_walls_a_pixel_wide_in_large_cells_are_bright_enough() -> None:
    picture = np.zeros((900, 1200), np.uint8)
    turn = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
    around = np.radians(30.0 + 60.0 * np.arange(6))
    cell = 26.0 * np.stack([np.cos(around), np.sin(around)], axis=1)
    for row in range(-18, 19):
        for column in range(-18, 19):
            corners = (cell + np.array([45.0 * (column + 0.5 * (row % 2)), 39.0 * row])) @ turn + np.array(
                [600.0, 450.0]
            )
            cv2.polylines(picture, [np.rint(corners).astype(np.int32)], True, 255, 1)
    block = np.zeros_like(picture)
    block[120:781, 150:1051] = picture[120:781, 150:1051]
    found = Measurer(None).measure(block, PlainRecipe(), 0.0)
    assert found.reasons == ()
    assert found.pixels is not None
    truth = Contour(np.array([[149.5, 119.5], [149.5, 780.5], [1050.5, 780.5], [1050.5, 119.5]]))
    assert agreement(found.pixels, truth).hausdorff_px < 1.0
