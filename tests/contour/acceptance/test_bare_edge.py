"""Parts of an outline without cells behind them."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from contour.acceptance.acceptance import View, judge
from contour.acceptance.bare_edge import comb_at_edge
from contour.acceptance.disagreement import Disagreement
from contour.acceptance.findings import Limits, Refusal
from contour.acceptance.trace_check import CheckedTrace
from contour.edge.edge_parts import EdgePart
from contour.edge.stretches import Hider, State, Stretch
from contour.edge.table_look import TableLook
from contour.geometry.rings import Contour, Ring, oriented
from contour.polygon.polygon import Polygon
from contour.tracing.trace import Trace

PITCH = 16.0
BLOCK = shapely.box(80, 80, 400, 336)
HOLE = shapely.box(160, 160, 240, 240)


def ring(shape: shapely.Polygon) -> Ring:
    return oriented(np.array(shape.exterior.coords)[:-1], counter_clockwise=False)


def comb(shape: shapely.Polygon, table: int, *, walls: int = 200, cells: int = 60) -> NDArray[np.uint8]:
    """A grid for cells within the shape, on a table: grey levels. Straight cuts go through the middle of cells."""
    lines = np.arange(8, 488) % int(PITCH) < 3
    grid = np.where(lines | lines[:, None], walls, cells).astype(np.uint8)
    block = np.zeros((480, 480), np.uint8)
    rings = [np.array(one.coords)[:-1] for one in (shape.exterior, *shape.interiors)]
    cv2.fillPoly(block, [np.rint(one).astype(np.int32) for one in rings], 1)
    return np.where(block > 0, grid, np.uint8(table))


def traced(picture: NDArray[np.uint8], outline: shapely.Polygon, *evidence: Stretch) -> Trace:
    exterior, holes = ring(outline), [np.array(one.coords)[:-1] for one in outline.interiors]
    contour = Contour(exterior, tuple(oriented(hole, counter_clockwise=True) for hole in holes))
    return Trace("wall-tips", "bright", PITCH, contour, picture, evidence=evidence)


def found(picture: NDArray[np.uint8], outline: shapely.Polygon, *evidence: Stretch) -> EdgePart | None:
    return comb_at_edge(traced(picture, outline, *evidence), PITCH)[0]


@pytest.mark.parametrize("table", [10, 60, 130, 200, 250])
def test_along_a_cut_edge_cells_lie_behind_it_all_around(table: int) -> None:
    holed = BLOCK - HOLE
    assert found(comb(holed, table), holed) is None
    assert found(comb(holed, table, walls=30, cells=150), holed) is None


@pytest.mark.parametrize("table", [10, 130, 250])
def test_where_an_outline_bulges_over_the_table_it_is_told_with_its_place(table: int) -> None:
    bulge = shapely.Polygon([(400, 120), (400 + 0.9 * PITCH, 160), (400 + 0.9 * PITCH, 200), (400, 240)])
    one = found(comb(BLOCK, table), BLOCK | bulge)
    assert one is not None
    assert one.length_pitches == pytest.approx(3.0, abs=1.5)
    assert one.place_px == pytest.approx((400 + 0.9 * PITCH, 180), abs=1.5 * PITCH)
    assert one.moved(10.0, 20.0).place_px == (one.place_px[0] + 10.0, one.place_px[1] + 20.0)


def test_a_corner_drawn_where_the_block_is_rounded_is_told() -> None:
    rounded = BLOCK - (shapely.box(320, 256, 410, 346) - shapely.Point(320, 256).buffer(80))
    one = found(comb(rounded, 20), BLOCK)
    assert one is not None
    assert one.place_px == pytest.approx((400, 336), abs=2.5 * PITCH)


def test_a_hole_drawn_too_small_is_told() -> None:
    one = found(comb(BLOCK - HOLE.buffer(PITCH), 20), BLOCK - HOLE)
    assert one is not None
    assert shapely.Point(one.place_px).distance(HOLE.exterior) < 1.0


def filled(part: shapely.Polygon) -> NDArray[np.uint8]:
    """A block whose cells are filled there, as dark as nothing else is."""
    picture = comb(BLOCK, 130)
    cv2.fillPoly(picture, [np.rint(np.array(part.exterior.coords)).astype(np.int32)], 15)
    return picture


@pytest.mark.parametrize(
    "part",
    [shapely.box(340, 180, 400, 230), shapely.box(340, 130, 400, 280), shapely.box(300, 250, 400, 336)],
)
def test_filled_cells_end_in_line_with_the_edge_and_at_a_corner_with_both(part: shapely.Polygon) -> None:
    assert found(filled(part), BLOCK) is None


@pytest.mark.parametrize("depth", [0.3, 0.7])
def test_cells_in_a_shadow_are_darker_walls_and_all(depth: float) -> None:
    shaded = comb(BLOCK, 60, cells=20)
    shaded[:, 376:] = np.rint(shaded[:, 376:] * (1.0 - depth))
    assert found(shaded, BLOCK) is None
    bulge = shapely.Polygon([(400, 120), (400 + 0.9 * PITCH, 160), (400 + 0.9 * PITCH, 200), (400, 240)])
    assert found(shaded, BLOCK | bulge) is not None


def test_in_a_shadow_so_deep_that_walls_are_a_few_grey_levels_nothing_tells_them() -> None:
    shaded = comb(BLOCK, 60, cells=20)
    shaded[:, 376:] = np.rint(shaded[:, 376:] * 0.02)
    assert found(shaded, BLOCK) is not None


def test_what_is_a_little_lighter_than_the_table_and_in_line_with_the_edge_fills_cells() -> None:
    picture = comb(BLOCK, 40)
    picture[180:230, 340:400] = 60
    assert found(picture, BLOCK) is None
    picture[180:230, 340:400] = 30
    assert found(picture, BLOCK) is not None, "it may be the table, shaded"


LABEL = shapely.Polygon([(330, 130), (400 + 0.9 * PITCH, 130), (400 + 0.9 * PITCH, 280), (330, 280)])


def test_a_thing_that_stands_out_of_the_edge_is_told() -> None:
    one = found(filled(LABEL), BLOCK | LABEL)
    assert one is not None
    assert one.place_px[0] > 400


def test_a_thing_so_deep_that_no_cells_lie_farther_in_either_is_told() -> None:
    hand = shapely.box(260, 100, 400 + 3 * PITCH, 310)
    picture = filled(hand)
    some = np.random.default_rng(1).integers(0, 5, picture.shape, dtype=np.uint8)
    one = found(picture + cv2.blur(some, (3, 3)) * np.uint8(2), BLOCK | hand)
    assert one is not None
    assert one.length_pitches > 12.0
    assert shapely.Point(one.place_px).distance(hand.exterior) < 1.0


@pytest.mark.parametrize(("state", "by"), [("seen", "compound"), ("bridged", "object"), ("covered", "object")])
def test_what_is_told_to_fill_or_to_hide_the_edge_is_left_out(state: State, by: Hider) -> None:
    whole = float((BLOCK | LABEL).length)
    assert found(filled(LABEL), BLOCK | LABEL, Stretch(0, 0.0, whole, state, by, 1.0)) is None
    assert found(filled(LABEL), BLOCK | LABEL, Stretch(0, 0.0, whole, "seen", None, 1.0)) is not None


def beyond(picture: NDArray[np.uint8], outline: shapely.Polygon, *evidence: Stretch) -> EdgePart | None:
    return comb_at_edge(traced(picture, outline, *evidence), PITCH)[1]


def with_faint_rim(walls: int) -> NDArray[np.uint8]:
    """A block whose last cells on the right show faint walls, on a table as light as its cells."""
    picture = comb(BLOCK, 60)
    rim = comb(BLOCK, 60, walls=walls)
    picture[:, 384:] = rim[:, 384:]
    return picture


SHORT = shapely.box(80, 80, 384, 336)


def test_faint_walls_beyond_an_outline_over_more_than_four_cells_are_told_with_their_place() -> None:
    one = beyond(with_faint_rim(110), SHORT)
    assert one is not None
    assert one.length_pitches == pytest.approx(256 / PITCH, abs=3.0)
    assert one.place_px == pytest.approx((384, 208), abs=2 * PITCH)
    assert beyond(with_faint_rim(70), SHORT) is None
    assert beyond(with_faint_rim(110), BLOCK) is None
    assert beyond(with_faint_rim(110), SHORT, Stretch(0, 0.0, float(SHORT.length), "covered", "object", 1.0)) is None


def test_comb_beyond_that_was_told_from_the_block_is_left_out() -> None:
    picture = with_faint_rim(110)
    loose = np.zeros((240, 240), np.bool_)
    loose[:, 192:] = True
    none, away = np.zeros_like(loose), np.full(loose.shape, 1e6, np.float32)
    look = TableLook(none, none, none, 2, PITCH, none, none, away, picture, loose)
    trace = replace(traced(picture, SHORT), look=look)
    assert comb_at_edge(trace, PITCH)[1] is None
    assert comb_at_edge(replace(trace, look=replace(look, loose=None)), PITCH)[1] is not None


def test_a_speck_beside_the_edge_is_no_comb_nor_is_a_table_that_changes_everywhere() -> None:
    specks = comb(BLOCK, 60)
    cv2.rectangle(specks, (406, 200), (412, 220), 200, -1)
    assert beyond(specks, BLOCK) is None
    table = (60 + 40 * (np.arange(480) // 8 % 2)).astype(np.uint8)
    grained = comb(BLOCK, 60)
    grained[:, 400:] = table[:, None]
    assert beyond(grained, BLOCK) is None


@pytest.mark.parametrize("dark", [False, True])
def test_nor_are_shadows_of_the_other_sign_than_walls(dark: bool) -> None:
    block = comb(BLOCK, 130, walls=30, cells=200) if dark else comb(BLOCK, 130, walls=230)
    for y in range(90, 330, 24):
        cv2.rectangle(block, (401, y), (412, y + 11), 230 if dark else 30, -1)
    trace = replace(traced(block, BLOCK), polarity="dark" if dark else "bright")
    assert comb_at_edge(trace, PITCH)[1] is None


def test_comb_beyond_a_contour_is_refused_with_its_place_where_the_picture_is_asked() -> None:
    block = traced(comb(BLOCK, 20), BLOCK)
    agrees = Disagreement(0.1, (0.0, 0.0), True, 0.0)
    checked = CheckedTrace(block, disagreement=agrees, beyond=EdgePart(4.1, (120.0, 80.0))).moved(np.array([10.0, 0.0]))
    polygon = Polygon(block.contour, None, 1e4, None, None)
    findings = judge(polygon, View((480, 480)), Limits(max_disagreement_pitches=2.0), traced=checked)
    (finding,) = [finding for finding in findings if finding.refusal == Refusal.METHODS_DISAGREE]
    assert "4.1 cells" in finding.text
    assert "(130, 80) px" in finding.text
    free = judge(polygon, View((480, 480)), Limits(), traced=checked)
    assert not [finding for finding in free if finding.refusal == Refusal.METHODS_DISAGREE]


def test_such_a_contour_is_refused_with_the_place_and_the_next_step_where_the_picture_is_asked() -> None:
    block = traced(comb(BLOCK, 20), BLOCK)
    agrees = Disagreement(0.1, (0.0, 0.0), True, 0.0)
    checked = CheckedTrace(block, disagreement=agrees, bare=EdgePart(3.2, (120.0, 80.0)))
    polygon = Polygon(block.contour, None, 1e4, None, None)
    findings = judge(polygon, View((480, 480)), Limits(max_disagreement_pitches=2.0), traced=checked)
    (text,) = [finding.text for finding in findings if finding.refusal == Refusal.METHODS_DISAGREE]
    assert "3.2 cells" in text
    assert "(120, 80) px" in text
    assert "Look at the overlay" in text
    free = judge(polygon, View((480, 480)), Limits(), traced=checked)
    assert not [finding for finding in free if finding.refusal == Refusal.METHODS_DISAGREE]
