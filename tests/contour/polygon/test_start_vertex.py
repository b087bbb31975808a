import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contour.geometry.rings import Contour
from contour.polygon.start_vertex import Start, begun_at, first_vertices
from tests.support.pictures.rings import SQUARE, stars

DIAMOND = np.array([[0.0, -50], [50, 0], [0, 50], [-50, 0]])


@pytest.mark.parametrize(
    ("start", "place"),
    [
        ("lower-left", (0, 0)),
        ("lower-right", (10, 0)),
        ("upper-left", (0, 10)),
        ("upper-right", (10, 10)),
        ((12.0, 6.0), (10, 10)),
        ((-3.0, 20.0), (0, 10)),
    ],
)
@pytest.mark.parametrize("turned", range(4))
def test_a_ring_begins_at_the_corner_or_the_nearest_vertex(start: Start, place: tuple[int, int], turned: int) -> None:
    ring = np.roll(SQUARE, turned, axis=0)
    contour = begun_at(Contour(ring), first_vertices(Contour(ring), start, 0.5))
    assert tuple(contour.exterior[0]) == place


@given(stars, st.sampled_from(["lower-left", "upper-right", (300.0, 20.0)]), st.integers(0, 60))
def test_where_the_ring_was_begun_before_makes_no_difference(ring: np.ndarray, start: Start, turned: int) -> None:
    again = np.roll(ring, turned, axis=0)
    one, two = (begun_at(Contour(r), first_vertices(Contour(r), start, 1.0)) for r in (ring, again))
    np.testing.assert_array_equal(one.exterior, two.exterior)


@given(st.integers(0, 1000))
def test_noise_does_not_move_the_start_between_two_corners_that_are_as_good(seed: int) -> None:
    # Both the lowest and the leftmost corner of a diamond are farthest to the lower left.
    ring = DIAMOND + np.random.default_rng(seed).uniform(-0.2, 0.2, (4, 2))
    assert first_vertices(Contour(ring), "lower-left", 1.0) == [3]


def test_each_hole_begins_at_its_own_corner() -> None:
    contour = Contour(SQUARE * 10, (SQUARE[::-1] + 40,))
    assert tuple(begun_at(contour, first_vertices(contour, "lower-left", 1.0)).holes[0][0]) == (40, 40)
