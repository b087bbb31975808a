"""Deviations of outlines whose difference is known, wherever they lie, and the scatter of many."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contour.errors import ParameterError
from contour.geometry.comparison import compare, scatter_mm
from contour.geometry.rings import Contour

L_SHAPE = Contour(np.array([[0.0, 0], [200, 0], [200, 80], [90, 80], [90, 150], [0, 150]]))
HOLED = Contour(L_SHAPE.exterior, (np.array([[20.0, 20], [20, 60], [60, 60], [60, 20]]),))


def moved(contour: Contour, degrees: float, shift: tuple[float, float]) -> Contour:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    rings = [ring @ np.array([[c, s], [-s, c]]) + shift for ring in contour.rings]
    return Contour(rings[0], tuple(rings[1:]))


@settings(max_examples=12)
@given(st.floats(-180, 180), st.floats(-500, 500), st.floats(-500, 500))
def test_a_moved_outline_is_laid_back_without_deviation(degrees: float, x: float, y: float) -> None:
    found = compare(moved(HOLED, degrees, (x, y)), HOLED, fit=True)
    assert found.worst_mm < 1e-6
    assert np.cos(np.radians(found.turn_deg + degrees)) == pytest.approx(1, abs=1e-9)


def test_in_place_a_shift_counts() -> None:
    found = compare(moved(L_SHAPE, 0.0, (0.3, 0.0)), L_SHAPE, fit=False)
    assert found.worst_mm == pytest.approx(0.3, abs=1e-9)
    assert found.bias_mm == pytest.approx(0.0, abs=0.01)


def test_an_outline_too_large_has_a_bias_outwards_and_a_hole_too_large_inwards() -> None:
    larger = Contour(np.array([[-0.5, -0.5], [200.5, -0.5], [200.5, 80.5], [90.5, 80.5], [90.5, 150.5], [-0.5, 150.5]]))
    found = compare(larger, L_SHAPE, fit=True)
    assert found.bias_mm == pytest.approx(0.5, abs=0.02)
    assert found.p95_mm == pytest.approx(0.5, abs=0.02)
    hole = np.array([[19.0, 19], [19, 61], [61, 61], [61, 19]])
    holed = compare(Contour(HOLED.exterior, (hole,)), HOLED, fit=False)
    assert holed.bias_mm < 0
    assert holed.worst_mm == pytest.approx(np.sqrt(2), abs=0.05)


def test_a_missing_hole_is_another_part() -> None:
    with pytest.raises(ParameterError, match="0 holes, the master 1"):
        compare(L_SHAPE, HOLED, fit=True)


def test_scatter_is_the_deviation_across_the_edge() -> None:
    rng = np.random.default_rng(1)
    outlines = [moved(L_SHAPE, 0.0, (float(rng.normal(0, 0.1)), 0.0)) for _ in range(400)]
    spread = scatter_mm(outlines)
    upright = np.sort(spread)[-150:]
    assert np.median(upright) == pytest.approx(0.1, rel=0.1)
    assert np.sort(spread)[:150].max() < 0.01
