"""Two blocks that lie against each other are told from one, whatever happened to that."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from contour.acceptance.acceptance import View, judge
from contour.acceptance.findings import Limits, Refusal
from contour.acceptance.trace_check import check_trace
from contour.geometry.rings import Contour, area
from contour.polygon.polygon import Polygon
from contour.seams.floors import parted_by_floors
from contour.seams.openings import Openings
from contour.seams.seam import parted_by_seam
from contour.synthetic import CellGeometry, Fade, Filling, Ink, Scene, Slip, Strip, polygon, render, thick_line
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from contour.tracing.wall_tips import looked_at
from contour.walls.lightness import wall_light
from contour.walls.pieces import Piece
from contour.walls.see_block import see_walls
from tests.support.scenes.edge_scenes import BLOCK, CELLS, LONG, PLAIN, WIDE, at, patch
from tests.support.scenes.shop_floor_scenes import shop_floor_scene

SAMPLES = Path(__file__).parents[3] / "service" / "samples"

OTHER = replace(CELLS, ribbon_deg=40.0, offset_mm=(3.0, 4.0))


def seam_in(scene: Scene) -> Piece | None:
    picture = render(scene).picture
    light = wall_light(picture)
    walls = see_walls(picture, light, "auto")
    seen = looked_at(picture, walls, lambda _: None)[0]
    return parted_by_seam(walls, seen, seen.rings[0].coarse)


def two(first: Contour, second: Contour, cells: CellGeometry = OTHER) -> Scene:
    return replace(PLAIN, outline=first, things=(Strip(second, cells),))


def halves(gap: float, cells: CellGeometry = OTHER) -> Scene:
    """Two blocks side by side, so many pitches apart."""
    long = 0.5 * (LONG - gap * CELLS.pitch_mm)
    out, along = -0.5 * WIDE, 0.5 * (LONG - long)
    return two(patch(-along, out, long, WIDE), patch(along, out, long, WIDE), cells)


@pytest.mark.parametrize(("gap", "pitch_mm"), [(0.0, 10.0), (0.15, 13.0), (0.3, 10.0)])
def test_two_blocks_edge_to_edge_are_parted_where_they_meet(gap: float, pitch_mm: float) -> None:
    part = seam_in(halves(gap, replace(OTHER, pitch_mm=pitch_mm)))
    assert part is not None
    assert 2.0 * part.area_px2 == pytest.approx(abs(area(BLOCK)) / 0.25, rel=0.15)


@pytest.mark.parametrize("gap", [0.0, 0.3])
def test_a_small_block_against_the_edge_of_a_large_one_is_the_part(gap: float) -> None:
    large, small = patch(0.0, -90.0, LONG, 80.0), patch(20.0, -10.0 + gap * CELLS.pitch_mm, 80.0, 80.0)
    part = seam_in(two(large, small))
    assert part is not None
    assert part.area_px2 == pytest.approx(abs(area(small)) / 0.25, rel=0.2)


def test_a_block_whose_floors_are_lighter_is_another_one() -> None:
    """Neither openings nor the order of cells tell of it."""
    assert seam_in(shop_floor_scene("pushed_together", 1_420_099).scene) is not None


@pytest.mark.parametrize("cells", [0, 1])
def test_a_block_without_whole_cells_or_walls_far_from_its_outline_has_no_floors(cells: int) -> None:
    none = np.zeros((40, 40), np.int32)
    numbers = none.copy()
    numbers[15:25, 15:25] = cells
    sizes = np.array([0, 100], np.int32)
    free = Openings(
        1,
        (0, 0),
        10.0,
        none.astype(np.float32),
        numbers,
        sizes / 100.0,
        sizes * cells,
        np.array([[0.0, 0.0], [19.5, 19.5]]),
    )
    assert free.cells.any() == bool(cells)
    assert parted_by_floors(none.astype(np.uint8), free) is None


@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        ("pushed_together", 3_390_109),  # cells of another size, along a straight line
        ("pushed_together", 3_320_057),  # irregular ones
        ("pushed_together", 3_320_011),  # and floors in another light
        ("pushed_together", 3_350_037),  # floors, in the notch of an L, with openings along it
        ("pushed_together", 3_390_020),  # irregular cells in another order, with long openings
        ("offcut", 3_350_068),  # with a row of short ones
    ],
)
def test_other_core_is_told_by_what_little_there_is(kind: str, seed: int) -> None:
    assert seam_in(shop_floor_scene(kind, seed, alone=True).scene) is not None


@pytest.mark.parametrize(
    ("base", "high", "turn_deg", "offset_mm"), [(8.0, 7.0, 3.0, (3.0, 4.0)), (9.0, 8.0, 15.0, (1.0, 9.0))]
)
def test_a_triangle_of_nearly_the_same_order_begins_between_two_corners_that_turn_in(
    base: float, high: float, turn_deg: float, offset_mm: tuple[float, float]
) -> None:
    """Too few walls are missing along it for a row of openings, and too few cells lie in it for their order to tell."""
    half, up = 0.5 * base * CELLS.pitch_mm, high * CELLS.pitch_mm
    piece = polygon([at(-half, -50.0), at(0.0, -50.0 + up), at(half, -50.0)])
    cells = replace(CELLS, ribbon_deg=CELLS.ribbon_deg + turn_deg, offset_mm=offset_mm)
    part = trace(render(two(patch(0.0, -85.0, LONG, 70.0), piece, cells)).picture, TraceSettings()).parted
    assert part is not None
    assert part.area_px2 == pytest.approx(abs(area(piece)) / 0.25, rel=0.3)


@pytest.mark.parametrize(
    ("kind", "seed", "alone"),
    [
        ("compound", 1_470_013, False),
        ("glare", 1_564_045, False),
        ("compound", 3_360_002, True),
        ("compound", 3_360_056, True),
        ("splice", 3_360_005, True),
    ],
)
def test_compound_in_some_cells_beside_a_line_and_glare_make_no_other_block(kind: str, seed: int, alone: bool) -> None:
    assert seam_in(shop_floor_scene(kind, seed, alone=alone).scene) is None


def test_two_halves_that_lie_as_they_were_cut_are_two() -> None:
    assert seam_in(halves(0.3, CELLS)) is not None


@pytest.mark.parametrize(("turn_deg", "pitch_mm"), [(25.0, 12.0), (25.0, 8.0)])
def test_blocks_that_touch_along_a_curve_are_told_by_the_order_of_their_cells(turn_deg: float, pitch_mm: float) -> None:
    x = np.linspace(-0.5 * LONG, 0.5 * LONG, 60)
    y = 10.0 * np.cos(5.0 * x / LONG) - 0.5 * WIDE
    seam = [at(along, out) for along, out in zip(x.tolist(), y.tolist(), strict=True)]
    lower = polygon([at(-0.5 * LONG, -WIDE), at(0.5 * LONG, -WIDE), *seam[::-1]])
    upper = polygon([*seam, at(0.5 * LONG, 0.0), at(-0.5 * LONG, 0.0)])
    assert seam_in(two(lower, upper, replace(OTHER, ribbon_deg=turn_deg, pitch_mm=pitch_mm))) is not None


def test_noise_across_one_opening_from_edge_to_edge_is_no_faint_wall() -> None:
    irregular = replace(CELLS, kind="irregular", jitter=0.3)
    picture = render(replace(halves(0.4, irregular), cells=irregular)).picture
    walls = see_walls(picture, wall_light(picture), "auto")
    seen = looked_at(picture, walls, lambda _: None)[0]
    noisy = replace(walls, mask=replace(walls.mask, faint=lambda: np.full_like(walls.mask.mask, 255)))
    assert parted_by_seam(noisy, seen, seen.rings[0].coarse) is not None


def _line(width_mm: float) -> Contour:
    return thick_line([at(-20.0, 20.0), at(20.0, -WIDE - 20.0)], width_mm)


SINGLE: dict[str, Scene] = {
    "plain": PLAIN,
    "broken walls": replace(PLAIN, cells=replace(CELLS, broken=0.06, warp=0.15, wobble=0.04)),
    "fading": replace(PLAIN, things=(Fade(at(0.0, -0.5 * WIDE), 0.95, 35.0),)),
    "marked across": replace(PLAIN, things=(Ink((_line(5.0),), 0.1, strength=0.8),)),
    **{
        f"splice, {level}": replace(
            PLAIN, things=(Filling(_line(14.0), level, walls=0.0), Slip(at(0.0, -0.5 * WIDE), at_unit, 4.0))
        )
        for level, at_unit in ((0.25, (0.2, -0.98)), (0.9, (0.2, -0.98)))
    },
}


@pytest.mark.parametrize("name", SINGLE)
def test_one_block_is_one(name: str) -> None:
    assert seam_in(SINGLE[name]) is None


def test_a_block_of_three_arms_is_one() -> None:
    """Few cells lie around where two arms meet, and fewer of their neighbours' are whole."""
    picture = np.asarray(cv2.imread(str(SAMPLES / "3-u-shape.jpg"), cv2.IMREAD_UNCHANGED), np.uint8)
    assert trace(picture, TraceSettings(method="wall-tips")).parted is None


def test_blocks_that_lie_against_each_other_are_refused_and_shown_unless_the_recipe_judges_no_outline() -> None:
    picture = render(halves(0.2)).picture
    checked = check_trace(picture, trace(picture, TraceSettings()), None)
    contour = checked.trace.contour
    polygon = Polygon(contour, None, area(contour), None, None)
    view = View((picture.shape[1], picture.shape[0]), picture=picture)
    (finding,) = judge(polygon, view, Limits(max_disagreement_pitches=2.0), traced=checked)
    assert finding.refusal == Refusal.SEVERAL_BLOCKS
    assert "two blocks seem to lie against each other" in finding.text
    assert len(finding.shown_px[0]) > 4
    assert judge(polygon, view, Limits(), traced=checked) == ()
    moved = checked.trace.moved(np.array([7.0, 9.0])).parted
    assert moved is not None
    assert checked.trace.parted is not None
    assert moved.box_px[:2] == (checked.trace.parted.box_px[0] + 7, checked.trace.parted.box_px[1] + 9)
