"""Short edges, lost corners, torn stretches and small holes: what is missing and what was cut so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from contour.outline.fit import FittedRing, fit_ring
from contour.outline.labelling import supports
from contour.outline.witnesses import cost, prepare
from contour.walls.wall_evidence import EdgePoints, RingEvidence, WitnessKind
from tests.support.pictures.outline_scenes import PITCH, circle, distances, errors, perimeter, rectangle, witnesses

CORNER = np.array([300.0, 300.0])


def fitted(evidence: RingEvidence) -> FittedRing:
    return fit_ring(evidence, pitch_px=PITCH, wall_px=3.0, rectifier=None)


def joined(
    evidence: RingEvidence, points: NDArray[np.float64], normal: NDArray[np.float64], beyond_px: NDArray[np.float64]
) -> RingEvidence:
    """The evidence with clean ends that follow its last witness, so far on along the ring."""
    ends = EdgePoints(points, evidence.position.max() + beyond_px, normal)
    return evidence.joined_by(ends, float(evidence.sigma[0]), WitnessKind.CLEAN)[0]


def cut_corner(length: float, size: float = 600.0) -> NDArray[np.float64]:
    """A square whose first corner is cut off `length` px along either edge."""
    low, high = 300.0, 300.0 + size
    return np.array([[low + length, low], [high, low], [high, high], [low, high], [low, low + length]])


@pytest.mark.parametrize("pitches", [2.6, 4.0, 6.0])
@pytest.mark.parametrize("seed", range(5))
def test_a_cut_off_corner_is_no_missing_cell(pitches: float, seed: int) -> None:
    truth = cut_corner(pitches * PITCH)
    found = fitted(witnesses(truth, seed=seed, sigma=0.25, deep=0.03))
    assert errors(found.ring, truth).max() < 0.5 * PITCH


def beside_a_cell(seed: int) -> RingEvidence:
    """A corner cut off at two pitches, seen by one wall end and the side of a whole cell, both a little inside."""
    evidence = witnesses(cut_corner(2.0 * PITCH), seed=seed, sigma=0.25)
    middle = CORNER + PITCH
    away = np.abs(evidence.points - middle).sum(axis=1) > 2.05 * PITCH
    end, side = middle + [0.5 * PITCH, -0.5 * PITCH] + 2.0, middle + [-0.5 * PITCH, 0.5 * PITCH] + 4.0
    points = np.vstack([evidence.points[away], side, end])
    outwards = np.vstack([evidence.normal[away], np.full((2, 2), -np.sqrt(0.5))])
    position = np.append(evidence.position[away], evidence.position[-1] + np.array([0.3, 0.6]) * PITCH)
    sigma = np.append(evidence.sigma[away], [1.0, evidence.sigma[0]])
    kind = np.append(evidence.kind[away], [WitnessKind.OUTERMOST, WitnessKind.CLEAN]).astype(np.int8)
    return replace(evidence, points=points, normal=outwards, position=position, sigma=sigma, kind=kind)


def test_a_corner_that_walls_behind_it_speak_against_is_less_than_a_pitch_off_either_way() -> None:
    for seed in range(4):
        ring = fitted(beside_a_cell(seed)).ring
        assert errors(ring, cut_corner(2.0 * PITCH)).max() < 0.8 * PITCH, seed
        assert distances(CORNER[None], ring)[0] < PITCH, seed


def test_a_corner_that_is_cut_part_of_the_way_is_told_to_be_unsure() -> None:
    for seed in range(4):
        assert len(fitted(beside_a_cell(seed)).untold) > 0, seed


@pytest.mark.parametrize("seed", range(4))
def test_a_corner_that_is_drawn_whole_far_from_what_was_seen_is_told_to_be_unsure(seed: int) -> None:
    """It is cut off at little more than a pitch, with one end on the cut."""
    size = 1.15 * PITCH
    evidence = witnesses(cut_corner(size), seed=seed, sigma=0.15)
    away = np.abs(evidence.points - CORNER).sum(axis=1) > 1.2 * size
    across, outwards = CORNER + np.array([[0.35, 0.65]]) * size, np.full((1, 2), -np.sqrt(0.5))
    found = fitted(joined(evidence.take(away), across, outwards, np.ones(1)))
    assert distances(CORNER[None], found.ring)[0] < 1.0
    assert len(found.untold) > 0


@pytest.mark.parametrize("seed", range(4))
def test_a_corner_across_which_ends_lie_in_one_line_is_told_to_be_unsure(seed: int) -> None:
    """It is cut off at two pitches, where the last ends on both edges lie, with one end between them."""
    truth = cut_corner(2.0 * PITCH)
    evidence = witnesses(truth, seed=seed, sigma=0.15)
    away = np.abs(evidence.points - CORNER).sum(axis=1) > 2.6 * PITCH
    across = CORNER + PITCH * np.array([[0.0, 2.0], [1.1, 0.9], [2.0, 0.0]])
    outwards = np.array([[-1.0, 0.0], [-np.sqrt(0.5), -np.sqrt(0.5)], [0.0, -1.0]])
    told = joined(evidence.take(away), across, outwards, PITCH * np.array([0.4, 1.8, 3.0]))
    assert len(fitted(told).untold) > 0


@pytest.mark.parametrize("seed", range(4))
def test_an_arc_that_leaves_a_round_hole_by_less_than_a_cell_is_told_to_be_unsure(seed: int) -> None:
    truth = circle(4.5 * PITCH)
    evidence = witnesses(truth, seed=seed, sigma=0.3, hole=True)
    assert len(fitted(evidence).untold) == 0
    inked = np.abs(evidence.position - 0.5 * perimeter(truth)) < 2.6 * PITCH
    depth = np.where(inked, 0.65 * PITCH, 0.0)
    assert len(fitted(replace(evidence, points=evidence.points - depth[:, None] * evidence.normal)).untold) > 0


def test_a_corner_behind_which_nothing_is_seen_is_where_its_edges_meet() -> None:
    for seed in range(8):
        evidence = witnesses(cut_corner(0.0), seed=seed, sigma=0.25)
        seen = np.abs(evidence.points - CORNER).sum(axis=1) > 1.3 * PITCH
        assert distances(CORNER[None], fitted(evidence.take(seen)).ring)[0] < 0.1 * PITCH, seed


def test_a_corner_hidden_by_more_than_two_cells_is_cut_unless_something_stands_in_it() -> None:
    low, far = 300.0, 2.8 * PITCH
    for seed in range(3):
        evidence = witnesses(cut_corner(0.0), seed=seed, sigma=0.25)
        seen = np.abs(evidence.points - CORNER).sum(axis=1) > far
        evidence = evidence.take(seen)
        assert distances(CORNER[None], fitted(evidence).ring)[0] > 1.5 * PITCH, seed
        strand = np.array([[low + 0.3 * PITCH, low + 0.8 * PITCH], [low + 0.8 * PITCH, low + 0.3 * PITCH]])
        assert distances(CORNER[None], fitted(replace(evidence, beside=strand)).ring)[0] < 0.1 * PITCH, seed


def test_a_sharp_horn_is_drawn_to_its_tip_though_a_wall_is_seen_short_of_it() -> None:
    tip = np.array([300.0, 300.0])
    horn = np.array([tip, [900.0, 120.0], [900.0, 480.0]])
    for seed in range(4):
        evidence = witnesses(horn, seed=seed, sigma=0.25)
        away = np.flatnonzero(evidence.points[:, 0] > tip[0] + 1.4 * PITCH)
        last = away[-1]
        seen = np.append(away, last)
        evidence = evidence.take(seen)
        evidence.points[-1] = (tip[0] + 1.35 * PITCH, tip[1] + 2.0)
        evidence.position[-1] += 0.5 * PITCH
        assert distances(tip[None], fitted(evidence).ring)[0] < 0.2 * PITCH, seed


@pytest.mark.parametrize("beyond", [0.9, 1.2, 1.5])
def test_a_speck_on_an_edges_line_beyond_its_corner_draws_no_spike(beyond: float) -> None:
    for seed in range(4):
        evidence = witnesses(cut_corner(0.0), seed=seed, sigma=0.25)
        seen = np.append(np.arange(len(evidence.points)), -1)
        evidence = evidence.take(seen)
        evidence.points[-1] = CORNER - [0.0, beyond * PITCH]
        evidence.position[-1] += 0.3 * PITCH
        ring = fitted(evidence).ring
        assert errors(ring, cut_corner(0.0)).max() < 0.2 * PITCH, seed


def lost_corner(seed: int) -> RingEvidence:
    """A square with the walls about its first corner pushed in by about half a cell, each by another amount."""
    evidence = witnesses(cut_corner(0.0), seed=seed, sigma=0.25)
    lost = np.abs(evidence.points - CORNER).sum(axis=1) < 1.3 * PITCH
    inward = 0.4 * PITCH + 0.3 * PITCH * np.random.default_rng(seed).random((len(lost), 2))
    return replace(evidence, points=evidence.points + np.where(lost[:, None], inward, 0.0))


def test_a_corner_of_one_lost_cell_with_its_walls_behind_is_half_a_pitch_off_at_the_most() -> None:
    # Now and then the ends behind it lie in line: then it is taken for a cut.
    missed = [distances(CORNER[None], fitted(lost_corner(seed)).ring)[0] > 0.6 * PITCH for seed in range(20)]
    assert np.mean(missed) <= 0.15


@pytest.mark.parametrize("seed", range(5))
def test_a_torn_stretch_of_many_cells_is_followed(seed: int) -> None:
    low, high, deep = 300.0, 1200.0, 1.7 * PITCH
    torn = np.array(
        [[low, low], [600, low], [660, low + deep], [800, low + deep], [860, low], [high, low], [high, 900], [low, 900]]
    )
    found = fitted(witnesses(torn, seed=seed, sigma=0.3, deep=0.05))
    assert errors(found.ring, torn).max() < 0.5 * PITCH


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("deep", [1.2, 1.5])
def test_a_torn_stretch_without_wall_ends_is_followed_too(deep: float, seed: int) -> None:
    low, high, floor = 300.0, 1200.0, 300.0 + deep * PITCH
    begin, end = 560.0, 560.0 + 7.0 * PITCH
    tear = [[begin, low], [begin + 2.0 * PITCH, floor], [end - 2.0 * PITCH, floor], [end, low]]
    torn = np.array([[low, low], *tear, [high, low], [high, 900.0], [low, 900.0]])
    evidence = witnesses(torn, seed=seed, sigma=0.4, spacing=0.9 * PITCH)
    along_tear = (evidence.points[:, 1] > low + 4.0) & (evidence.points[:, 1] < floor + 5.0)
    kind = np.where(along_tear, WitnessKind.OUTERMOST, evidence.kind).astype(np.int8)
    found = fitted(replace(evidence, kind=kind, sigma=np.where(along_tear, 1.0, evidence.sigma)))
    assert errors(found.ring, torn).max() < 0.5 * PITCH


@pytest.mark.parametrize("pitches", [2.2, 2.6])
def test_a_cut_seen_by_two_or_three_wall_ends_is_no_missing_cell(pitches: float) -> None:
    truth = cut_corner(pitches * PITCH)
    for seed in range(10):
        found = fitted(witnesses(truth, seed=seed, sigma=0.25, spacing=1.1 * PITCH))
        assert errors(found.ring, truth).max() < 0.5 * PITCH, seed


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("side", [4.0, 5.5])
def test_a_rectangular_hole_keeps_its_corners(side: float, seed: int) -> None:
    truth = rectangle(side * PITCH, 0.85 * side * PITCH, angle=0.1 * seed)
    found = fitted(witnesses(truth, seed=seed, sigma=0.3, spacing=0.7 * PITCH, hole=True))
    assert len(found.ring) == 4
    assert errors(found.ring, truth).max() < 0.15 * PITCH


@pytest.mark.parametrize("seed", range(1, 8))
def test_a_wall_broken_out_beside_a_rectangular_hole_does_not_round_it(seed: int) -> None:
    truth = rectangle(4.4 * PITCH, 4.0 * PITCH)
    evidence = witnesses(truth, seed=seed, sigma=0.3, hole=True)
    broken = np.abs(evidence.position - 2.0 * PITCH) < 0.55 * PITCH
    depth = np.where(broken, 0.8 * PITCH, 0.0)
    found = fitted(replace(evidence, points=evidence.points - depth[:, None] * evidence.normal))
    assert errors(found.ring, truth).max() < 0.4 * PITCH


def test_many_moderate_errors_make_no_extra_edges() -> None:
    truth = rectangle(900.0, 600.0)
    vertices = []
    for seed in range(12):
        evidence = witnesses(truth, seed=seed, sigma=0.2)
        rng = np.random.default_rng(seed)
        wide = np.where(rng.random(len(evidence.points)) < 0.2, rng.normal(0.0, 0.8, len(evidence.points)), 0.0)
        vertices.append(len(fitted(replace(evidence, points=evidence.points + wide[:, None] * evidence.normal)).ring))
    assert np.median(vertices) == 4
    assert max(vertices) <= 5


def test_a_wall_end_a_few_deviations_off_costs_less_than_its_square_and_a_far_one_its_cap() -> None:
    ready = prepare(witnesses(rectangle(900.0, 600.0), seed=1), PITCH, None)
    near, some, far = (cost(ready, -off * ready.inner) for off in (0.5, 3.0, 60.0))
    assert (near > 0.9 * 0.125).all()
    assert (some < 0.65 * 4.5).all()
    assert (far < ready.cap_inside).all()
    assert (far > 0.99 * ready.cap_inside).all()


def test_supports_are_the_nearest_witnesses_on_the_same_model() -> None:
    lies = np.array([False, True, False, True, False, False, True])
    place = np.array([5, 6, 7, 8, 2, 3, 4])
    begin, end = np.array([0, 0, 0, 0, 4, 4, 4]), np.array([4, 4, 4, 4, 7, 7, 7])
    back, ahead = supports(lies, place, begin, end)
    assert back.tolist() == [-1, 6, 6, 8, -1, -1, 4]
    assert ahead.tolist() == [6, 6, 8, 8, 4, 4, 4]
