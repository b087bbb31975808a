"""The renderer's geometry is exact by areas, OpenCV's projection and half maxima, not by its own rasteriser."""

import dataclasses

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contour.errors import ParameterError
from contour.synthetic import (
    CellGeometry,
    Clutter,
    Light,
    Material,
    Scene,
    Sensor,
    Table,
    area_coverage,
    blob,
    camera_above,
    convex,
    crescent,
    disc_ring,
    l_shape,
    rectangle,
    render,
    signed_distance,
    u_shape,
    with_holes,
)

CLEAN = Sensor(blur_px=0.0, shot_noise=0.0, read_noise=0.0)
LENS = (-0.09, 0.02, 4e-4, -3e-4, 0.0)


def camera(tilt=(1.5, -1.0), distortion=LENS, scale=1.0):
    return camera_above(400, 300, scale, distance_mm=900.0, plane_mm=10.0, tilt_deg=tilt, distortion=distortion)


def solid(outline, **changes):
    """A plate without cells, texture, shadow, noise: white 1.0 on black 0."""
    plain = Scene(
        outline,
        camera(),
        CellGeometry(kind="solid"),
        thickness_mm=10.0,
        material=Material(top=1.0, side=0.0, spread=0.0, texture=0.0, glints=0.0, sheen=0.0, sparks=0.0),
        table=Table(level=0.0, texture=0.0),
        light=Light(shadow=0.0),
        sensor=CLEAN,
    )
    return dataclasses.replace(plain, **changes)


def shoelace(ring):
    x, y = ring[:, 0], ring[:, 1]
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


OUTLINES = {
    "rectangle": rectangle((200.0, 150.0), 210.3, 130.7, 13.0),
    "axis-parallel": rectangle((200.0, 150.0), 200.0, 120.0),
    "l": l_shape((200.0, 150.0), 220.0, 180.0, 80.0, -7.0),
    "u": u_shape((200.0, 150.0), 240.0, 180.0, 70.0, 60.0, 21.0),
    "crescent": crescent((200.0, 150.0), 100.0, 80.0, 70.0, 30.0),
    "blob": blob((200.0, 150.0), 90.0, 5),
    "convex": convex((200.0, 150.0), 110.0, 4),
    "holes": with_holes(
        rectangle((200.0, 150.0), 260.0, 180.0, 3.0), disc_ring((150.0, 150.0), 30.0), disc_ring((250.0, 140.0), 40.0)
    ),
}


@pytest.mark.parametrize("name", OUTLINES)
def test_the_light_of_a_solid_plate_is_the_area_of_its_projected_outline(name):
    rendered = render(solid(OUTLINES[name]))
    area = -sum(shoelace(ring) for ring in rendered.truth_px.rings)
    light = float(rendered.picture.sum(dtype=np.float64)) / 255.0
    length = sum(np.linalg.norm(np.roll(r, -1, axis=0) - r, axis=1).sum() for r in rendered.truth_px.rings)
    # an outline that lay 0.02 px outside would add length x 0.02
    assert abs(light - area) < 0.003 * length


@pytest.mark.parametrize("name", OUTLINES)
def test_a_blurred_plates_half_maximum_lies_on_the_truth_along_its_edges(name):
    sigma = 0.8  # a wider blur moves the half maximum of an edge of radius R by sigma^2 / 2R
    rendered = render(solid(OUTLINES[name], sensor=dataclasses.replace(CLEAN, blur_px=sigma)))
    picture = rendered.picture.astype(np.float32)
    for ring in rendered.truth_px.rings:
        offsets = edge_offsets(picture, ring)
        assert len(offsets) > 10
        assert abs(float(np.mean(offsets))) < 0.02
        assert float(np.percentile(np.abs(offsets), 95)) < 0.06


def edge_offsets(picture, ring, reach=4.0):
    """Signed distance from truth to the half-maximum crossing, at places away from corners; positive outside."""
    before, after = ring - np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0) - ring
    turn = np.abs(np.arctan2(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1)))
    calm = np.array([turn.take(range(i - 5, i + 7), mode="wrap").max() < 0.08 for i in range(len(ring))])
    middle = (ring + 0.5 * after)[calm]
    chord = (np.roll(ring, -3, axis=0) - np.roll(ring, 2, axis=0))[calm]
    # the material lies to the left as seen, so (-dy, dx) in pixels, y down, points away from it
    outward = np.column_stack((-chord[:, 1], chord[:, 0])) / np.linalg.norm(chord, axis=1, keepdims=True)
    steps = np.arange(-reach, reach + 1e-9, 0.1)
    found = []
    for place, out in zip(middle, outward, strict=True):
        profile = bilinear(picture, place + steps[:, None] * out)
        below = np.flatnonzero((profile[:-1] >= 127.5) & (profile[1:] < 127.5))
        if len(below) == 1:
            k = below[0]
            found.append(steps[k] + 0.1 * (profile[k] - 127.5) / (profile[k] - profile[k + 1]))
    return np.array(found)


def bilinear(picture, points):
    x, y = points[:, 0], points[:, 1]
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = x - i, y - j
    return (
        picture[j, i] * (1 - fx) * (1 - fy)
        + picture[j, i + 1] * fx * (1 - fy)
        + picture[j + 1, i] * (1 - fx) * fy
        + picture[j + 1, i + 1] * fx * fy
    )


def test_coverage_of_a_square_on_quarter_pixels_is_known_by_hand():
    square = np.array([[1.25, 1.25], [1.25, 3.0], [3.0, 3.0], [3.0, 1.25]])  # centres at whole numbers
    cover = area_coverage([square], 5, 5)
    assert cover[1, 1] == pytest.approx(0.25 * 0.25)
    assert cover[2, 1] == pytest.approx(0.25)
    assert cover[2, 2] == pytest.approx(1.0)
    assert cover[3, 3] == pytest.approx(0.25)
    assert cover.sum() == pytest.approx(1.75 * 1.75)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(-30.0, 30.0), st.floats(-30.0, 30.0))
def test_coverage_sums_to_the_area_of_the_part_of_a_polygon_inside_the_raster(seed, dx, dy):
    import shapely

    ring = convex((20.0 + dx, 20.0 + dy), 15.0, seed).exterior
    cover = area_coverage([ring[::-1]], 40, 40)
    inside = shapely.Polygon(ring).intersection(shapely.box(-0.5, -0.5, 39.5, 39.5)).area
    assert float(cover.sum(dtype=np.float64)) == pytest.approx(inside, abs=2e-3)
    assert cover.min() >= 0.0
    assert cover.max() <= 1.0


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (3.0, -2.0), (-12.0, 8.0)])
def test_projection_is_opencvs(tilt):
    model = camera(tilt, (-0.3, 0.2, 2e-3, -1e-3, 0.4))
    rng = np.random.default_rng(1)
    points = np.column_stack((rng.uniform(0, 400, 50), rng.uniform(0, 300, 50), np.full(50, 7.0)))
    expected, _ = cv2.projectPoints(
        points,
        np.array(model.rotation_vector),
        np.array(model.translation_mm),
        model.matrix,
        np.array(model.distortion),
    )
    assert np.allclose(model.project(points[:, :2], 7.0), expected[:, 0], atol=1e-6)


def test_back_projection_undoes_projection_at_every_height():
    model = camera((4.0, 3.0))
    points = np.random.default_rng(2).uniform(0, 300, (50, 2))
    for z in (0.0, 10.0, 55.0):
        assert np.allclose(model.back_project(model.project(points, z), z), points, atol=1e-6)


def test_the_work_frames_y_axis_runs_up_in_the_picture():
    model = camera((0.0, 0.0))
    low, high = model.project(np.array([[200.0, 100.0], [200.0, 200.0]]), 10.0)
    assert high[1] < low[1]
    assert abs(high[0] - low[0]) < 1e-9


def test_truth_runs_counter_clockwise_as_seen_in_the_work_frame_and_holes_the_other_way():
    rendered = render(solid(OUTLINES["holes"]))
    assert shoelace(rendered.truth_mm.exterior) > 0
    assert shoelace(rendered.truth_px.exterior) < 0
    assert all(shoelace(hole) < 0 for hole in rendered.truth_mm.holes)
    assert all(shoelace(hole) > 0 for hole in rendered.truth_px.holes)


def test_walls_end_at_the_outline_no_light_lies_outside_it():
    scene = solid(OUTLINES["u"], cells=CellGeometry(pitch_mm=12.0, wall_mm=2.0))
    rendered = render(scene)
    cover = area_coverage(rendered.truth_px.rings, 400, 300)
    assert rendered.picture[cover == 0.0].max() == 0
    inside = rendered.picture[cover == 1.0] / 255.0
    assert 0.25 < float(inside.mean()) < 0.5  # a honeycomb of 2 mm (ribbons 3.4) walls at 12 mm


def test_the_share_of_wall_is_that_of_hexagons_a_wall_narrower():
    cells = CellGeometry(pitch_mm=20.0, wall_mm=2.0, doubled=1.0, ribbon_deg=17.0)
    outline = rectangle((200.0, 150.0), 340.0, 240.0)
    scene = solid(outline, camera=camera((0.0, 0.0), (0.0,) * 5), cells=cells)
    rendered = render(scene)
    inside = rendered.picture[area_coverage(rendered.truth_px.rings, 400, 300) == 1.0] / 255.0
    assert float(inside.mean()) == pytest.approx(1.0 - ((20.0 - 2.0) / 20.0) ** 2, rel=0.01)


def test_ribbons_are_thicker_by_the_factor_given():
    def wall_at(ribbon_deg):
        cells = CellGeometry(pitch_mm=24.0, wall_mm=2.0, doubled=2.0, ribbon_deg=ribbon_deg)
        rendered = render(
            solid(rectangle((200.0, 150.0), 340.0, 240.0), camera=camera((0.0, 0.0), (0.0,) * 5), cells=cells)
        )
        return rendered.picture[area_coverage(rendered.truth_px.rings, 400, 300) == 1.0].mean() / 255.0

    # two of six half walls count double: two foils of 2 and one of 4 mm where there were three of 2
    single, double = 1.0 - (22.0 / 24.0) ** 2, wall_at(30.0)
    assert double / single == pytest.approx(4.0 / 3.0, rel=0.05)


def test_walls_cut_across_reach_their_full_brightness_up_to_the_outline():
    """Ribbons that run across the left and right edge: their ends' light is cut exactly at the edge."""
    outline = rectangle((200.0, 150.0), 200.4, 120.0)
    scene = solid(outline, camera=camera((0.0, 0.0), (0.0,) * 5), cells=CellGeometry(pitch_mm=24.0, wall_mm=6.0))
    rendered = render(scene)
    left = rendered.truth_px.exterior[:, 0].min()  # 99.3: the pixel 99 reaches from 98.5 to 99.5
    column = round(float(left))
    share = column + 0.5 - left
    bright = (rendered.picture[:, column + 1 : column + 7] == 255).all(axis=1)
    assert bright.sum() > 10
    steady = cv2.erode(bright.astype(np.uint8)[:, None], np.ones((3, 1), np.uint8))[:, 0] > 0
    assert steady.sum() > 5
    assert np.allclose(rendered.picture[steady, column] / 255.0, share, atol=0.01)


def test_the_same_scene_gives_the_same_bytes_and_another_seed_does_not():
    scene = Scene(OUTLINES["l"], camera(), clutter=Clutter(specks=5, debris=5), cells=CellGeometry(broken=0.05))
    assert np.array_equal(render(scene).picture, render(scene).picture)
    assert not np.array_equal(render(scene).picture, render(dataclasses.replace(scene, seed=2)).picture)


def test_a_block_beside_the_cameras_foot_shows_its_outer_side_below_the_outline():
    outline = rectangle((330.0, 150.0), 90.0, 200.0)
    far = solid(
        outline,
        thickness_mm=60.0,
        material=Material(top=1.0, side=0.5, spread=0.0, texture=0.0, glints=0.0, sheen=0.0, sparks=0.0),
    )
    rendered = render(far)
    cover = area_coverage(rendered.truth_px.rings, 400, 300)
    beside = rendered.picture[150, : int(rendered.truth_px.exterior[:, 0].min())]
    assert beside.max() > 30
    assert rendered.picture[cover == 0.0].max() < 200


def test_colour_pictures_have_three_channels_and_the_colours_asked_for():
    scene = Scene(
        OUTLINES["rectangle"],
        camera(),
        CellGeometry(kind="solid"),
        material=Material(colour=(0.5, 1.0, 1.5)),
        table=Table(level=0.3, colour=(1.5, 1.0, 0.5)),
        sensor=Sensor(colour=True),
    )
    picture = render(scene).picture
    assert picture.shape == (300, 400, 3)
    block, table = picture[150, 200].astype(int), picture[5, 5].astype(int)
    assert block[2] > block[1] > block[0]
    assert table[0] > table[1] > table[2]


@pytest.mark.parametrize("kind", ["honeycomb", "irregular", "foam", "perforated"])
def test_every_kind_of_cell_shows_walls_and_openings(kind):
    cells = CellGeometry(kind=kind, pitch_mm=14.0, wall_mm=3.0, jitter=0.3 if kind in ("irregular", "foam") else 0.0)
    rendered = render(solid(OUTLINES["rectangle"], cells=cells))
    cover = area_coverage(rendered.truth_px.rings, 400, 300)
    inside = rendered.picture[cover == 1.0]
    assert (inside > 250).mean() > 0.1
    assert (inside < 5).mean() > 0.15


def test_a_missing_cell_leaves_a_dark_patch_where_it_was():
    where = (200.0, 150.0)
    whole = CellGeometry(pitch_mm=20.0, wall_mm=3.0)
    light = [
        int(render(solid(OUTLINES["rectangle"], cells=c)).picture[125:175, 175:225].sum())
        for c in (whole, dataclasses.replace(whole, missing_cells_mm=(where,)))
    ]
    assert light[1] < 0.85 * light[0]


def test_a_perforated_plate_with_a_rim_has_a_closed_border():
    cells = CellGeometry(kind="perforated", pitch_mm=16.0, wall_mm=6.0, rim_mm=4.0)
    rendered = render(solid(OUTLINES["rectangle"], cells=cells))
    x, y = np.meshgrid(np.arange(400.0), np.arange(300.0))
    depth = signed_distance(rendered.truth_px, np.column_stack((x.ravel(), y.ravel()))).reshape(300, 400)
    rim = (depth > 1.0) & (depth < 3.0)
    assert rendered.picture[rim].min() == 255
    assert rendered.picture[depth > 8.0].min() == 0


def test_the_mean_cell_area_of_an_over_expanded_honeycomb_follows_from_its_constant_foil_length():
    regular, over = CellGeometry(pitch_mm=10.0), CellGeometry(pitch_mm=10.0, expansion_deg=80.0)
    assert regular.cell_area_mm2 == pytest.approx(10.0**2 * np.sqrt(3.0) / 2.0)
    side = 10.0 / np.sqrt(3.0)
    assert over.cell_area_mm2 == pytest.approx(2 * side * np.sin(np.radians(80)) * side * (1 + np.cos(np.radians(80))))


def test_parameters_out_of_range_are_refused_by_name():
    with pytest.raises(ParameterError, match="wall_mm"):
        CellGeometry(pitch_mm=5.0, wall_mm=6.0)
    with pytest.raises(ParameterError, match="jitter"):
        CellGeometry(jitter=0.7)
    with pytest.raises(ParameterError, match="mm_per_px"):
        camera_above(100, 100, 0.0)
    with pytest.raises(ParameterError, match="thickness_mm"):
        Scene(OUTLINES["l"], camera(), thickness_mm=-1.0)
