"""How well outlines agree: what a person computes by hand, and what shapely does."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from contour.geometry.agreement import agreement as figures
from contour.geometry.agreement import distances_to, intersection_over_union, places_along, rectified_edges
from contour.geometry.rings import Contour, densified
from contour.synthetic import blob, disc_ring, rectangle, with_holes
from tests.support.scenes.metrics import agreement
from tests.support.scenes.sample_scenes import CAMERA, THICKNESS_MM


def square(left, top, side):
    """Counter-clockwise as seen, y down."""
    return np.array([[left, top], [left, top + side], [left + side, top + side], [left + side, top]], dtype=float)


def test_a_contour_agrees_with_itself_wholly():
    found = agreement(Contour(square(10, 10, 100)), Contour(square(10, 10, 100)))
    assert (found.mean_px, found.p95_px, found.hausdorff_px) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert found.bias_px == pytest.approx(0.0, abs=1e-12)
    assert found.iou == pytest.approx(1.0)
    assert found.vertices == 4


def test_a_square_two_pixels_larger_all_around_is_two_pixels_outside():
    found = agreement(Contour(square(8, 8, 104)), Contour(square(10, 10, 100)))
    # of the larger square's 416 px only 4 x 4 lie beyond the smaller one's corners: 2 to 2.83 px away
    assert found.mean_px == pytest.approx(2.0, abs=0.02)
    assert found.bias_px == pytest.approx(2.0, abs=0.02)
    assert found.p95_px == pytest.approx(2.0, abs=0.05)
    assert found.hausdorff_px == pytest.approx(np.sqrt(8.0), abs=0.2)
    assert found.iou == pytest.approx(100.0**2 / 104.0**2)


def test_a_square_three_pixels_smaller_is_three_pixels_inside():
    found = agreement(Contour(square(13, 13, 94)), Contour(square(10, 10, 100)))
    assert found.bias_px == pytest.approx(-3.0, abs=0.05)
    assert found.mean_px == pytest.approx(3.0, abs=0.05)


def test_a_square_moved_by_one_pixel_has_no_bias_and_half_a_pixel_of_mean_error():
    found = agreement(Contour(square(11, 10, 100)), Contour(square(10, 10, 100)))
    # two of four sides are 1 px away, the other two lie on the truth
    assert found.mean_px == pytest.approx(0.5, abs=0.01)
    assert found.bias_px == pytest.approx(0.0, abs=0.01)
    assert found.hausdorff_px == pytest.approx(1.0, abs=0.01)
    assert found.iou == pytest.approx(99.0 / 101.0)


def test_a_hole_left_out_is_seen_from_the_truths_side():
    hole = square(40, 40, 20)[::-1]
    found = agreement(Contour(square(0, 0, 100)), Contour(square(0, 0, 100), (hole,)))
    # 80 of 480 px of truth are the hole's, each 40 to 50 px from the outer edge
    assert found.mean_px == pytest.approx(80 / 480 * 40.0, rel=0.01)
    assert found.hausdorff_px == pytest.approx(40.0, abs=0.5)
    assert found.bias_px == pytest.approx(0.5 * 80 / 480 * 40.0, rel=0.02)
    assert found.iou == pytest.approx(0.96)


def test_a_hole_found_too_small_counts_as_outside_because_the_material_is_too_much():
    truth = Contour(square(0, 0, 100), (square(40, 40, 20)[::-1],))
    found = agreement(Contour(square(0, 0, 100), (square(41, 41, 18)[::-1],)), truth)
    assert found.bias_px > 0.1


def test_one_spike_moves_the_hausdorff_distance_and_little_else():
    ring = np.insert(densified(square(0, 0, 100), 1.0), 50, [[-20.0, 50.0]], axis=0)
    found = agreement(Contour(ring), Contour(square(0, 0, 100)))
    assert found.hausdorff_px == pytest.approx(20.0, abs=0.5)
    assert found.mean_px < 2.0


def test_distances_are_those_to_the_nearest_edge_not_vertex():
    points = np.array([[50.0, -7.0], [50.0, 30.0], [110.0, 110.0]])
    assert np.allclose(distances_to(points, Contour(square(0, 0, 100))), [7.0, 30.0, np.sqrt(200.0)])


def test_samples_count_every_ring_by_its_length():
    contour = Contour(square(0, 0, 100), (square(40, 40, 20)[::-1],))
    assert len(places_along(contour, 0.5)) == 800 + 160


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.floats(-3.0, 3.0).filter(lambda v: abs(v) > 0.05))
def test_a_disc_grown_by_a_known_width_shows_it_as_mean_and_bias(seed, width):
    radius = 60.0 + seed % 40
    truth = Contour(disc_ring((100.0, 100.0), radius)[::-1])
    found = agreement(Contour(disc_ring((100.0, 100.0), radius + width)[::-1]), truth)
    assert found.mean_px == pytest.approx(abs(width), abs=0.01)
    assert found.bias_px == pytest.approx(width, abs=0.01)
    assert found.hausdorff_px == pytest.approx(abs(width), abs=0.01)


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 1000), st.integers(0, 1000))
def test_mean_hausdorff_and_overlap_do_not_depend_on_which_is_the_truth(a, b):
    one, two = blob((100.0, 100.0), 60.0, a), blob((102.0, 99.0), 58.0, b)
    forth, back = agreement(one, two), agreement(two, one)
    assert forth.mean_px == pytest.approx(back.mean_px)
    assert forth.hausdorff_px == pytest.approx(back.hausdorff_px)
    assert forth.iou == pytest.approx(back.iou)
    assert forth.bias_px == pytest.approx(-back.bias_px, abs=1e-9)


class PlaneOfSamples:
    """The sample camera's top plane, y down, in units of a third of a millimetre."""

    def rectify(self, points_px):
        return CAMERA.back_project(points_px, THICKNESS_MM) * [3.0, -3.0]

    def unrectify(self, points):
        return CAMERA.project(points / [3.0, -3.0], THICKNESS_MM)


def test_four_corners_found_through_a_lens_agree_with_the_curved_truth_when_edges_are_straight_in_the_plane():
    outline = with_holes(rectangle((300.0, 225.0), 480.0, 330.0, 4.0), disc_ring((300.0, 225.0), 40.0))
    truth = CAMERA.project_contour(outline, THICKNESS_MM, 0.5)
    corners = CAMERA.project_contour(outline, THICKNESS_MM, 1e9)
    in_pixels = agreement(corners, truth)
    in_plane = agreement(corners, truth, rectifier=PlaneOfSamples())
    assert in_plane.mean_px < 0.01
    assert in_plane.hausdorff_px < 0.02
    assert in_pixels.hausdorff_px > 1.0
    assert in_plane.vertices == corners.point_count
    assert rectified_edges(corners, PlaneOfSamples()).point_count > 300


def test_a_contour_that_crosses_itself_is_still_measured():
    bow = np.array([[0.0, 0.0], [100.0, 100.0], [100.0, 0.0], [0.0, 100.0]])
    found = agreement(Contour(bow), Contour(square(0, 0, 100)))
    assert found.iou == pytest.approx(0.5, abs=0.01)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 1000), st.integers(0, 1000), st.floats(-80.0, 80.0), st.booleans())
def test_the_overlap_is_that_of_shapely(a, b, right, holed):
    one, two = blob((100.0, 100.0), 60.0, a), blob((100.0 + right, 99.0), 58.0, b)
    if holed:
        one = with_holes(one, disc_ring((100.0, 100.0), 20.0)[::-1])
    polygons = [shapely.Polygon(contour.exterior, contour.holes) for contour in (one, two)]
    expected = shapely.area(shapely.intersection(*polygons)) / shapely.area(shapely.union(*polygons))
    assert intersection_over_union(one, two) == pytest.approx(expected, abs=1e-9)


def test_outlines_apart_from_each_other_or_without_area_have_nothing_in_common():
    assert intersection_over_union(Contour(square(0, 0, 10)), Contour(square(20, 0, 10))) == 0.0
    assert intersection_over_union(Contour(square(0, 0, 0)), Contour(square(0, 0, 0))) == 0.0


def test_a_bound_holds_where_95_per_cent_of_the_truth_lie_within_it():
    truth = square(0, 0, 100)
    notched = np.insert(truth, 1, [[0, 40], [10, 40], [10, 52], [0, 52]], axis=0)  # 12 of 400 px of truth are lost
    found = figures(Contour(notched), Contour(truth))
    assert (found.holds(0.01), found.hausdorff_px) == (True, pytest.approx(10.0, abs=0.3))
    moved = figures(Contour(square(1, 0, 100)), Contour(truth))
    assert (moved.holds(0.99), moved.holds(1.01)) == (False, True)
