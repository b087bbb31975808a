import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contour.errors import ParameterError
from contour.geometry.rings import Contour, contour_defect, densified
from contour.polygon.vertex_budget import lies_within, within_budget
from tests.support.pictures.rings import SQUARE, alike, contours, solid

BLOCK = densified(SQUARE * [40, 30], 5.0)


@settings(max_examples=60)
@given(contours(), st.floats(0.3, 10.0), st.floats(0.1, 0.9))
def test_the_smaller_contour_never_leaves_the_traced_one_and_keeps_the_bound(
    contour: Contour, bound: float, share: float
) -> None:
    got = within_budget(contour, max(int(contour.point_count * share), 3), bound)
    # By another library, which rounds: 1e-9 of a unit.
    assert solid(got.contour).difference(solid(contour).buffer(1e-9)).area < 1e-9
    assert contour_defect(got.contour) is None
    assert len(got.contour.holes) == len(contour.holes)
    for traced, smaller in zip(contour.rings, got.contour.rings, strict=True):
        assert alike(traced, smaller, got.shift)
    if got.fits:
        assert got.shift <= bound
        assert got.contour.point_count <= max(int(contour.point_count * share), 3)


def test_a_dense_rectangle_needs_four_vertices_and_gives_up_nothing() -> None:
    got = within_budget(Contour(BLOCK), 4, 0.1)
    assert (len(got.contour.exterior), got.fits) == (4, True)
    assert got.shift < 0.01


def test_an_arc_bent_outwards_is_cut_by_chords_and_one_bent_inwards_by_tangents() -> None:
    angle = np.linspace(0, 2 * np.pi, 360, endpoint=False)
    disc = np.column_stack([np.cos(angle), np.sin(angle)]) * 100
    frame = Contour(SQUARE * 40 - 200, (disc[::-1],))
    outwards, inwards = within_budget(Contour(disc), 40, 1.0), within_budget(frame, 64, 1.0)
    assert outwards.fits
    assert inwards.fits
    assert np.hypot(*outwards.contour.exterior.T).max() <= 100 * (1 + 1e-12)
    # A polygon of 360 corners lies 0.004 inside of its circle.
    assert np.hypot(*inwards.contour.holes[0].T).min() > 99.99


def test_what_the_bound_does_not_allow_is_told() -> None:
    got = within_budget(Contour(np.array([[0.0, 0], [100, 0], [100, 100], [50, 80], [0, 100]])), 3, 0.5)
    assert not got.fits
    assert got.contour.point_count == 5


def test_a_hole_in_a_corner_that_would_be_cut_off_is_not_lost() -> None:
    corner = np.array([[0.0, 0], [100, 0], [100, 100], [97, 103], [0, 103]])
    hole = SQUARE[::-1] * 0.03 + np.array([98.2, 100.9])
    contour = Contour(corner, (hole,))
    assert contour_defect(contour) is None
    got = within_budget(contour, 8, 5.0)
    assert contour_defect(got.contour) is None
    assert lies_within(contour, got.contour)


def test_a_contour_that_leaves_another_is_seen_to() -> None:
    outer = Contour(SQUARE * 10, (SQUARE[::-1] + 45,))
    for rings in (
        Contour(SQUARE * 10 + [1, 0]),
        Contour(SQUARE * 2 + [40, 40]),
        Contour(SQUARE * 11 - 5),
        Contour(SQUARE + 200),
    ):
        assert not lies_within(outer, rings)
    assert lies_within(outer, outer)


@pytest.mark.parametrize("bound", [0.0, -1.0, float("nan")])
def test_a_bound_that_is_none_is_refused(bound: float) -> None:
    with pytest.raises(ParameterError, match="bound is"):
        within_budget(Contour(BLOCK), 4, bound)


def test_a_crossed_contour_has_no_inside() -> None:
    with pytest.raises(ParameterError, match="no inside"):
        within_budget(Contour(densified(SQUARE[[0, 2, 1, 3]], 1.0)), 4, 1.0)
