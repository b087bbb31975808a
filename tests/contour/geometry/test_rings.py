import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from contour.geometry.rings import (
    Contour,
    area,
    bounding_box,
    contour_defect,
    densified,
    hausdorff,
    is_simple,
    largest_loop,
    oriented,
    oriented_contour,
    perimeter,
    signed_area,
)
from tests.support.pictures.rings import SQUARE, random_blob, simple_rings, star

hole = SQUARE[::-1] * 0.2 + 4.0


@given(simple_rings, st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_area_is_the_shoelace_area_wherever_the_ring_lies(ring: np.ndarray, x: float, y: float) -> None:
    expected = shapely.Polygon(ring).area
    assert abs(signed_area(ring + np.array([x, y]))) == pytest.approx(expected, rel=1e-6, abs=1e-4)


def test_counter_clockwise_is_positive_for_y_up() -> None:
    assert signed_area(SQUARE) == 100.0
    assert signed_area(SQUARE[::-1]) == -100.0


@given(simple_rings, st.booleans())
def test_orienting_keeps_the_first_vertex_and_the_shape(ring: np.ndarray, wanted: bool) -> None:
    turned = oriented(ring, wanted)
    assert (signed_area(turned) > 0) == wanted
    np.testing.assert_array_equal(turned[0], ring[0])
    assert abs(signed_area(turned)) == pytest.approx(abs(signed_area(ring)))
    np.testing.assert_array_equal(oriented(turned, wanted), turned)


def test_holes_turn_against_the_exterior() -> None:
    contour = oriented_contour(Contour(SQUARE[::-1], (hole[::-1],)), counter_clockwise=True)
    assert signed_area(contour.exterior) > 0
    assert signed_area(contour.holes[0]) < 0
    assert area(contour) == 96.0


def test_box_and_perimeter_of_a_square() -> None:
    box = bounding_box(SQUARE + np.array([1, 2]))
    assert (box.min_x, box.min_y, box.max_x, box.max_y) == (1, 2, 11, 12)
    assert (box.width, box.height) == (10, 10)
    assert perimeter(SQUARE) == 40


@given(simple_rings)
def test_simple_rings_are_simple(ring: np.ndarray) -> None:
    assert is_simple(ring)


@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=3, max_size=9))
def test_simplicity_on_a_grid_agrees_with_an_independent_library(corners: list[tuple[int, int]]) -> None:
    ring = np.array(corners, dtype=np.float64)
    repeated = (ring == np.roll(ring, 1, axis=0)).all(axis=1).any()
    # GEOS tolerates a vertex given twice in a row, a cutting path should not hold one.
    expected = not repeated and shapely.LinearRing(ring).is_simple and shapely.Polygon(ring).area > 0
    assert is_simple(ring) == expected


@pytest.mark.parametrize(
    ("name", "ring"),
    [
        ("bow tie", [[0, 0], [10, 10], [10, 0], [0, 10]]),
        ("vertex touches an edge", [[0, 0], [10, 0], [10, 10], [5, 0], [0, 10]]),
        ("vertex given twice", [[0, 0], [10, 0], [10, 0], [10, 10]]),
        ("first vertex repeated at the end", [[0, 0], [10, 0], [10, 10], [0, 0]]),
        ("two loops that share a vertex", [[0, 0], [5, 5], [10, 0], [10, 10], [5, 5], [0, 10]]),
        ("spike that folds back", [[0, 0], [10, 0], [15, 0], [10, 0], [10, 10]]),
        ("edges that overlap", [[0, 0], [10, 0], [10, 5], [7, 0], [3, 0], [0, 5]]),
        ("needle", [[0, 0], [10, 0], [5, 0]]),
        ("two vertices", [[0, 0], [10, 0]]),
    ],
)
def test_a_ring_that_meets_itself_is_not_simple(name: str, ring: list[list[float]]) -> None:
    assert not is_simple(np.array(ring, dtype=np.float64)), name


def test_a_gap_of_one_float_is_a_gap() -> None:
    ring = np.array([[0, 0], [10, 0], [10, 10], [5, 5e-324], [0, 10]], dtype=np.float64)
    assert is_simple(ring)
    ring[3, 1] = 0.0
    assert not is_simple(ring)


def test_a_vertex_that_is_not_a_number_is_a_defect() -> None:
    ring = SQUARE.copy()
    ring[2, 0] = np.nan
    assert "not finite" in (contour_defect(Contour(ring)) or "")


def test_one_crossing_in_twenty_thousand_vertices_is_found() -> None:
    angle = np.linspace(0, 2 * np.pi, 20_000, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * 1000
    assert is_simple(ring)
    ring[[7000, 7001]] = ring[[7001, 7000]]
    assert not is_simple(ring)


def test_a_dense_straight_sided_ring_is_simple() -> None:
    # All vertices of a side on one line: nothing but exact arithmetic tells touching from running on.
    assert is_simple(densified(SQUARE * 100, 0.25))


@pytest.mark.parametrize(
    ("holes", "words"),
    [
        ((hole,), None),
        ((hole + 20,), "hole 1 lies outside the exterior"),
        ((hole + 5,), "the exterior and hole 1 meet"),
        ((hole + np.array([6, 0]),), "the exterior and hole 1 meet"),
        ((hole, hole + 0.5), "the hole 1 and hole 2 meet"),
        ((hole, (hole - 5) * 0.5 + 5), "the hole 2 lies inside the hole 1"),
        (((hole - 5) * 0.5 + 5, hole), "the hole 1 lies inside the hole 2"),
        ((hole[:2],), "hole 1 has 2 vertices"),
        ((SQUARE * 3 - 10,), "hole 1 lies outside the exterior"),
    ],
)
def test_a_contour_says_what_makes_it_unfit(holes: tuple[np.ndarray, ...], words: str | None) -> None:
    defect = contour_defect(Contour(SQUARE, holes))
    assert (defect is None) if words is None else (words in (defect or ""))


def test_hausdorff_of_a_shifted_square_is_the_shift() -> None:
    assert hausdorff(SQUARE, SQUARE + np.array([0.5, 0]), 0.1) == pytest.approx(0.5)
    assert hausdorff(SQUARE, np.vstack([SQUARE, [[-3, 5]]]), 0.1) == pytest.approx(3.0)


@given(simple_rings, simple_rings)
def test_hausdorff_is_within_half_a_spacing_of_a_fine_one(a: np.ndarray, b: np.ndarray) -> None:
    fine = shapely.hausdorff_distance(shapely.LinearRing(a), shapely.LinearRing(b), densify=0.02)
    assert hausdorff(a, b, 0.5) >= fine - 0.25 - 1e-9


@given(simple_rings, st.floats(0.3, 20))
def test_densifying_keeps_vertices_and_the_curve(ring: np.ndarray, spacing: float) -> None:
    dense = densified(ring, spacing)
    steps = np.roll(dense, -1, axis=0) - dense
    assert np.hypot(*steps.T).max() <= spacing * (1 + 1e-9)
    assert {tuple(vertex) for vertex in ring.tolist()} <= {tuple(vertex) for vertex in dense.tolist()}
    assert abs(signed_area(dense)) == pytest.approx(abs(signed_area(ring)))


def test_filaments_and_pinches_are_cut_off_to_the_largest_loop() -> None:
    square = SQUARE.tolist()
    spike = [[10.0, 0.0], [11.0, 0.0], [12.0, 0.0], [11.0, 0.0], [10.0, 0.0]]
    pinched = [[10.0, 10.0], [11.0, 11.0], [12.0, 10.0], [11.0, 9.0], [10.0, 10.0]]
    ring = np.array([square[0], *spike, *pinched, square[3]])
    assert not is_simple(ring)
    loop = largest_loop(ring)
    assert is_simple(loop)
    assert signed_area(loop) == 100.0


@given(st.integers(0, 2000))
def test_the_largest_loop_of_any_pixel_outline_is_simple(seed: int) -> None:
    assert is_simple(random_blob(seed, 24))


def test_a_simple_ring_is_its_own_largest_loop() -> None:
    ring = star([3.0, 5.0, 4.0, 6.0, 2.0])
    assert largest_loop(ring) is ring
