"""Places on a ring by their length along it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contour.geometry.ring_lengths import RingLengths
from contour.geometry.segments import distances_to_ring
from tests.support.pictures.rings import SQUARE, star


def test_lengths_go_around_from_the_first_vertex() -> None:
    square = RingLengths.of(SQUARE)
    assert square.length == 40.0
    points = square.at(np.array([0.0, 4.0, 10.0, 36.0, 40.0, 52.0, -5.0]))
    assert points.tolist() == [[0, 0], [4, 0], [10, 0], [0, 4], [0, 0], [10, 2], [0, 5]]


def test_the_rings_end_lies_on_its_last_edge() -> None:
    edge, share = RingLengths.of(SQUARE).places(np.array([0.0, 10.0, 40.0]))
    assert (edge.tolist(), share.tolist()) == ([0, 1, 3], [0.0, 0.0, 1.0])


def test_along_one_edge_it_ends_where_the_edge_does() -> None:
    edge = np.array([1, 1, 1])
    points = np.array([[12.0, -3.0], [9.0, 4.0], [8.0, 30.0]])
    assert RingLengths.of(SQUARE).along_edge(edge, points).tolist() == [10.0, 14.0, 20.0]


def test_a_path_has_both_ends_and_the_vertices_between() -> None:
    square = RingLengths.of(SQUARE)
    assert square.path(4.0, 22.0).tolist() == [[4, 0], [10, 0], [10, 10], [8, 10]]
    assert square.path(30.0, 40.0).tolist() == [[0, 10], [0, 0]]


def test_a_vertex_given_twice_does_no_harm() -> None:
    ring = RingLengths.of(SQUARE[[0, 1, 1, 2, 3]])
    assert ring.at(np.array([10.0, 15.0])).tolist() == [[10, 0], [10, 5]]
    assert ring.feet(np.array([[11.0, -1.0]])).tolist() == [10.0]


@given(
    st.lists(st.floats(1.0, 5.0), min_size=3, max_size=60),
    st.lists(st.tuples(st.floats(-6.0, 6.0), st.floats(-6.0, 6.0)), min_size=1, max_size=300),
)
def test_the_foot_is_the_nearest_place(radii: list[float], where: list[tuple[float, float]]) -> None:
    ring = RingLengths.of(star(radii))
    points = np.array(where)
    apart = np.hypot(*(ring.at(ring.feet(points)) - points).T)
    assert apart == pytest.approx(distances_to_ring(points, ring.ring), abs=1e-9)
