"""The bench knows how ribbons were drawn, and counts what was told of them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.placement.ribbon import Read, drawn_ribbon, jobs, report
from contour.ribbon.ribbon import Ribbon
from contour.synthetic import CellGeometry, Scene, camera_above, rectangle
from service.parts.core_ribbon import CoreRibbon

SCENE = Scene(rectangle((80.0, 60.0), 110.0, 85.0), camera_above(640, 480, 0.25), CellGeometry(ribbon_deg=175.0))


def test_ribbons_are_known_as_they_were_drawn() -> None:
    assert drawn_ribbon(SCENE) == pytest.approx(175.0)
    warped = drawn_ribbon(replace(SCENE, cells=replace(SCENE.cells, warp=0.15)))
    assert warped is not None
    assert 0.0 < abs(warped - 175.0) < 5.0
    assert drawn_ribbon(replace(SCENE, cells=replace(SCENE.cells, kind="foam"))) is None


def test_no_block_is_drawn_twice() -> None:
    drawn = list(jobs(7, 60))
    assert len(set(drawn)) == len(drawn)
    assert {group for group, _, _ in drawn} >= {"random", "shop floor", "over-expanded"}


def test_told_where_there_is_none_is_wrong() -> None:
    def read(angle_deg: float | None, true_deg: float | None) -> Read:
        told = Ribbon(why="no") if angle_deg is None else Ribbon(angle_deg, 0.5, "walls")
        return Read("random", 1, CoreRibbon(told), true_deg, 0.1)

    text = report([read(179.8, 0.1), read(5.0, 65.0), read(5.0, None), read(None, 4.0)], 1, 4)
    assert "| random | 4 | 3 | 3 | 0 | 0 | 1 | 2 | 0.30 | 1 of 3 |" in text
