"""Scenes of the shop floor show what they say, hide what they say, and change no scene without things."""

import dataclasses

import cv2
import numpy as np
import pytest

from contour.geometry.rings import densified
from contour.synthetic import (
    CellGeometry,
    Clutter,
    Cover,
    Crush,
    Fade,
    Filling,
    Flare,
    Ink,
    Light,
    Material,
    Mirror,
    Scene,
    Sensor,
    Shade,
    Slip,
    Strip,
    Structure,
    Table,
    camera_above,
    rectangle,
    render,
    signed_distance,
    thick_line,
)
from tests.support.scenes.shop_floor_scenes import KINDS, LATER, shop_floor_scene

CAMERA = camera_above(320, 240, 1.0, distance_mm=900.0, plane_mm=0.0)
OUTLINE = rectangle((160.0, 120.0), 180.0, 120.0)
EDGE = (250.0, 120.0)
"""The middle of the right edge."""

PLAIN = Scene(
    OUTLINE,
    CAMERA,
    CellGeometry(pitch_mm=20.0, wall_mm=3.0),
    thickness_mm=0.0,
    material=Material(top=0.8, spread=0.0, texture=0.0, glints=0.0, sheen=0.0, sparks=0.0),
    table=Table(level=0.2, texture=0.0),
    light=Light(shadow=0.0),
    sensor=Sensor(blur_px=0.0, shot_noise=0.0, read_noise=0.0),
)
HIDING = {"tape", "sheet", "clamp", "hand_or_cable"}


def with_things(*things, scene=PLAIN):
    return render(dataclasses.replace(scene, things=things))


def at(rendered, place):
    """The grey level seen at a place, millimetres."""
    x, y = np.rint(CAMERA.project(np.array([place]), 0.0)[0]).astype(int)
    return int(rendered.picture[y, x])


# --- all kinds --------------------------------------------------------------------------------------------------------


def small(kind, seed):
    """The scene on a picture of a ninth of the size: what is done is the same, and many are quick."""
    scene = shop_floor_scene(kind, seed, alone=True).scene
    camera = scene.camera
    third = dataclasses.replace(
        camera,
        width=camera.width // 3,
        height=camera.height // 3,
        focal_px=(camera.focal_px[0] / 3, camera.focal_px[1] / 3),
        centre_px=((camera.width // 3 - 1) / 2, (camera.height // 3 - 1) / 2),
    )
    return dataclasses.replace(scene, camera=third)


@pytest.fixture(scope="module")
def undisturbed():
    return render(small("undisturbed", 5))


OTHER_BLOCKS = {"undisturbed", "pushed_together", "corners"}


@pytest.mark.parametrize("kind", [kind for kind in (*KINDS, *LATER) if kind not in OTHER_BLOCKS])
def test_every_kind_changes_the_picture_and_hides_the_edge_or_not(undisturbed, kind):
    plain, done = undisturbed, render(small(kind, 5))
    before, after = (p if p.ndim == 2 else p.mean(axis=2) for p in (plain.picture, done.picture))
    assert np.abs(before.astype(float) - after).max() > 10.0
    assert all(np.array_equal(a, b) for a, b in zip(plain.truth_px.rings, done.truth_px.rings, strict=True))
    assert [len(seen) for seen in done.visible] == [len(ring) for ring in done.truth_px.rings]
    assert (not all(seen.all() for seen in done.visible)) == (kind in HIDING)
    assert sum(seen.sum() for seen in done.visible) > 0.4 * sum(map(len, done.visible))


@pytest.mark.parametrize("seed", range(8))
def test_corners_are_sharp_cut_or_round_and_no_edge_between_them_is_gone(seed):
    scene = shop_floor_scene("corners", seed, alone=True).scene
    ring = scene.outline.exterior
    edge = np.roll(ring, -1, axis=0) - ring
    way = edge[:, 0] + 1j * edge[:, 1]
    quarters = np.angle(way / way[np.abs(way).argmax()]) / (0.5 * np.pi)
    along = np.abs(quarters - np.rint(quarters)) < 0.01
    assert {int(quarter) % 4 for quarter in np.rint(quarters[along])} == {0, 1, 2, 3}
    assert np.abs(way[along]).min() > scene.cells.pitch_mm


@pytest.mark.parametrize("seed", range(8))
def test_blocks_that_are_pushed_together_lie_within_a_cell_of_each_other_and_never_over_each_other(seed):
    scene = shop_floor_scene("pushed_together", seed, alone=True).scene
    (other,) = scene.things
    nearest = signed_distance(scene.outline, densified(other.outline.exterior, 0.1)).max() / scene.cells.pitch_mm
    assert -0.9 < nearest < 0.01


def test_the_same_kind_and_seed_give_the_same_bytes_and_another_seed_does_not():
    assert np.array_equal(render(small("clamp", 6)).picture, render(small("clamp", 6)).picture)
    other = dataclasses.replace(small("clamp", 7), camera=small("clamp", 6).camera)
    assert not np.array_equal(render(small("clamp", 6)).picture, render(other).picture)


def test_a_quarter_of_the_scenes_have_two_kinds_and_an_undisturbed_one_has_none():
    both = [len(shop_floor_scene("dust", seed).kinds) == 2 for seed in range(40)]
    assert 4 <= sum(both) <= 18
    assert all(shop_floor_scene("undisturbed", seed).kinds == ("undisturbed",) for seed in range(20))


@pytest.mark.parametrize("seed", range(12))
def test_what_covers_the_edge_is_never_as_bright_as_the_table_beside_it(seed):
    scene = shop_floor_scene("tape", seed, alone=True).scene
    tape = next(thing for thing in scene.things if isinstance(thing, Cover))
    grey = [255.0 * scene.light.level * level for level in (tape.level, scene.table.level)]
    assert abs(grey[0] - grey[1]) >= 11.9


def test_a_scene_without_things_looks_as_it_always_did():
    scene = dataclasses.replace(
        PLAIN,
        thickness_mm=12.0,
        cells=CellGeometry(kind="irregular", pitch_mm=14.0, jitter=0.2, broken=0.02, warp=0.1),
        material=Material(),
        clutter=Clutter(specks=20, debris=5),
        sensor=dataclasses.replace(PLAIN.sensor, colour=True),
    )
    assert np.abs(render(scene).picture[40:200:20, 80:250:30, 0].astype(int) - BEFORE).max() <= 1


BEFORE = np.array(
    [
        [51, 51, 51, 51, 51, 51],
        [55, 42, 192, 42, 43, 42],
        [35, 34, 75, 119, 91, 34],
        [65, 36, 34, 34, 39, 35],
        [49, 34, 34, 61, 40, 34],
        [143, 61, 105, 34, 36, 57],
        [35, 34, 34, 34, 34, 34],
        [43, 43, 43, 43, 43, 43],
    ]
)
"""As rendered before there were things."""


# --- what hides -------------------------------------------------------------------------------------------------------


def test_a_cover_hides_exactly_what_lies_under_it():
    rendered = with_things(Cover(rectangle(EDGE, 40.0, 30.0, 20.0), 0.5, texture=0.0))
    area = CAMERA.project_contour(rectangle(EDGE, 40.0, 30.0, 20.0), 0.0)
    depth = signed_distance(area, rendered.truth_px.exterior)
    assert (depth > 0.0).sum() > 10
    assert np.array_equal(rendered.visible[0], depth < -1.0)
    assert at(rendered, EDGE) == round(0.5 * 255)


def test_a_rounded_cover_is_darker_at_its_flanks_and_its_shadow_falls_beside_it():
    cable = Cover(
        thick_line([(220.0, 120.0), (250.0, 120.0), (300.0, 125.0)], 24.0),
        0.6,
        texture=0.0,
        rounding_mm=12.0,
        shadow=0.5,
        shadow_mm=(0.0, -14.0),
    )
    rendered = with_things(cable)
    assert at(rendered, (275.0, 122.0)) > at(rendered, (275.0, 132.0)) + 30
    assert at(rendered, (275.0, 103.0)) < 0.75 * at(rendered, (275.0, 145.0))


# --- what fills, marks and bends ----------------------------------------------------------------------------------


def test_filled_cells_are_material_up_to_the_cut_and_leave_the_edge_visible():
    rendered = with_things(Filling(rectangle(EDGE, 90.0, 90.0), 0.5, walls=0.0))
    y, x = np.mgrid[80:160, 230:249]
    depth = signed_distance(rendered.truth_px, np.column_stack((x.ravel(), y.ravel())).astype(float))
    inside = rendered.picture[y.ravel(), x.ravel()][depth > 1.0]
    assert (inside > 0.35 * 255).all()
    assert at(rendered, (252.0, 120.0)) == round(0.2 * 255)
    assert all(seen.all() for seen in rendered.visible)


def test_walls_show_through_a_filling_as_far_as_it_says():
    area = rectangle((160.0, 120.0), 100.0, 80.0)
    shown = with_things(Filling(area, 0.3, walls=1.0)).picture[90:150, 120:200]
    covered = with_things(Filling(area, 0.3, walls=0.0)).picture[90:150, 120:200]
    assert shown.max() > 0.7 * 255
    assert covered.max() < 0.4 * 255


def test_compound_and_ink_have_their_colour_in_colour_pictures():
    scene = dataclasses.replace(PLAIN, sensor=dataclasses.replace(PLAIN.sensor, colour=True))
    blue = (2.0, 0.5, 0.5)
    filled = with_things(Filling(rectangle((160.0, 120.0), 90.0, 90.0), 0.4, blue, walls=0.0), scene=scene)
    assert (filled.picture[100:140, 140:180, 0] > 2 * filled.picture[100:140, 140:180, 2].astype(int)).all()
    ink = Ink((rectangle((160.0, 120.0), 60.0, 60.0),), 0.4, blue, strength=1.0)
    written = with_things(ink, scene=scene).picture[100:140, 140:180].astype(int)
    walls = written[..., 0] > 0.6 * 255
    assert walls.any()
    assert (written[walls][:, 2] < 0.5 * written[walls][:, 0]).all()


def test_ink_goes_on_walls_and_on_the_table_beside_the_block_only_where_asked():
    stroke = (thick_line([(200.0, 120.0), (240.0, 120.0), (300.0, 120.0)], 12.0),)
    plain = with_things()
    dry, wet = with_things(Ink(stroke, 0.02, strength=1.0)), with_things(Ink(stroke, 0.9, strength=1.0, on_table=True))
    assert at(dry, (280.0, 120.0)) == at(plain, (280.0, 120.0))
    assert at(wet, (280.0, 120.0)) == pytest.approx(0.9 * 255, abs=2)
    row = slice(118, 122), slice(205, 245)
    assert plain.picture[row].max() > 0.7 * 255 > 0.3 * 255 > dry.picture[row].max()
    cells = plain.picture[row] < 0.21 * 255
    assert np.array_equal(wet.picture[row][cells], plain.picture[row][cells])


def test_crushed_cells_move_near_the_place_only_and_stay_inside_the_outline():
    crush = Crush(EDGE, (-1.0, 0.0), 80.0, 40.0, 20.0, 4.0)
    plain, done = with_things(), with_things(crush)
    changed = np.abs(plain.picture.astype(int) - done.picture) > 20
    x = np.flatnonzero(changed.any(axis=0))
    assert 200 <= x.min() < x.max() <= 250
    assert changed[:, 210:250].mean() > 0.05
    # more of the cells lie near the edge: they were pressed together
    assert (done.picture[90:150, 235:250] > 150).mean() > 1.15 * (plain.picture[90:150, 235:250] > 150).mean()


def test_behind_a_slip_the_cells_do_not_go_on():
    plain, done = with_things(), with_things(Slip((160.0, 120.0), (0.0, 1.0), 8.0))
    assert np.array_equal(plain.picture[:, 170:], done.picture[:, 170:])
    shifted = np.roll(plain.picture, -8, axis=0)[80:160, 80:150]
    assert np.abs(shifted.astype(int) - done.picture[80:160, 80:150]).mean() < 12.0


def test_a_strip_beside_the_block_has_cells_of_its_own_and_is_no_part_of_the_truth():
    cells = dataclasses.replace(PLAIN.cells, offset_mm=(3.0, 4.0))
    plain, done = with_things(), with_things(Strip(rectangle((270.0, 120.0), 30.0, 80.0), cells))
    assert done.picture[90:150, 256:284].mean() > plain.picture[90:150, 256:284].mean() + 10
    assert np.array_equal(plain.picture[:, :250], done.picture[:, :250])
    assert np.array_equal(plain.truth_px.exterior, done.truth_px.exterior)


# --- light, table and sensor ------------------------------------------------------------------------------------------


def test_a_polished_table_shows_the_walls_again_fainter_and_fading():
    plain = with_things().picture.astype(int)
    extra = with_things(Mirror(0.5, 20.0, 0.5)).picture - plain
    assert extra[60:180, 70:250].max() <= 1
    columns = extra[70:170, 251:310].mean(axis=0)
    assert columns[:15].mean() > 3.0 * columns[40:].mean() > 0.0
    inside, outside = plain[70:170, 243], extra[70:170, 257]
    assert np.corrcoef(inside, outside)[0, 1] > 0.6


def test_a_shadow_takes_light_from_the_table_or_from_the_block_as_well():
    area = rectangle(EDGE, 60.0, 60.0)
    plain = with_things()
    beside, over = with_things(Shade(area, 0.5, 0.0)), with_things(Shade(area, 0.5, 0.0, on_block=True))
    assert at(beside, (265.0, 120.0)) == at(over, (265.0, 120.0)) == pytest.approx(0.1 * 255, abs=1)
    walls = (slice(95, 145), slice(224, 247))
    assert beside.picture[walls].max() == plain.picture[walls].max()
    assert over.picture[walls].max() == pytest.approx(0.5 * plain.picture[walls].max(), abs=1)


def test_a_flare_adds_light_where_it_is_and_less_on_the_block_where_asked():
    plain, done = with_things(), with_things(Flare(EDGE, 0.4, (15.0, 8.0), 90.0, on_block=0.0))
    extra = done.picture.astype(int) - plain.picture
    assert extra[118:122, 252:255].min() > 0.3 * 255
    assert extra[118:122, 290:].max() == 0
    assert extra[plain.picture == plain.picture.max()].max() <= 1


def test_walls_fade_in_the_middle_and_stay_at_the_edge():
    plain, done = with_things().picture, with_things(Fade((160.0, 120.0), 0.8, 20.0)).picture
    assert done[110:130, 150:170].max() < 0.4 * plain[110:130, 150:170].max()
    assert np.array_equal(plain[:, 240:], done[:, 240:])


@pytest.mark.parametrize("kind", ["wood", "brushed", "slots", "old-cuts", "expanded", "ribbed", "cork"])
def test_a_structured_table_varies_about_its_level(kind):
    table = with_things(Structure(kind, 30.0, 0.2, 30.0)).picture[:50]
    assert table.mean() == pytest.approx(0.2 * 255, rel=0.3)
    assert table.std() > 3.0


def test_grain_and_slots_run_along_their_angle():
    across, along = (with_things(Structure("slots", 30.0, 0.3, angle)).picture[:50] for angle in (90.0, 0.0))
    assert np.ptp(across.mean(axis=0)) > 5 * np.ptp(across.mean(axis=1))
    assert np.ptp(along.mean(axis=1)) > 5 * np.ptp(along.mean(axis=0))


def sensed(**changes):
    return render(dataclasses.replace(PLAIN, sensor=dataclasses.replace(PLAIN.sensor, **changes))).picture


def test_motion_smears_along_its_way_and_keeps_the_light():
    still, moved = sensed().astype(float), sensed(motion_px=(9.0, 0.0)).astype(float)
    assert moved[100:140, 100:220].mean() == pytest.approx(still[100:140, 100:220].mean(), rel=0.03)
    kernel = np.full((1, 9), 1.0 / 9.0)
    assert np.abs(cv2.filter2D(still, -1, kernel) - moved)[20:-20, 20:-20].mean() < 3.0
    assert np.abs(np.diff(moved, axis=1)).max() < 0.4 * np.abs(np.diff(moved, axis=0)).max()


def test_rows_hot_pixels_and_gamma_are_read_out():
    still = sensed().astype(float)
    rows = sensed(row_noise=0.03).astype(float) - still
    assert rows[:, :60].mean(axis=1).std() == pytest.approx(0.03 * 255, rel=0.3)
    assert rows[:, :60].std(axis=1).max() < 0.6
    hot = sensed(hot_pixels=0.01).astype(float) - still
    assert 0.002 < (hot > 20).mean() < 0.01
    assert np.allclose(sensed(gamma=2.0), still**2 / 255.0, atol=1.6)
