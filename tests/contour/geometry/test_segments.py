from fractions import Fraction

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from contour.geometry.segments import (
    BoxTree,
    contains,
    distances_to_ring,
    first_meeting,
    near_pairs,
    segments_meet,
    turns,
)
from tests.support.pictures.rings import SQUARE, random_blob, simple_rings

coordinates = st.one_of(st.integers(-3, 3).map(float), st.floats(-1e6, 1e6))
points = st.tuples(coordinates, coordinates).map(np.array)


def pair(value: np.ndarray) -> np.ndarray:
    return value.reshape(1, 2)


def exact_turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> int:
    (ax, ay), (bx, by), (cx, cy) = (map(Fraction, point.tolist()) for point in (a, b, c))
    turn = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (turn > 0) - (turn < 0)


@given(points, points, points)
def test_a_turn_has_the_sign_of_exact_arithmetic(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> None:
    assert turns(pair(a), pair(b), pair(c))[0] == exact_turn(a, b, c)


@pytest.mark.parametrize(("b", "c"), [(12.0, 24.0), (17.3, 7.3 * 17.3), (8.8, 12.1)])
def test_points_a_few_floats_beside_a_line_are_on_their_side(b: float, c: float) -> None:
    # The classic failure of plain float64 (Kettner and others 2008): it sees many of these on the wrong side.
    i, j = (grid.ravel() for grid in np.mgrid[0:32, 0:32])
    beside = np.column_stack([0.5 + i * 2.0**-53, 0.5 + j * 2.0**-53])
    start, end = np.full((len(i), 2), b), np.full((len(i), 2), c)
    exact = [exact_turn(point, np.array([b, b]), np.array([c, c])) for point in beside]
    np.testing.assert_array_equal(turns(beside, start, end), exact)


@given(points, points, points, points)
def test_segments_meet_where_exact_arithmetic_says_so(
    p: np.ndarray, q: np.ndarray, r: np.ndarray, s: np.ndarray
) -> None:
    assume(not (p == q).all() and not (r == s).all())  # the library says no to segments of length 0
    boxes_meet = bool((np.minimum(p, q) <= np.maximum(r, s)).all() and (np.minimum(r, s) <= np.maximum(p, q)).all())
    expected = shapely.LineString([p, q]).intersects(shapely.LineString([r, s]))
    meets = boxes_meet and bool(segments_meet(pair(p), pair(q), pair(r), pair(s))[0])
    assert meets == expected


@given(simple_rings)
def test_every_pair_of_segments_with_meeting_boxes_is_found_once(ring: np.ndarray) -> None:
    tree = BoxTree.of_ring(ring)
    low, high = tree.levels[0]
    meets = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
    expected = {(int(i), int(j)) for i, j in np.argwhere(np.triu(meets, 1))}
    found = [(int(i), int(j)) for chunk in near_pairs(tree) for i, j in zip(*chunk, strict=True)]
    assert len(found) == len(set(found))
    assert set(found) == expected


def test_rings_of_very_different_lengths_are_compared_too() -> None:
    ring = random_blob(3)
    x, y = ring[len(ring) // 2]
    through = np.array([[x - 0.3, y - 200.0], [x + 0.3, y - 200.0], [x + 0.4, y + 200.0]])
    assert first_meeting(BoxTree.of_ring(ring), BoxTree.of_ring(through)) is not None
    assert first_meeting(BoxTree.of_ring(through), BoxTree.of_ring(ring)) is not None
    assert first_meeting(BoxTree.of_ring(ring), BoxTree.of_ring(through + 1000.0)) is None


@given(simple_rings, st.lists(st.tuples(st.floats(-150, 150), st.floats(-150, 150)), min_size=1, max_size=20))
def test_distances_and_containment_agree_with_an_independent_library(
    ring: np.ndarray, places: list[tuple[float, float]]
) -> None:
    where = np.array(places)
    polygon = shapely.Polygon(ring)
    expected = shapely.distance(polygon.exterior, shapely.points(where))
    np.testing.assert_allclose(distances_to_ring(where, ring), expected, atol=1e-9)
    clear = expected > 1e-6
    np.testing.assert_array_equal(contains(ring, where)[clear], shapely.contains_xy(polygon, where)[clear])


def test_many_points_are_measured_in_parts_without_a_seam() -> None:
    where = np.column_stack([np.linspace(-5, 15, 40_000), np.full(40_000, -2.0)])
    expected = np.hypot(np.maximum(np.maximum(-where[:, 0], where[:, 0] - 10), 0), 2.0)
    np.testing.assert_allclose(distances_to_ring(where, SQUARE), expected)
