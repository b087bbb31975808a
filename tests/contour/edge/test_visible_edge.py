"""Which witnesses an outline is laid through where something lies at the edge."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.edge.edge_evidence import ring_evidence
from contour.edge.stretches import Stretch
from contour.edge.table_look import TableLook
from contour.edge.visible_edge import VisibleRing, fit_visible
from contour.errors import NoBlockFound
from contour.outline.fit import fit_ring
from contour.outline.uncertainty import RingBounds
from contour.walls.wall_evidence import EdgePoints, RingEvidence, WitnessKind
from tests.support.pictures.hand_looks import HEIGHT, WIDTH, drawn, look
from tests.support.pictures.outline_scenes import PITCH, along, blob, circle, distances, errors, rectangle, witnesses

PICTURE = np.full((HEIGHT, WIDTH), 40, np.uint8)
FIT = partial(fit_ring, pitch_px=PITCH, wall_px=2.0, rectifier=None)
BLOCK = rectangle(700.0, 500.0)


def patch(ring: NDArray[np.float64], place: float, deep: float, wide: float, out: float = 3.0) -> NDArray[np.float64]:
    """A rectangle over a ring at an arc length: so many pitches into it, along it, and out of it."""
    (point,), (normal,) = along(ring, np.array([place]))
    side = np.array([-normal[1], normal[0]]) * 0.5 * wide * PITCH
    inner, outer = point - deep * PITCH * normal, point + out * PITCH * normal
    return np.array([inner - side, inner + side, outer + side, outer - side])


def ending_at(
    evidence: RingEvidence, ring: NDArray[np.float64], place: float, deep: float, wide: float
) -> RingEvidence:
    """The evidence with the ends of walls at the inner border of such a patch instead of at the edge beneath."""
    beneath = np.abs(evidence.position - place) < 0.5 * wide * PITCH
    points = evidence.points - np.where(beneath, deep * PITCH, 0.0)[:, None] * evidence.normal
    return replace(evidence, points=points)


def fitted(evidence: RingEvidence, there: TableLook) -> VisibleRing:
    return fit_visible(evidence, PICTURE, there, None, FIT)


def told(one: VisibleRing, there: TableLook) -> list[Stretch]:
    """The stretches that are not plainly seen."""
    sure = RingBounds(0.5, one.on_line, np.full(len(one.on_line), 0.5))
    stretches = ring_evidence(0, one.fitted.ring, one, there, None, sure)
    return [stretch for stretch in stretches if stretch.state != "seen"]


@pytest.mark.parametrize("wide", [8.0, 10.0, 12.0])
def test_walls_that_end_at_a_thing_do_not_draw_the_outline_in(wide: float) -> None:
    tape = patch(BLOCK, 350.0, 1.5, wide)
    evidence, there = ending_at(witnesses(BLOCK, seed=1), BLOCK, 350.0, 1.5, wide), look(BLOCK, tape)
    assert errors(FIT(evidence).ring, BLOCK).max() > 0.5 * PITCH
    one = fitted(evidence, there)
    assert errors(one.fitted.ring, BLOCK).max() < 0.1 * PITCH
    assert len(one.distrusted) >= wide - 2
    (stretch,) = told(one, there)
    assert (stretch.state, stretch.by, stretch.straight) == ("bridged", "object", True)


def test_ends_on_the_line_of_the_others_are_taken_back() -> None:
    """A thing that only touches the block."""
    beside = patch(BLOCK, 350.0, 0.0, 8.0)
    evidence, there = witnesses(BLOCK, seed=2), look(BLOCK, beside)
    one = fitted(evidence, there)
    assert len(one.distrusted) == 0
    assert len(one.evidence.points) == len(evidence.points)
    assert told(one, there) == []


def test_with_nothing_foreign_near_all_are_fitted() -> None:
    evidence = witnesses(BLOCK, seed=3)
    one = fitted(evidence, look(BLOCK, np.array([[50.0, 50.0], [150.0, 50.0], [150.0, 150.0], [50.0, 150.0]])))
    assert np.array_equal(one.fitted.ring, FIT(evidence).ring)
    assert not one.filled.any()


def test_a_curved_edge_in_a_long_shadow_is_its_own() -> None:
    """Nothing could be bridged there, but the outline runs on past it and nowhere turns into the block."""
    ring = blob(350.0)
    points, normal = along(ring, np.arange(300.0, 720.0, 10.0))
    shadow = np.concatenate([points - 0.3 * PITCH * normal, (points + PITCH * normal)[::-1]])
    dark, bright = look(ring, shadow, lighter=False, shade=True), look(ring, shadow)
    evidence = witnesses(ring, seed=4)
    assert told(fitted(evidence, dark), dark) == []
    assert told(fitted(evidence, bright), bright) != []


def test_a_dark_thing_over_the_edge_is_none_of_its_shadows() -> None:
    """As dark as a shadow, but the outline goes into the block around it."""
    tape = patch(BLOCK, 350.0, 2.0, 10.0)
    evidence = ending_at(witnesses(BLOCK, seed=5), BLOCK, 350.0, 2.0, 10.0)
    dark = look(BLOCK, tape, lighter=False, shade=True)
    one = fitted(evidence, dark)
    assert errors(one.fitted.ring, BLOCK).max() < 0.1 * PITCH
    assert [stretch.by for stretch in told(one, dark)] == ["object"]


@pytest.mark.parametrize("out", [0.0, 1.5])
def test_dark_compound_that_ends_flush_with_the_edge_is_no_shadow_beside_it(out: float) -> None:
    """The outline leaves the block along its inner border, and comes back to the edge aslant."""
    begin, end = 200.0, 200.0 + 13.5 * PITCH
    evidence = witnesses(BLOCK, seed=6)
    share = (evidence.position - begin) / (end - begin)
    deep = np.where((share > 0.0) & (share < 1.0), 3.5 * PITCH * (1.0 - share), 0.0)
    evidence = replace(evidence, points=evidence.points - deep[:, None] * evidence.normal)
    points, normal = along(BLOCK, np.array([begin, end]))
    fill = np.array([points[0] - 3.5 * PITCH * normal[0], points[1], *(points + out * PITCH * normal)[::-1]])
    picture = np.array(cv2.fillPoly(PICTURE.copy(), [np.rint(fill * 16).astype(np.int32)], 15, cv2.LINE_AA, 4))
    dark = look(BLOCK, fill, lighter=False, shade=True)
    one = fit_visible(evidence, picture, dark, None, FIT)
    assert told(one, dark) == []
    assert bool(errors(one.fitted.ring, BLOCK).max() < 0.1 * PITCH) is (out == 0.0)


def test_grain_of_what_fills_cells_is_no_end_of_a_wall() -> None:
    """Its bright specks end deep inside, but it goes on beyond them."""
    fill = patch(BLOCK, 350.0, 3.0, 8.0, out=0.0)
    evidence = witnesses(BLOCK, seed=8)
    deep = np.abs(evidence.position - 350.0) < 2.0 * PITCH
    evidence = replace(evidence, points=evidence.points - np.where(deep, 1.5 * PITCH, 0.0)[:, None] * evidence.normal)
    plain = look(BLOCK)
    grainy = replace(plain, lighter=drawn(fill))
    assert len(fitted(evidence, plain).evidence.points) == len(evidence.points)
    one = fitted(evidence, grainy)
    assert len(one.evidence.points) == np.count_nonzero(~deep)
    assert errors(one.fitted.ring, BLOCK).max() < 0.1 * PITCH
    assert len(fitted(witnesses(BLOCK, seed=8), grainy).evidence.points) == len(evidence.points), "table lies beyond"


def filled_end(out: float) -> tuple[NDArray[np.uint8], TableLook, VisibleRing]:
    """Compound that fills a block's end, both corners of it, three pitches deep; so much wider than the block."""
    side, deep = BLOCK[1] - BLOCK[0], BLOCK[2] - BLOCK[1]
    long, down = side / np.hypot(*side), deep / np.hypot(*deep)
    wide = out * PITCH * down
    inner = np.array([BLOCK[1] - wide, BLOCK[2] + wide]) - 3.0 * PITCH * long
    fill = np.array([*inner, BLOCK[2] + wide, BLOCK[1] - wide])
    evidence = witnesses(BLOCK, seed=7)
    beyond = (evidence.points - inner[0]) @ long
    evidence = replace(evidence, points=evidence.points - np.maximum(beyond, 0.0)[:, None] * long)
    picture = np.array(cv2.fillPoly(PICTURE.copy(), [np.rint(fill * 16).astype(np.int32)], 150, cv2.LINE_AA, 4))
    there = look(BLOCK, fill)
    return picture, there, fit_visible(evidence, picture, there, None, FIT)


def test_compound_that_fills_a_whole_end_is_cut_where_the_edges_on_both_sides_go_on_to_its_own() -> None:
    _, there, one = filled_end(0.0)
    assert told(one, there) == []
    assert errors(one.fitted.ring, BLOCK).max() < 0.1 * PITCH
    _, there, one = filled_end(1.0)
    assert told(one, there) != [], "a sheet that is wider than the block leaves its edges at an angle"


def test_a_dark_thing_over_a_corner_is_none_either() -> None:
    """The outline turns into the block once, and out of it on both sides."""
    corner = BLOCK[1]
    one_way, other = ((BLOCK[k] - corner) / np.hypot(*(BLOCK[k] - corner)) * 6.0 * PITCH for k in (0, 2))
    thing = np.array(
        [corner + one_way + other, corner - one_way + other, corner - one_way - other, corner + one_way - other]
    )
    left = np.array([BLOCK[0], corner + one_way, thing[0], corner + other, BLOCK[2], BLOCK[3]])
    dark = look(BLOCK, thing, lighter=False, shade=True)
    states = {stretch.state for stretch in told(fitted(witnesses(left, seed=11), dark), dark)}
    assert states == {"covered"}


@pytest.mark.parametrize("reach", [2.5, 3.5])
def test_ends_along_the_border_of_a_thing_across_a_corner_are_not_taken_for_its_bevel(reach: float) -> None:
    """What closes the gap between the edges on both sides is just that line."""
    corner = BLOCK[1]
    one_way, other = ((BLOCK[k] - corner) / np.hypot(*(BLOCK[k] - corner)) * reach * PITCH for k in (0, 2))
    ends = np.array([corner + one_way, corner + other])
    beyond = ends + ends - ends[::-1]
    thing = np.array([*beyond, corner - 2 * (one_way + other)])
    bevelled = np.array([BLOCK[0], *ends, BLOCK[2], BLOCK[3]])
    there = look(BLOCK, thing)
    hidden = told(fitted(witnesses(bevelled, seed=13), there), there)
    assert {stretch.state for stretch in hidden} == {"covered"}


@pytest.mark.parametrize(
    ("deep", "beside_next", "hides"), [(3.0, False, True), (3.0, True, False), (1.2, False, False)]
)
def test_a_wide_shadow_along_a_bevel_goes_on_beside_one_of_the_next_edges(
    deep: float, beside_next: bool, hides: bool
) -> None:
    """What does not is a dark thing that takes the corner off."""
    corner = BLOCK[1]
    one_way, other = ((BLOCK[k] - corner) / np.hypot(*(BLOCK[k] - corner)) * 8.0 * PITCH for k in (0, 2))
    ends = np.array([corner + one_way, corner + other])
    bevelled = np.array([BLOCK[0], *ends, BLOCK[2], BLOCK[3]])
    away = -(one_way + other) / np.hypot(*(one_way + other)) * deep * PITCH
    thing = np.array([ends[0], ends[1], ends[1] + away, ends[0] + away])
    if beside_next:
        down = ends[1] - corner
        thing = np.array([ends[0], ends[1], ends[1] + down, ends[1] + down + away, ends[0] + away])
    dark = look(bevelled, thing, lighter=False, shade=True)
    hidden = told(fitted(witnesses(bevelled, seed=14), dark), dark)
    assert {stretch.state for stretch in hidden} == ({"covered"} if hides else set())


def test_a_corner_that_points_into_the_block_may_lie_in_a_shadow() -> None:
    """The edges beside it are longer than a thing over a corner is wide."""
    ring = rectangle(700.0, 500.0, angle=0.0)
    slot = np.array([[525.0, 250.0], [525.0, 550.0], [875.0, 550.0], [875.0, 250.0]])
    ring = np.concatenate([ring[:1], slot, ring[1:]])
    shadow = np.array([[518.0, 300.0], [550.0, 300.0], [550.0, 525.0], [800.0, 525.0], [800.0, 557.0], [518.0, 557.0]])
    dark = look(ring, shadow, lighter=False, shade=True)
    evidence = witnesses(ring, seed=12, sigma=2.0)
    assert told(fitted(evidence, dark), dark) == []
    assert not fitted(evidence, dark).distrusted.any()


def test_where_nearly_all_ends_lie_at_something_foreign_there_is_no_block_to_be_seen() -> None:
    everywhere = rectangle(1000.0, 800.0)
    evidence = ending_at(witnesses(BLOCK, seed=6), BLOCK, 0.0, 1.0, 1000.0)
    with pytest.raises(NoBlockFound, match="neither the table nor cells"):
        fitted(evidence, look(BLOCK, everywhere))


@pytest.mark.parametrize("place", [350.0, 600.0])
def test_a_thing_that_ends_at_the_edge_hides_none_of_it(place: float) -> None:
    """A groove of the table, amidst an edge or at its corner: its sides count as walls, and comb lies along it."""
    beside = patch(BLOCK, place, 0.0, 4.0)
    evidence = ending_at(witnesses(BLOCK, seed=1), BLOCK, place, -0.6, 4.0)
    there = look(BLOCK, beside)
    one = fitted(evidence, there)
    assert len(one.distrusted) >= 3
    assert errors(one.fitted.ring, BLOCK).max() < 0.1 * PITCH
    assert told(one, there) == []
    over = look(BLOCK, patch(BLOCK, place, 1.0, 4.0))
    assert told(fitted(evidence, over), over) != []


def test_over_an_arc_a_bridge_is_told_as_one() -> None:
    ring = circle(350.0)
    evidence = ending_at(witnesses(ring, seed=7), ring, 600.0, 1.5, 4.0)
    there = look(ring, patch(ring, 600.0, 1.5, 4.0))
    one = fitted(evidence, there)
    assert errors(one.fitted.ring, ring).max() < 0.15 * PITCH
    (stretch,) = told(one, there)
    assert (stretch.state, stretch.straight) == ("bridged", False)


@pytest.mark.parametrize("corner", [0.0, 700.0, 1200.0])
def test_over_a_corner_it_is_covered(corner: float) -> None:
    reach = BLOCK[[0, 1, 2][[0.0, 700.0, 1200.0].index(corner)]]
    tape = reach + 3.0 * PITCH * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    evidence = witnesses(BLOCK, seed=8)
    off = np.abs(evidence.points - reach).max(axis=1) < 3.0 * PITCH
    evidence = replace(
        evidence,
        **{name: getattr(evidence, name)[~off] for name in ("points", "position", "normal", "sigma", "kind")},
    )
    # What ends at the tape's border, inside of the block.
    inner = tape.mean(axis=0) + 1.3 * 3.0 * PITCH * (BLOCK.mean(axis=0) - reach) / np.hypot(
        *(BLOCK.mean(axis=0) - reach)
    )
    k = int(np.searchsorted(evidence.position, corner)) % len(evidence.points)
    points = evidence.points.copy()
    points[k] = inner
    there = look(BLOCK, tape)
    states = {stretch.state for stretch in told(fitted(replace(evidence, points=points), there), there)}
    assert states == {"covered"}


def test_a_tape_from_corner_to_corner_bridges_nothing() -> None:
    """Its border is a straight line as well, and next to its ends it is an edge like any."""
    tape = patch(BLOCK, 350.0, 1.5, 26.0)
    evidence = ending_at(witnesses(BLOCK, seed=9), BLOCK, 350.0, 1.5, 28.0)
    there = look(BLOCK, tape)
    hidden = told(fitted(evidence, there), there)
    assert {stretch.state for stretch in hidden} == {"covered"}


def test_an_outline_that_leaves_walls_out_that_reach_a_thing_is_covered_there() -> None:
    """Ends that lie in a row by chance, across a corner that a thing hides."""
    before, after = BLOCK[1] + 3.0 * PITCH * np.stack([one / np.hypot(*one) for one in BLOCK[[0, 2]] - BLOCK[1]])
    cut = np.array([BLOCK[0], before, after, *BLOCK[2:]])
    foot = np.hypot(*(before - BLOCK[0])) + 0.5 * np.hypot(*(after - before)) + np.array([-12.0, 0.0, 12.0])
    place, normal = along(cut, foot)
    more = EdgePoints(place + 0.9 * PITCH * normal, foot, normal)
    both, _ = witnesses(cut, seed=5).joined_by(more, 0.2, WitnessKind.CLEAN)
    there = look(BLOCK, patch(cut, float(foot[1]), -1.0, 3.0))
    one = fitted(both, there)
    assert errors(one.fitted.ring, cut).max() < 0.25 * PITCH
    assert len(one.outside) >= 2
    (stretch,) = told(one, there)
    assert stretch.state != "seen"


def test_hidden_places_are_those_far_from_all_ends_and_near_the_thing() -> None:
    tape = patch(BLOCK, 350.0, 1.5, 8.0)
    there = look(BLOCK, tape)
    one = fitted(ending_at(witnesses(BLOCK, seed=10), BLOCK, 350.0, 1.5, 8.0), there)
    places, _ = along(BLOCK, np.arange(0.0, 2400.0, 10.0))
    hidden = one.hidden(places, there)
    near = distances(places, tape) < 0.6 * PITCH
    inside = np.abs(np.arange(0.0, 2400.0, 10.0) - 350.0) < 4.0 * PITCH
    assert hidden[np.abs(np.arange(0.0, 2400.0, 10.0) - 350.0) < 2.5 * PITCH].all()
    assert not hidden[~near & ~inside].any()
