"""Borders that go on past an outline's corners: told where a thing lies along the edge, and nowhere else."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.edge.border_beyond import _rays, border_beyond
from contour.geometry.arrays import Bytes, Float64s
from contour.geometry.rings import Contour

PITCH_PX = 14.0
TABLE, WALLS = 30.0, 150.0
LEFT, TOP, RIGHT, BOTTOM = 200.0, 160.0, 440.0, 340.0
CORNERS = np.array([[LEFT, TOP], [RIGHT, TOP], [RIGHT, BOTTOM], [LEFT, BOTTOM]])


def turned(points: Float64s, degrees: float) -> Float64s:
    """About the picture's middle."""
    angle = np.radians(degrees)
    middle = np.array([320.0, 240.0])
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.asarray((points - middle) @ turn + middle)


def block_on_table(
    *things: tuple[Float64s, float], degrees: float = 20.0, hole: bool = False, block: Float64s = CORNERS
) -> tuple[Bytes, Contour]:
    """Light on a noisy table with a block, and things of so many grey levels above the table over it; the outline."""
    rng = np.random.default_rng(7)
    light = np.full((480, 640), TABLE, np.float32) + cv2.GaussianBlur(rng.normal(0, 8, (480, 640)), (0, 0), 3.0)
    ring = turned(block, degrees)
    walls = np.zeros(light.shape, np.uint8)
    cv2.fillPoly(walls, [np.rint(ring).astype(np.int32)], 1)
    if hole:
        walls = 1 - walls
    light[walls > 0] = WALLS
    for corners, levels in things:
        there = np.zeros(light.shape, np.float32)
        cv2.fillPoly(there, [np.rint(turned(corners, degrees)).astype(np.int32)], 1.0)
        there = cv2.GaussianBlur(there, (0, 0), 0.8)
        light = np.where(walls > 0, light, light + there * np.float32(levels))
    light += rng.normal(0, 0.8, light.shape)
    grey = np.clip(np.rint(light), 0, 255).astype(np.uint8)
    if not hole:
        return grey, Contour(ring, ())
    frame = np.array([[2.0, 2.0], [637.0, 2.0], [637.0, 477.0], [2.0, 477.0]])
    return grey, Contour(frame, (ring[::-1].copy(),))


def box(left: float, top: float, right: float, bottom: float) -> Float64s:
    """Corners of a rectangle along the block's edges."""
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])


ALONG_TOP = box(LEFT - 80, TOP - 50, RIGHT + 80, TOP)
CAST = np.array(
    [[LEFT, BOTTOM], [LEFT + 90, BOTTOM + 90], [RIGHT + 90, BOTTOM + 90], [RIGHT + 90, TOP + 90], [RIGHT, TOP]]
)
BESIDE_TOP_RIGHT = box(RIGHT - 60, TOP - 40, RIGHT + 90, TOP)


@pytest.mark.parametrize("levels", [-10.0, -4.0, 4.0, 60.0])
@pytest.mark.parametrize("thing", [ALONG_TOP, BESIDE_TOP_RIGHT])
@pytest.mark.parametrize("degrees", [0.0, 20.0, 77.0])
def test_a_thing_whose_border_runs_on_past_a_corner_is_told_there(
    thing: Float64s, levels: float, degrees: float
) -> None:
    light, contour = block_on_table((thing, levels), degrees=degrees)
    found = border_beyond([light], contour, PITCH_PX)
    assert found is not None
    corners = turned(CORNERS[:2], degrees)
    assert np.hypot(*(corners - found.place_px).T).min() < 0.5 * PITCH_PX
    reversed_way = Contour(contour.exterior[::-1].copy(), ())
    assert border_beyond([light], reversed_way, PITCH_PX) is not None


def test_it_is_told_in_a_hole_too() -> None:
    across = box(LEFT, TOP + 70, RIGHT, TOP + 180)  # over one end of the hole, and the walls behind it
    light, contour = block_on_table(hole=True)
    assert border_beyond([light], contour, PITCH_PX) is None
    cut = Contour(contour.exterior, (turned(box(LEFT, TOP, RIGHT, TOP + 70)[::-1], 20.0),))
    assert border_beyond([light], cut, PITCH_PX) is None
    dent = np.array(
        [[LEFT, TOP], [RIGHT, TOP], [RIGHT, TOP + 70], [LEFT + 90, TOP + 70], [LEFT + 90, BOTTOM], [LEFT, BOTTOM]]
    )
    light, contour = block_on_table((across, 6.0), hole=True)
    beside = Contour(contour.exterior, (turned(dent[::-1], 20.0),))
    found = border_beyond([light], beside, PITCH_PX)
    assert found is not None
    assert np.hypot(*(turned(np.array([[LEFT + 90, TOP + 70]]), 20.0)[0] - found.place_px)) < 0.5 * PITCH_PX


def test_a_short_border_is_told_at_both_ends_of_an_edge_alone() -> None:
    """A sheet that ends two and a half cells beyond the block on both sides, or on one."""
    beyond = 2.5 * PITCH_PX
    for left, told in ((LEFT - beyond, True), (LEFT + 20, False)):
        light, contour = block_on_table((box(left, TOP - 50, RIGHT + beyond, TOP), 12.0))
        assert (border_beyond([light], contour, PITCH_PX) is not None) == told


@pytest.mark.parametrize(
    "thing",
    [
        pytest.param((box(0, 0, 1, 1), 0.0), id="nothing"),
        pytest.param((box(RIGHT, TOP, RIGHT + 90, BOTTOM), -12.0), id="the block's shadow, light along two edges"),
        pytest.param((CAST, -12.0), id="the block's shadow, light across"),
        pytest.param((box(LEFT - 80, TOP - 90, RIGHT + 80, TOP - 15), 20.0), id="a thing a cell off"),
        pytest.param((box(LEFT + 60, TOP - 90, RIGHT - 60, TOP), 20.0), id="a thing that touches an edge"),
        pytest.param((turned(box(LEFT - 80, TOP - 90, RIGHT + 80, TOP), 25.0), 20.0), id="a line to a corner, askew"),
    ],
)
def test_what_is_no_edge_going_on_is_not_told(thing: tuple[Float64s, float]) -> None:
    light, contour = block_on_table(thing)
    assert border_beyond([light], contour, PITCH_PX) is None


@pytest.mark.parametrize("levels", [4.0, 6.0])
def test_a_border_beyond_both_ends_of_an_edge_is_told_where_light_falls_off_along_it(levels: float) -> None:
    """A sheet over all of one side, dimmer towards the right; over one corner alone it may be the table's own light.

    A faint one hardly stands out of the noise at its dim end, and twice as far at the other.
    """
    falls = np.linspace(1.0, 0.4, 640) + 0.0 * np.arange(480)[:, None]
    for thing, told in ((ALONG_TOP, True), (BESIDE_TOP_RIGHT, False)):
        light, contour = block_on_table((thing, levels), degrees=0.0)
        dimmed = [np.rint(np.where(light > 100, light, falls * light)).astype(np.uint8)]
        assert (border_beyond(dimmed, contour, PITCH_PX) is not None) == told


def test_a_clear_border_may_be_a_mottled_sheets() -> None:
    lighter = box(RIGHT - 60, TOP - 40, RIGHT, TOP)
    for levels, told in ((4.0, True), (7.0, True), (9.5, False)):
        light, contour = block_on_table((BESIDE_TOP_RIGHT, 10.0), (lighter, levels))
        assert (border_beyond([light], contour, PITCH_PX) is not None) == told


def test_borders_beyond_both_ends_of_a_notch_are_told_where_a_sheet_is_lighter_in_it() -> None:
    """A sheet's corner over the block's; what goes on beyond one end of a notch alone may be the table's own light."""
    left, low = RIGHT - 90, TOP + 70
    notched = np.array([[LEFT, TOP], [left, TOP], [left, low], [RIGHT, low], [RIGHT, BOTTOM], [LEFT, BOTTOM]])
    for right, told in ((RIGHT + 80, True), (RIGHT - 25, False)):
        sheet, lighter = box(left, TOP - 60, right, low), box(left, TOP, min(right, RIGHT), low)
        light, contour = block_on_table((sheet, 3.0), (lighter, 3.0), block=notched)
        assert (border_beyond([light], contour, PITCH_PX) is not None) == told


def test_a_thing_of_another_colour_is_told_in_the_plane_that_shows_it() -> None:
    plain, contour = block_on_table()
    blue, _ = block_on_table((ALONG_TOP, 8.0))
    assert border_beyond([plain], contour, PITCH_PX) is None
    assert border_beyond([plain, blue, plain], contour, PITCH_PX) is not None


def test_soft_borders_and_round_outlines_are_none() -> None:
    light, contour = block_on_table((ALONG_TOP, -4.0))
    soft = cv2.GaussianBlur(light, (0, 0), 1.2 * PITCH_PX)
    ramp = np.where(light > 0.5 * (TABLE + WALLS), light, soft).astype(np.uint8)
    assert border_beyond([ramp], contour, PITCH_PX) is None
    angle = np.linspace(0.0, 2.0 * np.pi, 90, endpoint=False)
    circle = np.column_stack([320 + 90 * np.cos(angle), 240 + 90 * np.sin(angle)])
    assert border_beyond([light], Contour(circle, ()), PITCH_PX) is None
    assert border_beyond([light], Contour(CORNERS[:3] * 0.05, ()), PITCH_PX) is None


@pytest.mark.parametrize("degrees", [0.0, 7.0, 20.0, 33.0])
def test_each_corner_is_one_whatever_the_last_bits(degrees: float) -> None:
    rng, ring = np.random.default_rng(2), turned(CORNERS, degrees)
    found = [_rays(ring + 1e-10 * rng.normal(size=ring.shape), 1.0, PITCH_PX).corner for _ in range(5)]
    for corners in found:
        assert len(corners) == 2 * len(ring)
        assert np.abs(corners - found[0]).max() < 1e-6


def test_grain_of_a_table_is_seldom_taken_for_a_border() -> None:
    """Grain up to as wide as cells, with nothing on it."""
    light, contour = block_on_table()
    told = 0
    for seed in range(160):
        size = (0.3, 0.45, 0.6, 0.9)[seed % 4] * PITCH_PX
        grain = cv2.GaussianBlur(np.random.default_rng(seed).normal(0, 1, (480, 640)), (0, 0), size)
        mottled = np.where(light > 100, light, light + 4.0 / grain.std() * grain)
        told += border_beyond([np.rint(mottled).astype(np.uint8)], contour, PITCH_PX) is not None
    assert told < 8
