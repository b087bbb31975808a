"""What a traced outline rests on, with things over its edge, in it and beside it."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from contour.geometry.ring_lengths import RingLengths
from contour.synthetic import render
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from tests.support.scenes.edge_scenes import COVERED, LONG, PITCH, at, edge_scene
from tests.support.scenes.shop_floor_scenes import shop_floor_scene

CLEAR = (
    "",
    "soft shadow",
    "hard shadow",
    "mirror",
    "tape far away",
    "tape in the middle",
    "hole",
    "wood",
    "strip beside",
)
"""Scenes with nothing at the edge that hides it."""


@pytest.mark.parametrize("name", ["bright tape", "compound", "hole"])
def test_stretches_cover_each_ring_from_its_first_vertex_to_its_length_without_gaps(name: str) -> None:
    traced = edge_scene(name).trace
    assert traced.evidence is not None
    for number, ring in enumerate(traced.contour.rings):
        own = [stretch for stretch in traced.evidence if stretch.ring == number]
        assert own[0].from_px == 0.0
        assert own[-1].to_px == pytest.approx(RingLengths.of(ring).length)
        assert all(one.to_px == other.from_px for one, other in itertools.pairwise(own))


@pytest.mark.parametrize("name", CLEAR)
def test_where_nothing_lies_over_the_edge_all_of_it_is_seen(name: str) -> None:
    scene = edge_scene(name)
    assert scene.hidden == []
    assert scene.trace.evidence is not None
    assert {stretch.by for stretch in scene.trace.evidence} == {None}
    assert scene.off.mean() < 0.02 * PITCH
    assert scene.off.max() < 0.1 * PITCH


def test_a_dark_label_is_there_though_its_print_looks_like_a_piece_of_comb_in_a_shadow() -> None:
    traced = trace(render(shop_floor_scene("tape", 4_060_059).scene).picture, TraceSettings())
    assert traced.evidence is not None
    assert "object" in {stretch.by for stretch in traced.evidence}


@pytest.mark.parametrize("name", COVERED)
def test_what_lies_over_a_straight_edge_is_found_there_and_the_edge_goes_on_beneath(name: str) -> None:
    scene = edge_scene(name)
    (stretch,) = scene.hidden
    assert (stretch.state, stretch.by, stretch.straight) == ("bridged", "object", True)
    place = scene.pixel(at(COVERED[name][0], 0.0))
    assert np.hypot(*(scene.middle(stretch) - place)) < PITCH
    assert scene.off[scene.rendered.visible[0]].max() < 0.1 * PITCH
    assert scene.off.max() < 0.15 * PITCH


@pytest.mark.parametrize("name", COVERED)
def test_a_bridge_is_less_sure_than_the_whole_and_what_is_seen_beside_it_and_its_bound_holds(name: str) -> None:
    scene = edge_scene(name)
    (stretch,) = scene.hidden
    assert scene.trace.evidence is not None
    own = [one for one in scene.trace.evidence if one.ring == stretch.ring]
    index = own.index(stretch)
    beside = [own[index - 1], own[(index + 1) % len(own)]]
    assert {one.state for one in beside} == {"seen"}
    assert stretch.bound_px > max(one.bound_px for one in beside) == min(one.bound_px for one in own)
    assert scene.off[~scene.rendered.visible[0]].max() < stretch.bound_px


@pytest.mark.parametrize("name", COVERED)
def test_no_more_than_the_nearest_cells_of_what_is_hidden_are_told_as_seen(name: str) -> None:
    """And no more than those of what is seen as hidden."""
    scene = edge_scene(name)
    (stretch,) = scene.hidden
    truth, seen = scene.rendered.truth_px.exterior, scene.rendered.visible[0]
    hidden_px = np.count_nonzero(~seen) * RingLengths.of(truth).length / len(truth)
    assert hidden_px - 2.2 * PITCH < stretch.to_px - stretch.from_px < hidden_px + 2.2 * PITCH


def test_over_a_corner_nothing_is_bridged() -> None:
    scene = edge_scene("tape on a corner")
    assert {stretch.state for stretch in scene.hidden} == {"covered"}
    corner = scene.pixel(at(0.5 * LONG, 0.0))
    assert min(np.hypot(*(scene.middle(stretch) - corner)) for stretch in scene.hidden) < 2 * PITCH
    assert scene.off[scene.rendered.visible[0]].max() < 0.1 * PITCH


def test_over_an_edge_from_corner_to_corner_nothing_is_bridged() -> None:
    scene = edge_scene("tape along an edge")
    assert {stretch.state for stretch in scene.hidden} == {"covered"}
    assert sum(stretch.to_px - stretch.from_px for stretch in scene.hidden) > 8 * PITCH


@pytest.mark.parametrize(("kind", "seed"), [("jpeg", 996_504), ("tape", 991_003)])
def test_dark_things_cover_what_they_part_from_the_block_or_hide_in_a_corner(kind: str, seed: int) -> None:
    """Behind a cable lies comb that touches none of the block's: it is told from it, and what lies between is not. A
    tape hides a corner that points into the block.
    """
    rendered = render(shop_floor_scene(kind, seed).scene)
    traced = trace(rendered.picture, TraceSettings())
    assert traced.evidence is not None
    assert "covered" in {stretch.state for stretch in traced.evidence}


def test_a_tape_that_takes_a_corner_off_covers_it_though_its_border_is_short() -> None:
    """Two ends at it happen to lie on the lines of the edge, and hardly a cell between them is hidden."""
    rendered = render(shop_floor_scene("tape", 1_650_033).scene)
    traced = trace(rendered.picture, TraceSettings())
    assert traced.evidence is not None
    assert any(stretch.state == "covered" for stretch in traced.evidence)


def test_a_block_that_a_hand_brings_to_the_frame_lies_in_view_and_is_hardly_known() -> None:
    """No wall of the block lies in the picture's last pixels, and the outline goes around the hand."""
    traced = trace(render(shop_floor_scene("hand_or_cable", 1_003_002).scene).picture, TraceSettings())
    assert not traced.reaches_frame
    assert traced.uncertainty_px is not None
    assert traced.pitch_px is not None
    assert traced.uncertainty_px > 0.5 * traced.pitch_px


@pytest.mark.parametrize("side", ["left", "right", "top", "bottom"])
def test_a_block_that_goes_on_outside_of_the_picture_reaches_the_frame(side: str) -> None:
    picture = edge_scene("compound").rendered.picture
    height, width = picture.shape[:2]
    x, y = (width // 2, height // 2)
    part = {"left": picture[:, x:], "right": picture[:, :x], "top": picture[y:], "bottom": picture[:y]}[side]
    traced = trace(np.ascontiguousarray(part), TraceSettings())
    assert traced.reaches_frame
    assert traced.uncertainty_px is None


def test_comb_in_a_corner_that_the_outline_cuts_off_is_a_part_left_out() -> None:
    """The cable is as dark as the table."""
    left_out = edge_scene("cable across a corner").checked().disagreement
    assert left_out is not None
    assert left_out.pitches > 3.0
    assert not left_out.claimed


def test_compound_flush_with_the_cut_is_seen_and_the_outline_runs_along_it() -> None:
    scene = edge_scene("compound")
    assert scene.hidden == []
    assert scene.trace.evidence is not None
    (stretch,) = (one for one in scene.trace.evidence if one.by is not None)
    assert stretch.by == "compound"
    assert np.hypot(*(scene.middle(stretch) - scene.pixel(at(10.0, 0.0)))) < 1.5 * PITCH
    assert stretch.to_px - stretch.from_px == pytest.approx(7 * PITCH, abs=2 * PITCH)
    assert scene.off.max() < 0.1 * PITCH


def test_compound_at_a_corner_leaves_the_corner_where_it_was_cut() -> None:
    scene = edge_scene("compound at a corner")
    assert scene.hidden == []
    assert scene.off.max() < 0.1 * PITCH


def test_what_lies_far_from_the_block_changes_nothing() -> None:
    far, plain = edge_scene("tape far away").trace, edge_scene().trace
    assert far.look is not None
    assert far.look.foreign.any()
    assert np.abs(far.contour.exterior - plain.contour.exterior).max() < 0.05 * PITCH


def test_a_hole_with_the_table_in_it_stays_and_a_filled_one_is_none() -> None:
    assert len(edge_scene("hole").trace.contour.holes) == 1
    assert edge_scene("filled hole").trace.contour.holes == ()


@pytest.mark.parametrize("name", ["", "bright tape", "clamp", "compound at a corner"])
def test_through_a_lens_it_is_the_same(name: str) -> None:
    bent, straight = edge_scene(name, lens=True), edge_scene(name)
    assert [(one.state, one.by) for one in bent.hidden] == [(one.state, one.by) for one in straight.hidden]
    for stretch in bent.hidden:
        assert np.hypot(*(bent.middle(stretch) - bent.pixel(at(COVERED[name][0], 0.0)))) < PITCH
    assert bent.off.max() < 0.15 * PITCH


def test_a_chip_that_clings_to_the_edge_is_found_as_a_narrow_bump() -> None:
    scene = edge_scene("clinging chip")
    narrow = scene.checked().narrow
    assert narrow is not None
    assert narrow.outwards
    assert np.hypot(*(np.array(narrow.place_px) - scene.pixel(at(10.0, 25.0)))) < 1.5 * PITCH


@pytest.mark.parametrize("name", ["", "bright tape", "compound", "hard shadow", "strip beside"])
def test_nothing_else_makes_one_nor_a_disagreement(name: str) -> None:
    checked = edge_scene(name).checked()
    assert checked.narrow is None
    assert checked.disagreement is not None
    assert checked.disagreement.pitches < 1.2
