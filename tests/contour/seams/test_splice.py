"""Halves of a block that something flat joins are one block."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contour.edge.table_look import table_look
from contour.geometry.rings import area
from contour.seams.splice import spliced
from contour.synthetic import Filling, Scene, render, thick_line
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from contour.walls.lightness import wall_light
from contour.walls.see_block import see_block, see_walls
from tests.support.scenes.edge_scenes import BLOCK, CELLS, PLAIN, WIDE, at


def adhesive(level: float, wide: float = 2.0) -> Scene:
    """A block with a seam of smooth adhesive across, so light, in which no walls show."""
    line = thick_line([at(-15.0, 20.0), at(15.0, -WIDE - 20.0)], wide * CELLS.pitch_mm)
    return replace(PLAIN, things=(Filling(line, level, walls=0.0),))


@pytest.mark.parametrize("level", [0.02, 0.3, 0.5])
def test_adhesive_joins_both_halves_and_ends_with_them(level: float) -> None:
    picture = render(adhesive(level)).picture
    found = trace(picture, TraceSettings())
    assert area(found.contour) == pytest.approx(area(BLOCK) / 0.25, rel=0.02)
    assert {stretch.state for stretch in found.evidence or ()} == {"seen"}
    assert found.others == ()


def test_what_is_as_light_as_the_table_between_two_pieces_joins_nothing() -> None:
    picture = render(adhesive(0.02)).picture
    seen = see_block(see_walls(picture, wall_light(picture), "auto"))
    look = table_look(picture, seen)
    assert len(seen.others) == 1
    joined = spliced(look.things, look.table, look.light, seen, look.step)
    assert joined is not None
    alike = np.full_like(look.light, int(np.median(look.light[look.table])))
    assert spliced(look.things, look.table, alike, seen, look.step) is None
