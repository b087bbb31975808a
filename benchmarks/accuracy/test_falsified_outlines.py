"""What the benchmark of false outlines does to an outline."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.accuracy.falsified_outlines import report, too_fat, with_notch, with_spike
from contour.geometry.rings import Contour, area, contour_defect

SQUARE = Contour(np.array([[100.0, 100.0], [500.0, 100.0], [500.0, 500.0], [100.0, 500.0]]))
TURNED = Contour(SQUARE.exterior[::-1].copy())


@pytest.mark.parametrize("contour", [SQUARE, TURNED], ids=["one way around", "the other"])
@pytest.mark.parametrize("seed", range(4))
def test_spikes_add_and_notches_take_a_triangle_four_cells_long_and_one_wide(contour: Contour, seed: int) -> None:
    for falsify, sign in ((with_spike, 1.0), (with_notch, -1.0)):
        false = falsify(contour, 20.0, np.random.default_rng(seed))
        assert contour_defect(false) is None
        assert area(false) - area(contour) == pytest.approx(sign * 0.5 * 20.0 * 80.0)


@pytest.mark.parametrize("contour", [SQUARE, TURNED], ids=["one way around", "the other"])
def test_too_fat_is_a_cell_wider_on_every_side(contour: Contour) -> None:
    assert area(too_fat(contour, 20.0, np.random.default_rng(1))) == pytest.approx(440.0**2, rel=1e-3)


def test_outlines_that_cannot_be_falsified_do_not_count() -> None:
    text = report([(True, False, None, False), (True, True, True, False)], range(2))
    assert "| a cell too fat everywhere | 1 | 1 |" in text
    assert "| a notch four cells deep, one wide | 2 | 1 |" in text
