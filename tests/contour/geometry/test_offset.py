import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from contour.errors import MarginImpossible, ParameterError
from contour.geometry.offset import offset_contour
from contour.geometry.rings import Contour, area, contour_defect, densified, signed_area
from tests.support.pictures.rings import SQUARE, contours, solid, star

BLOCK = SQUARE * [40, 30]
OPENING = SQUARE[::-1] * 8 + [100, 100]
margins = st.floats(0.01, 15.0)


def moved_or_refused(contour: Contour, margin: float) -> Contour | None:
    try:
        return offset_contour(contour, margin)
    except MarginImpossible:
        return None


def test_a_rectangle_with_an_opening_shrinks_and_its_opening_grows_with_sharp_corners() -> None:
    moved = offset_contour(Contour(BLOCK, (OPENING,)), 5.0)
    assert sorted(map(tuple, moved.exterior.round(6))) == [(5, 5), (5, 295), (395, 5), (395, 295)]
    assert sorted(map(tuple, moved.holes[0].round(6))) == [(95, 95), (95, 185), (185, 95), (185, 185)]
    assert signed_area(moved.exterior) > 0 > signed_area(moved.holes[0])


def test_a_negative_margin_goes_the_other_way() -> None:
    moved = offset_contour(Contour(BLOCK, (OPENING,)), -5.0)
    assert area(moved) == pytest.approx(410 * 310 - 70 * 70)


@settings(max_examples=60)
@given(contours(), margins)
def test_inwards_no_point_comes_nearer_to_the_edge_than_the_margin_and_little_else_is_lost(
    contour: Contour, margin: float
) -> None:
    moved = moved_or_refused(contour, margin)
    if moved is None:
        return
    # By another library: nothing nearer than the margin, and all that is deeper than the longest mitre.
    nothing_nearer = solid(contour).buffer(-margin, quad_segs=64)
    all_deeper = solid(contour).buffer(-2 * margin, quad_segs=64)
    # The other library's arcs are polygons, 1e-4 of the radius inside.
    assert solid(moved).difference(nothing_nearer.buffer(margin * 2e-4 + 1e-6)).area < 1e-6
    assert all_deeper.difference(solid(moved).buffer(1e-6)).area < 1e-6
    assert contour_defect(moved) is None
    assert len(moved.holes) == len(contour.holes)


@settings(max_examples=60)
@given(contours(), margins)
def test_outwards_it_covers_all_within_the_margin_and_no_more_than_a_mitre_beyond(
    contour: Contour, margin: float
) -> None:
    moved = moved_or_refused(contour, -margin)
    if moved is None:
        return
    within, beyond = (solid(contour).buffer(reach * margin, quad_segs=64) for reach in (1, 2))
    assert within.difference(solid(moved).buffer(1e-6)).area < 1e-6
    assert solid(moved).difference(beyond.buffer(margin * 5e-4 + 1e-6)).area < 1e-6
    assert contour_defect(moved) is None


@settings(max_examples=60)
@given(contours(), margins, st.floats(0.05, 0.95))
def test_a_larger_margin_leaves_less(contour: Contour, margin: float, share: float) -> None:
    smaller, larger = moved_or_refused(contour, margin * share), moved_or_refused(contour, margin)
    assume(smaller is not None and larger is not None)
    assert area(larger) < area(smaller) < area(contour)


@given(st.lists(st.floats(60.0, 70.0), min_size=5, max_size=12), st.floats(0.1, 5.0))
def test_the_inverse_margin_leads_back_where_all_corners_are_blunt(radii: list[float], margin: float) -> None:
    ring = star(radii)
    back = offset_contour(offset_contour(Contour(ring), margin), -margin)
    assert solid(back).symmetric_difference(shapely.Polygon(ring)).area < 1e-3 * len(ring)


def test_a_vertex_cut_off_by_a_short_edge_is_no_trouble() -> None:
    bevelled = np.array([[0.0, 0], [99.9, 0], [100, 0.1], [100, 100], [0, 100]])
    moved = offset_contour(Contour(bevelled), 2.0)
    assert area(moved) == pytest.approx(96 * 96, abs=0.02)
    assert len(moved.exterior) == 4


def test_a_tip_sharper_than_the_mitre_limit_is_cut_off_square() -> None:
    slit = np.array([[0.0, 0], [100, 0], [100, 100], [51, 100], [50, 50], [49, 100], [0, 100]])
    lowest = offset_contour(Contour(slit), 2.0).exterior
    near = lowest[(abs(lowest[:, 0] - 50) < 5) & (lowest[:, 1] < 60)]
    assert near[:, 1].min() == pytest.approx(48.0)


@pytest.mark.parametrize(
    ("contour", "margin", "why"),
    [
        (Contour(BLOCK), 151.0, "the exterior vanishes"),
        (Contour(np.array([[0.0, 0], [50, 40], [100, 0], [100, 100], [50, 60], [0, 100]])), 11.0, "2 pieces"),
        (Contour(BLOCK, (OPENING,)), -41.0, "hole 1 vanishes"),
        (Contour(BLOCK, (OPENING,)), 60.0, "hole 1 vanishes or runs into another"),
        (Contour(BLOCK, (OPENING, OPENING + np.array([90, 0]))), 6.0, "hole"),
    ],
)
def test_what_vanishes_splits_or_merges_is_refused(contour: Contour, margin: float, why: str) -> None:
    with pytest.raises(MarginImpossible, match=why):
        offset_contour(contour, margin)


def test_a_dense_outline_gets_the_corners_of_a_plain_one() -> None:
    moved = offset_contour(Contour(densified(BLOCK, 0.7)), 3.0)
    assert area(moved) == pytest.approx(394 * 294)
    assert len(moved.exterior) == 4


def test_a_contour_that_meets_itself_and_a_margin_that_is_no_number_are_errors() -> None:
    with pytest.raises(ParameterError, match="no inside"):
        offset_contour(Contour(BLOCK[[0, 2, 1, 3]]), 1.0)
    with pytest.raises(ParameterError, match="margin is nan"):
        offset_contour(Contour(BLOCK), float("nan"))
