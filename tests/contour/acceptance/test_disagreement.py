"""Another account of the block agrees with every true outline, and shows what a wrong one left out or made up."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from contour.acceptance.disagreement import disagreement
from contour.geometry.rings import Contour
from contour.synthetic import Rendered, render
from tests.support.pictures.small_scenes import OUTLINES, block
from tests.support.scenes.shop_floor_scenes import shop_floor_scene

KINDS = ("easy", "shop", "dim", "dark")
LIMIT = 2.0
"""The recipe's default."""
EVERYWHERE = LIMIT / 8
"""What an outline may lie outside of the busy part on the whole."""


def polygon(contour: Contour) -> shapely.Polygon:
    return shapely.Polygon(contour.exterior, contour.holes)


def contour(shape: shapely.Geometry) -> Contour:
    """The largest polygon of a shape."""
    largest = max(getattr(shape, "geoms", [shape]), key=lambda part: part.area)
    exterior, *holes = (np.array(ring.coords)[:-1] for ring in (largest.exterior, *largest.interiors))
    return Contour(exterior, tuple(holes))


def bare(scene: Rendered, area: shapely.Geometry) -> NDArray[np.uint8]:
    """The scene's picture with the light of its table all over an area."""
    y, x = np.mgrid[: scene.picture.shape[0], : scene.picture.shape[1]]
    return np.where(shapely.contains_xy(area, x, y), np.uint8(np.median(scene.picture[:40, :40])), scene.picture)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", OUTLINES)
def test_it_agrees_with_the_true_outline(name: str, kind: str) -> None:
    scene = block(name, kind)
    assert disagreement(scene.picture, scene.truth_px, scene.pitch_px).pitches < 1.2


def test_a_sliver_of_the_block_disagrees() -> None:
    """Of its vertices two are left: no corner of it is cut off."""
    scene = block("rectangle", "easy")
    middle = scene.truth_px.exterior.mean(axis=0)
    long, wide = 5.0 * scene.pitch_px, 0.05 * scene.pitch_px
    sliver = middle + np.array([(-long, -wide), (-long, wide), (long, wide), (long, -wide)])
    assert disagreement(scene.picture, Contour(sliver), scene.pitch_px).pitches > LIMIT


@pytest.mark.parametrize("kind", KINDS)
def test_half_the_block_lost_is_seen(kind: str) -> None:
    scene = block("rectangle", kind)
    whole = polygon(scene.truth_px)
    x0, y0, _, y1 = whole.bounds
    found = disagreement(scene.picture, contour(whole & shapely.box(x0, y0, whole.centroid.x, y1)), scene.pitch_px)
    assert found.pitches > 2 * LIMIT
    assert not found.claimed
    assert whole.contains(shapely.Point(found.place_px))
    assert found.place_px[0] > whole.centroid.x


@pytest.mark.parametrize("kind", KINDS)
def test_a_corner_of_four_cells_cut_off_is_seen(kind: str) -> None:
    scene = block("rectangle", kind)
    corner = shapely.Point(scene.truth_px.exterior[scene.truth_px.exterior[:, 0].argmax()])
    rest = polygon(scene.truth_px) - corner.buffer(4.5 * scene.pitch_px)
    found = disagreement(scene.picture, contour(rest), scene.pitch_px)
    assert found.pitches > LIMIT
    assert corner.distance(shapely.Point(found.place_px)) < 4.5 * scene.pitch_px


def test_a_fibre_where_the_sides_of_a_blunt_corner_would_meet_is_no_corner_cut_off() -> None:
    scene = block("rectangle")
    corner, one, other = (scene.truth_px.exterior[k] for k in (0, 1, -1))
    ends = [corner + 4.0 * scene.pitch_px * (end - corner) / np.hypot(*(end - corner)) for end in (one, other)]
    blunt = polygon(scene.truth_px) - shapely.Polygon([corner, *ends]).buffer(0.1)
    picture = bare(scene, shapely.box(-1.0, -1.0, *scene.picture.shape[::-1]) - blunt)
    assert disagreement(picture, contour(blunt), scene.pitch_px).pitches < LIMIT
    x0, y0 = np.rint(corner + 0.2 * (np.mean(ends, axis=0) - corner)).astype(int)
    picture[y0 - 3 : y0 + 4, x0 - 10 : x0 + 11] = 230
    assert disagreement(picture, contour(blunt), scene.pitch_px).pitches < LIMIT


@pytest.mark.parametrize("kind", KINDS)
def test_table_taken_for_block_is_seen(kind: str) -> None:
    scene = block("l", kind)
    found = disagreement(scene.picture, contour(polygon(scene.truth_px).convex_hull), scene.pitch_px)
    assert found.pitches > LIMIT
    assert found.claimed


@pytest.mark.parametrize("kind", KINDS)
def test_a_hole_that_was_not_seen_is_seen(kind: str) -> None:
    scene = block("holed", kind)
    found = disagreement(scene.picture, Contour(scene.truth_px.exterior), scene.pitch_px)
    assert found.pitches > LIMIT
    assert polygon(Contour(scene.truth_px.holes[0])).contains(shapely.Point(found.place_px))


def needle(scene: Rendered, *, outwards: bool) -> tuple[shapely.Geometry, shapely.Point]:
    """A triangle across the middle of the longest edge, 1.6 pitches wide and 4 long, and its tip."""
    ring, pitch = scene.truth_px.exterior, scene.pitch_px
    corners = np.array(polygon(scene.truth_px).minimum_rotated_rectangle.exterior.coords)
    edge = max(range(4), key=lambda k: float(np.hypot(*(corners[k + 1] - corners[k]))))
    middle = 0.5 * (corners[edge] + corners[edge + 1])
    along = (corners[edge + 1] - corners[edge]) / np.hypot(*(corners[edge + 1] - corners[edge]))
    across = middle - ring.mean(axis=0)
    across = (1.0 if outwards else -1.0) * across / np.hypot(*across)
    tip = middle + 4.0 * pitch * across
    foot = 0.8 * pitch * along
    return shapely.Polygon([middle - foot - pitch * across, middle + foot - pitch * across, tip]), shapely.Point(tip)


@pytest.mark.parametrize("kind", KINDS)
def test_a_spike_onto_the_table_is_seen(kind: str) -> None:
    """Narrower than two cells, but it reaches four cells far."""
    scene = block("rectangle", kind)
    spike, tip = needle(scene, outwards=True)
    found = disagreement(scene.picture, contour(polygon(scene.truth_px) | spike), scene.pitch_px)
    assert found.pitches > LIMIT
    assert found.claimed
    assert tip.distance(shapely.Point(found.place_px)) < scene.pitch_px


@pytest.mark.parametrize("kind", KINDS)
def test_a_notch_into_the_block_is_seen(kind: str) -> None:
    scene = block("rectangle", kind)
    notch, tip = needle(scene, outwards=False)
    found = disagreement(scene.picture, contour(polygon(scene.truth_px) - notch), scene.pitch_px)
    assert found.pitches > LIMIT
    assert not found.claimed
    assert tip.distance(shapely.Point(found.place_px)) < 2 * scene.pitch_px


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["rectangle", "l", "holed"])
def test_an_outline_a_cell_too_fat_everywhere_is_seen(name: str, kind: str) -> None:
    scene = block(name, kind)
    true = disagreement(scene.picture, scene.truth_px, scene.pitch_px)
    fat = contour(polygon(scene.truth_px).buffer(scene.pitch_px, join_style="mitre"))
    found = disagreement(scene.picture, fat, scene.pitch_px)
    assert true.outside_pitches < EVERYWHERE - 0.05
    assert found.outside_pitches > EVERYWHERE + 0.05


def test_walls_that_glare_hides_are_no_table() -> None:
    """Dark walls inside a block grow as light as their cells: as light as the block, but never the table."""
    scene = block("rectangle", "dark")
    y, x = np.mgrid[: scene.picture.shape[0], : scene.picture.shape[1]]
    middle = scene.truth_px.exterior.mean(axis=0)
    hidden = np.hypot(x - middle[0], y - middle[1]) < 3 * scene.pitch_px
    picture = scene.picture.copy()
    picture[hidden] = int(scene.picture[hidden].mean())
    assert disagreement(picture, scene.truth_px, scene.pitch_px).pitches < LIMIT
    picture[hidden] = int(np.median(scene.picture[:20]))
    assert disagreement(picture, scene.truth_px, scene.pitch_px).pitches > LIMIT


def test_scratches_against_the_block_are_no_block() -> None:
    scene = block("rectangle", "dark")
    picture, pitch = scene.picture.copy(), scene.pitch_px
    corner = scene.truth_px.exterior[scene.truth_px.exterior[:, 0].argmax()]
    for offset in (-0.9, -0.3, 0.3, 0.9):
        start = np.rint(corner + pitch * np.array([-3.0, offset])).astype(int)
        outside = polygon(scene.truth_px).buffer(-0.1 * pitch)
        mask = np.zeros_like(picture)
        cv2.line(mask, start.tolist(), (picture.shape[1] - 1, int(start[1])), 255, 2, cv2.LINE_AA)
        cv2.fillPoly(mask, [np.rint(np.array(outside.exterior.coords)).astype(np.int32)], 0)
        picture = cv2.add(picture, np.asarray(mask // 5, np.uint8))
    assert disagreement(picture, scene.truth_px, pitch).pitches < LIMIT


def test_another_block_apart_from_this_one_is_none_of_its_business() -> None:
    scene = block("rectangle")
    both = np.concatenate([scene.picture, scene.picture], axis=1)
    assert disagreement(both, scene.truth_px, scene.pitch_px).pitches < 1.2


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_a_quarter_turn_changes_nothing(turns: int) -> None:
    """Within the half pixel that the reduction by whole pixels leaves."""
    scene = block("l", "shop")
    hull = contour(polygon(scene.truth_px).convex_hull)
    one = disagreement(scene.picture, hull, scene.pitch_px)
    picture, ring = scene.picture, hull.exterior
    for _ in range(turns):
        ring = np.column_stack([ring[:, 1], picture.shape[1] - 1 - ring[:, 0]])
        picture = np.ascontiguousarray(np.rot90(picture))
    other = disagreement(picture, Contour(ring), scene.pitch_px)
    assert other.pitches == pytest.approx(one.pitches, abs=0.3)


def test_a_picture_twice_as_large_gives_the_same_in_pitches() -> None:
    scene = block("l", "easy")
    hull = contour(polygon(scene.truth_px).convex_hull)
    large = np.asarray(cv2.resize(scene.picture, None, fx=2, fy=2, interpolation=cv2.INTER_LINEAR), np.uint8)
    ring = (hull.exterior + 0.5) * 2 - 0.5
    one = disagreement(scene.picture, hull, scene.pitch_px)
    other = disagreement(large, Contour(ring), 2 * scene.pitch_px)
    assert other.pitches == pytest.approx(one.pitches, rel=0.1)


def test_colour_counts_where_lightness_is_the_same() -> None:
    """Walls that only their colour tells from the table: one channel up, another down by as much light."""
    scene = block("rectangle")
    walls = (scene.picture.astype(np.float64) - scene.picture.min()) / np.ptp(scene.picture)
    blue, red = 128 - 60 * walls, 128 + 60 * 0.114 / 0.299 * walls
    picture = np.stack([blue, np.full_like(blue, 128.0), red], axis=2).astype(np.uint8)
    assert disagreement(picture, scene.truth_px, scene.pitch_px).pitches < 1.2
    half = contour(polygon(scene.truth_px).intersection(shapely.box(0, 0, 300, 480)))
    assert disagreement(picture, half, scene.pitch_px).pitches > LIMIT


def test_walls_that_fade_far_inside_are_no_table() -> None:
    scene = block("rectangle")
    (x, y), table = scene.truth_px.exterior.mean(axis=0), float(np.median(scene.picture[:20]))
    rows, columns = np.mgrid[: scene.picture.shape[0], : scene.picture.shape[1]]
    near = np.exp(-0.5 * (np.hypot(columns - x, rows - y) / (1.6 * scene.pitch_px)) ** 2)

    left = 1.0 - 0.8 * near
    faded = np.asarray(table + (scene.picture - table) * left, np.uint8)
    assert disagreement(faded, scene.truth_px, scene.pitch_px).pitches < 1.3


def test_nor_are_those_that_all_but_vanish_where_all_around_have_faded() -> None:
    scene = render(shop_floor_scene("fading", 4_010_008).scene)
    assert disagreement(scene.picture, scene.truth_px, scene.pitch_px).pitches < LIMIT
    middle = shapely.Point(940.0, 598.0).buffer(1.6 * scene.pitch_px)
    assert disagreement(bare(scene, middle), scene.truth_px, scene.pitch_px).pitches > LIMIT


def test_comb_in_a_shadow_is_no_table_and_what_is_as_dark_and_flat_may_be() -> None:
    scene = block("rectangle")
    left = int(scene.truth_px.exterior[:, 0].min() + 4.5 * scene.pitch_px)
    dark, flat = scene.picture.copy(), scene.picture.copy()
    flat[:, :left] = cv2.blur(flat, (61, 61))[:, :left]
    for picture in (dark, flat):
        picture[:, :left] //= 4
    assert disagreement(dark, scene.truth_px, scene.pitch_px).pitches < LIMIT
    assert disagreement(flat, scene.truth_px, scene.pitch_px).pitches > LIMIT


@pytest.mark.parametrize(("left", "is_hole"), [(0.2, False), (0.0, True)])
def test_a_hole_in_which_walls_are_faint_is_none_and_one_that_shows_the_table_is(left: float, is_hole: bool) -> None:
    scene = block("rectangle", "easy")
    table = float(np.median(scene.picture[:30]))
    x, y = scene.truth_px.exterior.mean(axis=0)
    rows, columns = np.indices(scene.picture.shape)
    inside = np.hypot(columns - x, rows - y) < 2.2 * scene.pitch_px
    noise = np.random.default_rng(3).normal(table, 2.0, scene.picture.shape)
    faint = np.where(inside, noise + left * (scene.picture - table), scene.picture)
    hole = shapely.Point(x, y).buffer(2.2 * scene.pitch_px)
    outline = contour(polygon(scene.truth_px) - hole)
    found = disagreement(np.clip(faint, 0, 255).astype(np.uint8), outline, scene.pitch_px)
    assert (found.pitches < LIMIT) == is_hole
    if not is_hole:
        assert not found.claimed
        assert hole.contains(shapely.Point(found.place_px))


def test_what_is_flat_and_known_is_no_table_inside_the_contour() -> None:
    """Compound: without cells it looks like table, with its place given it is no disagreement."""
    scene = block("rectangle")
    middle, size = scene.truth_px.exterior.mean(axis=0), 3.0 * scene.pitch_px
    area = np.rint(middle + size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])).astype(np.int32)
    picture, flat = scene.picture.copy(), np.zeros((120, 160), np.uint8)
    cv2.fillPoly(picture, [area], int(np.median(scene.picture[:20])))
    cv2.fillPoly(flat, [area // 4], 1)
    assert disagreement(picture, scene.truth_px, scene.pitch_px).pitches > LIMIT
    assert disagreement(picture, scene.truth_px, scene.pitch_px, flat).pitches < 1.2
    assert disagreement(picture, scene.truth_px, scene.pitch_px, np.zeros_like(flat)).pitches > LIMIT


def test_comb_beside_the_contour_that_is_told_from_it_is_no_block() -> None:
    scene = block("rectangle")
    whole = polygon(scene.truth_px)
    x0, y0, _, y1 = whole.bounds
    half = contour(whole & shapely.box(x0, y0, whole.centroid.x, y1))
    loose = np.zeros((120, 160), np.uint8)
    loose[:, int(whole.centroid.x / 4) :] = 1
    assert disagreement(scene.picture, half, scene.pitch_px).pitches > LIMIT
    assert disagreement(scene.picture, half, scene.pitch_px, loose=loose).pitches < 1.2


@pytest.mark.parametrize("kinked", [False, True])
def test_a_corner_beyond_a_cable_is_the_blocks_even_where_it_is_told_from_it(kinked: bool) -> None:
    """A band of table across a corner, along an edge of the outline or two; what lies beyond is told from the block."""
    scene = block("rectangle")
    whole, pitch = polygon(scene.truth_px), scene.pitch_px
    corners = scene.truth_px.exterior
    corner, *ends = (corners[k] for k in (0, 1, -1))
    long = 6.0 * pitch
    one, other = (corner + long * (end - corner) / np.hypot(*(end - corner)) for end in ends)
    bend = 0.5 * (one + other) + (0.8 * pitch if kinked else 0.0) * (0.5 * (one + other) - corner) / long
    beyond = shapely.Polygon([corner, one, bend, other]).buffer(0.1)
    cut = contour(whole - beyond)
    band = shapely.LineString([one, bend, other]).buffer(0.8 * pitch)
    picture = bare(scene, band)
    y, x = np.mgrid[: picture.shape[0], : picture.shape[1]]
    loose = shapely.contains_xy(beyond, x, y)
    assert disagreement(picture, cut, pitch, loose=cv2.resize(loose.astype(np.uint8), (160, 120))).pitches > LIMIT


def test_what_is_flat_elsewhere_hides_no_disagreement() -> None:
    scene = block("rectangle")
    whole = polygon(scene.truth_px)
    x0, y0, _, y1 = whole.bounds
    half, flat = contour(whole & shapely.box(x0, y0, whole.centroid.x, y1)), np.zeros((120, 160), np.uint8)
    flat[:10, :10] = 1
    one, other = (disagreement(scene.picture, half, scene.pitch_px, given) for given in (None, flat))
    assert other == one
