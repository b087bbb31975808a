"""Corners that are rounded and bends of which little is seen: curves, not tips outside of all that was seen."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from contour.outline.fit import FittedRing, fit_ring
from contour.walls.wall_evidence import RingEvidence
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
