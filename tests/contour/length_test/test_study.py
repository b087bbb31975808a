"""The analysis of variance: what each share of the scatter comes from."""

from __future__ import annotations

import numpy as np
import pytest

from contour.errors import ParameterError
from contour.length_test.study import gauge_study

PARTS, PEOPLE, REPEATS = 5, 3, 4


def blank() -> np.ndarray:
    return np.zeros((PARTS, PEOPLE, REPEATS))


def test_lengths_that_differ_are_no_scatter() -> None:
    study = gauge_study(blank() + np.arange(PARTS)[:, None, None], 0.1)
    assert (study.total_mm, study.of_limits) == (0.0, 0.0)
    assert (study.lengths, study.operators, study.placements) == (PARTS, PEOPLE, REPEATS)


def test_what_an_operator_adds_is_reproducibility_alone() -> None:
    added = np.array([-0.02, 0.0, 0.02])
    study = gauge_study(blank() + added[None, :, None], 0.1)
    assert study.repeatability_mm == pytest.approx(0.0, abs=1e-12)
    assert study.interaction_mm == pytest.approx(0.0, abs=1e-12)
    assert study.reproducibility_mm == pytest.approx(float(np.std(added, ddof=1)))
    assert study.of_limits == pytest.approx(6 * 0.02 / 0.2)


def test_placements_scatter_is_repeatability_and_what_stays_below_it_is_nothing() -> None:
    study = gauge_study(blank() + np.array([-0.01, 0.01, -0.01, 0.01]), 0.1)
    assert study.repeatability_mm == pytest.approx(np.sqrt(REPEATS * 0.01**2 / (REPEATS - 1)))
    assert study.reproducibility_mm == 0.0


def test_variances_of_random_scatter_are_found_again() -> None:
    rng = np.random.default_rng(8)
    parts, people, repeats = 40, 40, 10
    errors = rng.normal(0, 0.03, (parts, people, repeats)) + rng.normal(0, 0.02, people)[None, :, None]
    errors += rng.normal(0, 0.01, (parts, people))[:, :, None] + rng.normal(0, 0.5, parts)[:, None, None]
    study = gauge_study(errors, 0.1)
    found = (study.repeatability_mm, study.operators_mm, study.interaction_mm)
    assert found == pytest.approx((0.03, 0.02, 0.01), rel=0.2)


@pytest.mark.parametrize("shape", [(1, 2, 2), (2, 1, 2), (2, 2, 1), (2, 2)])
def test_what_no_scatter_can_be_told_from_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ParameterError, match="expected two or more of each"):
        gauge_study(np.zeros(shape), 0.1)
