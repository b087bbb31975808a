"""An even table is told from a picture with a block on it; one with borders of its own is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contour.geometry.agreement import agreement
from contour.material.even_table import even_table
from contour.synthetic import Structure, Table, render, render_empty_table
from tests.support.scenes.edge_scenes import COVERED, PLAIN, THINGS
from tests.support.scenes.shop_floor_scenes import KINDS, LATER, shop_floor_block, shop_floor_scene
from tests.support.scenes.trials import measured

LIGHT = replace(PLAIN, table=Table(level=0.5))


@pytest.mark.parametrize("colour", [False, True])
def test_it_is_as_light_as_it_would_be_without_the_block(colour: bool) -> None:
    picture, (empty, *_) = render(LIGHT).picture, render_empty_table(LIGHT, 1)
    if not colour:
        picture, empty = (np.ascontiguousarray(one[..., 1]) for one in (picture, empty))
    look = even_table(picture)
    assert look is not None
    assert look.known.shape == picture.shape
    off = np.abs(look.known.astype(float) - empty) / (empty + 1.0)
    assert np.percentile(off, 95) < 0.1


@pytest.mark.parametrize("kind", ["wood", "brushed", "slots"])
def test_a_table_with_borders_of_its_own_is_not_told(kind: str) -> None:
    assert even_table(render(replace(LIGHT, things=(Structure(kind, 60.0, 0.25, 30.0),))).picture) is None


def test_a_picture_full_of_borders_shows_no_table_and_one_without_any_no_block() -> None:
    noise = np.random.default_rng(1).integers(0, 255, (300, 400), dtype=np.uint8)
    assert even_table(noise) is None
    assert even_table(np.full((300, 400), 80, np.uint8)) is None


def test_streaks_without_borders_make_no_even_table() -> None:
    assert even_table(render(shop_floor_scene("wood", 1_600_083).scene).picture) is None


def test_a_block_on_an_even_table_as_light_as_its_walls_needs_no_taught_one() -> None:
    scene = shop_floor_scene("light_table", 1_572_033, alone=True).scene
    seen = measured(render(scene))
    assert seen.reasons == ()
    assert seen.uncertainty_px is not None


def test_the_tables_own_shades_beside_a_block_are_no_walls_of_it() -> None:
    rendered = render(shop_floor_scene("light_table", 1_712_003, alone=True).scene)
    seen = measured(rendered)
    assert seen.pixels is not None
    assert agreement(seen.pixels, rendered.truth_px).hausdorff_px < 0.5 * rendered.pitch_px


@pytest.mark.parametrize("name", [*COVERED, "tape on a corner", "tape along an edge"])
def test_what_lies_over_its_edge_is_refused_as_ever(name: str) -> None:
    assert measured(render(replace(LIGHT, things=THINGS[name]))).reasons != ()


def test_a_hard_shadow_beside_it_hides_nothing() -> None:
    rendered = render(replace(LIGHT, things=THINGS["hard shadow"]))
    seen = measured(rendered)
    assert seen.reasons == ()
    assert seen.pixels is not None
    assert seen.uncertainty_px is not None
    near = agreement(seen.pixels, rendered.truth_px)
    assert near.hausdorff_px < 1.0
    assert near.holds(seen.uncertainty_px)


def test_two_blocks_against_each_other_are_told_by_how_their_cells_are_lit() -> None:
    """Floors of cells do not differ from the table."""
    rng, block = np.random.default_rng(2), shop_floor_block(1_574_002)
    assert measured(render(LATER["pushed_together"](rng, KINDS["light_table"](rng, block)))).reasons != ()
