"""A hole too small to be traced is no reason to leave it out without a word."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contour.geometry.rings import Contour
from contour.synthetic import Rendered, render
from contour.synthetic.outlines import disc_ring, rectangle, with_holes
from contour.tracing.trace import Trace, TraceSettings
from contour.tracing.tracing import trace
from service.config.plain_recipe import PlainRecipe
from service.reasons import Reason
from tests.support.scenes.bench_scenes import easy
from tests.support.scenes.shop_floor_scenes import shop_floor_scene
from tests.support.scenes.trials import measured

PITCH_MM = 9.0
PLACE_MM = (220.0, 200.0)


def with_hole(cells_wide: float) -> Rendered:
    """A block with a hole so many cells wide, or without one."""
    block = rectangle((250.0, 190.0), 330.0, 230.0, 6.0)
    if cells_wide:
        block = with_holes(block, disc_ring(PLACE_MM, 0.5 * cells_wide * PITCH_MM))
    return render(easy("small-openings", block))


@pytest.mark.parametrize(("cells_wide", "holes"), [(0.0, 0), (4.0, 1)])
def test_a_block_without_a_hole_or_with_one_wide_enough_is_accepted(cells_wide: float, holes: int) -> None:
    found = measured(with_hole(cells_wide))
    assert not found.findings
    assert found.pixels is not None
    assert len(found.pixels.holes) == holes


def test_a_hole_of_two_cells_is_refused_with_its_place_unless_the_recipe_asks_for_no_second_opinion() -> None:
    rendered = with_hole(2.0)
    found = measured(rendered)
    ((reason, text),) = found.findings
    assert reason == Reason.METHODS_DISAGREE
    assert text.startswith("Walls are missing over ")
    assert "max_disagreement_pitches: 0" in text
    assert not measured(rendered, PlainRecipe(max_disagreement_pitches=0)).findings


def test_grain_of_what_fills_cells_shows_no_table_and_is_no_hole() -> None:
    rendered = render(shop_floor_scene("compound", 4_010_087).scene)
    assert trace(rendered.picture, TraceSettings()).opening_px is None


def test_its_place_moves_with_the_trace() -> None:
    one = Trace("wall-tips", "bright", 24.0, Contour(np.zeros((3, 2))), np.zeros((9, 9), np.uint8))
    assert replace(one, opening_px=(1.0, 2.0, 3.0)).moved(np.array([20.0, 10.0])).opening_px == (21.0, 12.0, 3.0)
