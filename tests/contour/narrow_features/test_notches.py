"""A notch as wide and deep as two and a half cells is traced where walls tell it; a slit is refused as ever."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from contour.geometry.agreement import agreement
from contour.narrow_features.narrow_feature import narrow_feature
from contour.synthetic import CellGeometry, Rendered, Scene, Table, camera_above, moved, polygon, render
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from service.reasons import Reason
from tests.support.pictures.narrow_shapes import BLOCK, PITCH, contour, dent

CELL_MM = 8.0


def notched(wide: float, deep: float, seed: int, *, round_: bool) -> Rendered:
    """A block with a notch of so many cells in an edge, with a round floor or a straight one."""
    half, depth = 0.5 * wide * CELL_MM, deep * CELL_MM
    angles = np.linspace(math.pi, 0.0, 24) if round_ else ()
    floor = [(half * math.cos(a), depth - half + half * math.sin(a) - 65.0) for a in angles]
    floor = floor or [(-half, depth - 65.0), (half, depth - 65.0)]
    sides = [(-95.0, -65.0), (-half, -65.0), *floor, (half, -65.0), (95.0, -65.0), (95.0, 65.0), (-95.0, 65.0)]
    return render(
        Scene(
            moved(polygon(sides), (150.0, 112.0), 9.0),
            camera_above(800, 600, 0.375, distance_mm=1500.0),
            CellGeometry(pitch_mm=CELL_MM, wall_mm=0.6, ribbon_deg=seed * 7.0 % 60.0),
            table=Table(texture=0.004),
            seed=seed,
        )
    )


@pytest.mark.parametrize("seed", [0, 3])
def test_a_milled_notch_of_three_cells_is_traced(seed: int) -> None:
    rendered = notched(3.0, 5.0, seed, round_=True)
    seen = Measurer(None).measure(rendered.picture, PlainRecipe(), 0.0)
    assert seen.findings == ()
    assert seen.pixels is not None
    assert agreement(seen.pixels, rendered.truth_px).hausdorff_px < 0.25 * rendered.pitch_px


def test_one_of_two_cells_is_not() -> None:
    seen = Measurer(None).measure(notched(2.0, 5.0, 0, round_=False).picture, PlainRecipe(network=False), 0.0)
    assert Reason.METHODS_DISAGREE in seen.reasons
    assert "goes into its edge" in seen.texts[0]


def test_a_square_one_is_not_where_few_walls_tell_its_floor() -> None:
    """It was drawn 0.6 of a cell off."""
    seen = Measurer(None).measure(notched(3.0, 5.0, 8, round_=False).picture, PlainRecipe(network=False), 0.0)
    assert seen.reasons == (Reason.UNCERTAINTY_TOO_LARGE,)


@pytest.mark.parametrize("turn_deg", [0.0, 33.0, 200.0])
def test_what_is_beside_a_notch_is_no_step(turn_deg: float) -> None:
    """Nor is what has an end of the block a few cells behind it."""
    block = contour(BLOCK - shapely.box(700 - 10 * PITCH, 500 - 4 * PITCH, 700 - 6 * PITCH, 501), turn_deg)
    assert narrow_feature(block, PITCH) is not None
    assert narrow_feature(block, PITCH, notches=True) is None


@pytest.mark.parametrize(("wide", "deep"), [(1.5, 4.0), (4.0, 1.5), (2.0, 2.0)])
def test_a_dent_that_is_narrower_or_less_deep_is_told_as_ever(wide: float, deep: float) -> None:
    told = narrow_feature(contour(BLOCK - dent(wide, deep)), PITCH, notches=True)
    assert told is not None
    assert not told.outwards
