"""Where a polished table mirrors a block, and what is traced there."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from contour.edge import mirrored_block
from contour.edge.mirrored_block import is_mirrored
from contour.edge.reflection import Reflection, axis_beside, reflection
from contour.errors import NoBlockFound
from contour.geometry.agreement import distances_to
from contour.geometry.rings import Contour, oriented
from contour.synthetic import Mirror, Rendered, render
from contour.synthetic.outlines import disc_ring, signed_distance, with_holes
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from contour.walls.lightness import wall_light
from contour.walls.see_block import see_walls
from tests.support.scenes.edge_scenes import BLOCK, COVERED, HOLED, MIDDLE, PLAIN, THINGS

FAINT, STRONG, FAR = Mirror(0.2, 15.0), Mirror(0.35, 15.0), Mirror(0.55, 30.0, 2.0)


@cache
def mirrored(mirror: Mirror | None, thing: str = "") -> Rendered:
    """The block on a table that mirrors it, with the thing of this name at its edge, or with a hole."""
    things = (() if mirror is None else (mirror,)) + THINGS.get(thing, ())
    return render(replace(HOLED if thing == "hole" else PLAIN, things=things))


def light(rendered: Rendered) -> NDArray[np.uint8]:
    return wall_light(rendered.picture)


def moved(outline: Contour, by_px: float) -> Contour:
    """The exterior so far outwards."""
    grown = shapely.Polygon(outline.exterior).buffer(by_px, join_style="mitre")
    return Contour(oriented(np.array(grown.exterior.coords)[:-1], counter_clockwise=False))


@pytest.mark.parametrize("mirror", [FAINT, STRONG, FAR])
@pytest.mark.parametrize("thing", ["", "hole"])
def test_the_true_edge_of_a_mirrored_block_is_an_axis_all_along(mirror: Mirror, thing: str) -> None:
    rendered = mirrored(mirror, thing)
    seen = reflection(light(rendered), rendered.truth_px, rendered.pitch_px)
    assert seen.whole
    assert seen.share > 0.98
    assert len(seen.places) == len(rendered.truth_px.rings)


@pytest.mark.parametrize("pitches", [-0.15, 0.15])
def test_an_outline_a_seventh_of_a_cell_off_is_none(pitches: float) -> None:
    rendered = mirrored(STRONG)
    off = moved(rendered.truth_px, pitches * rendered.pitch_px)
    assert reflection(light(rendered), off, rendered.pitch_px).share < 0.1


def test_on_a_plain_table_no_edge_is_one() -> None:
    rendered = mirrored(None)
    assert reflection(light(rendered), rendered.truth_px, rendered.pitch_px).share == 0.0


@pytest.mark.parametrize("mirror", [FAINT, STRONG, FAR])
@pytest.mark.parametrize("thing", [*COVERED, "tape on a corner", "tape along an edge"])
def test_no_edge_with_a_thing_over_it_is_one_all_along(mirror: Mirror, thing: str) -> None:
    rendered = mirrored(mirror, thing)
    seen = reflection(light(rendered), rendered.truth_px, rendered.pitch_px)
    assert not seen.whole
    assert seen.share > 0.3


@pytest.mark.parametrize("pitches", [-0.3, 0.3])
def test_beside_an_outline_that_misses_it_the_axis_is_found(pitches: float) -> None:
    rendered = mirrored(STRONG)
    off = moved(rendered.truth_px, pitches * rendered.pitch_px)
    found = axis_beside(light(rendered), off, rendered.pitch_px)
    assert found.share > 0.8
    (places,), (shown,) = found.places, found.shown
    apart = distances_to(places[shown], rendered.truth_px) / rendered.pitch_px
    assert np.percentile(apart, 90) < 0.06


@pytest.mark.parametrize("radius_mm", [10.0, 25.0])
@pytest.mark.parametrize("mirror", [STRONG, FAR])
def test_mirrored_walls_in_a_hole_do_not_close_it(mirror: Mirror, radius_mm: float) -> None:
    outline = with_holes(BLOCK, disc_ring(MIDDLE, radius_mm))
    rendered = render(replace(PLAIN, outline=outline, things=(mirror,)))
    walls = see_walls(rendered.picture, light(rendered), "auto")
    closed = Contour(rendered.truth_px.exterior)
    assert reflection(walls.light, closed, rendered.pitch_px).whole
    assert not is_mirrored(walls, closed)
    assert is_mirrored(walls, rendered.truth_px)


@pytest.mark.parametrize("mirror", [STRONG, FAR])
def test_a_block_whose_mirrored_walls_look_like_its_own_is_traced(mirror: Mirror) -> None:
    rendered = mirrored(mirror)
    traced = trace(rendered.picture, TraceSettings())
    assert traced.evidence is not None
    assert {stretch.state for stretch in traced.evidence} == {"seen"}
    off = np.abs(signed_distance(traced.contour, rendered.truth_px.exterior))
    assert off.max() < 0.1 * rendered.pitch_px
    assert traced.uncertainty_px is not None
    assert traced.uncertainty_px < 0.1 * rendered.pitch_px


def test_another_block_beside_a_mirrored_one_is_told_and_its_image_is_none() -> None:
    one = mirrored(STRONG).picture
    assert trace(one, TraceSettings()).others == ()
    (other,) = trace(np.concatenate([one, one], axis=1), TraceSettings()).others
    assert other.area_px2 == pytest.approx(shapely.Polygon(mirrored(STRONG).truth_px.exterior).area, rel=0.15)


@pytest.mark.parametrize("thing", COVERED)
def test_a_thing_over_its_edge_hides_that_there_as_well(thing: str) -> None:
    rendered = mirrored(STRONG, thing)
    try:
        traced = trace(rendered.picture, TraceSettings())
    except NoBlockFound:
        return
    assert traced.evidence is not None
    assert {stretch.state for stretch in traced.evidence} != {"seen"}


def test_where_no_axis_lies_near_the_coarse_outline_no_line_is_laid(monkeypatch: pytest.MonkeyPatch) -> None:
    rendered = mirrored(STRONG)
    walls = see_walls(rendered.picture, light(rendered), "auto")
    assert list(mirrored_block.mirrored_block(rendered.picture, walls, None, None))
    nowhere = Reflection((rendered.truth_px.exterior,), (np.zeros(len(rendered.truth_px.exterior), np.bool_),))
    monkeypatch.setattr(mirrored_block, "axis_beside", lambda *_seen: nowhere)
    monkeypatch.setattr(mirrored_block, "visible_rings", lambda *_seen: pytest.fail("a line was laid"))
    assert not list(mirrored_block.mirrored_block(rendered.picture, walls, None, None))
