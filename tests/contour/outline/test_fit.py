"""The outline through witnesses: accuracy, robustness, corners, curves, laws of symmetry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from contour.errors import NoBlockFound
from contour.outline.fit import FittedRing, fit_ring
from contour.walls.wall_evidence import RingEvidence, WitnessKind
from tests.support.pictures.outline_scenes import (
    PITCH,
    area,
    blob,
    circle,
    distances,
    errors,
    perimeter,
    rectangle,
    witnesses,
)


def fitted(evidence: RingEvidence) -> FittedRing:
    return fit_ring(evidence, pitch_px=PITCH, wall_px=3.0, rectifier=None)


@pytest.mark.parametrize("seed", range(12))
def test_a_rectangle_has_four_vertices_where_its_edges_meet(seed: int) -> None:
    truth = rectangle(900.0, 600.0)
    found = fitted(witnesses(truth, seed=seed, deep=0.1, outside=0.01))
    assert len(found.ring) == 4
    assert distances(truth, found.ring).max() < 0.6
    assert errors(found.ring, truth).mean() < 0.2


def test_long_edges_reach_the_error_of_a_mean_of_their_witnesses() -> None:
    truth = rectangle(1600.0, 1200.0)
    mean = [errors(fitted(witnesses(truth, seed=seed, sigma=0.5)).ring, truth).mean() for seed in range(10)]
    assert np.median(mean) < 0.12


def test_the_outline_has_no_bias_though_one_in_ten_witnesses_lies_deep() -> None:
    truth = circle(400.0)
    grown = [
        (area(fitted(witnesses(truth, seed=seed, deep=0.1, sigma=0.3)).ring) - area(truth)) / perimeter(truth)
        for seed in range(20)
    ]
    assert abs(np.mean(grown)) < 0.03


@pytest.mark.parametrize("seed", range(8))
def test_a_corner_whose_cells_are_gone_is_where_its_edges_meet(seed: int) -> None:
    truth = rectangle(900.0, 600.0)
    corner = 900.0
    found = fitted(witnesses(truth, seed=seed, gaps=((corner - 1.4 * PITCH, corner + 1.4 * PITCH),)))
    assert distances(truth, found.ring).max() < 0.8
    assert len(found.ring) == 4


@pytest.mark.parametrize("seed", range(8))
def test_missing_cells_are_bridged(seed: int) -> None:
    truth = rectangle(900.0, 600.0)
    evidence = witnesses(truth, seed=seed)
    dent = np.abs(evidence.position - 430.0) < 1.3 * PITCH
    evidence = replace(evidence, points=evidence.points - np.where(dent, 0.85 * PITCH, 0.0)[:, None] * evidence.normal)
    found = fitted(evidence)
    assert errors(found.ring, truth).max() < 1.0
    assert not found.inlier[dent].any()


@pytest.mark.parametrize("seed", range(6))
def test_debris_does_not_pull_the_outline_out(seed: int) -> None:
    truth = rectangle(900.0, 600.0)
    found = fitted(witnesses(truth, seed=seed, outside=0.04))
    assert errors(found.ring, truth).max() < 1.5


@pytest.mark.parametrize("seed", range(6))
def test_a_notch_of_five_pitches_is_kept(seed: int) -> None:
    notch = (
        np.array([[0, 0], [900, 0], [900, 600], [560, 600], [560, 480], [430, 480], [430, 600], [0, 600]], float)
        + 300.0
    )
    found = fitted(witnesses(notch, seed=seed, deep=0.03))
    assert errors(found.ring, notch).max() < 0.3 * PITCH
    assert len(found.ring) <= 10


@pytest.mark.parametrize("seed", [0, 1, 2, 7])
def test_no_arc_cuts_off_the_short_edge_of_a_pocket(seed: int) -> None:
    """With three in ten witnesses deep, an arc past six of that edge's was better than what lay near it."""
    pocket = np.array([[0, 0], [24, 0], [24, 8], [15, 8], [15, 15], [24, 15], [24, 23], [0, 23]]) * PITCH + 100.0
    found = fitted(witnesses(pocket, seed=seed, deep=0.3, sigma=0.3, outside=0.05))
    assert distances(pocket, found.ring).max() < 0.6 * PITCH


@pytest.mark.parametrize("seed", range(6))
def test_a_circular_hole_is_one_arc_with_the_holes_own_direction(seed: int) -> None:
    truth = circle(150.0)
    found = fitted(witnesses(truth, seed=seed, deep=0.05, hole=True))
    assert found.segments == 1
    assert area(found.ring) < 0.0
    assert errors(found.ring, truth).mean() < 0.25


@pytest.mark.parametrize("seed", range(6))
def test_a_free_curve_is_followed_within_its_noise(seed: int) -> None:
    truth = blob(380.0)
    found = fitted(witnesses(truth, seed=seed, deep=0.05, sigma=0.3))
    assert errors(found.ring, truth).mean() < 0.3
    assert errors(found.ring, truth).max() < 0.12 * PITCH


def test_stated_noise_may_be_wrong_by_two_either_way() -> None:
    truth = rectangle(900.0, 600.0)
    for noise in (0.5, 2.0):
        found = fitted(witnesses(truth, seed=3, noise=noise))
        assert len(found.ring) == 4
        assert found.spread_px == pytest.approx(0.2, abs=0.06)


def test_fillers_of_a_zigzag_edge_count_less_than_wall_ends_but_carry_an_edge_alone() -> None:
    truth = rectangle(900.0, 600.0)
    evidence = witnesses(truth, seed=5)
    edge = evidence.position < 900.0
    kind = np.where(edge, WitnessKind.OUTERMOST, evidence.kind).astype(np.int8)
    rough = np.random.default_rng(1).normal(0.0, 1.0, len(kind))
    points = evidence.points + np.where(edge, rough, 0.0)[:, None] * evidence.normal
    found = fitted(replace(evidence, points=points, kind=kind, sigma=np.where(edge, 1.0, evidence.sigma)))
    assert len(found.ring) == 4
    assert errors(found.ring, truth).max() < 2.0


def test_vertex_deviations_tell_the_size_of_the_corners_errors() -> None:
    truth = rectangle(900.0, 600.0)
    ratio = []
    for seed in range(30):
        found = fitted(witnesses(truth, seed=seed, sigma=0.4))
        ratio.append(distances(found.ring, truth[[0, 0, 0]]).min() / found.vertex_sigma_px.mean())
    assert 0.4 < np.sqrt(np.mean(np.square(ratio))) < 2.0


def test_a_stretch_without_witnesses_is_counted_as_unseen() -> None:
    truth = rectangle(900.0, 600.0)
    assert fitted(witnesses(truth, seed=1)).unseen_share == 0.0
    found = fitted(witnesses(truth, seed=1, gaps=((200.0, 500.0),)))
    assert found.unseen_share == pytest.approx((300.0 - 2.0 * PITCH) / 3000.0, abs=0.02)


def test_too_few_witnesses_are_refused_with_their_number() -> None:
    evidence = witnesses(circle(150.0), seed=1, spacing=200.0)
    assert len(evidence.points) < 6
    with pytest.raises(NoBlockFound, match=f"{len(evidence.points)} wall ends"):
        fitted(evidence)


def test_witnesses_of_one_side_only_are_no_outline() -> None:
    with pytest.raises(NoBlockFound, match="on a single line"):
        fitted(witnesses(rectangle(900.0, 600.0), seed=1, sigma=0.5, gaps=((450.0, 3000.0),)))


def moved(evidence: RingEvidence, turn: NDArray[np.float64], scale: float, mirror: bool) -> RingEvidence:
    """The evidence in a turned (and mirrored) picture; a mirrored ring runs the other way round."""
    matrix = turn * scale
    evidence = replace(
        evidence,
        coarse=evidence.coarse @ matrix.T,
        points=evidence.points @ matrix.T,
        normal=evidence.normal @ turn.T,
        position=evidence.position * scale,
        sigma=evidence.sigma * scale,
    )
    if not mirror:
        return evidence
    total = perimeter(evidence.coarse)
    back = slice(None, None, -1)
    return replace(
        evidence,
        coarse=evidence.coarse[back],
        points=evidence.points[back],
        normal=evidence.normal[back],
        position=(total - evidence.position)[back],
        sigma=evidence.sigma[back],
        kind=evidence.kind[back],
    )


@settings(max_examples=20, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10_000), quarter=st.integers(0, 3), mirror=st.booleans(), scale=st.sampled_from([0.5, 1.0, 3.0])
)
def test_the_outline_turns_scales_and_mirrors_with_the_picture(
    seed: int, quarter: int, mirror: bool, scale: float
) -> None:
    evidence = witnesses(rectangle(900.0, 600.0), seed=seed, deep=0.05)
    angle = 0.5 * np.pi * quarter
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    if mirror:
        turn = turn @ np.diag([1.0, -1.0])
    one = fitted(evidence).ring @ (turn * scale).T
    other = fit_ring(moved(evidence, turn, scale, mirror), pitch_px=PITCH * scale, wall_px=3.0, rectifier=None).ring
    assert errors(one, other).max() < 0.3 * scale


@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000), shift=st.integers(1, 100))
def test_the_outline_does_not_depend_on_where_the_ring_begins(seed: int, shift: int) -> None:
    evidence = witnesses(rectangle(900.0, 600.0), seed=seed, deep=0.05)
    total = perimeter(evidence.coarse)
    first = shift % len(evidence.points)
    order = np.roll(np.arange(len(evidence.points)), -first)
    begin = evidence.position[first]
    other = RingEvidence(
        evidence.coarse,
        evidence.is_hole,
        evidence.points[order],
        np.mod(evidence.position[order] - begin, total),
        evidence.normal[order],
        evidence.sigma[order],
        evidence.kind[order],
    )
    assert errors(fitted(evidence).ring, fitted(other).ring).max() < 0.3


def test_the_same_evidence_gives_the_same_outline_to_the_bit() -> None:
    evidence = witnesses(blob(300.0), seed=7, deep=0.05)
    assert (fitted(evidence).ring == fitted(evidence).ring).all()


class Barrel:
    """A lens about (700, 500) that pulls points in with the square of their distance."""

    centre = np.array([700.0, 500.0])

    def unrectify(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        away = points - self.centre
        return self.centre + away * (1.0 - 1e-7 * (away**2).sum(axis=1, keepdims=True))

    def rectify(self, points_px: NDArray[np.float64]) -> NDArray[np.float64]:
        seen = points_px - self.centre
        away = seen.copy()
        for _ in range(40):
            away = seen / (1.0 - 1e-7 * (away**2).sum(axis=1, keepdims=True))
        return self.centre + away


@pytest.mark.parametrize("seed", range(6))
def test_a_rectangle_through_a_distorting_lens_has_four_vertices_when_the_lens_is_known(seed: int) -> None:
    lens, truth = Barrel(), rectangle(900.0, 600.0)
    flat = witnesses(truth, seed=seed, deep=0.05)
    points = lens.unrectify(flat.points)
    normal = lens.unrectify(flat.points + flat.normal) - points
    seen = replace(flat, points=points, normal=normal, coarse=lens.unrectify(flat.coarse))
    found = fit_ring(seen, pitch_px=PITCH, wall_px=3.0, rectifier=lens)
    assert len(found.ring) == 4
    assert errors(lens.rectify(found.ring), truth).mean() < 0.2
    blind = fit_ring(seen, pitch_px=PITCH, wall_px=3.0, rectifier=None)
    bent = lens.unrectify(
        np.array([truth[k] + (truth[k - 3] - truth[k]) * t for k in range(4) for t in np.linspace(0, 1, 50)])
    )
    assert errors(blind.ring, bent).mean() < 0.3
    assert 4 < len(blind.ring) <= 24
