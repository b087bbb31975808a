import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from contour.geometry.rings import Ring, densified, is_simple, signed_area
from contour.geometry.simplification import simplify_indices
from tests.support.pictures.rings import SQUARE, alike, blobs, random_blob, simple_rings, star

tolerances = st.floats(0.01, 60.0)


def both_ways(a: Ring, b: Ring) -> float:
    """Two-sided Hausdorff distance by an independent library; fine enough for the tolerances here."""
    return float(shapely.hausdorff_distance(shapely.LinearRing(a), shapely.LinearRing(b), densify=0.05))


@settings(max_examples=60)
@given(simple_rings, tolerances)
def test_the_bound_holds_both_ways(ring: np.ndarray, tolerance: float) -> None:
    kept = ring[simplify_indices(ring, tolerance)]
    assert both_ways(ring, kept) <= tolerance * (1 + 1e-9) + 1e-9
    assert alike(ring, kept, tolerance)


@given(simple_rings, tolerances)
def test_a_simple_ring_stays_simple_with_three_vertices_or_more(ring: np.ndarray, tolerance: float) -> None:
    indices = simplify_indices(ring, tolerance)
    assert len(indices) >= 3
    assert (np.diff(indices) > 0).all()
    assert is_simple(ring[indices])


@given(simple_rings, tolerances)
def test_the_direction_stays(ring: np.ndarray, tolerance: float) -> None:
    kept = ring[simplify_indices(ring, tolerance)]
    assert (signed_area(kept) > 0) == (signed_area(ring) > 0)


@settings(max_examples=60)
@given(blobs, st.floats(0.3, 10.0), st.integers(1, 10_000))
def test_the_number_of_vertices_does_not_depend_on_where_the_ring_starts(
    ring: np.ndarray, tolerance: float, shift: int
) -> None:
    turned = np.roll(ring, shift % len(ring), axis=0)
    first = {tuple(vertex) for vertex in ring[simplify_indices(ring, tolerance)].tolist()}
    second = {tuple(vertex) for vertex in turned[simplify_indices(turned, tolerance)].tolist()}
    assert first == second


def fewest_by_trial(ring: Ring, tolerance: float) -> int:
    """Fewest vertices of any choice whose every stretch stays within the tolerance of its segment, from any start."""
    count, best = len(ring), len(ring)
    for start in range(count):
        path = [*range(start, count), *range(start + 1)]
        cost = [0.0] + [np.inf] * count
        for j in range(1, count + 1):
            for i in range(j):
                segment = shapely.LineString([ring[path[i]], ring[path[j]]]) if j - i < count else None
                between = shapely.points(ring[path[i + 1 : j]])
                if segment is not None and (shapely.distance(segment, between) <= tolerance + 1e-9).all():
                    cost[j] = min(cost[j], cost[i] + 1)
        best = min(best, int(cost[count]))
    return max(best, 3)


@settings(max_examples=30)
@given(st.lists(st.floats(2.0, 10.0), min_size=4, max_size=11).map(star), st.floats(0.2, 4.0))
def test_there_is_at_most_one_vertex_more_than_the_fewest_possible(ring: np.ndarray, tolerance: float) -> None:
    kept = ring[simplify_indices(ring, tolerance)]
    fewest = fewest_by_trial(ring, tolerance)
    # Where the fewest would meet themselves, vertices had to be put back: nothing to compare with.
    assert fewest <= len(kept) <= fewest + 1


@given(blobs, st.floats(0.3, 1.5))
def test_there_are_no_more_vertices_than_douglas_peucker_keeps(ring: np.ndarray, tolerance: float) -> None:
    # Larger tolerances tangle these small rings, and vertices have to be put back.
    other = shapely.LinearRing(ring).simplify(tolerance, preserve_topology=False)
    assume(both_ways(ring, np.array(other.coords)) <= tolerance)
    assert len(simplify_indices(ring, tolerance)) <= max(len(other.coords) - 1, 3) + 1


@pytest.mark.parametrize("turn", np.linspace(0, 1.5, 7))
def test_a_dense_rectangle_becomes_its_four_corners(turn: float) -> None:
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    dense = densified(SQUARE * [16, 10] @ rotation.T, 0.25)
    rng = np.random.default_rng(5)
    shaken = dense + rng.uniform(-0.05, 0.05, dense.shape)
    assert len(simplify_indices(dense, 0.05)) == 4
    assert len(simplify_indices(np.roll(shaken, 333, axis=0), 0.25)) == 4


def test_a_staircase_within_the_tolerance_becomes_straight() -> None:
    steps = np.repeat(np.arange(200.0), 2)
    stair = np.column_stack([steps[1:], steps[:-1]])
    ring = np.vstack([stair, [[0.0, 199.0]]])
    assert len(simplify_indices(ring, 0.75)) == 3
    assert len(simplify_indices(ring, 0.0)) == len(ring)


def test_a_tolerance_larger_than_the_ring_leaves_a_triangle() -> None:
    ring = random_blob(1)
    kept = ring[simplify_indices(ring, 1e6)]
    assert len(kept) == 3
    assert is_simple(kept)


def test_a_path_that_doubles_back_beyond_a_chord_keeps_its_bound() -> None:
    # The stretch overshoots both ends of its chord: distance to the line through the chord would say 0.1.
    ring = np.array([[0, 0], [10, 0], [10, 0.1], [-8, 0.1], [-8, 0.2], [10, 0.2], [10, 5], [0, 5]], dtype=np.float64)
    kept = ring[simplify_indices(ring, 0.5)]
    assert both_ways(ring, kept) <= 0.5


def test_a_narrow_channel_does_not_close() -> None:
    # A slot 0.4 wide whose two ragged walls may each move by 0.5: alone they would cross.
    x = np.arange(0, 100, 1.0)
    lower = np.column_stack([x, 10 + 0.45 * (-1.0) ** x])
    upper = lower[::-1] + np.array([0.0, 0.4])
    ring = np.vstack([[[-20, 0], [120, 0], [120, 9.0]], lower[::-1], [[-1, 10.2]], upper[::-1], [[120, 30], [-20, 30]]])
    assert is_simple(ring)
    kept = ring[simplify_indices(ring, 0.5)]
    assert is_simple(kept)
    assert both_ways(ring, kept) <= 0.5 + 1e-9


def test_a_ring_of_fifty_thousand_vertices_is_simplified() -> None:
    angle = np.linspace(0, 2 * np.pi, 50_000, endpoint=False)
    radius = 800 + 90 * np.cos(3 * angle) + 30 * np.sin(11 * angle)
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * radius[:, None]
    indices = simplify_indices(ring, 0.2)
    assert len(indices) < len(shapely.LinearRing(ring).simplify(0.2).coords)
    assert alike(ring, ring[indices], 0.2)


def test_a_ring_that_meets_itself_is_simplified_without_a_hang() -> None:
    t = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    ring = np.column_stack([np.sin(2 * t), np.sin(t)]) * 50
    indices = simplify_indices(ring, 0.5)
    assert 3 <= len(indices) < 100
