"""The bench's own judge is right where the answer is known, and its table says what was measured."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.placement import pose_search
from benchmarks.placement.__main__ import Laid, report
from benchmarks.placement.parts import random_part
from benchmarks.placement.pose_search import Found, margin, search, shape_of, signed_margin
from contour.geometry.rings import area, contour_defect
from contour.synthetic import disc_ring, rectangle, with_holes

BLOCK = rectangle((150.0, 100.0), 300.0, 200.0)


def test_the_search_comes_near_the_known_best_and_polishing_reaches_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pose_search, "POSES", 100_000)
    found = search(rectangle((7.0, -3.0), 260.0, 120.0), BLOCK, 1)
    assert 16.0 < found.searched_mm <= found.polished_mm
    assert found.polished_mm == pytest.approx(20.0, abs=0.1)


def test_margin_is_that_to_the_edge_and_to_holes_and_none_outside() -> None:
    block = shape_of(with_holes(BLOCK, disc_ring((250.0, 100.0), 20.0)))
    assert margin(shape_of(rectangle((100.0, 100.0), 100.0, 100.0)), block) == pytest.approx(50.0)
    assert margin(shape_of(rectangle((190.0, 100.0), 60.0, 20.0)), block) == pytest.approx(10.0, abs=0.01)
    assert margin(shape_of(rectangle((250.0, 100.0), 90.0, 90.0)), block) == -np.inf
    assert margin(shape_of(rectangle((300.0, 100.0), 50.0, 50.0)), block) == -np.inf


def test_what_leaves_the_block_is_told_by_how_far() -> None:
    block = shape_of(with_holes(BLOCK, disc_ring((250.0, 100.0), 20.0)))
    assert signed_margin(shape_of(rectangle((100.0, 100.0), 100.0, 100.0)), block) == pytest.approx(50.0)
    assert signed_margin(shape_of(rectangle((48.0, 100.0), 100.0, 100.0)), block) == pytest.approx(-2.0)
    assert signed_margin(shape_of(rectangle((190.0, 100.0), 82.0, 20.0)), block) == pytest.approx(-1.0, abs=0.01)


def test_parts_are_sound_and_of_the_size_that_is_said() -> None:
    for seed in range(20):
        part = random_part(BLOCK, seed)
        assert contour_defect(part) is None
        assert 0.08 * area(BLOCK) <= area(part) * (1 + 1e-9) <= 0.5 * area(BLOCK) * (1 + 2e-9)


def test_the_table_counts_what_fits_and_what_lies_nearer_than_its_bound() -> None:
    def laid(margin_mm: float, polished_mm: float, true_mm: float) -> Laid:
        return Laid(5, margin_mm, margin_mm, Found(polished_mm, polished_mm), 0.5, 0.25, true_mm, 0.2, 0.1)

    text = report([laid(4.0, 4.05, 3.8), laid(2.0, 2.3, 1.2), laid(-3.0, -np.inf, -np.inf)], 1)
    assert "| parts that fit with some margin | 2 of 3 |" in text
    assert "| behind these by more than 0.1 mm | 1 |" in text
    assert "| nearer to the rendered edge than margin less the bound for parts | 1 of 2 |" in text
    assert "| the worst of them, by | 0.30 mm |" in text
