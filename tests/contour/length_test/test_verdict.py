"""Errors against limits: budget, decision, planes, and what is missing of a test."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contour.calibration.calibration import SimpleCalibration
from contour.length_test.coverage import FEWEST_A_DIRECTION, missing
from contour.length_test.seen_gauge import SeenGauge, SeenLength
from contour.length_test.verdict import (
    Conditions,
    Decision,
    KnownLength,
    Limit,
    decided,
    height_limit_mm,
    length_errors,
    plane_errors,
    together,
)

CALIBRATION = SimpleCalibration(900, 600, 1.0, (0.0, 599.0))


def gauge(
    x: float, y: float, turn_deg: float, size: float = 100.0, measured: float = 100.0, lift: float = 0.0
) -> SeenGauge:
    """A gauge of one length, its outline half as wide as long."""
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    box = np.array([[-0.5, -0.25], [0.5, -0.25], [0.5, 0.25], [-0.5, 0.25]]) * size
    ends = np.array([[-0.5, 0.0], [0.5, 0.0]]) * size
    turn = np.array([[c, s], [-s, c]])
    length = SeenLength("only", measured, ends @ turn + [x, y], -0.1)
    return SeenGauge((length,), (), box @ turn + [x, y], turn_deg, np.array([0.0, 0.0, 0.0, lift]) + 20.0)


@given(error=st.floats(-1, 1), unsure=st.floats(0, 1), limit=st.floats(0.001, 1))
def test_what_passes_is_within_for_any_truth_and_what_fails_beyond(error: float, unsure: float, limit: float) -> None:
    found = decided(error, unsure, limit)
    least, most = max(abs(error) - unsure, 0.0), abs(error) + unsure
    assert (found is Decision.PASSES) == (most <= limit)
    assert (found is Decision.FAILS) == (least > limit)


def test_one_failure_fails_and_one_doubt_does_not_pass() -> None:
    yes, no, doubt = Decision.PASSES, Decision.FAILS, Decision.UNDECIDED
    assert together([yes, yes]) is yes
    assert together([yes, doubt]) is doubt
    assert together([doubt, no, yes]) is no
    assert together([]) is doubt, "nothing measured is nothing shown"


def test_the_budget_is_of_gauge_warmth_and_height_and_the_gauge_grows() -> None:
    known = (KnownLength("only", 100.0, 0.02),)
    conditions = Conditions(0.2, 1e-5, 4.0, 0.5)
    (found,) = length_errors("p", gauge(0, 0, 0, measured=100.05), known, conditions, Limit(0.1, 0.5))
    assert found.true_mm == pytest.approx(100.004)
    assert found.error_mm == pytest.approx(0.046)
    parts = (found.budget.gauge_mm, found.budget.temperature_mm, found.budget.height_mm)
    assert parts == pytest.approx((0.01, 0.0005, 0.01))
    assert found.budget.expanded_mm == pytest.approx(2 * np.sqrt(0.01**2 + 0.0005**2 + 0.01**2))
    assert found.limit_mm == pytest.approx(0.15)
    assert found.decision is Decision.PASSES


def test_planes_are_held_against_their_mean_height() -> None:
    seen = [("a", gauge(0, 0, 0)), ("b", gauge(0, 0, 0, lift=0.8))]
    flat, lifted = plane_errors(seen, 0.05, 0.3)
    assert (flat.off_mm, lifted.off_mm) == pytest.approx((-0.1, 0.7))
    assert (flat.decision, lifted.decision) == (Decision.PASSES, Decision.FAILS)
    assert plane_errors([], 0.05, 0.3) == ()
    assert height_limit_mm(CALIBRATION, 0.0, Limit(0.1)) > 1e4, "nothing shifts under a camera infinitely high"


def test_what_is_missing_is_told_until_nothing_is() -> None:
    one = [gauge(450, 300, 0)]
    lack = missing(one, CALIBRATION, 0.0, 5)
    assert (lack.places, len(lack.zones)) == (4, 8)
    assert ("left", "top") in lack.zones
    assert ("middle", "middle") not in lack.zones
    assert dict(lack.directions) == {"x": 2, "rising": 3, "y": 3, "falling": 3}
    turns = [0, 45, 90, 135] * FEWEST_A_DIRECTION
    grid = [(x, y) for y in (80, 300, 520) for x in (80, 300, 600, 820)]
    all_of_it = [gauge(x, y, turn) for (x, y), turn in zip(grid, turns, strict=True)]
    assert missing(all_of_it, CALIBRATION, 0.0, 5).nothing
    assert not missing(all_of_it, CALIBRATION, 0.0, 13).nothing


@pytest.mark.parametrize(
    ("turn", "name"), [(0, "x"), (22, "x"), (23, "rising"), (90, "y"), (135, "falling"), (170, "x")]
)
def test_a_direction_is_within_an_eighth_of_a_turn(turn: float, name: str) -> None:
    assert gauge(0, 0, turn).lengths[0].direction == name
    assert gauge(0, 0, turn + 180).lengths[0].direction == name
