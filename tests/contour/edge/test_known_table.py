"""Blocks on a table as light as their walls are traced where the table is known, and what lies over them is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contour.edge.known_table import OverTable, over_known_table
from contour.errors import NoBlockFound
from contour.geometry.agreement import distances_to
from contour.image.taught_table import look_at, teach
from contour.relief.relief import Displacement
from contour.synthetic import Cover, Scene, Structure, Table, render, render_empty_table
from contour.walls.see_block import SeenWalls
from service.config.recipes import Recipe
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.measuring.table_file import TableRecord
from service.reasons import Reason
from tests.support.scenes.edge_scenes import PLAIN, THICKNESS_MM, THINGS
from tests.support.scenes.trials import calibration_for

RECIPE = Recipe(number=1, name="any", min_area_mm2=0.0, roi_px=(60.0, 40.0, 600.0, 440.0))
WOODEN = replace(PLAIN, table=Table(level=0.55), things=(Structure("wood", 80.0, 0.2, 30.0),))
NONE = Displacement(0.0, np.zeros(2))


def measured(scene: Scene) -> tuple[Measurement, float]:
    """What is measured in part of the picture, and how far 95 % of the true outline lie off at most, pixels."""
    rendered = render(scene)
    table = TableRecord(teach(render_empty_table(scene, 2)), "", 2, "")
    seen = Measurer(calibration_for(rendered.camera), table=table).measure(rendered.picture, RECIPE, THICKNESS_MM)
    off = (
        0.0 if seen.pixels is None else float(np.percentile(distances_to(rendered.truth_px.exterior, seen.pixels), 95))
    )
    return seen, off


def test_a_block_on_a_taught_table_as_light_as_its_walls_is_traced_within_its_bound() -> None:
    seen, off = measured(WOODEN)
    assert seen.findings == ()
    assert off < min(1.5, seen.uncertainty_px or 0.0)


def test_what_darkens_the_table_over_its_edge_as_a_shadow_does_is_told() -> None:
    tape = THINGS["tape along an edge"][0]
    assert isinstance(tape, Cover)
    seen, _ = measured(replace(WOODEN, things=(*WOODEN.things, replace(tape, level=0.2))))
    assert Reason.EDGE_COVERED in seen.reasons


def test_on_a_darker_table_walls_are_seen_as_ever() -> None:
    assert over(PLAIN) is None


@pytest.mark.parametrize(("level", "alike"), [(0.12, False), (0.4, True), (0.55, True)])
def test_a_table_lighter_than_the_cells_of_light_walls_is_taken_out_of_the_picture(level: float, alike: bool) -> None:
    """Also where walls stand out of it by more than half of what they stand out of their cells by."""
    seen = over(replace(PLAIN, table=Table(level=level)))
    assert (seen is not None and seen.alike) == alike


def test_where_the_picture_shows_no_cells_they_are_looked_for_in_what_differs_from_the_table(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plain = over(WOODEN)

    def none(*_: object) -> SeenWalls:
        raise NoBlockFound("no cells")

    monkeypatch.setattr("contour.edge.known_table.see_walls", none)
    seen = over(WOODEN)
    assert plain is not None
    assert seen is not None
    assert seen.relief().wall_px == pytest.approx(plain.relief().wall_px, rel=0.5)


def over(scene: Scene) -> OverTable | None:
    """What the scene's picture shows of its block on its table, which was taught."""
    picture, table = render(scene).picture, teach(render_empty_table(scene, 2))
    return over_known_table(picture, look_at(picture, table), "auto", NONE)
