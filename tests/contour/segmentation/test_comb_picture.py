"""A picture's comb is drawn on black, whatever its pitch; nothing is drawn where there is none, or it is in doubt."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from functools import cache
from typing import Any

import cv2
import numpy as np
import pytest

from contour.errors import NoBlockFound
from contour.geometry.agreement import distances_to, places_along
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour
from contour.geometry.signed_distance import nearest
from contour.segmentation import comb_picture as drawing
from contour.segmentation.comb_picture import CombPicture, comb_picture
from contour.segmentation.network import Segments
from contour.synthetic import Rendered, area_coverage, pitch_px, render, render_empty_table
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
    """Have what the network tells changed before it is drawn; the other one sees the same things."""
    told, things = drawing.segments, list[np.ndarray]()

    def changed(light: np.ndarray, *where: Any) -> Segments:
        seen = told(light, *where)
        change(seen)
        things.append(seen.thing)
        return seen

    def covered(light: np.ndarray, pitch: float) -> np.ndarray:
        comb, _ = covers(light, pitch)
        return np.stack((comb, cv2.resize(things[-1], comb.shape[::-1])))

    covers = drawing.comb_and_covers
    monkeypatch.setattr(drawing, "segments", changed)
    monkeypatch.setattr(drawing, "comb_and_covers", covered)


def hide_within(seen: Segments, half: tuple[int, int], thing: float) -> None:
    """Take comb away over so many rows and columns to both sides of a place within it, with so sure a thing there."""
    rows, columns = np.nonzero(cv2.erode((seen.comb > 0.5).astype(np.uint8), np.ones((61, 61), np.uint8)))
    if len(rows):
        patch = slice(rows[0] - half[0], rows[0] + half[0]), slice(columns[0] - half[1], columns[0] + half[1])
        seen.comb[patch], seen.wall[patch], seen.thing[patch] = 0.0, 0.0, thing


def is_drawn(picture: np.ndarray) -> bool:
    """Whether walls are drawn to tell where the block ends."""
    drawn = comb_picture(picture)
    assert drawn is not None
    with contextlib.suppress(NoBlockFound):
        return drawn.bordered().border is not None
    return False


def farthest_from_walls(drawn: CombPicture | None, rendered: Rendered) -> float:
    """How far a place well within the block lies from drawn walls, pixels."""
    assert drawn is not None
    block = area_coverage(rendered.truth_px.rings, *rendered.picture.shape[1::-1]) > 0.5
    within = cv2.distanceTransform(block.astype(np.uint8), cv2.DIST_L2, 5) > rendered.pitch_px
    return float(cv2.distanceTransform((drawn.drawn < 100).astype(np.uint8), cv2.DIST_L2, 5)[within].max())


def border_of(drawn: CombPicture | None) -> Float64s:
    assert drawn is not None
    border = drawn.bordered().border
    assert border is not None
    return border


@cache
def told_scene() -> Rendered:
    """A block on wood of which two networks tell the same."""
    return render(shop_floor_scene("wood", 95_000_008, alone=True).scene)


def outline_of(drawn: CombPicture | None) -> Contour:
    assert drawn is not None
    outline = drawn.outlined().outline
    assert outline is not None
    return outline.contour


@pytest.mark.parametrize("pitch", [(12.0, 15.0), (19.0, 23.0), (30.0, 40.0), (50.0, 60.0)])
def test_cells_of_any_size_are_found(pitch: tuple[float, float]) -> None:
    rendered = scene_of(pitch)
    drawn = comb_picture(rendered.picture)
    assert drawn is not None
    assert drawn.drawn.shape == rendered.picture.shape[:2]
    rows, columns = np.nonzero(drawn.drawn > 100)
    truth = rendered.truth_px.exterior
    for seen, ring in ((columns, truth[:, 0]), (rows, truth[:, 1])):
        assert seen.min() == pytest.approx(ring.min(), abs=0.6 * rendered.pitch_px)
        assert seen.max() == pytest.approx(ring.max(), abs=0.6 * rendered.pitch_px)


@pytest.mark.parametrize("pitch", [(12.0, 15.0), (19.0, 23.0), (30.0, 40.0), (50.0, 60.0)])
def test_where_comb_ends_is_told_all_around(pitch: tuple[float, float]) -> None:
    rendered = scene_of(pitch)
    border, truth = border_of(comb_picture(rendered.picture)), rendered.truth_px
    off = distances_to(border, truth) / rendered.pitch_px
    assert np.median(off) < 0.08
    assert np.quantile(off, 0.95) < 0.3
    assert nearest(places_along(truth, 1.0), border).max() < 1.5 * rendered.pitch_px


def test_an_outline_is_told_all_around() -> None:
    rendered = told_scene()
    outline, truth = outline_of(comb_picture(rendered.picture)), rendered.truth_px
    off = distances_to(places_along(outline, 1.0), truth) / rendered.pitch_px
    assert np.quantile(off, 0.95) < 0.2
    assert max(off.max(), distances_to(places_along(truth, 1.0), outline).max() / rendered.pitch_px) < 0.5


def test_an_outline_elsewhere_than_networks_see_the_border_is_refused() -> None:
    rendered = told_scene()
    drawn = comb_picture(rendered.picture)
    assert drawn is not None
    drawn.check(rendered.truth_px)
    aside = (0.7 * rendered.pitch_px, 0.0)
    moved = Contour(rendered.truth_px.exterior + aside, tuple(hole + aside for hole in rendered.truth_px.holes))
    with pytest.raises(NoBlockFound, match=r"a network sees the border of comb up to 0\.\d cells from the outline"):
        drawn.check(moved)


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
    assert farthest_from_walls(comb_picture(rendered.picture), rendered) < rendered.pitch_px


def test_on_a_dark_table_comb_is_drawn_too() -> None:
    rendered = render(shop_floor_scene("undisturbed", 95_000_003, alone=True).scene)
    assert comb_picture(rendered.picture) is not None


def test_comb_of_fine_cells_in_a_large_picture_is_drawn() -> None:
    """At 16 pixels a pitch the picture has 6 million, what shows comb a fraction of them."""
    rendered = scene_of((12.0, 15.0))
    wide = cv2.copyMakeBorder(rendered.picture, 700, 100, 100, 700, cv2.BORDER_REPLICATE)
    off = distances_to(border_of(comb_picture(wide)) - [100.0, 700.0], rendered.truth_px) / rendered.pitch_px
    assert np.quantile(off, 0.9) < 0.3


def test_a_thing_within_the_comb_may_be_a_hole_and_is_not_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    picture = scene_of((19.0, 23.0)).picture
    assert is_drawn(picture)
    told_otherwise(monkeypatch, lambda seen: hide_within(seen, (20, 20), 1.0))
    assert not is_drawn(picture)


def test_what_lies_away_from_the_block_does_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    def with_swarf_beneath_a_thing(seen: Segments) -> None:
        seen.comb[10:20, 10:60], seen.thing[10:20, 10:60] = 1.0, 0.0
        seen.comb[14:40, 30:40], seen.thing[14:40, 30:40] = 0.0, 1.0

    told_otherwise(monkeypatch, with_swarf_beneath_a_thing)
    assert is_drawn(scene_of((19.0, 23.0)).picture)


@pytest.mark.parametrize(
    ("first", "other", "told"),
    [(0.1, 0.0, True), (0.4, 0.0, True), (0.1, 0.4, True), (0.4, 0.4, False), (0.1, 0.6, False)],
)
def test_a_thing_at_the_edge_is_one_where_both_networks_see_it_or_the_one_that_knows_more_surely_does(
    monkeypatch: pytest.MonkeyPatch, first: float, other: float, told: bool
) -> None:
    told_otherwise(monkeypatch, lambda seen: seen.thing.fill(first))
    covers = drawing.comb_and_covers

    def covered(light: np.ndarray, pitch: float) -> np.ndarray:
        comb, thing = covers(light, pitch)
        return np.stack((comb, np.full_like(thing, other)))

    monkeypatch.setattr(drawing, "comb_and_covers", covered)
    drawn = comb_picture(told_scene().picture)
    with contextlib.nullcontext() if told else pytest.raises(NoBlockFound, match="nothing over its edge"):
        assert outline_of(drawn)


def test_ink_narrower_than_a_cell_within_the_block_is_comb(monkeypatch: pytest.MonkeyPatch) -> None:
    rendered = scene_of((19.0, 23.0))
    told_otherwise(monkeypatch, lambda seen: hide_within(seen, (30, 6), 0.1))
    assert farthest_from_walls(comb_picture(rendered.picture), rendered) < rendered.pitch_px


def test_a_cable_narrower_than_a_cell_within_the_block_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    told_otherwise(monkeypatch, lambda seen: hide_within(seen, (30, 6), 0.9))
    assert not is_drawn(scene_of((19.0, 23.0)).picture)


def test_beside_glare_nothing_is_drawn() -> None:
    rendered = scene_of((19.0, 23.0))
    corner = rendered.truth_px.exterior[0]
    lit = cv2.circle(rendered.picture.copy(), np.rint(corner).astype(int).tolist(), 60, (255, 255, 255), -1)
    assert is_drawn(rendered.picture)
    assert not is_drawn(lit)
    drawn = comb_picture(lit)
    with pytest.raises(NoBlockFound, match="nothing over its edge"):
        outline_of(drawn)
