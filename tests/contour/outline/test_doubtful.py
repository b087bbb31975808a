"""A curve that two lines explain nearly as well as it does may be a corner, and is told."""

from __future__ import annotations

import numpy as np
import pytest

from contour.synthetic import CellGeometry, Scene, Table, camera_above, moved, polygon, render
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from tests.support.scenes.random_scenes import random_scene
from tests.support.scenes.shop_floor.corners import rounding
from tests.support.scenes.shop_floor_scenes import ShopFloorScene, shop_floor_scene
from tests.support.scenes.trials import traced_with_lens

CUT = 8.2
"""Millimetres, of cells of 8."""


def assert_told(scene: ShopFloorScene, place: tuple[float, float], *, within: float) -> None:
    """It is told within so many pitches of a place, pixels."""
    rendered = render(scene.scene)
    traced = traced_with_lens(rendered)
    assert traced.untold_px is not None
    assert np.hypot(*np.subtract(traced.untold_px, place)) < within * rendered.pitch_px


@pytest.mark.parametrize(("seed", "place"), [(1_054_048, (633.0, 424.0)), (1_058_134, (598.0, 460.0))])
def test_a_curve_is_told_where_two_lines_would_do_and_lie_elsewhere(seed: int, place: tuple[float, float]) -> None:
    """An arc over a corner whose tip is lost, 0.8 of a cell off, and a free curve around one, 0.7."""
    traced = trace(render(random_scene(seed).scene).picture, TraceSettings())
    assert traced.untold_px is not None
    assert traced.pitch_px is not None
    assert np.hypot(*np.subtract(traced.untold_px, place)) < 2.0 * traced.pitch_px


def test_an_arc_whose_ends_a_line_explains_nearly_as_well_and_leads_elsewhere_is_told() -> None:
    """Along a side of an L that moved, 0.8 of a cell off at its inner corner."""
    assert_told(shop_floor_scene("motion", 1_420_045), (480.0, 490.0), within=2.0)


def test_so_is_one_whose_outermost_ends_may_be_those_of_the_lines_beside_it() -> None:
    """Over a side of a square hole of six cells, 0.9 of a cell off at its corner."""
    assert_told(shop_floor_scene("swarf", 1_830_011, alone=True), (1077.0, 727.0), within=2.0)


def test_a_corner_of_two_arcs_out_of_sight_is_told() -> None:
    """A notch at the end of a dark splice, 0.6 of a cell deep, and a step under glare, 0.7 off."""
    assert_told(shop_floor_scene("splice", 1_480_021, alone=True), (773.0, 205.0), within=2.0)
    assert_told(shop_floor_scene("glare", 1_480_017, alone=True), (598.0, 509.0), within=2.0)


def test_a_curve_is_one_where_two_lines_hardly_turn() -> None:
    assert trace(render(random_scene(1_058_142).scene).picture, TraceSettings()).untold_px is None


def test_a_corner_in_which_two_clean_ends_lie_is_told() -> None:
    """It is bevelled by a cell and a half, 0.9 of a cell off."""
    assert_told(shop_floor_scene("undisturbed", 1_564_084), (1116.0, 387.0), within=1.5)


def test_a_corner_of_which_hardly_anything_is_seen_is_told() -> None:
    """It is bevelled by three cells, and was drawn halfway, 0.5 of a cell off."""
    assert_told(shop_floor_scene("undisturbed", 1_621_213, alone=True), (160.0, 628.0), within=2.0)


def test_a_line_that_two_ends_alone_put_across_a_corner_is_told() -> None:
    """The walls of the cell in it are inked as dark as the table, 0.7 of a cell of the block."""
    rendered = render(shop_floor_scene("writing", 1_310_004).scene)
    traced = traced_with_lens(rendered)
    corner = max(rendered.truth_px.exterior.tolist())
    assert traced.untold_px is not None
    assert np.hypot(*np.subtract(traced.untold_px, corner)) < 1.5 * rendered.pitch_px


@pytest.mark.parametrize("seed", [1, 23])
def test_a_corner_of_which_little_is_seen_is_told_where_another_is_round(seed: int) -> None:
    """It is cut by a cell, and was drawn whole, 0.7 of a cell off."""
    round_ = rounding(np.array([95.0, 65.0]), np.array([0.0, -24.0]), np.array([-24.0, 0.0])).tolist()
    outline = polygon([(-95.0, -65.0), (95.0 - CUT, -65.0), (95.0, CUT - 65.0), *map(tuple, round_), (-95.0, 65.0)])
    scene = Scene(
        moved(outline, (150.0, 112.0), 9.0),
        camera_above(800, 600, 0.375, distance_mm=1500.0),
        CellGeometry(pitch_mm=8.0, wall_mm=0.6, ribbon_deg=seed * 7.0 % 60.0),
        table=Table(texture=0.004),
        seed=seed,
    )
    rendered = render(scene)
    traced = trace(rendered.picture, TraceSettings())
    assert traced.untold_px is not None
    cut = rendered.truth_px.exterior
    assert np.hypot(*(cut - traced.untold_px).T).min() < rendered.pitch_px


@pytest.mark.parametrize(
    ("seed", "place"),
    [(3_920_109, (1021.0, 933.0)), (3_920_122, (359.0, 48.0)), (3_920_068, (158.0, 446.0))],
    ids=["where another is cut", "where another is round", "where all were drawn whole"],
)
def test_a_corner_that_no_wall_ends_near_is_told_sooner(seed: int, place: tuple[float, float]) -> None:
    """They are cut by a cell, and were drawn whole, 0.6 to 0.7 of a cell off."""
    assert_told(shop_floor_scene("corners", seed), place, within=1.0)


def test_a_sharp_corner_that_no_wall_ends_near_is_none_to_tell_where_a_whole_cell_is_not_unseen() -> None:
    """No wall ends within a cell of it; nor of one of nine tenths of a cell, in another picture."""
    for kind, seed in (("mirror", 3_910_016), ("light_table", 3_910_001)):
        assert traced_with_lens(render(shop_floor_scene(kind, seed).scene)).untold_px is None


def test_an_arc_that_a_cut_or_two_lines_lead_near_to_is_told_from_neither() -> None:
    """A rounding of five cells: a line across it, or two, are nowhere half a cell from it."""
    assert traced_with_lens(render(shop_floor_scene("undisturbed", 3_700_019, alone=True).scene)).untold_px is None
