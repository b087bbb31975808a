"""Outlines and borders of rendered blocks: orientation, areas known by hand, closed cell borders, broken-off parts."""

import numpy as np
import pytest
import shapely

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
    broken_off,
    camera_above,
    closed_border,
    convex,
    crescent,
    disc_ring,
    l_shape,
    moved,
    rectangle,
    render,
    signed_distance,
    u_shape,
    with_holes,
)

CENTRE = (200.0, 150.0)


def area(contour):
    def one(ring):
        x, y = ring[:, 0], ring[:, 1]
        return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))

    return sum(one(ring) for ring in contour.rings)


@pytest.mark.parametrize(
    ("contour", "expected"),
    [
        (rectangle(CENTRE, 200.0, 100.0, 33.0), 20_000.0),
        (l_shape(CENTRE, 200.0, 150.0, 60.0, 5.0), 60.0 * (200.0 + 150.0 - 60.0)),
        (u_shape(CENTRE, 200.0, 150.0, 60.0, 40.0), 200.0 * 150.0 - 80.0 * 110.0),
        (with_holes(rectangle(CENTRE, 200.0, 100.0), disc_ring((180.0, 150.0), 20.0)), 20_000.0 - np.pi * 400.0),
    ],
)
def test_areas_are_those_computed_by_hand(contour, expected):
    assert area(contour) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("seed", range(6))
def test_every_outline_is_simple_and_counter_clockwise(seed):
    outlines = [
        blob(CENTRE, 80.0, seed),
        convex(CENTRE, 80.0, seed),
        crescent(CENTRE, 90.0, 70.0, 60.0, 40.0 * seed),
        moved(l_shape((0.0, 0.0), 90.0, 70.0, 25.0), CENTRE, 50.0 * seed),
        broken_off(rectangle(CENTRE, 200.0, 140.0), 0.2 + 0.05 * seed, 0.34 + 0.05 * seed, 9.0, seed),
    ]
    for outline in outlines:
        shape = shapely.Polygon(outline.exterior)
        assert shape.is_valid
        assert shape.exterior.is_ccw


def test_a_crescent_is_a_disc_without_the_part_under_the_other_disc():
    found = shapely.Polygon(crescent((0.0, 0.0), 90.0, 70.0, 60.0).exterior)
    disc = shapely.Point(0, 0).buffer(90.0, 2000)
    bite = shapely.Point(60, 0).buffer(70.0, 2000)
    assert found.symmetric_difference(disc - bite).area < 0.002 * found.area


def test_a_broken_off_part_takes_area_and_leaves_the_rest_of_the_outline():
    whole = rectangle(CENTRE, 200.0, 140.0)
    rest = broken_off(whole, 0.25, 0.38, 10.0, 3)
    before, after = shapely.Polygon(whole.exterior), shapely.Polygon(rest.exterior)
    assert 200.0 < before.area - after.area < 6000.0
    assert before.buffer(1e-6).contains(after)
    assert after.exterior.intersection(before.exterior.buffer(1e-6)).length > 0.84 * before.exterior.length


def test_signed_distance_is_positive_in_the_material_only():
    contour = with_holes(rectangle(CENTRE, 100.0, 60.0), disc_ring(CENTRE, 10.0))
    points = np.array([[200.0, 150.0], [160.0, 150.0], [100.0, 150.0], [200.0, 175.0]])
    assert np.allclose(signed_distance(contour, points), [-10.0, 10.0, -50.0, 5.0], atol=0.01)


def test_one_closed_cell_is_a_hexagon_grown_by_half_a_wall():
    cells = CellGeometry(pitch_mm=20.0, wall_mm=2.0, doubled=1.0)
    border = closed_border(cells, rectangle((0.0, 0.0), 10.0, 10.0), 1)
    assert len(border.exterior) == 6
    across = 22.0  # flats move out by half a wall on both sides
    assert area(border) == pytest.approx(across**2 * np.sqrt(3.0) / 2.0)


def test_a_closed_border_surrounds_as_many_cells_as_fit_and_keeps_its_holes():
    cells = CellGeometry(pitch_mm=10.0, wall_mm=0.02, doubled=1.0, warp=0.1, ribbon_deg=17.0, expansion_deg=66.0)
    outline = with_holes(rectangle(CENTRE, 160.0, 120.0), disc_ring(CENTRE, 25.0))
    border = closed_border(cells, outline, 5)
    assert len(border.holes) == 1
    assert area(border) / cells.cell_area_mm2 == pytest.approx(round(area(border) / cells.cell_area_mm2), abs=2.0)
    assert shapely.Polygon(border.exterior).is_valid


def test_the_material_of_a_closed_border_reaches_it_everywhere():
    camera = camera_above(400, 300, 1.0, distance_mm=900.0, plane_mm=10.0)
    cells = CellGeometry(pitch_mm=24.0, wall_mm=5.0, doubled=1.4, warp=0.05, expansion_deg=64.0, ribbon_deg=9.0)
    border = closed_border(cells, rectangle(CENTRE, 200.0, 150.0), 1)
    scene = Scene(
        border,
        camera,
        cells,
        thickness_mm=0.0,
        material=Material(top=1.0, spread=0.0, texture=0.0, glints=0.0, sheen=0.0, sparks=0.0),
        table=Table(level=0.0, texture=0.0),
        light=Light(shadow=0.0),
        sensor=Sensor(blur_px=0.0, shot_noise=0.0, read_noise=0.0),
    )
    rendered = render(scene)
    x, y = np.meshgrid(np.arange(400.0), np.arange(300.0))
    depth = signed_distance(rendered.truth_px, np.column_stack((x.ravel(), y.ravel()))).reshape(300, 400)
    rim = (depth > 0.8) & (depth < 1.7)
    assert rim.sum() > 500
    assert (rendered.picture[rim] > 200).mean() > 0.995
    assert rendered.picture[area_coverage(rendered.truth_px.rings, 400, 300) == 0.0].max() == 0


def test_only_a_honeycomb_has_a_closed_border():
    with pytest.raises(ParameterError, match="honeycomb"):
        closed_border(CellGeometry(kind="foam"), rectangle(CENTRE, 50.0, 50.0), 1)
    with pytest.raises(ParameterError, match="no cell"):
        closed_border(CellGeometry(pitch_mm=90.0), rectangle((25.0, 25.0), 2.0, 2.0), 1)


def test_a_neighbouring_piece_is_seen_but_no_part_of_the_truth():
    camera = camera_above(400, 300, 1.0, distance_mm=900.0, plane_mm=10.0)
    alone = Scene(rectangle((120.0, 150.0), 140.0, 140.0), camera, thickness_mm=10.0)
    beside = Scene(
        alone.outline, camera, thickness_mm=10.0, clutter=Clutter(neighbours=(rectangle((320.0, 150.0), 90.0, 140.0),))
    )
    one, two = render(alone), render(beside)
    assert two.picture[80:220, 280:360].mean() > one.picture[80:220, 280:360].mean() + 20
    assert np.array_equal(one.truth_px.exterior, two.truth_px.exterior)
    assert np.array_equal(one.picture[:, :180], two.picture[:, :180])
