"""What is told as table, as comb and as neither in a picture of a block with things painted on it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.edge.table_look import TableLook, table_look
from contour.edge.visible_edge import doubtful
from contour.walls.lightness import wall_light
from contour.walls.see_block import see_block, see_walls
from contour.walls.wall_evidence import BlockEvidence
from tests.support.pictures.small_scenes import block

Picture = NDArray[np.uint8]
PITCH = 20.0


@cache
def plain(name: str = "rectangle") -> tuple[Picture, BlockEvidence]:
    """A grey picture and the block seen in it; things painted later leave the block as it was seen."""
    picture = block(name).picture
    return picture, see_block(see_walls(picture, wall_light(picture), "auto"))


def middle_of_an_edge(name: str = "rectangle") -> NDArray[np.float64]:
    """The middle of the rectangle's upper edge, pixels."""
    corners = cv2.boxPoints(cv2.minAreaRect(block(name).truth_px.exterior.astype(np.float32)))
    edges = [0.5 * (corners[k] + corners[(k + 1) % 4]) for k in range(4)]
    return np.asarray(min(edges, key=lambda place: place[1]), np.float64)


def square(place: NDArray[np.float64], size: float) -> NDArray[np.float64]:
    return place + 0.5 * size * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def painted(picture: Picture, area: NDArray[np.float64], level: int | tuple[int, int, int]) -> Picture:
    """The area in one colour, its border as soft as a lens leaves it."""
    mask = np.zeros(picture.shape[:2], np.float32)
    cv2.fillPoly(mask, [np.rint(area).astype(np.int32)], 1.0)
    mask = cv2.GaussianBlur(mask, (0, 0), 0.8)
    mask = mask if picture.ndim == 2 else mask[:, :, None]
    return np.rint(picture * (1.0 - mask) + np.array(level) * mask).astype(np.uint8)


def lit_by_a_lamp(picture: Picture, hole: NDArray[np.float64], shade_px: float, level: float) -> Picture:
    """The table in a hole as light as nowhere else, but for the block's shade along the hole's rim, so soft."""
    inside = np.zeros(picture.shape[:2], np.float32)
    cv2.fillPoly(inside, [np.rint(hole).astype(np.int32)], 1.0)
    light = np.minimum(level * cv2.GaussianBlur(inside, (0, 0), shade_px), 255.0)
    return np.where(inside > 0, np.maximum(picture, light), picture).astype(np.uint8)


def look_at(change: Callable[[Picture], Picture], name: str = "rectangle") -> TableLook:
    picture, seen = plain(name)
    return table_look(change(picture), seen)


def test_an_undisturbed_block_has_table_around_it_and_nothing_foreign() -> None:
    look = look_at(lambda picture: picture)
    assert not look.foreign.any()
    corners = np.array([[20.0, 20.0], [620.0, 20.0], [620.0, 460.0], [20.0, 460.0]])
    assert look.table_at(corners).all()
    assert not look.table_at(block("rectangle").truth_px.exterior.mean(axis=0)[None]).any()
    assert (look.foreign_at(corners) > 1000.0).all()
    assert not doubtful(plain()[1].rings[0], look).any()


@pytest.mark.parametrize("level", [0, 50, 120, 240])
def test_a_flat_thing_over_the_edge_is_foreign_wherever_it_lies(level: int) -> None:
    place = middle_of_an_edge()
    look = look_at(lambda picture: painted(picture, square(place, 70.0), level))
    inside = place + np.array([[0.0, -25.0], [0.0, 0.0], [0.0, 25.0], [-20.0, 0.0], [20.0, 0.0]])
    assert (look.foreign_at(inside) < 4.0).all()
    assert not look.table_at(inside).any()
    assert look.foreign_at(place[None] - [0.0, 80.0]) > 30.0
    assert look.table_at(place[None] - [0.0, 80.0]).all()
    assert doubtful(plain()[1].rings[0], look).any()
    assert look.lighter_at(place[None]).all() == (level > 40)


def test_a_thing_is_told_by_its_colour_alone() -> None:
    place = middle_of_an_edge() - [0.0, 40.0]
    picture, seen = plain()
    table = int(np.median(picture[:40]))
    coloured = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)
    look = table_look(painted(coloured, square(place, 60.0), (table, table, table + 40)), seen)
    assert (look.foreign_at(place[None]) < 4.0).all()


def test_light_that_changes_softly_is_table() -> None:
    def lit(picture: Picture) -> Picture:
        y, x = np.mgrid[: picture.shape[0], : picture.shape[1]]
        lamp = 60.0 * np.exp(-((x - 120.0) ** 2 + (y - 60.0) ** 2) / (2 * 70.0**2))
        shadow = 1.0 - 0.5 / (1.0 + np.exp(-(x - 500.0) / 40.0))
        return np.clip(np.rint(picture * shadow + lamp), 0, 255).astype(np.uint8)

    look = look_at(lit)
    assert look.foreign.mean() < 0.002
    assert look.table_at(np.array([[120.0, 40.0], [600.0, 60.0], [600.0, 440.0]])).all()


def test_a_label_is_a_thing_where_its_border_is_sharp_and_none_where_it_fades() -> None:
    """Some grey levels from the table, no more than the table differs by itself from side to side."""
    place = np.array([80.0, 400.0])

    def patch(blur_px: float) -> TableLook:
        picture, seen = plain()
        mask = np.zeros(picture.shape, np.float32)
        cv2.fillPoly(mask, [square(place, 60.0).astype(np.int32)], 15.0)
        return table_look(np.rint(picture + cv2.GaussianBlur(mask, (0, 0), blur_px)).astype(np.uint8), seen)

    sharp, soft = patch(0.8), patch(25.0)
    assert sharp.foreign_at(place[None]) < 4.0
    assert not sharp.table_at(place[None]).any()
    assert not soft.foreign.any()
    assert soft.table_at(place[None]).all()


def test_a_sharp_shadow_on_the_table_may_be_one_and_a_lighter_thing_is_none() -> None:
    place = middle_of_an_edge() - [0.0, 35.0]

    def shaded(picture: Picture, size: float = 60.0) -> Picture:
        return painted(picture, square(place, size), int(0.5 * np.median(picture[:40])))

    wide = look_at(lambda picture: shaded(picture, 9.0 * PITCH))
    assert not wide.in_shade(place[None]).any(), "no shadow with sharp borders is as wide"
    dark, light = look_at(shaded), look_at(lambda picture: painted(picture, square(place, 60.0), 150))
    assert dark.in_shade(place[None]).all()
    assert not dark.hiding.any()
    assert not light.in_shade(place[None]).any()
    assert light.hiding[int((place[1] + 0.5) / light.step), int((place[0] + 0.5) / light.step)]


def test_comb_in_a_shadow_is_comb_and_what_is_as_dark_and_flat_is_none() -> None:
    place = middle_of_an_edge()

    def shaded(picture: Picture, flat: float) -> Picture:
        mask = np.zeros(picture.shape, np.float32)
        cv2.fillPoly(mask, [square(place, 7.0 * PITCH).astype(np.int32)], 0.75)
        light = 1.0 - cv2.GaussianBlur(mask, (0, 0), 8.0)
        level = flat * cv2.blur(picture, (41, 41)) + (1.0 - flat) * picture
        return np.rint(np.where(mask > 0, level, picture) * light).astype(np.uint8)

    below = (place + np.array([0.0, 2.0 * PITCH]))[None]
    assert look_at(partial(shaded, flat=0.0)).foreign_at(below) > PITCH
    assert look_at(partial(shaded, flat=1.0)).foreign_at(below) < 4.0


def test_a_hole_with_the_table_in_it_is_one_and_a_filled_one_is_none() -> None:
    _, seen = plain("holed")
    (hole,) = (ring for ring in seen.rings if ring.is_hole)
    ring = block("holed").truth_px.holes[0]
    assert not look_at(lambda picture: picture, "holed").fills(hole)
    assert look_at(lambda picture: painted(picture, ring, 150), "holed").fills(hole)
    assert not look_at(lambda picture: painted(picture, ring, 10), "holed").fills(hole)
    within = ring + 0.6 * PITCH * (ring.mean(axis=0) - ring) / np.hypot(*(ring.mean(axis=0) - ring).T)[:, None]
    assert look_at(lambda picture: painted(painted(picture, ring, 10), within, 150), "holed").fills(hole)
    for shade_px, level in ((20.0, 150.0), (10.0, 150.0), (10.0, 900.0)):
        lamp = partial(lit_by_a_lamp, hole=ring, shade_px=shade_px, level=level)
        assert not look_at(lamp, "holed").fills(hole)
    lit = look_at(partial(lit_by_a_lamp, hole=ring, shade_px=20.0, level=150.0), "holed")
    assert (lit.foreign_at(hole.points) > PITCH).all(), "what the block shades along the rim is the table under a lamp"
    part = look_at(lambda picture: painted(picture, ring + np.array([0.3 * PITCH, 0.0]), 150), "holed")
    assert (part.foreign_at(hole.points) < PITCH).any(), "a thing in a hole lies at its edge"


def striped_around(picture: Picture) -> Picture:
    """Stripes as wide as half a cell all around the block, such as borders of a table's own."""
    around = np.zeros(picture.shape, np.uint8)
    cv2.fillPoly(around, [np.rint(block("rectangle").truth_px.exterior).astype(np.int32)], 1)
    beside = (cv2.dilate(around, np.ones((121, 121), np.uint8)) > 0) & (around == 0)
    stripes = np.where(np.add.outer(np.arange(picture.shape[0]), np.arange(picture.shape[1])) % 24 < 12, 90, 190)
    return np.where(beside, stripes, picture).astype(np.uint8)


def test_borders_all_around_are_the_tables_own_but_not_around_what_a_thing_left_of_a_block() -> None:
    picture, seen = plain()
    own = table_look(striped_around(picture), seen)
    assert not own.plain
    assert own.things.sum() > 2 * own.foreign.sum()
    known = table_look(striped_around(picture), seen, plain=look_at(lambda same: same).plain)
    assert known.plain
    assert (known.foreign == known.things).all()
