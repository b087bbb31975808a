"""Cells of a few pixels are looked at twice as large, too: what both looks agree on comes in the picture's pixels."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from contour.geometry.agreement import agreement
from contour.geometry.arrays import Bytes
from contour.geometry.rings import Contour
from contour.image.pixel_grid import samples_of
from contour.synthetic import render
from service.config.plain_recipe import PlainRecipe
from service.config.recipes import Recipe
from service.measuring.measure import Measurer
from service.reasons import Reason
from tests.support.scenes.lattices import Border, Cells, lattice
from tests.support.scenes.sample_scenes import sample_scenes
from tests.support.scenes.trials import calibration_for


def halved(cells: Cells, border: Border, seed: int) -> tuple[Bytes, Contour, float]:
    """A lattice of so few pixels a cell, its outline, and its pitch."""
    drawn = lattice(seed, cells, border)
    picture = np.asarray(cv2.resize(drawn.picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), np.uint8)
    exterior, *holes = (samples_of(ring, 2) for ring in drawn.outline.rings)
    return picture, Contour(exterior, tuple(holes)), drawn.pitch_px / 2


@pytest.mark.parametrize("seed", [6_200_000, 6_200_005])
def test_a_border_of_cells_too_small_to_tell_is_told_at_twice_their_size(seed: int) -> None:
    picture, outline, pitch_px = halved("square", "mixed", seed)
    seen = Measurer(None).measure(picture, PlainRecipe(), 0.0)
    assert (seen.findings, seen.edge) == ((), "mixed")
    assert seen.pitch_px == pytest.approx(pitch_px, rel=0.2)
    assert seen.pixels is not None
    assert seen.uncertainty_px is not None
    near = agreement(seen.pixels, outline)
    assert near.hausdorff_px < 0.25 * pitch_px
    assert near.holds(seen.uncertainty_px)


def test_looks_that_do_not_agree_on_a_border_are_refused() -> None:
    """At its own size alone it was accepted, a cell off."""
    picture, _, _ = halved("over-expanded", "closed", 6_200_002)
    seen = Measurer(None).measure(picture, PlainRecipe(), 0.0)
    ((reason, text),) = seen.findings
    assert reason == Reason.EDGE_CONTRADICTED
    assert "looked at twice as large, the border runs elsewhere, by 0." in text


@pytest.fixture(scope="module")
def fine():
    """A block of cells of 10 px, seen by a lens."""
    scene = sample_scenes()[0]
    finer = 10.0 / render(scene).pitch_px
    return render(replace(scene, cells=replace(scene.cells, pitch_mm=finer * scene.cells.pitch_mm)))


@pytest.mark.parametrize("told", [{}, {"roi_px": (100, 60, 1500, 1150)}], ids=["whole", "region"])
def test_what_is_seen_at_twice_the_size_comes_in_the_pixels_and_millimetres_of_the_picture(fine, told) -> None:
    recipe = Recipe(number=1, name="fine", **told)
    seen = Measurer(calibration_for(fine.camera)).measure(fine.picture, recipe, fine.thickness_mm)
    assert seen.findings == ()
    assert seen.pixels is not None
    near = agreement(seen.pixels, fine.truth_px)
    assert near.mean_px < 0.5
    assert seen.uncertainty_px is not None
    assert near.holds(seen.uncertainty_px)
    assert seen.evidence
    total = sum(part.to_px - part.from_px for part in seen.evidence if part.ring == 0)
    assert total == pytest.approx(cv2.arcLength(seen.pixels.exterior.astype(np.float32), True), rel=0.02)
