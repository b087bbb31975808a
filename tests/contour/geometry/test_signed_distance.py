"""Depth inside a ring, against an independent reading."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from shapely import LinearRing, Point, Polygon

from contour.geometry.signed_distance import depth_inside, nearest

RING = np.array([[0.0, 0.0], [10.0, 1.0], [9.0, 8.0], [5.0, 3.0], [1.0, 9.0]])


@given(x=st.floats(-5, 15), y=st.floats(-5, 15), turned=st.booleans())
def test_depth_is_the_distance_from_the_ring_with_the_side_as_its_sign(x: float, y: float, turned: bool) -> None:
    ring = RING[::-1] if turned else RING
    point = Point(x, y)
    distance = LinearRing(RING).distance(point)
    found = float(depth_inside(ring, np.array([[x, y]]))[0])
    assert np.isclose(abs(found), distance, atol=1e-6)
    if distance > 1e-6:
        assert (found > 0) == Polygon(RING).contains(point)


@given(seed=st.integers(0, 2**32 - 1), whole=st.booleans(), sides=st.sampled_from([100, 140, 400, 3000]))
def test_of_a_long_ring_only_near_sides_are_asked_and_the_depth_is_the_same(seed: int, whole: bool, sides: int) -> None:
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, sides))
    radius = 200.0 + 60.0 * np.sin(7.0 * angle) + rng.normal(0.0, 3.0, sides)
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    near = ring[rng.integers(0, sides, 200)] + rng.normal(0.0, 4.0, (200, 2))
    points = np.concatenate([near, rng.uniform(-400.0, 400.0, (100, 2))])
    if whole:  # pixels, of which many lie level with the ends of sides
        ring, points = np.round(ring), np.round(points)
    depth = depth_inside(ring, points)
    outline = LinearRing(ring)
    distance = np.array([outline.distance(Point(*point)) for point in points])
    assert np.allclose(np.abs(depth), distance, atol=1e-9)
    off = distance > 1e-9
    if outline.is_simple:  # rounded ones mostly are not
        inside = np.array([Polygon(ring).contains(Point(*point)) for point in points])
        assert np.array_equal(depth[off] > 0.0, inside[off])


def test_the_nearest_of_none_is_infinitely_far() -> None:
    assert np.isinf(nearest(np.zeros((3, 2)), np.empty((0, 2)))).all()
    many = np.column_stack([np.arange(1000.0), np.zeros(1000)])
    assert np.allclose(nearest(many, many[::2]), np.arange(1000) % 2)
