"""Corners that are rounded and bends of which little is seen: curves, not tips outside of all that was seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from contour.outline.fit import FittedRing, fit_ring
from contour.walls.wall_evidence import RingEvidence, WitnessKind
from tests.support.pictures.outline_scenes import PITCH, blob, distances, errors, rectangle, witnesses


def fitted(evidence: RingEvidence) -> FittedRing:
    return fit_ring(evidence, pitch_px=PITCH, wall_px=3.0, rectifier=None)


def with_round_corners(ring: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """A convex polygon with quarter circles (or what its angles leave) in its corners."""
    parts = []
    for back, corner, ahead in zip(np.roll(ring, 1, axis=0), ring, np.roll(ring, -1, axis=0), strict=True):
        one, other = (complex(*(point - corner)) / np.hypot(*(point - corner)) for point in (back, ahead))
        half = 0.5 * abs(np.angle(other / one))
        middle = (one + other) / abs(one + other) * radius / np.sin(half)
        spread = np.linspace(half - 0.5 * np.pi, 0.5 * np.pi - half, 40)
        turned = spread if np.angle(other / one) < 0.0 else -spread
        arc = middle - middle / abs(middle) * radius * np.exp(1j * turned)
        if abs(arc[0] - one * abs(one) * 1e3) > abs(arc[-1] - one * 1e3):
            arc = arc[::-1]
        parts.append(np.column_stack([arc.real, arc.imag]) + corner)
    return np.concatenate(parts)


@pytest.mark.parametrize("pitches", [1.4, 2.0, 3.0])
@pytest.mark.parametrize("seed", range(4))
def test_corners_rounded_by_a_cell_or_two_are_drawn_round(pitches: float, seed: int) -> None:
    truth = with_round_corners(rectangle(12.0 * PITCH, 9.0 * PITCH), pitches * PITCH)
    found = fitted(witnesses(truth, seed=seed))
    assert errors(found.ring, truth).max() < 0.25 * PITCH


def one_round_corner(pitches: float) -> NDArray[np.float64]:
    """A square of 24 pitches with a quarter circle in its first corner."""
    low, high, radius = 300.0, 300.0 + 24.0 * PITCH, pitches * PITCH
    angle = np.linspace(-np.pi, -np.pi / 2, 40)
    arc = low + radius * (1.0 + np.column_stack([np.cos(angle), np.sin(angle)]))
    return np.vstack([[[high, low], [high, high], [low, high]], arc])


def on_the_arc(evidence: RingEvidence, pitches: float) -> NDArray[np.bool_]:
    return np.asarray((evidence.points < 300.0 + 0.9 * pitches * PITCH).all(axis=1))


@pytest.mark.parametrize("seed", [0, 1, 3, 6, 7])  # of which the fit makes a round corner
def test_an_arc_of_its_own_radius_that_one_end_alone_tells_from_a_corner_is_untold(seed: int) -> None:
    evidence = witnesses(one_round_corner(1.6), seed=seed, sigma=0.25)
    round_ = on_the_arc(evidence, 1.6)
    assert np.count_nonzero(round_) >= 2
    first = int(np.argmax(round_))
    outermost = round_ & (np.arange(len(round_)) != first)
    kind = np.where(outermost, WitnessKind.OUTERMOST, evidence.kind).astype(np.int8)
    (place,) = fitted(replace(evidence, kind=kind)).untold
    assert np.hypot(*(place - 300.0)) < 1.6 * PITCH


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("pitches", [3.0, 5.0])
def test_an_arc_that_several_ends_tell_is_no_corner(pitches: float, seed: int) -> None:
    assert not len(fitted(witnesses(one_round_corner(pitches), seed=seed, sigma=0.25)).untold)


@pytest.mark.parametrize(("pitches", "seed"), [(2.2, 0), (2.4, 1)])
def test_a_radius_between_those_that_are_tried_first_is_found(pitches: float, seed: int) -> None:
    """Of which the corner had been drawn 0.8 of a cell outside of the block."""
    truth = one_round_corner(pitches)
    assert errors(fitted(witnesses(truth, seed=seed, sigma=0.25)).ring, truth).max() < 0.1 * PITCH


@pytest.mark.parametrize("seed", [0, 2])  # of which the fit makes a corner
def test_a_corner_that_may_as_well_be_round_half_a_cell_within_is_untold(seed: int) -> None:
    found = fitted(witnesses(one_round_corner(1.4), seed=seed, sigma=0.25))
    assert np.hypot(*(found.ring - 300.0).T).min() < 0.1 * PITCH
    (place,) = found.untold
    assert np.hypot(*(place - 300.0)) < 0.1 * PITCH


@pytest.mark.parametrize("seed", range(4))
def test_a_corner_up_to_which_walls_end_is_told(seed: int) -> None:
    truth = rectangle(12.0 * PITCH, 9.0 * PITCH)
    assert not len(fitted(witnesses(truth, seed=seed, sigma=0.25)).untold)


@pytest.mark.parametrize("seed", range(8))
def test_small_arcs_that_are_alike_tell_each_other(seed: int) -> None:
    truth = with_round_corners(rectangle(12.0 * PITCH, 9.0 * PITCH), 1.5 * PITCH)
    assert not len(fitted(witnesses(truth, seed=seed, sigma=0.25)).untold)


@pytest.mark.parametrize("seed", range(8))
def test_broken_walls_beside_the_corners_of_a_small_block_round_none(seed: int) -> None:
    truth = rectangle(14.0 * PITCH, 10.0 * PITCH)
    found = fitted(witnesses(truth, seed=seed, deep=0.1))
    assert distances(truth, found.ring).max() < 0.1 * PITCH


@pytest.mark.parametrize("seed", range(6))
def test_a_bend_of_which_nothing_is_seen_is_no_corner_in_a_curve(seed: int) -> None:
    truth = blob(7.0 * PITCH)
    begin = 0.97 * np.hypot(*(np.roll(truth, -1, axis=0) - truth).T).sum()
    found = fitted(witnesses(truth, seed=seed, gaps=((begin, np.inf), (-np.inf, 0.02 * begin))))
    assert errors(found.ring, truth).max() < 0.3 * PITCH
