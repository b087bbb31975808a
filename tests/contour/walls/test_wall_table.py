"""Tables lighter than the cells, and openings behind thin strands: what is no wall, and what is a hole."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.geometry.rings import signed_area
from contour.material.closed_cells import material_edge
from contour.walls.coarse_block import coarse_block
from contour.walls.wall_mask import wall_mask


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


@pytest.mark.parametrize("table", [5.0, 60.0, 90.0])
def test_a_table_up_to_the_walls_in_lightness_is_not_in_the_mask(table: float) -> None:
    light, block = comb(table)
    mask = wall_mask(light, 20.0, bright=True).mask > 0
    middle = light > 108  # of the walls, those that end beside the table too
    assert np.count_nonzero(middle & ~mask) < 0.01 * np.count_nonzero(middle)
    assert not (mask & ~cv2.dilate(block.astype(np.uint8), np.ones((5, 5), np.uint8)).astype(np.bool_)).any()


def test_the_edge_of_a_shadow_on_a_light_table_is_no_wall() -> None:
    light, block = comb(60.0)
    shadow = cv2.dilate(block.astype(np.uint8), np.ones((41, 41), np.uint8)) > 0
    light = np.where(shadow & ~block, np.uint8(15), light)
    mask = wall_mask(cv2.GaussianBlur(light, (0, 0), 2.0), 20.0, bright=True).mask > 0
    assert not (mask & ~cv2.dilate(block.astype(np.uint8), np.ones((9, 9), np.uint8)).astype(np.bool_)).any()


@pytest.mark.parametrize(("spacing", "radius", "level"), [(22, 5.5, 30.0), (22, 3.3, 45.0), (26, 3.9, 45.0)])
def test_a_tables_light_between_its_holes_is_no_wall_and_a_wall_as_faint_is(
    spacing: int, radius: float, level: float
) -> None:
    light, block = comb(level)
    grey = light.astype(np.float64)
    rows, columns = np.indices(light.shape)
    holes = np.hypot(rows % spacing - spacing // 2, columns % spacing - spacing // 2) < radius
    grey[holes & ~block] = 10.0
    grey[100:103, 144:196] = 45.0
    light = np.rint(cv2.GaussianBlur(grey, (0, 0), 0.8)).astype(np.uint8)
    outside = cv2.dilate(block.astype(np.uint8), np.ones((5, 5), np.uint8)) == 0
    unknown, known = (wall_mask(light, 20.0, bright=True, contrast=110.0, wall=wall).mask > 0 for wall in (0.0, 3.0))
    assert known[outside].mean() < 0.001 < unknown[outside].mean()
    assert known[101, 144:196].all()


def test_an_opening_behind_a_broken_strand_of_walls_is_a_hole() -> None:
    light, _ = comb(5.0)
    light[63:140, 240:320] = 5
    light[85:105, 318:326] = 5
    mask = np.where(light > 45, np.uint8(255), np.uint8(0))
    rings = coarse_block(mask, light, 20.0).rings
    assert [ring.is_hole for ring in rings] == [False, True]


@pytest.mark.parametrize("spot", [5, 60, 100])
def test_a_lamp_mirrored_by_the_table_in_a_hole_leaves_it_a_hole(spot: int) -> None:
    light, _ = comb(5.0)
    light[103:180, 183:260] = spot
    rings = coarse_block(wall_mask(light, 20.0, bright=True).mask, light, 20.0).rings
    assert [ring.is_hole for ring in rings] == [False, True]


@pytest.mark.parametrize(("level", "holes"), [(100, [True]), (82, [])])
def test_a_light_table_in_the_shade_of_a_block_makes_a_hole_and_black_cells_do_not(
    level: int, holes: list[bool]
) -> None:
    light, _ = comb(150.0)
    light[103:180, 183:260] = level
    rings = coarse_block(wall_mask(light, 20.0, bright=True).mask, light, 20.0).rings
    assert [ring.is_hole for ring in rings] == [False, *holes]


def test_a_hole_of_which_half_lies_in_deep_shade_is_one() -> None:
    light, _ = comb(150.0)
    light[103:180, 183:260] = 150
    light[103:150, 183:260] = 20
    rings = coarse_block(wall_mask(light, 20.0, bright=True).mask, light, 20.0).rings
    assert [ring.is_hole for ring in rings] == [False, True]


def test_an_opening_with_a_wide_way_out_is_a_bay() -> None:
    light, _ = comb(5.0)
    light[63:140, 240:330] = 5
    mask = np.where(light > 45, np.uint8(255), np.uint8(0))
    rings = coarse_block(mask, light, 20.0).rings
    assert [ring.is_hole for ring in rings] == [False]


def test_dust_that_encloses_table_makes_no_hole() -> None:
    light, _ = comb(5.0)
    mask = np.where(light > 45, np.uint8(255), np.uint8(0))
    alone = coarse_block(mask, light, 20.0).rings
    # Specks closer than a cell, from one side of the block to another, around half a dozen cells of table.
    for x, y in [(160, 50), (160, 38), (162, 26), (174, 18), (188, 14), (202, 14), (216, 20), (222, 32), (222, 46)]:
        mask[y : y + 3, x : x + 3] = 255
    rings = coarse_block(mask, light, 20.0).rings
    assert [ring.is_hole for ring in rings] == [False]
    assert abs(rings[0].length - alone[0].length) < 20.0


def test_a_closed_cell_with_a_gap_in_its_outer_wall_stays_in_the_material() -> None:
    whole, _ = comb(5.0)
    torn = whole.copy()
    torn[56:66, 126:137] = 5
    areas = []
    for light in (whole, torn):
        edge = material_edge(light, 20.0, wall_mask(light, 20.0, bright=True).mask).contour
        areas.append(abs(signed_area(edge.exterior)))
    # A cell without its walls has 289 px².
    assert areas[0] - areas[1] < 60.0


def test_specks_all_over_the_table_are_no_material() -> None:
    light, block = comb(5.0)
    for x, y in np.stack(np.meshgrid(np.arange(4, 396, 13), np.arange(4, 296, 13)), axis=-1).reshape(-1, 2):
        if not block[max(0, y - 6) : y + 9, max(0, x - 6) : x + 9].any():
            light[y : y + 3, x : x + 3] = 120
    edge = material_edge(light, 20.0, wall_mask(light, 20.0, bright=True).mask).contour
    assert abs(signed_area(edge.exterior)) == pytest.approx(np.count_nonzero(block), rel=0.05)
