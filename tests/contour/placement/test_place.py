"""A part is laid where its least margin is largest: against shapes whose answer is known, and against shapely."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from contour.errors import ParameterError
from contour.geometry.rings import Contour, oriented_contour
from contour.placement.clearance import crosses
from contour.placement.place import Placement, best_placement
from contour.placement.pose import Pose, Turns
from contour.synthetic import convex, disc_ring, l_shape, moved, polygon, rectangle, u_shape, with_holes

BLOCK = rectangle((150.0, 100.0), 300.0, 200.0)


def shape_of(contour: Contour) -> shapely.Polygon:
    return shapely.Polygon(contour.exterior, list(contour.holes))


def margin_by_shapely(part: Contour, block: Contour, placement: Placement) -> float:
    laid, whole = shape_of(placement.pose.placed(part)), shape_of(block)
    assert whole.contains(laid)
    return float(shapely.distance(laid, whole.boundary))


def test_a_rectangle_lies_in_the_middle_of_a_wider_one_along_it() -> None:
    placement = best_placement(rectangle((7.0, -3.0), 120.0, 260.0), BLOCK, Turns.free())
    # The best is that of 120 against 200, wherever it is shifted along the longer side within that margin's slack.
    assert placement.margin == pytest.approx(20.0, abs=1e-3)
    assert abs(placement.pose.angle_deg) == pytest.approx(90.0, abs=0.01)


def test_a_disc_lies_in_the_middle_of_a_triangle() -> None:
    corners = [(0.0, 0.0), (200.0, 0.0), (100.0, 100.0 * math.sqrt(3.0))]
    placement = best_placement(Contour(disc_ring((500.0, 0.0), 10.0)), polygon(corners), Turns.free())
    inradius = 200.0 / (2.0 * math.sqrt(3.0))
    assert placement.margin == pytest.approx(inradius - 10.0, abs=0.003)
    assert placement.pose.moved(np.array([[500.0, 0.0]]))[0] == pytest.approx([100.0, inradius], abs=0.01)


def test_the_tightest_place_lies_on_both_outlines_as_far_apart_as_the_margin() -> None:
    part = l_shape((0.0, 0.0), 150.0, 100.0, 40.0)
    placement = best_placement(part, BLOCK, Turns.free())
    of_part, of_block = (shapely.Point(place) for place in placement.tightest)
    assert shape_of(placement.pose.placed(part)).exterior.distance(of_part) < 1e-6
    assert shape_of(BLOCK).exterior.distance(of_block) < 1e-6
    assert of_part.distance(of_block) == pytest.approx(placement.margin)


@pytest.mark.parametrize("turns", [Turns.steps(1), Turns.steps(4), Turns.steps(7), Turns.free().along(33.0, 2.0)])
def test_only_turns_that_are_allowed_are_taken(turns: Turns) -> None:
    placement = best_placement(rectangle((0.0, 0.0), 120.0, 90.0), BLOCK, turns)
    assert any(
        low - 1e-9 <= angle <= high + 1e-9
        for low, high in turns.intervals
        for angle in (placement.pose.angle + turn for turn in (-2 * math.pi, 0.0, 2 * math.pi))
    )
    assert placement.margin == pytest.approx(margin_by_shapely(rectangle((0.0, 0.0), 120.0, 90.0), BLOCK, placement))


def test_as_drawn_it_is_only_shifted() -> None:
    placement = best_placement(rectangle((0.0, 0.0), 200.0, 100.0), BLOCK, Turns.steps(1))
    assert placement.pose.angle == 0.0
    assert placement.margin == pytest.approx(50.0, abs=1e-3)


def test_a_hole_of_the_block_is_kept_clear_of() -> None:
    block = with_holes(BLOCK, disc_ring((150.0, 100.0), 30.0))
    part = rectangle((0.0, 0.0), 60.0, 60.0)
    placement = best_placement(part, block, Turns.free())
    assert placement.margin == pytest.approx(margin_by_shapely(part, block, placement), abs=1e-9)
    # A strip of 120 mm is left on either side: its middle holds a square of 60 with 30 all around, were there corners.
    assert placement.margin > 25.0


def test_a_small_hole_within_the_parts_material_is_not_overlooked() -> None:
    """No vertex of the part is near it: the part would lie over it in the middle."""
    block = with_holes(BLOCK, disc_ring((150.0, 100.0), 4.0))
    part = rectangle((0.0, 0.0), 280.0, 60.0)
    placement = best_placement(part, block, Turns.free())
    assert placement.margin == pytest.approx(margin_by_shapely(part, block, placement), abs=1e-9)
    assert placement.margin == pytest.approx(10.0, abs=0.01)


def test_a_hole_of_the_block_may_lie_in_one_of_the_parts() -> None:
    block = with_holes(BLOCK, disc_ring((150.0, 100.0), 30.0))
    part = with_holes(rectangle((0.0, 0.0), 280.0, 180.0), disc_ring((0.0, 0.0), 45.0))
    placement = best_placement(part, block, Turns.free())
    assert placement.margin == pytest.approx(10.0, abs=0.01)
    assert placement.margin == pytest.approx(margin_by_shapely(part, block, placement), abs=1e-9)


def test_what_is_too_large_stands_out_by_what_is_said() -> None:
    placement = best_placement(rectangle((0.0, 0.0), 310.0, 190.0), BLOCK, Turns.steps(1))
    assert placement.margin == pytest.approx(-5.0, abs=0.01)


@pytest.mark.parametrize(("width", "height"), [(250.0, 100.0), (900.0, 800.0), (90_000.0, 3.0), (30_000.0, 20_000.0)])
def test_what_is_far_too_large_is_told_to_be_so(width: float, height: float) -> None:
    placement = best_placement(rectangle((0.0, 0.0), width, height), rectangle((0.0, 0.0), 300.0, 50.0), Turns.free())
    assert placement.margin < -20.0


def test_edges_that_cross_with_all_vertices_on_their_right_side_are_seen() -> None:
    """A bar through the gap of a U: its ends lie in both arms, no vertex of the U lies in it."""
    block = u_shape((0.0, 0.0), 300.0, 200.0, 80.0, 80.0)
    bar = rectangle((0.0, 60.0), 260.0, 20.0)
    assert crosses(bar, block)
    placement = best_placement(rectangle((0.0, 0.0), 260.0, 20.0), block, Turns.free())
    assert placement.margin == pytest.approx(
        margin_by_shapely(rectangle((0.0, 0.0), 260.0, 20.0), block, placement), abs=1e-9
    )


def test_rings_may_run_either_way() -> None:
    block = with_holes(BLOCK, disc_ring((60.0, 60.0), 30.0))
    part = l_shape((0.0, 0.0), 150.0, 100.0, 40.0)
    both = [
        best_placement(oriented_contour(part, way), oriented_contour(block, not way), Turns.free()).margin
        for way in (True, False)
    ]
    assert both[0] == pytest.approx(both[1], abs=1e-3)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 10_000), turn=st.floats(-180, 180), scale=st.floats(0.2, 0.6))
def test_the_margin_is_shapelys_and_does_not_depend_on_how_the_part_was_drawn(
    seed: int, turn: float, scale: float
) -> None:
    block, part = convex((100.0, 100.0), 100.0, seed), convex((0.0, 0.0), 100.0 * scale, seed + 1)
    margins = []
    for drawn in (part, moved(part, (370.0, -90.0), turn)):
        placement = best_placement(drawn, block, Turns.free())
        margins.append(placement.margin)
        if placement.margin > 0:
            assert placement.margin == pytest.approx(margin_by_shapely(drawn, block, placement), abs=1e-9)
    assert margins[0] == pytest.approx(margins[1], abs=0.1)


def test_what_is_no_contour_is_refused() -> None:
    bow = polygon([(0.0, 0.0), (10.0, 10.0), (10.0, 0.0), (0.0, 10.0)])
    with pytest.raises(ParameterError, match=r"The part cannot be placed: the exterior meets itself"):
        best_placement(bow, BLOCK, Turns.free())


def test_a_ribbon_that_no_step_lies_along_is_told() -> None:
    with pytest.raises(
        ParameterError, match=r"none of its 4 angles leaves the part within 2 degrees of the ribbon's 45"
    ):
        Turns.steps(4).along(45.0, 2.0)


def test_a_ribbon_has_no_sense() -> None:
    assert len(Turns.steps(4).along(91.0, 2.0).intervals) == 2
    assert Turns.free().along(30.0, 90.0) == Turns.free()


def test_a_pose_moves_there_and_back() -> None:
    pose, points = Pose(3.0, -4.0, 2.0), np.array([[1.0, 2.0], [-5.0, 0.5]])
    assert pose.undone(pose.moved(points)) == pytest.approx(points)
    assert Pose(0.0, 0.0, -math.pi).angle_deg == 180.0
