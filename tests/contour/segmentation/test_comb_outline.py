"""An outline is told where two networks and the picture agree, and only there."""

from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np
import pytest

from contour.errors import NoBlockFound
from contour.geometry.agreement import distances_to, places_along
from contour.geometry.arrays import Bytes, Float32s
from contour.geometry.rings import Contour
from contour.segmentation.comb_outline import comb_outline, farthest_from
from contour.segmentation.network import PITCH_PX, Segments

SIDE = 480
SQUARE = np.array([[60.0, 70.0], [420.0, 70.0], [420.0, 410.0], [60.0, 410.0]])
HOLE = np.array([[200.0, 200.0], [200.0, 280.0], [280.0, 280.0], [280.0, 200.0]])
POINTED = np.array(
    [[60.0, 70.0], [420.0, 70.0], [420.0, 200.0], [240.0, 235.0], [420.0, 270.0], [420.0, 410.0], [60.0, 410.0]]
)


def lattice() -> Float32s:
    """Walls of a comb, 0…1."""
    y, x = np.mgrid[:SIDE, :SIDE] * (4.0 * math.pi / math.sqrt(3.0) / PITCH_PX)
    waves = sum(np.cos(x * math.cos(turn) + y * math.sin(turn)) for turn in np.arange(3) * math.pi / 3.0)
    return np.asarray(waves < -0.8, np.float32)


def comb_of(*rings: np.ndarray) -> Float32s:
    """How surely a network sees comb within rings: less so about their borders, and with corners rounded off."""
    block = np.zeros((SIDE, SIDE), np.uint8)
    cv2.fillPoly(block, [np.rint(ring).astype(np.int32) for ring in rings], 1)
    return np.asarray(cv2.GaussianBlur(block.astype(np.float32), (0, 0), 3.0), np.float32)


def seen(*rings: np.ndarray) -> tuple[Bytes, Segments]:
    """A picture of a block, and what a network tells of it."""
    comb = comb_of(*rings)
    wall = np.asarray(lattice() * comb, np.float32)
    return (60.0 + 120.0 * wall).astype(np.uint8), Segments(wall, comb, np.zeros_like(comb))


def test_an_outline_with_its_corners_and_its_hole_is_told() -> None:
    light, told = seen(SQUARE, HOLE)
    outline, apart = comb_outline(light, told, told.comb)
    assert apart == 0.0
    assert len(outline.holes) == 1
    truth = Contour(SQUARE, (HOLE,))
    off = distances_to(places_along(outline, 1.0), truth) / PITCH_PX, distances_to(places_along(truth, 1.0), outline)
    assert np.quantile(off[0], 0.95) < 0.06
    assert max(off[0].max(), off[1].max() / PITCH_PX) < 0.3


@pytest.mark.parametrize("ring", [SQUARE, np.add(SQUARE, (12.0, 0.0))])
def test_how_far_from_an_outline_a_network_sees_the_border_is_told(ring: np.ndarray) -> None:
    another = np.array([[440.0, 440.0], [475.0, 440.0], [475.0, 475.0], [440.0, 475.0]])
    away = abs(float((ring - SQUARE).max()))
    assert farthest_from(Contour(ring), comb_of(SQUARE, another)) * PITCH_PX == pytest.approx(away, abs=3.0)


def test_a_slot_that_an_outline_leaves_out_is_told_and_no_comb_is_infinitely_far() -> None:
    slot = np.array([[200.0, 60.0], [240.0, 60.0], [240.0, 200.0], [200.0, 200.0]])
    assert farthest_from(Contour(SQUARE), comb_of(SQUARE, slot)) * PITCH_PX == pytest.approx(130.0, abs=3.0)
    assert farthest_from(Contour(SQUARE), np.zeros((SIDE, SIDE), np.float32)) == math.inf


def test_how_far_networks_see_the_border_apart_is_told() -> None:
    light, told = seen(SQUARE)
    assert comb_outline(light, told, comb_of(np.add(SQUARE, (3.0, 0.0))))[1] == pytest.approx(3.0 / PITCH_PX, abs=0.03)


def another_block(told: Segments) -> None:
    told.comb[10:50, 200:300] = 1.0


def without_walls(told: Segments) -> None:
    told.wall[150:200, 150:200] = 0.0


def without_two_cells(told: Segments, sure: float = 0.2) -> None:
    """Walls are lost between cells of which the network is no surer than that that they are comb."""
    told.wall[206:214, 200:236] = 0.0
    told.comb[208:212, 203:233] = sure


REFUSED: dict[str, Callable[[Segments], None]] = {
    "more than one piece": another_block,
    "where it sees no walls": without_walls,
    "cells missing": without_two_cells,
}


@pytest.mark.parametrize("why", REFUSED)
def test_comb_that_is_in_doubt_is_refused(why: str) -> None:
    light, told = seen(SQUARE)
    REFUSED[why](told)
    with pytest.raises(NoBlockFound, match=why):
        comb_outline(light, told, told.comb)


def test_cells_between_which_walls_hardly_show_are_not_missing_where_they_surely_are_comb() -> None:
    light, told = seen(SQUARE)
    without_two_cells(told, 0.6)
    assert comb_outline(light, told, told.comb)[1] == 0.0


def test_another_border_by_the_other_network_is_refused() -> None:
    light, told = seen(SQUARE)
    with pytest.raises(NoBlockFound, match=r"up to 0\.6 cells apart"):
        comb_outline(light, told, comb_of(np.add(SQUARE, (10.0, 0.0))))


def test_a_network_that_sees_nothing_agrees_with_none() -> None:
    light, told = seen(SQUARE)
    with pytest.raises(NoBlockFound, match="cells apart"):
        comb_outline(light, told, np.zeros_like(told.comb))


def test_walls_that_the_picture_does_not_show_are_refused() -> None:
    light, told = seen(SQUARE)
    light[300:380, 100:200] = 60
    with pytest.raises(NoBlockFound, match="hardly shows any"):
        comb_outline(light, told, told.comb)


def test_dark_walls_are_walls() -> None:
    light, told = seen(SQUARE)
    assert comb_outline(255 - light, told, told.comb)[1] == 0.0


def test_a_tip_that_a_network_leaves_out_is_refused() -> None:
    light, told = seen(POINTED)
    with pytest.raises(NoBlockFound, match="tip of its border"):
        comb_outline(light, told, told.comb)


def test_the_round_end_of_a_notch_is_no_tip() -> None:
    """Sides that meet a pitch and a half beyond it, and are more than a pitch apart there."""
    ring = np.insert(np.delete(POINTED, 3, 0), 3, [[300.0, 214.0], [286.0, 235.0], [300.0, 256.0]], 0)
    light, told = seen(ring)
    outline, _ = comb_outline(light, told, told.comb)
    assert distances_to(places_along(outline, 1.0), Contour(ring)).max() < 0.5 * PITCH_PX


def test_comb_that_goes_on_to_the_last_pixels_is_refused() -> None:
    light, told = seen(np.where(SQUARE == 60.0, -20.0, SQUARE))
    with pytest.raises(NoBlockFound, match="last pixels"):
        comb_outline(light, told, told.comb)


@pytest.mark.parametrize(("half", "refused"), [(14.0, True), (18.0, False)])
def test_a_hole_of_two_cells_may_be_cells_that_are_lost(half: float, refused: bool) -> None:
    square = [200.0, 200.0] + half * np.array([[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]])
    light, told = seen(SQUARE, square)
    if refused:
        with pytest.raises(NoBlockFound, match="cells may be lost"):
            comb_outline(light, told, told.comb)
    else:
        assert len(comb_outline(light, told, told.comb)[0].holes) == 1
