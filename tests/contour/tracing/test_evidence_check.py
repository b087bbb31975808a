"""The outline against the wall ends: what is refused, and what is not."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.errors import NoBlockFound
from contour.geometry.rings import densified
from contour.outline.fit import FittedRing
from contour.relief.relief import Displacement, Relief
from contour.synthetic import render
from contour.tracing.evidence_check import (
    check_against_evidence,
    check_against_relief,
    check_on_walls,
    check_own_ends,
    check_unseen,
    ends_outside_corners,
)
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from contour.walls.wall_evidence import EdgePoints, RingEvidence, WitnessKind
from tests.support.pictures.outline_scenes import PITCH, along, rectangle, witnesses
from tests.support.scenes.shop_floor_scenes import shop_floor_scene

BLOCK = rectangle(900.0, 600.0)


class Lens:
    """A lens about (700, 500) that bends the long edges of BLOCK by a third of PITCH and more."""

    centre = np.array([700.0, 500.0])
    strength = 1e-7

    def unrectify(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        away = points - self.centre
        return self.centre + away * (1.0 - self.strength * (away**2).sum(axis=1, keepdims=True))

    def rectify(self, points_px: NDArray[np.float64]) -> NDArray[np.float64]:
        seen = points_px - self.centre
        away = seen.copy()
        for _ in range(40):
            away = seen / (1.0 - self.strength * (away**2).sum(axis=1, keepdims=True))
        return self.centre + away


def test_a_long_edge_bent_by_the_lens_by_more_than_half_a_small_cell_passes_none_of_its_ends() -> None:
    lens, pitch = Lens(), 8.0
    flat = witnesses(BLOCK, seed=1, spacing=pitch)
    seen = replace(flat, points=lens.unrectify(flat.points))
    ring = lens.unrectify(BLOCK)
    on_line = np.ones(len(seen.points), np.bool_)
    check_against_evidence(seen, ring, on_line, pitch, lens)
    with pytest.raises(NoBlockFound, match="more than half a cell"):
        check_against_evidence(seen, ring, on_line, pitch, None)


@pytest.mark.parametrize("pitches", [-0.8, 0.8])
def test_four_ends_in_a_row_far_off_on_either_side_are_refused_with_their_place(pitches: float) -> None:
    evidence = witnesses(BLOCK, seed=2)
    off = np.isin(np.arange(len(evidence.points)), np.arange(10, 14))
    moved = evidence.points + np.where(off, pitches * PITCH, 0.0)[:, None] * evidence.normal
    x, y = moved[13]
    with pytest.raises(NoBlockFound, match=rf"near \({x:.0f}, {y:.0f}\) px"):
        check_against_evidence(replace(evidence, points=moved), BLOCK, ~off, PITCH, None)


@pytest.mark.parametrize("is_hole", [False, True])
@pytest.mark.parametrize(
    ("pitches", "aside", "told"), [(0.4, 1.0, True), (0.2, 1.0, False), (-0.4, 1.0, False), (0.4, 3.0, False)]
)
def test_an_end_left_outside_beside_a_corner_is_told(pitches: float, aside: float, told: bool, is_hole: bool) -> None:
    evidence = replace(witnesses(BLOCK, seed=2), is_hole=is_hole)
    edge = (BLOCK[1] - BLOCK[0]) / np.hypot(*(BLOCK[1] - BLOCK[0]))
    outward = np.array([edge[1], -edge[0]]) * (-1.0 if is_hole else 1.0)
    points, on_line = evidence.points.copy(), np.ones(len(evidence.points), np.bool_)
    points[5] = BLOCK[0] + PITCH * (aside * edge + pitches * outward)
    on_line[5] = False
    kind = evidence.kind.copy()
    kind[5] = WitnessKind.BLUNT
    seen = replace(evidence, points=points, kind=kind)
    assert len(ends_outside_corners(seen, BLOCK, on_line, PITCH, None)) == told
    kind[5] = WitnessKind.OUTERMOST
    assert not len(ends_outside_corners(seen, BLOCK, on_line, PITCH, None))


def test_a_corner_outside_of_which_a_wall_ends_is_refused_though_the_rest_of_the_outline_is_right() -> None:
    rendered = render(shop_floor_scene("coloured", 2_100_013).scene)
    found = trace(rendered.picture, TraceSettings())
    assert found.outside_px is not None
    corners = rendered.truth_px.exterior
    assert np.hypot(*(corners - found.outside_px).T).min() < 1.5 * rendered.pitch_px


@pytest.mark.parametrize(("share", "refused"), [(0.5, True), (0.7, False)])
def test_an_outline_that_half_of_the_ends_lie_on_is_refused(share: float, refused: bool) -> None:
    evidence = witnesses(BLOCK, seed=2)
    on_line = np.random.default_rng(1).permutation(len(evidence.points)) < share * len(evidence.points)
    if refused:
        with pytest.raises(NoBlockFound, match=r"ends of walls around \(700, 500\) px only"):
            check_against_evidence(evidence, BLOCK, on_line, PITCH, None)
    else:
        check_against_evidence(evidence, BLOCK, on_line, PITCH, None)


@pytest.mark.parametrize(
    ("places", "every", "refused"), [(None, 3, False), (None, 10, True), (8, 3, False), (8, 4, True)]
)
def test_a_hole_along_which_hardly_any_wall_ends_was_not_cut(places: int | None, every: int, refused: bool) -> None:
    evidence = witnesses(BLOCK, seed=2)
    evidence = evidence.take(np.arange(len(evidence.points))[:places])
    count = len(evidence.points)
    kind = np.where(np.arange(count) % every == 0, WitnessKind.CLEAN, WitnessKind.OUTERMOST)
    hole, on_line = replace(evidence, kind=kind, is_hole=True), np.ones(count, np.bool_)
    with pytest.raises(NoBlockFound, match="as if it was not cut") if refused else nullcontext():
        check_on_walls(hole, on_line, np.zeros((1000, 1400), np.uint8), PITCH)


@pytest.mark.parametrize(("soft", "refused"), [(3, False), (4, True)])
def test_an_outline_along_glare_that_was_taken_for_walls_is_refused(soft: int, refused: bool) -> None:
    evidence = witnesses(BLOCK, seed=2)
    count = len(evidence.points)
    along = np.isin(np.arange(count), np.arange(10, 10 + soft))
    x, y = np.rint(evidence.points[~along]).astype(int).T
    light = np.full((1000, 1400), 40, np.uint8)
    light[y, x] = 220
    glare = cv2.circle(light.copy(), np.rint(evidence.points[12]).astype(int).tolist(), round(6 * PITCH), 90, -1)
    glare = np.where(light == 220, light, cv2.GaussianBlur(glare, (0, 0), 4.0 * PITCH)).astype(np.uint8)
    evidence = replace(evidence, kind=np.where(along, WitnessKind.OUTERMOST, WitnessKind.CLEAN))
    on_line = np.ones(count, np.bool_)
    with pytest.raises(NoBlockFound, match="changes too softly for walls") if refused else nullcontext():
        check_on_walls(evidence, on_line, glare, PITCH)


def test_edges_that_meet_far_from_the_block_are_refused() -> None:
    evidence = witnesses(BLOCK, seed=1)
    on_line = np.ones(len(evidence.points), np.bool_)
    check_against_evidence(evidence, BLOCK, on_line, PITCH, None)
    away = BLOCK.copy()
    away[0] += 1e7 * np.array([-1.0, 0.0])
    with pytest.raises(NoBlockFound, match="far from the block"):
        check_against_evidence(evidence, away, on_line, PITCH, None)


def test_three_ends_in_a_row_are_missing_cells() -> None:
    evidence = witnesses(BLOCK, seed=2)
    off = np.isin(np.arange(len(evidence.points)), np.arange(10, 13))
    moved = evidence.points - np.where(off, 0.8 * PITCH, 0.0)[:, None] * evidence.normal
    check_against_evidence(replace(evidence, points=moved), BLOCK, ~off, PITCH, None)


def blunt(evidence: RingEvidence) -> RingEvidence:
    return replace(evidence, kind=np.full_like(evidence.kind, WitnessKind.BLUNT))


@pytest.mark.parametrize("is_hole", [False, True])
def test_two_ends_side_by_side_outside_are_material_that_the_outline_leaves_out_and_one_is_a_chip(
    is_hole: bool,
) -> None:
    evidence = blunt(witnesses(BLOCK, seed=2))
    if is_hole:
        evidence = replace(evidence, is_hole=True, normal=-evidence.normal)
    # Inside, two are a cell that is missing.
    for count, pitches in ((1, 0.6), (2, 0.25), (2, -0.8)):
        off = np.isin(np.arange(len(evidence.points)), np.arange(10, 10 + count))
        moved = evidence.points + np.where(off, pitches * PITCH, 0.0)[:, None] * evidence.normal
        check_against_evidence(replace(evidence, points=moved), BLOCK, ~off, PITCH, None)
    moved = evidence.points + np.where(off, 0.4 * PITCH, 0.0)[:, None] * evidence.normal
    with pytest.raises(NoBlockFound, match="more than a third of a cell"):
        check_against_evidence(replace(evidence, points=moved), BLOCK, ~off, PITCH, None)


def test_a_clean_end_outside_is_a_chip_or_a_streak_alone_and_a_wall_beside_another_end_that_is_passed() -> None:
    evidence = witnesses(BLOCK, seed=2)
    off = np.arange(len(evidence.points)) == 10
    alone, beside = ~off, ~np.isin(np.arange(len(off)), (10, 11))
    for pitches, clean, on_line in (
        (0.6, True, alone),
        (0.1, True, beside),
        (0.25, False, beside),
        (-0.8, True, beside),
    ):
        moved = evidence.points + np.where(off, pitches * PITCH, 0.0)[:, None] * evidence.normal
        seen = replace(evidence if clean else blunt(evidence), points=moved)
        check_against_evidence(seen, BLOCK, on_line, PITCH, None)
    moved = evidence.points + np.where(off, 0.25 * PITCH, 0.0)[:, None] * evidence.normal
    with pytest.raises(NoBlockFound, match="more than a sixth of a cell"):
        check_against_evidence(replace(evidence, points=moved), BLOCK, beside, PITCH, None)


@pytest.mark.parametrize("pitches", [-0.6, 0.4])
def test_an_outline_that_cuts_off_the_end_of_an_edge_that_it_was_laid_through_is_refused(pitches: float) -> None:
    evidence = blunt(witnesses(BLOCK, seed=2))
    off = np.arange(len(evidence.points)) == 10
    moved = evidence.points + np.where(off, pitches * PITCH, 0.0)[:, None] * evidence.normal
    check_against_evidence(replace(evidence, points=moved), BLOCK, ~off, PITCH, None)
    with pytest.raises(NoBlockFound, match="more than half a cell" if pitches < 0.0 else "more than a third of a cell"):
        check_against_evidence(replace(evidence, points=moved), BLOCK, off | ~off, PITCH, None)


@pytest.mark.parametrize(("wide", "deep", "refused"), [(4.0, 1.0, True), (1.2, 1.0, False), (4.0, 0.5, False)])
def test_an_outline_far_over_the_table_and_far_from_all_it_was_laid_through_is_refused(
    wide: float, deep: float, refused: bool
) -> None:
    """Across a bay of so many pitches in the first edge; a cell or two that are lost leave no more than that. Walls in
    shade are no table.
    """
    first, along = BLOCK[0], (BLOCK[1] - BLOCK[0]) / np.hypot(*(BLOCK[1] - BLOCK[0]))
    inwards = np.array([-along[1], along[0]])
    begin, stop = 450.0 - 0.5 * wide * PITCH, 450.0 + 0.5 * wide * PITCH
    bay = first + np.outer((begin, begin + 1, stop - 1, stop), along) + np.outer((0, 1, 1, 0), deep * PITCH * inwards)
    ends = witnesses(BLOCK, seed=2)
    at, off = (ends.points - first) @ along, np.abs((ends.points - first) @ inwards)
    coarse = densified(np.concatenate([BLOCK[:1], bay, BLOCK[1:]]), 5.0)
    seen = replace(ends.take((at < begin) | (at > stop) | (off > 5.0)), coarse=coarse)
    on_line = np.ones(len(seen.points), np.bool_)
    table = np.random.default_rng(3).integers(40, 44, (1200, 1600)).astype(np.uint8)
    shaded = table.copy()
    shaded[:: int(0.4 * PITCH)] += 20
    outside = cv2.fillPoly(np.zeros_like(table), [np.rint(BLOCK).astype(np.int32)], 1) == 0
    shaded[outside] = table[outside]
    check_unseen(seen, BLOCK, on_line, shaded, PITCH, None)
    if refused:
        with pytest.raises(NoBlockFound, match="leads over the table near"):
            check_unseen(seen, BLOCK, on_line, table, PITCH, None)
    else:
        check_unseen(seen, BLOCK, on_line, table, PITCH, None)


@pytest.mark.parametrize(("own", "refused"), [(0, True), (1, True), (2, False)])
def test_a_short_edge_that_passes_an_end_inside_needs_more_of_its_own(own: int, refused: bool) -> None:
    """Between the ends of two others: it goes through these whatever lies between."""
    ring = rectangle(900.0, 4.0 * PITCH)
    length = 900.0 + np.array([0.0, 0.9, 1.7, 2.6, 4.0]) * PITCH
    kept = [0, 4, *range(1, 1 + own)]
    points, normal = along(ring, np.append(length[kept], 900.0 + 3.3 * PITCH))
    points[-1] -= 0.3 * PITCH * normal[-1]
    there = witnesses(ring, seed=3, gaps=((890.0, 910.0 + 4.0 * PITCH),))
    others = np.flatnonzero((there.position < 890.0) | (there.position > 910.0 + 4.0 * PITCH))
    seen = there.take(np.append(others, np.zeros(len(points), np.intp)))
    seen.points[len(others) :] = points
    seen.kind[len(others) :] = WitnessKind.CLEAN
    residual = np.zeros(len(seen.points))
    residual[-1] = -0.3 * PITCH
    fitted = FittedRing(ring, residual == 0.0, residual, 0.2, 0.0, np.full(4, 0.1), 4, np.empty((0, 2)))
    if refused:
        with pytest.raises(NoBlockFound, match=f"with {own} of its own"):
            check_own_ends(seen, fitted, PITCH, None)
    else:
        check_own_ends(seen, fitted, PITCH, None)


@pytest.mark.parametrize(("is_hole", "unseen", "refused"), [(True, 0.3, True), (True, 0.1, False), (False, 0.3, False)])
def test_a_hole_of_which_a_fifth_has_no_ends_may_have_another_shape(
    is_hole: bool, unseen: float, refused: bool
) -> None:
    evidence = replace(witnesses(BLOCK, seed=2), is_hole=is_hole)
    on_it = np.zeros(len(evidence.points))
    fitted = FittedRing(BLOCK, on_it == 0.0, on_it, 0.2, unseen, np.full(len(BLOCK), 0.1), 4, np.empty((0, 2)))
    with pytest.raises(NoBlockFound, match="70 % of the hole") if refused else nullcontext():
        check_own_ends(evidence, fitted, PITCH, None)


@pytest.mark.parametrize(
    ("long", "height", "refused"),
    [(0.8, 1.0, True), (0.8, 0.5, False), (1.2, 0.5, True), (1.2, 0.3, False), (0.2, 1.5, False)],
    ids=["wall", "streak", "faint wall", "long streak", "dust"],
)
def test_a_wall_outside_that_stands_out_of_a_known_table_as_walls_do_is_refused(
    long: float, height: float, refused: bool
) -> None:
    """Of walls just within an edge, and one along it half a cell out, of that length and so many times as high."""
    evidence = witnesses(BLOCK, seed=2)
    first, along = BLOCK[0], (BLOCK[1] - BLOCK[0]) / np.hypot(*(BLOCK[1] - BLOCK[0]))
    out = np.array([along[1], -along[0]])
    own = first + np.arange(50.0, 350.0, PITCH / 8)[:, None] * along - 2.0 * out
    wall = first + np.arange(400.0, 400.1 + long * PITCH, PITCH / 8)[:, None] * along + 0.5 * PITCH * out
    light = np.zeros((1200, 1500), np.float32)
    for points, level in ((own, 40.0), (wall, 40.0 * height)):
        for x, y in np.rint(points).astype(int).tolist():
            light[y - 1 : y + 2, x - 1 : x + 2] = level
    flat = np.zeros(light.shape, np.uint8)
    relief = Relief(flat, (light,), flat, Displacement(0.0, np.zeros(2)), 4.0)
    seen = replace(evidence, walls=EdgePoints(np.concatenate([own, wall])))
    if refused:
        with pytest.raises(NoBlockFound, match="leaves a wall outside near"):
            check_against_relief(seen, BLOCK, relief, PITCH, None)
    else:
        check_against_relief(seen, BLOCK, relief, PITCH, None)
