"""A picture's comb is drawn on black, whatever its pitch; nothing is drawn where there is none, or it is in doubt."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import cv2
import numpy as np
import pytest

from contour.geometry.agreement import distances_to, places_along
from contour.geometry.arrays import Bytes, Float64s
from contour.geometry.signed_distance import nearest
from contour.segmentation import comb_picture as drawing
from contour.segmentation.comb_picture import comb_picture
from contour.segmentation.network import Segments
from contour.synthetic import Rendered, area_coverage, pitch_px, render, render_empty_table
from contour.walls.see_block import Source
from tests.support.scenes.shop_floor_scenes import shop_floor_scene


@cache
def scene_of(pitch: tuple[float, float]) -> Rendered:
    """A block of that pitch, pixels, on wood."""
    for seed in range(95_000_000, 95_000_100):
        scene = shop_floor_scene("wood", seed, alone=True).scene
        if pitch[0] < pitch_px(scene) < pitch[1]:
            return render(scene)
    raise AssertionError(pitch)


def told_otherwise(monkeypatch: pytest.MonkeyPatch, change: Callable[[Segments], None]) -> None:
    """Have what the network tells changed before it is drawn."""
    told = drawing.segments

    def changed(light: np.ndarray, *where: Any) -> Segments:
        seen = told(light, *where)
        change(seen)
        return seen

    monkeypatch.setattr(drawing, "segments", changed)


def hide_within(seen: Segments, half: tuple[int, int], thing: float) -> None:
    """Take comb away over so many rows and columns to both sides of a place within it, with so sure a thing there."""
    rows, columns = np.nonzero(cv2.erode((seen.comb > 0.5).astype(np.uint8), np.ones((61, 61), np.uint8)))
    if len(rows):
        patch = slice(rows[0] - half[0], rows[0] + half[0]), slice(columns[0] - half[1], columns[0] + half[1])
        seen.comb[patch], seen.wall[patch], seen.thing[patch] = 0.0, 0.0, thing


def border_of(drawn: tuple[Bytes, Source] | None) -> Float64s:
    assert drawn is not None
    assert drawn[1].border is not None
    return drawn[1].border


@pytest.mark.parametrize("pitch", [(12.0, 15.0), (19.0, 23.0), (30.0, 40.0), (50.0, 60.0)])
def test_cells_of_any_size_are_found(pitch: tuple[float, float]) -> None:
    rendered = scene_of(pitch)
    drawn = comb_picture(rendered.picture)
    assert drawn is not None
    assert drawn[0].shape == rendered.picture.shape[:2]
    rows, columns = np.nonzero(drawn[0] > 100)
    truth = rendered.truth_px.exterior
    for seen, ring in ((columns, truth[:, 0]), (rows, truth[:, 1])):
        assert seen.min() == pytest.approx(ring.min(), abs=0.6 * rendered.pitch_px)
        assert seen.max() == pytest.approx(ring.max(), abs=0.6 * rendered.pitch_px)


@pytest.mark.parametrize("pitch", [(12.0, 15.0), (19.0, 23.0), (30.0, 40.0), (50.0, 60.0)])
def test_where_comb_ends_is_told_all_around(pitch: tuple[float, float]) -> None:
    rendered = scene_of(pitch)
    drawn = comb_picture(rendered.picture)
    assert drawn is not None
    truth = rendered.truth_px
    off = distances_to(drawn[1].border, truth) / rendered.pitch_px
    assert np.median(off) < 0.08
    assert np.quantile(off, 0.95) < 0.3
    assert nearest(places_along(truth, 1.0), drawn[1].border).max() < 1.5 * rendered.pitch_px


@pytest.mark.parametrize("kind", ["undisturbed", "wood", "brushed", "slots", "old_cuts", "expanded", "cork", "ribbed"])
def test_on_an_empty_table_nothing_is_drawn(kind: str) -> None:
    scene = shop_floor_scene(kind, 95_000_003, alone=True).scene
    assert comb_picture(render_empty_table(scene, 1)[0]) is None


def test_where_the_light_network_sees_no_comb_the_other_one_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "segments", lambda *_: pytest.fail("asked"))
    scene = shop_floor_scene("wood", 95_000_003, alone=True).scene
    assert comb_picture(render_empty_table(scene, 1)[0]) is None
    noise = np.random.default_rng(1).integers(60, 80, (900, 1200), dtype=np.uint8)
    assert comb_picture(noise) is None


@pytest.mark.parametrize(("shape", "asked"), [((1200, 1600), 3), ((3000, 4000), 2), ((6000, 8000), 1)])
def test_of_a_large_picture_no_more_is_asked_than_could_be_drawn(
    shape: tuple[int, int], asked: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    guesses: list[float] = []

    def nothing(_: np.ndarray, guess: float) -> np.ndarray:
        guesses.append(guess)
        return np.zeros((2, 8, 8), np.float32)

    monkeypatch.setattr(drawing, "comb_and_things", nothing)
    assert comb_picture(np.zeros(shape, np.uint8)) is None
    assert guesses == [40.0, 20.0, 11.0][:asked]


def test_where_walls_dont_show_in_comb_others_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    rendered = scene_of((19.0, 23.0))

    def with_filled_cells(seen: Segments) -> None:
        seen.wall[:, : seen.wall.shape[1] // 2] *= 0.1

    told_otherwise(monkeypatch, with_filled_cells)
    drawn = comb_picture(rendered.picture)
    assert drawn is not None
    block = area_coverage(rendered.truth_px.rings, *rendered.picture.shape[1::-1]) > 0.5
    within = cv2.distanceTransform(block.astype(np.uint8), cv2.DIST_L2, 5) > rendered.pitch_px
    from_walls = cv2.distanceTransform((drawn[0] < 100).astype(np.uint8), cv2.DIST_L2, 5)
    assert from_walls[within].max() < rendered.pitch_px


def test_on_a_dark_table_comb_is_drawn_too() -> None:
    rendered = render(shop_floor_scene("undisturbed", 95_000_003, alone=True).scene)
    assert comb_picture(rendered.picture) is not None


def test_comb_of_fine_cells_in_a_large_picture_is_drawn() -> None:
    """At 16 pixels a pitch the picture has 6 million, what shows comb a fraction of them."""
    rendered = scene_of((12.0, 15.0))
    wide = cv2.copyMakeBorder(rendered.picture, 700, 100, 100, 700, cv2.BORDER_CONSTANT, value=(80, 80, 80))
    drawn = comb_picture(wide)
    assert drawn is not None
    off = distances_to(drawn[1].border - [100.0, 700.0], rendered.truth_px) / rendered.pitch_px
    assert np.quantile(off, 0.9) < 0.3


def test_a_thing_within_the_comb_may_be_a_hole_and_is_not_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    rendered = scene_of((19.0, 23.0))
    assert comb_picture(rendered.picture) is not None

    told_otherwise(monkeypatch, lambda seen: hide_within(seen, (20, 20), 1.0))
    assert comb_picture(rendered.picture) is None


def test_what_lies_away_from_the_block_does_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    def with_swarf_beneath_a_thing(seen: Segments) -> None:
        seen.comb[10:20, 10:60], seen.thing[10:20, 10:60] = 1.0, 0.0
        seen.comb[14:40, 30:40], seen.thing[14:40, 30:40] = 0.0, 1.0

    told_otherwise(monkeypatch, with_swarf_beneath_a_thing)
    assert comb_picture(scene_of((19.0, 23.0)).picture) is not None


def test_ink_narrower_than_a_cell_within_the_block_is_comb(monkeypatch: pytest.MonkeyPatch) -> None:
    rendered = scene_of((19.0, 23.0))
    plain = comb_picture(rendered.picture)
    told_otherwise(monkeypatch, lambda seen: hide_within(seen, (30, 6), 0.1))
    inked = comb_picture(rendered.picture)
    assert len(border_of(inked)) == pytest.approx(len(border_of(plain)), abs=2)


def test_a_cable_narrower_than_a_cell_within_the_block_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    told_otherwise(monkeypatch, lambda seen: hide_within(seen, (30, 6), 0.9))
    assert comb_picture(scene_of((19.0, 23.0)).picture) is None


def test_beside_glare_nothing_is_drawn() -> None:
    rendered = scene_of((19.0, 23.0))
    corner = rendered.truth_px.exterior[0]
    lit = cv2.circle(rendered.picture.copy(), np.rint(corner).astype(int).tolist(), 60, (255, 255, 255), -1)
    assert comb_picture(rendered.picture) is not None
    assert comb_picture(lit) is None
