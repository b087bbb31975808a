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


def test_the_nearest_of_none_is_infinitely_far() -> None:
    assert np.isinf(nearest(np.zeros((3, 2)), np.empty((0, 2)))).all()
    many = np.column_stack([np.arange(1000.0), np.zeros(1000)])
    assert np.allclose(nearest(many, many[::2]), np.arange(1000) % 2)
