"""Along a straight cut the outline around material runs over cells that were cut open, not over bays of the table."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bytes
from contour.geometry.rings import area
from contour.material.closed_cells import closed_along, material_edge
from contour.synthetic import render
from contour.walls.wall_mask import wall_mask
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from tests.support.scenes.shop_floor_scenes import shop_floor_scene

TABLE, FLOOR, WALL = 90, 76, 220
PITCH, COLUMNS, ROWS, LEFT, TOP = 40, 8, 6, 60, 50
CUT_X = LEFT + PITCH * COLUMNS - PITCH // 2


def cut_squares(bay: int, opened: int = FLOOR) -> Bytes:
    """Square cells, the last column cut open along a vertical line; floors of these are `opened`, of one `bay`."""
    picture = np.full((340, 460), TABLE, np.uint8)
    right, bottom = LEFT + PITCH * COLUMNS, TOP + PITCH * ROWS
    cv2.rectangle(picture, (LEFT, TOP), (right, bottom), FLOOR, -1)
    cv2.rectangle(picture, (right - PITCH, TOP), (right, bottom), opened, -1)
    cv2.rectangle(picture, (right - PITCH, TOP + 2 * PITCH), (right, TOP + 3 * PITCH), bay, -1)
    for x in range(LEFT, right + 1, PITCH):
        cv2.line(picture, (x, TOP), (x, bottom), WALL, 5)
    for y in range(TOP, bottom + 1, PITCH):
        cv2.line(picture, (LEFT, y), (right, y), WALL, 5)
    picture[:, CUT_X + 1 :] = TABLE
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), 0.8), np.uint8)


def area_along_cut(bay: int, opened: int = FLOOR) -> float:
    """What lies in the outline of these cells along the cut, square pixels."""
    picture = cut_squares(bay, opened)
    material = material_edge(picture, PITCH, wall_mask(picture, PITCH, bright=True).mask)
    cut = np.array([[[CUT_X, TOP - 2.0], [CUT_X, TOP + PITCH * ROWS + 2.0]]])
    return area(closed_along(material, cut, PITCH).contour)


def test_a_bay_that_shows_the_table_is_no_cell_that_a_cut_opened() -> None:
    cell = (PITCH // 2 - 2.5) * (PITCH - 5)
    assert area_along_cut(FLOOR) - area_along_cut(TABLE) == pytest.approx(cell, rel=0.15)


@pytest.mark.parametrize("opened", [TABLE, TABLE - 2, TABLE - 5])
def test_cells_that_a_cut_opened_may_all_show_the_table(opened: int) -> None:
    """Light falls into them from beside the block; in whole cells it does not."""
    assert area_along_cut(opened, opened) == pytest.approx(area_along_cut(FLOOR), rel=0.003)


def test_what_touches_a_line_in_one_place_alone_is_no_cut() -> None:
    picture = cut_squares(FLOOR)
    material = material_edge(picture, PITCH, wall_mask(picture, PITCH, bright=True).mask)
    touched = closed_along(material, np.full((1, 2, 2), [CUT_X, TOP + 3.0]), PITCH)
    assert area(touched.contour) == area(material.contour)


def test_threads_alone_are_no_block() -> None:
    picture = np.full((300, 400), TABLE, np.uint8)
    cv2.line(picture, (60, 60), (330, 220), WALL, 1)
    with pytest.raises(NoBlockFound, match="threads"):
        material_edge(picture, PITCH, np.zeros_like(picture))


def test_a_picture_whose_threads_touch_its_side_is_refused() -> None:
    """Where nothing else is left of them but fewer pixels than make an outline."""
    rendered = render(shop_floor_scene("blown_out", 1_560_082).scene)
    assert Measurer(None).measure(rendered.picture, PlainRecipe(network=False), 0.0).reasons


@pytest.mark.parametrize(("wide", "high", "is_hole"), [(96, 96, True), (320, 22, False), (320, 26, True)])
def test_an_opening_is_a_hole_where_a_disc_fits_in_or_five_cells_do(wide: int, high: int, is_hole: bool) -> None:
    picture = np.full((400, 600), TABLE, np.uint8)
    cv2.rectangle(picture, (100, 100), (500, 300), WALL, -1)
    cv2.ellipse(picture, (300, 200), (wide // 2, high // 2), 0, 0, 360, TABLE, -1) if wide == high else cv2.rectangle(
        picture, (300 - wide // 2, 200 - high // 2), (299 + wide // 2, 199 + high // 2), TABLE, -1
    )
    material = material_edge(picture, PITCH, np.zeros_like(picture))
    assert len(material.contour.holes) == is_hole
