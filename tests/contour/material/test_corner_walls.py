"""Walls that a corner would have, were it whole, are looked for in it; where none can be told, nothing is said."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import pytest

from contour.geometry.arrays import Bytes, Float64s
from contour.material.corner_walls import corner_walls
from contour.synthetic import render
from tests.support.scenes.shop_floor_scenes import shop_floor_scene
from tests.support.scenes.trials import traced_with_lens

PITCH, SIZE, FIRST, LAST = 20.0, 380, 40.0, 340.0
RING = np.array([[FIRST, FIRST], [FIRST, LAST], [LAST, LAST], [LAST, FIRST]])
NOWHERE = np.empty((0, 2))


def comb(phase: float) -> Bytes:
    """Walls of hexagons within the ring: as far from two of their middles, nearly."""
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float64)
    rows = np.sqrt(3.0) * PITCH
    first, second = np.full((2, SIZE, SIZE), np.inf)
    for shift in (0.0, 0.5):
        for px, py in itertools.product(np.arange(0, SIZE + PITCH, PITCH), np.arange(0, SIZE + rows, rows)):
            away = np.hypot(x - px - phase - shift * PITCH, y - py - shift * rows)
            second = np.minimum(second, np.maximum(first, away))
            first = np.minimum(first, away)
    block = np.zeros((SIZE, SIZE), np.uint8)
    cv2.fillPoly(block, [RING.astype(np.int32)], 255)
    return np.where(second - first < 3.0, block, np.uint8(0))


def cut(mask: Bytes, deep: float) -> Bytes:
    """Without what lies within so much of the corner at the top left."""
    y, x = np.mgrid[:SIZE, :SIZE]
    return np.where(x + y - 2.0 * FIRST < np.sqrt(2.0) * deep, np.uint8(0), mask)


def told(mask: Bytes, doubted: Float64s = NOWHERE) -> tuple[list[list[float]], list[list[float]]]:
    found = corner_walls(mask, 1, RING, doubted, PITCH)
    return found.corners[found.bare].tolist(), found.corners[found.there].tolist()


@pytest.mark.parametrize("phase", [0.0, 5.0, 10.0, 15.0])
def test_a_corner_in_which_walls_stand_as_beside_it_is_there_and_a_cut_one_is_bare(phase: float) -> None:
    mask = comb(phase)
    assert told(mask, RING)[0] == []
    assert RING[0].tolist() in told(mask, RING)[1]
    bare, there = told(cut(mask, 0.7 * PITCH), RING)
    assert bare == [RING[0].tolist()]
    assert RING[0].tolist() not in there
    assert told(cut(mask, 0.7 * PITCH))[0] == bare, "also where nobody doubts it"


def test_a_corner_of_no_order_is_neither() -> None:
    rng = np.random.default_rng(5)
    noise = cv2.GaussianBlur(rng.normal(0.0, 1.0, (SIZE, SIZE)), (0, 0), 3.0)
    assert told(cut((noise > 0.1).astype(np.uint8) * np.uint8(255), 0.7 * PITCH), RING) == ([], [])


def test_a_vertex_that_stands_twice_is_no_corner_and_takes_none_from_the_others() -> None:
    mask = comb(0.0)
    twice = corner_walls(mask, 1, np.concatenate([RING[:1], RING]), RING, PITCH)
    assert RING[2].tolist() in twice.corners[twice.there].tolist()


def test_a_corner_at_the_pictures_border_and_a_picture_without_walls_are_none() -> None:
    mask = comb(0.0)
    assert told(np.zeros_like(mask), RING) == ([], [])
    beyond = corner_walls(mask, 1, RING - FIRST, RING - FIRST, PITCH)
    assert not beyond.bare.any()


@pytest.mark.parametrize("seed", [3_950_038, 3_950_048, 3_950_049])
def test_a_corner_that_was_cut_by_a_cell_and_drawn_whole_is_told(seed: int) -> None:
    """0.6 to 0.7 of a cell off."""
    rendered = render(shop_floor_scene("corners", seed).scene)
    traced = traced_with_lens(rendered)
    assert traced.untold_px is not None
    off = np.hypot(*(traced.contour.exterior - traced.untold_px).T).min()
    assert off < 0.1 * rendered.pitch_px, "at a corner of the outline"


@pytest.mark.parametrize(
    ("kind", "seed"),
    [("corners", 3_950_005), ("corners", 3_950_021), ("corners", 3_950_085), ("hot_pixels", 3_910_008)],
)
def test_a_sharp_corner_that_may_have_been_cut_is_told_by_its_walls(kind: str, seed: int) -> None:
    """The last one's cells have no order, by which it was told to be cut."""
    assert traced_with_lens(render(shop_floor_scene(kind, seed).scene)).untold_px is None
