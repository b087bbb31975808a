"""What jogging's spread explains is taken, what it does not is refused: by simulation, and where the law is known."""

from __future__ import annotations

import numpy as np
import pytest

from contour.calibration.calibration import Alignment
from contour.camera_calibration.alignment_fit import AlignmentFit, AlignmentLimits, explained, fit_alignment

MACHINE = Alignment(30.0, (1000.0, -50.0))
PLACES = np.array([[0.0, 0.0], [400.0, 0.0], [400.0, 300.0], [0.0, 300.0], [200.0, 150.0]])
SETS = 1500


def fits(spread_mm: float, repeats: int, limits: AlignmentLimits, scale: float = 1.0) -> list[AlignmentFit]:
    """Alignments through places that a person jogs to again and again, all sound."""
    rng = np.random.default_rng(7)
    work = np.repeat(PLACES, repeats, axis=0)
    machine = MACHINE.apply(scale * work)
    return [fit_alignment(work, machine + rng.normal(0, spread_mm, work.shape), limits) for _ in range(SETS)]


def refused(found: list[AlignmentFit]) -> float:
    return sum(fit.refusal is not None for fit in found) / SETS


@pytest.mark.parametrize("repeats", [1, 2, 5])
def test_sound_points_are_refused_in_at_most_5_of_100_sets(repeats: int) -> None:
    """And the bound is no idle one: with twice the spread that it is told, most sets are refused."""
    unscaled = AlignmentLimits(jog_mm=0.05, accept_scale=1.0)
    assert refused(fits(0.05, repeats, unscaled)) <= 0.05
    if repeats == 1:
        assert refused(fits(0.15, repeats, unscaled)) > 0.8


def test_a_place_that_is_off_beyond_the_repeats_spread_is_refused_and_named() -> None:
    rng = np.random.default_rng(3)
    work = np.repeat(PLACES, 3, axis=0)
    machine = MACHINE.apply(work) + rng.normal(0, 0.03, work.shape)
    machine[3:6] += [0.35, -0.2]
    assert fit_alignment(work, machine).refusal is not None
    assert "point 4 lies 0." in fit_alignment(work, machine).refusal.text
    assert fit_alignment(work, machine, AlignmentLimits(accept_mm=0.5)).refusal is None


@pytest.mark.parametrize("repeats", [1, 3])
def test_the_scales_interval_holds_it_in_95_of_100_sets(repeats: int) -> None:
    found = fits(0.1, repeats, AlignmentLimits(), scale=1.0004)
    held = np.mean([abs(fit.scale - 1.0004) <= fit.scale_95 for fit in found])
    assert held == pytest.approx(0.95, abs=0.02)


def test_a_scale_that_scatter_explains_gets_another_advice_than_one_it_does_not() -> None:
    near = 0.05 * PLACES
    scattered = np.array([[0.05, 0.02], [-0.04, 0.05], [0.06, 0.05], [0.02, -0.05], [-0.09, -0.07]])
    fit = fit_alignment(near, MACHINE.apply(near) + 2 * scattered)
    assert abs(fit.scale - 1) > 0.001
    assert fit.refusal is not None
    assert "The points' own scatter explains as much: jog to points farther apart" in fit.refusal.text
    fit = fit_alignment(PLACES, MACHINE.apply(1.0011 * PLACES))
    assert fit.refusal is not None
    assert "Check --square-mm" in fit.refusal.text
    assert fit_alignment(PLACES, MACHINE.apply(1.0009 * PLACES)).refusal is None


def test_the_bound_for_a_spread_by_many_repeats_is_that_of_a_known_one() -> None:
    """And F's closed quantile: 9.55 for 2 and 3 degrees, 5 % (Abramowitz and Stegun, table 26.9)."""
    assert explained(0.1, 100_000, 4) == pytest.approx(explained(0.1, 0, 4), rel=1e-3)
    assert explained(1.0, 3, 1) ** 2 / 2 == pytest.approx(9.55, abs=0.01)
