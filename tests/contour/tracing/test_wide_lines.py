"""Lines along an outline that are wider than walls."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from contour.acceptance.acceptance import View, judge
from contour.acceptance.findings import Limits, Refusal
from contour.acceptance.trace_check import CheckedTrace
from contour.edge.edge_parts import EdgePart
from contour.edge.stretches import Stretch
from contour.geometry.rings import Contour, oriented
from contour.polygon.polygon import Polygon
from contour.synthetic import render
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from contour.tracing.wide_lines import wide_line
from tests.support.scenes.shop_floor_scenes import shop_floor_scene

PITCH, WALL, SCALE = 32.0, 6.0, 2
BLOCK = Contour(oriented(np.array(shapely.box(160, 160, 800, 672).exterior.coords)[:-1], counter_clockwise=False), ())


def walls(*strokes: tuple[tuple[int, int], tuple[int, int], int]) -> NDArray[np.uint8]:
    """A mask of a grid of walls, and of strokes between two places of so many pixels, in samples of two pixels."""
    mask = np.zeros((416, 480), np.uint8)
    inside = np.s_[80:336, 80:400]
    lines = np.arange(480) % 16 < 3
    mask[inside] = 255 * (lines[None, :] | lines[:416, None])[inside]
    for first, last, wide in strokes:
        cv2.line(mask, first, last, 255, wide)
    return mask


def found(mask: NDArray[np.uint8], *evidence: Stretch) -> EdgePart | None:
    return wide_line(mask, BLOCK, evidence, pitch_px=PITCH, wall_px=WALL, scale=SCALE)


def test_walls_are_none_though_one_lies_all_along_the_cut() -> None:
    assert found(walls()) is None
    along = walls()
    along[335:338, 80:400] = 255
    assert found(along) is None


@pytest.mark.parametrize(("long", "told"), [(1.2, False), (4.0, True)])
def test_a_wider_one_over_two_cells_is_told_with_its_length_and_place(long: float, told: bool) -> None:
    half = round(long * PITCH / SCALE / 2)
    one = found(walls(((400, 200 - half), (400, 200 + half), 9)))
    assert (one is not None) == told
    if one is not None:
        assert one.length_pitches == pytest.approx(long, abs=0.7)
        assert one.place_px == pytest.approx((800, 400), abs=0.5 * PITCH)


def test_where_walls_are_as_wide_all_over_the_block_a_line_as_wide_is_one_of_them() -> None:
    mask = walls(((400, 168), (400, 232), 9))
    assert found(np.asarray(cv2.dilate(mask, np.ones((5, 5), np.uint8)), np.uint8)) is not None
    crossed = [((80 + 16 * step, 80), (80 + 16 * step, 335), 9) for step in range(20)]
    assert found(walls(((400, 168), (400, 232), 9), *crossed)) is None


def test_what_the_evidence_tells_is_left_out() -> None:
    mask = walls(((400, 168), (400, 232), 9))
    length = float(shapely.LinearRing(BLOCK.exterior).length)
    assert found(mask, Stretch(0, 0.0, length, "seen", None, 1.0)) is not None
    assert found(mask, Stretch(0, 0.0, length, "seen", "compound", 1.0)) is None


def test_ink_beside_the_edge_is_refused_with_its_place_where_the_picture_is_asked() -> None:
    rendered = render(shop_floor_scene("writing", 2_100_079).scene)
    one = trace(rendered.picture, TraceSettings())
    assert one.wide is not None
    checked = CheckedTrace(one).moved(np.array([10.0, 0.0]))
    polygon = Polygon(checked.trace.contour, None, 1e4, None, None)
    view, limits = View((4000, 4000)), Limits(max_disagreement_pitches=2.0)
    text = next(f.text for f in judge(polygon, view, limits, traced=checked) if f.refusal == Refusal.EDGE_COVERED)
    assert f"near ({one.wide.place_px[0] + 10.0:.0f}, {one.wide.place_px[1]:.0f}) px runs a line" in text
    unasked = judge(polygon, view, Limits(max_disagreement_pitches=None), traced=checked)
    assert Refusal.EDGE_COVERED not in {finding.refusal for finding in unasked}
