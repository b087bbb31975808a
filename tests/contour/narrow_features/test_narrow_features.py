"""Bumps and dents no wider than a chip are found; corners, arms and curves are none."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from contour.geometry.rings import Contour
from contour.narrow_features.arms import torn
from contour.narrow_features.feature import NarrowFeature
from contour.narrow_features.narrow_feature import narrow_feature
from tests.support.pictures.narrow_shapes import BLOCK, PITCH, chip, contour, dent
from tests.support.pictures.rings import SQUARE


def found(shape: shapely.Geometry, turn_deg: float = 0.0) -> NarrowFeature | None:
    return narrow_feature(contour(shape, turn_deg), PITCH)


@pytest.mark.parametrize("turn_deg", [0.0, 33.0, 90.0, 200.0])
@pytest.mark.parametrize(("width", "depth"), [(1.5, 1.0), (3.0, 2.0), (2.0, 4.0), (4.0, 1.5)])
def test_a_bump_as_wide_as_a_chip_is_found_where_it_is(width: float, depth: float, turn_deg: float) -> None:
    one = found(BLOCK | chip(width, depth), turn_deg)
    assert one is not None
    assert one.outwards
    assert one.depth_pitches == pytest.approx(depth, abs=0.35)
    assert one.width_pitches == pytest.approx(width, abs=1.0)
    bump = shapely.affinity.rotate(chip(width, depth), turn_deg, origin=(BLOCK | chip(width, depth)).envelope.centroid)
    assert shapely.Point(one.place_px).distance(bump) < 0.5 * PITCH


@pytest.mark.parametrize("turn_deg", [0.0, 70.0, 180.0])
@pytest.mark.parametrize(("width", "depth"), [(1.5, 1.0), (3.0, 2.0), (2.0, 4.0)])
def test_a_dent_as_narrow_is_found_and_goes_inwards(width: float, depth: float, turn_deg: float) -> None:
    one = found(BLOCK - dent(width, depth), turn_deg)
    assert one is not None
    assert not one.outwards
    assert one.depth_pitches == pytest.approx(depth, abs=0.35)


def test_a_bump_into_a_hole_stands_out_of_the_block_too() -> None:
    hole = shapely.box(200, 200, 600, 400) - shapely.box(380, 195, 420, 240)
    one = found(BLOCK - hole)
    assert one is not None
    assert one.outwards
    assert one.place_px == pytest.approx((400, 240), abs=1.2 * PITCH)


def test_of_several_the_deepest_is_told() -> None:
    shallow = shapely.affinity.translate(chip(2.0, 1.2), xoff=-200)
    one = found(BLOCK | chip(2.0, 3.0) | shallow)
    assert one is not None
    assert one.place_px[0] == pytest.approx(400, abs=1.5 * PITCH)


@pytest.mark.parametrize(("width", "depth"), [(11.0, 2.0), (9.0, 6.0), (3.0, 0.3)])
def test_wider_and_shallower_ones_are_the_blocks_own(width: float, depth: float) -> None:
    assert found(BLOCK | chip(width, depth)) is None
    assert found(BLOCK - dent(width, depth)) is None


@pytest.mark.parametrize(("width", "depth"), [(3.0, 0.5), (4.5, 0.6)])
def test_low_ones_on_a_straight_edge_are_found_and_none_of_a_corner(width: float, depth: float) -> None:
    for shape, outwards in ((BLOCK | chip(width, depth), True), (BLOCK - dent(width, depth), False)):
        one = found(shape)
        assert one is not None
        assert one.outwards == outwards
        assert one.depth_pitches == pytest.approx(depth, abs=0.1)
    roof = shapely.Polygon([(100, 499), (700, 499), (400, 500 + 300 * math.tan(math.radians(10)))])
    assert found(BLOCK | roof) is None


@pytest.mark.parametrize("turn_deg", [0.0, 30.0])
@pytest.mark.parametrize(("width", "depth"), [(6.0, 1.5), (7.0, 2.0), (9.0, 3.5)])
def test_a_strip_or_a_label_on_an_edge_is_found_and_a_dent_as_wide_is_the_blocks_own(
    width: float, depth: float, turn_deg: float
) -> None:
    one = found(BLOCK | chip(width, depth), turn_deg)
    assert one is not None
    assert one.outwards
    assert one.depth_pitches == pytest.approx(depth, abs=0.35)
    assert found(BLOCK - dent(width, depth), turn_deg) is None


def test_a_wide_bump_that_rises_to_a_point_is_the_end_of_an_arm() -> None:
    left, right = BLOCK.bounds[0] + 200.0, BLOCK.bounds[0] + 200.0 + 9.0 * PITCH
    top = BLOCK.bounds[3]
    assert found(BLOCK | shapely.Polygon([(left, top), (right, top), ((left + right) / 2, top + 4.0 * PITCH)])) is None


@pytest.mark.parametrize("turn_deg", [0.0, 20.0, 45.0])
@pytest.mark.parametrize("corner_deg", [15, 30, 45, 60, 75, 90, 105, 120, 135, 150, 165])
def test_a_corner_of_any_angle_is_none(corner_deg: float, turn_deg: float) -> None:
    half = math.radians(corner_deg) / 2
    kite = [
        (0, 0),
        (600 * math.cos(half), 600 * math.sin(half)),
        (900, 0),
        (600 * math.cos(half), -600 * math.sin(half)),
    ]
    assert found(shapely.Polygon(kite), turn_deg) is None


@pytest.mark.parametrize("arm", [5.5, 7.0, 12.0])
def test_an_arm_is_none(arm: float) -> None:
    """An L and a U whose arms are some cells wide, and a step between them."""
    w = arm * PITCH
    l_shaped = shapely.Polygon([(0, 0), (600, 0), (600, w), (w, w), (w, 500), (0, 500)])
    u_shaped = shapely.box(0, 0, 700, 500) - shapely.box(w, w, 700 - w, 600)
    assert found(l_shaped) is None
    assert found(u_shaped) is None


@pytest.mark.parametrize("slant", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("depth", [1.0, 1.5, 2.0, 3.0])
def test_a_step_is_none(depth: float, slant: float) -> None:
    """An edge that goes on in its own direction, but some cells farther out."""
    out = depth * PITCH
    step = [(0, 0), (600, 0), (600, 300), (300, 300), (300 - slant * out, 300 + out), (0, 300 + out)]
    assert found(shapely.Polygon(step)) is None
    assert found(shapely.Polygon(step), 25.0) is None


@pytest.mark.parametrize("slant", [0.0, 0.4])
@pytest.mark.parametrize("depth", [0.5, 0.8])
def test_a_step_lower_than_a_cell_is_found(depth: float, slant: float) -> None:
    """As the outline takes along cells whose walls are inked."""
    out = depth * PITCH
    step = [(0, 0), (600, 0), (600, 300), (300, 300), (300 - slant * out, 300 + out), (0, 300 + out)]
    one = found(shapely.Polygon(step), 25.0)
    assert one is not None
    assert one.depth_pitches == pytest.approx(depth, abs=0.05)


@pytest.mark.parametrize("long", [8.0, 25.0, 60.0])
def test_a_thread_of_any_length_is_found_at_its_end(long: float) -> None:
    """As a cable makes that was taken for a wall; it leaves the block in a bend."""
    path = shapely.LineString([(690, 480), (740, 500), (760 + 0.4 * long * PITCH, 480), (760 + long * PITCH, 560)])
    one = found(BLOCK | path.buffer(0.4 * PITCH))
    assert one is not None
    assert one.outwards
    assert one.depth_pitches > 0.8 * long
    assert one.place_px == pytest.approx((760 + long * PITCH, 560), abs=1.5 * PITCH)


@pytest.mark.parametrize("deep", [6.0, 14.0])
def test_a_slit_of_any_depth_is_found_and_goes_inwards(deep: float) -> None:
    """As an outline makes that follows a cable in from the edge, and back on its other side."""
    cable = shapely.LineString([(300, 520), (320, 500 - 3 * PITCH), (320, 500 - deep * PITCH)]).buffer(1.6 * PITCH)
    one = found(BLOCK - cable)
    assert one is not None
    assert not one.outwards
    assert one.depth_pitches > 0.6 * deep


def test_a_wide_bay_and_one_that_runs_to_a_point_are_the_blocks_own() -> None:
    assert found(BLOCK - shapely.box(300, 500 - 12 * PITCH, 300 + 6 * PITCH, 600)) is None
    assert found(BLOCK - shapely.Polygon([(200, 501), (600, 501), (400, 200)])) is None


@pytest.mark.parametrize("turn_deg", [0.0, 25.0])
@pytest.mark.parametrize("width", [2.2, 3.0])
def test_a_strip_of_cells_at_a_corner_is_found_whatever_way_it_lies(width: float, turn_deg: float) -> None:
    strip = shapely.LineString([(690, 490), (690 + 9 * PITCH, 490 + 5 * PITCH)]).buffer(
        0.5 * width * PITCH, cap_style="flat"
    )
    one = found(BLOCK | strip, turn_deg)
    assert one is not None
    assert one.outwards
    assert 4.0 < one.depth_pitches < 12.0


def test_what_is_nowhere_wider_than_a_thread_is_one() -> None:
    assert found(shapely.LineString([(0, 0), (400, 30)]).buffer(0.5 * PITCH)) is not None


@pytest.mark.parametrize("turn_deg", [0.0, 50.0, 180.0])
@pytest.mark.parametrize("slant", [0.0, 1.0])
@pytest.mark.parametrize(("high", "long"), [(1.5, 5.0), (2.5, 7.0), (4.0, 4.5)])
@pytest.mark.parametrize("left", [False, True])
def test_a_low_step_that_ends_in_a_corner_soon_is_a_strip(
    high: float, long: float, slant: float, left: bool, turn_deg: float
) -> None:
    h, w = high * PITCH, long * PITCH
    strip = shapely.Polygon([(700, 499), (700, 500 + h), (700 - w, 500 + h), (700 - w - slant * h, 499)])
    if left:
        strip = shapely.affinity.scale(strip, xfact=-1, origin=(400, 300))
    one = found(BLOCK | strip, turn_deg)
    assert one is not None
    assert one.outwards
    corner = shapely.affinity.rotate(strip, turn_deg, origin=(BLOCK | strip).envelope.centroid)
    assert shapely.Point(one.place_px).distance(corner) < 0.5 * PITCH


@pytest.mark.parametrize("turn_deg", [0.0, 25.0])
def test_and_so_is_one_that_ends_in_a_round_corner(turn_deg: float) -> None:
    """As an outline goes around a label: it leans where it rises, and turns by steps at its end."""
    p = PITCH
    step = [(700, 100), (700, 500 - 1 * p), (700 - 0.6 * p, 500 + 0.4 * p), (700 - 1.9 * p, 500 + 1.5 * p)]
    foot = [(700 - 4.8 * p, 500 + 2.2 * p), (700 - 6.0 * p, 500), (100, 500), (100, 100)]
    one = found(shapely.Polygon([*step, *foot]), turn_deg)
    assert one is not None
    assert one.outwards


@pytest.mark.parametrize(("high", "long"), [(1.5, 14.0), (5.5, 8.0)])
def test_a_long_step_and_the_end_of_an_arm_are_the_blocks_own(high: float, long: float) -> None:
    assert found(BLOCK | shapely.box(700 - long * PITCH, 499, 700, 500 + high * PITCH)) is None


def test_curves_are_none() -> None:
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    for lobes, strength in ((2, 0.15), (3, 0.1), (5, 0.06)):
        reach = 250 * (1 + strength * np.cos(lobes * angle))
        blob = np.column_stack([np.cos(angle), np.sin(angle)]) * reach[:, None] + 300
        assert found(shapely.Polygon(blob)) is None
    assert found(BLOCK.buffer(0) - shapely.Point(400, 300).buffer(4 * PITCH)) is None


def test_moved_moves_its_place() -> None:
    one = NarrowFeature(1.0, 2.0, (30.0, 40.0), outwards=True)
    assert one.moved(5.0, -7.0) == NarrowFeature(1.0, 2.0, (35.0, 33.0), outwards=True)


def test_a_small_square_is_no_feature_of_itself() -> None:
    assert narrow_feature(Contour(SQUARE[::-1] * 12.0), PITCH) is None


def pitches(*points: tuple[float, float]) -> shapely.Polygon:
    return shapely.affinity.scale(shapely.Polygon(points), PITCH, PITCH, origin=(0, 0))


@pytest.mark.parametrize("turn_deg", [0.0, 50.0, 160.0])
def test_what_stands_out_of_a_corner_on_both_sides_is_found(turn_deg: float) -> None:
    corner = pitches((0, 0), (18, 0), (18, -14), (0, -14))
    ink = pitches((0, -2.4), (-0.9, -0.9), (-0.5, 1.7), (2.4, 0), (1, -1))
    one = found(corner | ink, turn_deg)
    assert one is not None
    assert one.outwards
    assert one.width_pitches == pytest.approx(3.4, abs=0.5)
    assert found(corner, turn_deg) is None
    block = pitches((-10, -10), (10, -10), (10, 10), (-10, 10))
    inner = block - corner
    assert found(inner, turn_deg) is None
    bite = found(inner - ink, turn_deg)
    assert bite is not None
    assert not bite.outwards


@pytest.mark.parametrize("turn_deg", [0.0, 50.0, 160.0])
def test_the_missing_corner_of_an_l_is_no_dent_and_a_bevel_in_it_is(turn_deg: float) -> None:
    block = pitches((0, 0), (9, 0), (9, -8), (0, -8))
    missing = pitches((-1, 1), (3.4, 1), (3.4, -3.4), (-1, -3.4))
    assert found(block - missing, turn_deg) is None
    dent = found(block - missing - pitches((3.4, -1.2), (5, -3.4), (5, -5), (0, -3.4)), turn_deg)
    assert dent is not None
    assert not dent.outwards


@pytest.mark.parametrize("turn_deg", [0.0, 50.0, 160.0])
def test_a_horn_is_found_and_the_tips_of_a_crescent_are_none(turn_deg: float) -> None:
    disc = shapely.Point(-4.77 * PITCH, 1.36 * PITCH).buffer(4.9 * PITCH)
    one = found(disc | pitches((0, 0), (1.6, 4.7), (-0.2, 3.14), (-4, 1)), turn_deg)
    assert one is not None
    assert one.outwards
    assert one.depth_pitches == pytest.approx(2.4, abs=0.3)
    crescent = shapely.Point(0, 0).buffer(10 * PITCH) - shapely.Point(6 * PITCH, 0).buffer(8 * PITCH)
    assert found(crescent, turn_deg) is None


@pytest.mark.parametrize("turn_deg", [0.0, 50.0])
def test_an_edge_drawn_past_a_curve_is_a_horn(turn_deg: float) -> None:
    """As along glare: not so sharp, since one of its sides is the edge itself."""
    one = found(pitches((0, -10), (10, -10), (10, 1.6), (8.4, 1.1), (6.4, 2.3), (4, 2.6), (1.5, 1.8), (0, 0)), turn_deg)
    assert one is not None
    assert one.depth_pitches == pytest.approx(1.7, abs=0.1)


@pytest.mark.parametrize("turn_deg", [0.0, 50.0])
def test_a_small_round_hole_is_no_dent(turn_deg: float) -> None:
    assert found(BLOCK - shapely.Point(300, 300).buffer(2.0 * PITCH), turn_deg) is None


@pytest.mark.parametrize("turn_deg", [0.0, 35.0])
@pytest.mark.parametrize("arm", [4.0, 4.4, 4.8])
def test_an_arm_that_is_a_large_part_of_the_block_is_its_own(arm: float, turn_deg: float) -> None:
    l_shaped = pitches((0, 0), (11, 0), (11, arm), (arm, arm), (arm, 11), (0, 11))
    wide = 2 * arm + 5.5
    u_shaped = pitches(
        (0, 0), (wide, 0), (wide, 12), (wide - arm, 12), (wide - arm, arm), (arm, arm), (arm, 12), (0, 12)
    )
    assert found(l_shaped, turn_deg) is None
    assert found(u_shaped, turn_deg) is None
    stepped = pitches((0, 0), (12, 0), (12, arm), (7.5, arm), (7.5, arm + 4.4), (0, arm + 4.4))
    assert found(stepped, turn_deg) is None
    at_a_larger_block = pitches((0, 0), (32, 0), (32, 4), (24, 4), (24, 20), (0, 20))
    assert found(at_a_larger_block, turn_deg) is not None


@pytest.mark.parametrize("turn_deg", [0.0, 35.0])
def test_what_lies_between_a_hole_and_the_edge_is_no_strip_but_may_be_a_thread(turn_deg: float) -> None:
    size = BLOCK.bounds[3] - BLOCK.bounds[1]
    for web, none in ((4.0, True), (2.0, True), (1.0, False)):
        hole = shapely.box(200, 100 + web * PITCH, 500, 100 + size - web * PITCH)
        assert (found(BLOCK - hole, turn_deg) is None) == none


@pytest.mark.parametrize("turn_deg", [0.0, 33.0])
@pytest.mark.parametrize(("side", "lies"), [(6.0, 0.7), (10.0, 0.7), (10.0, 2.0)])
def test_what_hangs_on_a_block_by_a_corner_of_its_own_is_found(side: float, lies: float, turn_deg: float) -> None:
    """An offcut that touches the block, and reaches over its edge by so many pitches."""
    half = side * PITCH / math.sqrt(2.0)
    piece = shapely.affinity.rotate(
        shapely.box(400 - 0.5 * side * PITCH, 0, 400 + 0.5 * side * PITCH, side * PITCH), 45
    )
    piece = shapely.affinity.translate(piece, 0.0, 500 + half - lies * PITCH - piece.centroid.y)
    one = found(BLOCK | piece, turn_deg)
    assert one is not None
    assert one.outwards
    assert one.width_pitches == pytest.approx(2.0 * lies, abs=0.5)


def test_a_bone_is_held_by_its_middle() -> None:
    ends = shapely.box(100, 100, 300, 500) | shapely.box(500, 100, 700, 500)
    assert found(ends | shapely.box(250, 230, 550, 370)) is None


@pytest.mark.parametrize("turn_deg", [0.0, 33.0])
@pytest.mark.parametrize(("width", "depth", "is_torn"), [(0.6, 1.4, True), (0.6, 0.5, False), (1.6, 1.4, False)])
def test_what_goes_in_narrow_and_deep_is_torn(width: float, depth: float, is_torn: bool, turn_deg: float) -> None:
    assert torn(contour(BLOCK - dent(width, depth), turn_deg), PITCH) == is_torn
    assert not torn(contour(BLOCK | chip(width, depth), turn_deg), PITCH)
