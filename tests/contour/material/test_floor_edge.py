"""Where the floors of cells end tells a corner from a rounding, wherever the table is of another light."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.material.floor_edge import FloorEdge, floor_edge
from tests.support.pictures.outline_scenes import PITCH, rectangle
from tests.support.scenes.shop_floor.corners import rounding

BLOCK = rectangle(700.0, 500.0)
CORNER = BLOCK[1]
WALL, FLOOR, TABLE = 220, 60, 130
NOWHERE = np.empty((0, 2))


def rounded(radius: float) -> NDArray[np.float64]:
    """The block with arcs of so many pitches at its corners."""
    parts = []
    for before, corner, after in zip(np.roll(BLOCK, 1, axis=0), BLOCK, np.roll(BLOCK, -1, axis=0), strict=True):
        one, other = ((end - corner) / np.hypot(*(end - corner)) * radius * PITCH for end in (before, after))
        parts.append(rounding(corner, one, other))
    return np.concatenate(parts)


def seen(block: NDArray[np.float64], *, table: int = TABLE, inverted: bool = False) -> NDArray[np.uint8]:
    """A picture of a block with walls a pitch apart; inverted, walls are darker than floors."""
    picture = np.full((1000, 1400), FLOOR, np.uint8)
    for at in np.arange(0.0, 1400.0, PITCH):
        cv2.line(picture, (round(at), 0), (round(at), 999), WALL, 3)
    outside = np.ones(picture.shape, np.uint8)
    cv2.fillPoly(outside, [np.rint(block * 16).astype(np.int32)], 0, cv2.LINE_AA, 4)
    picture[outside > 0] = table
    noisy = cv2.GaussianBlur(picture, (0, 0), 0.8) + np.random.default_rng(1).normal(0.0, 1.5, picture.shape)
    light = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
    return 255 - light if inverted else light


def told(block: NDArray[np.float64], ring: NDArray[np.float64], *, table: int = TABLE, inverted: bool) -> FloorEdge:
    return floor_edge(seen(block, table=table, inverted=inverted), ring, PITCH, bright=not inverted)


@pytest.mark.parametrize("inverted", [False, True])
def test_the_edges_own_corners_and_roundings_are_told(inverted: bool) -> None:
    amidst = 0.5 * (BLOCK[1] + BLOCK[2])
    sharp = told(BLOCK, BLOCK, inverted=inverted)
    assert sharp.tells(np.array([CORNER, amidst]), PITCH).all()
    assert not sharp.tells(np.array([[700.0, 500.0]]), PITCH).any(), "that is no place of the edge"
    assert not len(sharp.passed(NOWHERE, PITCH))
    middle = rounded(2.0)[30 + 15]
    assert told(rounded(2.0), rounded(2.0), inverted=inverted).tells(middle[None], PITCH).all()


def test_so_are_they_beside_a_table_that_is_hardly_lighter_than_floors() -> None:
    assert not len(told(BLOCK, BLOCK, table=FLOOR + 14, inverted=False).passed(NOWHERE, PITCH))
    passed = told(rounded(2.0), BLOCK, table=FLOOR + 14, inverted=False).passed(NOWHERE, PITCH)
    assert np.hypot(*(passed[:, None] - BLOCK).transpose(2, 0, 1)).min(axis=0).max() < PITCH, "each corner"


@pytest.mark.parametrize("inverted", [False, True])
def test_a_corner_drawn_for_a_rounding_and_a_rounding_for_a_corner_are_not(inverted: bool) -> None:
    drawn_round = told(BLOCK, rounded(2.5), inverted=inverted)
    assert not drawn_round.tells(rounded(2.5)[[30 + 15]], PITCH).any()
    drawn_sharp = told(rounded(2.0), BLOCK, inverted=inverted)
    assert not drawn_sharp.tells(BLOCK, PITCH).any()
    passed = drawn_sharp.passed(NOWHERE, PITCH)
    assert np.hypot(*(passed[:, None] - BLOCK).transpose(2, 0, 1)).min(axis=0).max() < PITCH, "each corner"
    assert not len(drawn_sharp.passed(passed + 0.3 * PITCH, PITCH)), "walls end there"


def test_a_table_as_light_as_floors_tells_nothing() -> None:
    ring = told(rounded(2.0), BLOCK, table=FLOOR + 3, inverted=False)
    assert not ring.tells(BLOCK, PITCH).any()
    assert not len(ring.passed(NOWHERE, PITCH))


@pytest.mark.parametrize("inverted", [False, True])
def test_floors_beyond_a_rounding_are_told_where_the_block_has_a_corner(inverted: bool) -> None:
    drawn_round = told(BLOCK, rounded(1.7), inverted=inverted)
    beyond = drawn_round.places[drawn_round.beyond]
    away = np.hypot(*(beyond[:, None] - BLOCK).transpose(2, 0, 1))
    assert np.count_nonzero(away.min(axis=0) < 1.5 * PITCH) >= 3, "corners"
    assert away.min(axis=1).max() < 1.5 * PITCH, "nowhere else"
    for block in (BLOCK, rounded(1.7), rounded(2.5)):
        assert not told(block, block, inverted=inverted).beyond.any()
