"""Where along an outline the table is as light as walls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from contour.acceptance.acceptance import View, judge
from contour.acceptance.edge_contrast import alike_edge
from contour.acceptance.findings import Limits, Refusal
from contour.acceptance.trace_check import CheckedTrace, check_trace
from contour.edge.edge_parts import EdgePart
from contour.geometry.rings import Contour, oriented_contour
from contour.polygon.polygon import Polygon
from contour.synthetic import render
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from tests.support.pictures.rings import SQUARE
from tests.support.scenes.random_scenes import random_scene

PITCH = 12.0
BLOCK = Contour(SQUARE * 24.0 + 60.0, (SQUARE[::-1] * 8.0 + 140.0,))
WALLS, CELLS = 200, 40


def comb(table: int, *, hole: int | None = None, walls: int = WALLS, cells: int = CELLS) -> NDArray[np.uint8]:
    """Stripes for cells, in a block with a hole on a table: grey levels."""
    picture = np.full((360, 360), table, np.uint8)
    block = np.where(np.arange(240) % 12 < 3, walls, cells).astype(np.uint8)
    picture[60:300, 60:300] = np.minimum(block, block[:, None]) if walls < cells else np.maximum(block, block[:, None])
    picture[140:220, 140:220] = table if hole is None else hole
    return picture


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("colour", [False, True])
def test_a_table_as_light_as_walls_is_told_all_around(clockwise: bool, colour: bool) -> None:
    contour = oriented_contour(BLOCK, counter_clockwise=not clockwise)
    picture = comb(190)
    picture = np.dstack([picture] * 3) if colour else picture
    found = alike_edge(picture, contour, PITCH, dark=False)
    assert found is not None
    assert found.length_pitches == pytest.approx(80.0, abs=1.0)


@pytest.mark.parametrize("table", [20, 100, 255])
def test_one_that_is_darker_or_lighter_is_not(table: int) -> None:
    assert alike_edge(comb(table), BLOCK, PITCH, dark=False) is None


def test_another_colour_parts_them_as_well() -> None:
    picture = np.dstack([comb(190), comb(190), comb(90)])
    assert alike_edge(picture, BLOCK, PITCH, dark=False) is None


def test_dark_walls_on_a_dark_table_are_alike_and_on_a_light_one_not() -> None:
    assert alike_edge(comb(50, walls=40, cells=200), BLOCK, PITCH, dark=True) is not None
    assert alike_edge(comb(240, walls=40, cells=200), BLOCK, PITCH, dark=True) is None


def test_a_hole_is_looked_into() -> None:
    found = alike_edge(comb(20, hole=200), BLOCK, PITCH, dark=False)
    assert found is not None
    assert found.length_pitches == pytest.approx(320 / 12.0, abs=1.0)
    assert min(found.place_px) >= 139
    assert max(found.place_px) <= 221
    assert found.moved(10.0, 20.0).place_px == (found.place_px[0] + 10.0, found.place_px[1] + 20.0)


def test_a_part_of_the_edge_is_told_with_its_place() -> None:
    picture = comb(20)
    picture[40:60, 120:240] = 200
    found = alike_edge(picture, BLOCK, PITCH, dark=False)
    assert found is not None
    assert found.length_pitches == pytest.approx(10.0, abs=1.5)
    assert found.place_px == pytest.approx((180.0, 60.0), abs=8.0)


def checked(table: float) -> tuple[CheckedTrace, View]:
    """A block of bright walls on a table of that light, as it is measured."""
    scene = random_scene(5).scene
    assert scene.material.top > 0.5
    picture = render(replace(scene, table=replace(scene.table, level=table * scene.material.top))).picture
    return check_trace(picture, trace(picture, TraceSettings()), None), View(picture.shape[1::-1])


def said(one: CheckedTrace, view: View) -> list[str]:
    """What is said against the picture."""
    findings = judge(Polygon(one.trace.contour, None, 1e4, None, None), view, Limits(), traced=one)
    return [finding.text for finding in findings if finding.refusal == Refusal.IMAGE_QUALITY]


def test_a_block_on_such_a_table_is_refused_with_the_next_step() -> None:
    (text,) = said(*checked(1.0))
    assert "is as light as its walls" in text
    assert "Use a table that is darker" in text


def test_on_a_dark_table_it_is_not_but_where_too_much_of_the_edge_is_alike() -> None:
    one, view = checked(0.1)
    assert one.alike is None
    for length, count in ((4.0, 0), (4.25, 1)):
        assert len(said(replace(one, alike=EdgePart(length, (10.0, 20.0))), view)) == count
