"""Mask, cells and witnesses on rendered blocks of known outline."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.errors import NoBlockFound, PictureError
from contour.geometry.signed_distance import depth_inside
from contour.synthetic import (
    CameraModel,
    CellGeometry,
    Clutter,
    Fade,
    Light,
    Material,
    Rendered,
    Scene,
    Sensor,
    Table,
    camera_above,
    disc_ring,
    rectangle,
    render,
    signed_distance,
    with_holes,
)
from contour.walls.cell_scale import probe
from contour.walls.coarse_block import coarse_block
from contour.walls.lightness import light_from_table, wall_light
from contour.walls.see_block import see_block, see_walls
from contour.walls.wall_evidence import BlockEvidence, WitnessKind
from contour.walls.wall_mask import wall_mask
from tests.support.scenes.shop_floor_scenes import shop_floor_scene


def camera() -> CameraModel:
    return camera_above(800, 600, 0.375, distance_mm=1500.0)


BLOCK = rectangle((150.0, 112.0), 190.0, 130.0, 9.0)


def plain_scene() -> Scene:
    return Scene(BLOCK, camera(), CellGeometry(pitch_mm=8.0, wall_mm=0.6), table=Table(texture=0.004))


@cache
def picture(
    pitch_mm: float = 8.0, kind: str = "honeycomb", *, dark: bool = False, clutter: bool = False, hole: bool = False
) -> Rendered:
    outline = with_holes(BLOCK, disc_ring((150.0, 112.0), 26.0)) if hole else BLOCK
    wall = 0.4 if kind == "perforated" else 0.08
    return render(
        Scene(
            outline,
            camera(),
            CellGeometry(
                kind=kind,
                pitch_mm=pitch_mm,
                wall_mm=wall * pitch_mm,
                ribbon_deg=20.0,
                jitter=0.2 if kind == "irregular" else 0.0,
            ),
            thickness_mm=6.0 if dark else 15.0,
            material=Material(top=0.1, side=0.06, glints=0.0) if dark else Material(),
            table=Table(level=0.75) if dark else Table(),
            light=Light(gradient=0.3, vignetting=0.25),
            clutter=Clutter(specks=30, debris=10) if clutter else Clutter(),
            seed=5,
        )
    )


def seen_in(picture: NDArray[np.uint8], polarity: str) -> BlockEvidence:
    """The block as it is seen in the picture's own light."""
    return see_block(see_walls(picture, wall_light(picture), polarity))


@pytest.mark.parametrize("pitch_mm", [3.0, 5.0, 8.0, 14.0, 22.0])
def test_the_pitch_is_read_from_the_picture(pitch_mm: float) -> None:
    rendered = picture(pitch_mm)
    assert probe(wall_light(rendered.picture), "auto").pitch_px == pytest.approx(rendered.pitch_px, rel=0.1)


@pytest.mark.parametrize("dark", [False, True])
def test_bright_and_dark_walls_are_told_apart(dark: bool) -> None:
    assert probe(wall_light(picture(dark=dark).picture), "auto").bright is not dark


def test_the_polarity_can_be_fixed() -> None:
    with pytest.raises(NoBlockFound):
        seen_in(picture().picture, "dark")


def test_the_mask_of_the_inverted_picture_is_the_same() -> None:
    light = wall_light(picture().picture)
    bright = wall_mask(light, 21.0, bright=True, contrast=80.0).mask
    dark = wall_mask(255 - light, 21.0, bright=False, contrast=80.0).mask
    assert np.mean(bright != dark) < 0.002


def test_the_mask_does_not_follow_the_light() -> None:
    light = wall_light(picture().picture).astype(np.float64)
    ramp = np.linspace(0.55, 1.0, light.shape[1])
    even = wall_mask(np.rint(light).astype(np.uint8), 21.0, bright=True).mask
    shaded = wall_mask(np.rint(light * ramp).astype(np.uint8), 21.0, bright=True).mask
    assert np.mean(even != shaded) < 0.02


@pytest.mark.parametrize("kind", ["honeycomb", "irregular", "foam", "perforated"])
def test_witnesses_lie_on_the_outline(kind: str) -> None:
    rendered = picture(9.0, kind)
    ring = seen_in(rendered.picture, "auto").rings[0]
    off = signed_distance(rendered.truth_px, ring.points)
    assert len(ring.points) > 20
    assert abs(float(np.median(off))) < 0.3
    assert np.mean(np.abs(off) < 1.0) > 0.8
    assert np.mean(off < -1.0) < 0.08


def test_witnesses_come_in_order_with_outward_normals() -> None:
    ring = seen_in(picture().picture, "auto").rings[0]
    assert (np.diff(ring.position) >= 0).all()
    assert np.allclose(np.linalg.norm(ring.normal, axis=1), 1.0)
    middle = ring.points.mean(axis=0)
    assert ((ring.points - middle) * ring.normal).sum(axis=1).min() > 0
    assert set(np.unique(ring.kind)) <= {int(kind) for kind in WitnessKind}
    assert (ring.sigma > 0).all()


def test_no_stretch_of_the_outline_is_without_witness() -> None:
    rendered = picture()
    ring = seen_in(rendered.picture, "auto").rings[0]
    edge = rendered.truth_px.exterior
    nearest = np.sqrt(((edge[:, None] - ring.points[None]) ** 2).sum(axis=2)).min(axis=1)
    assert np.mean(nearest > 1.2 * rendered.pitch_px) < 0.02


def test_rings_turn_with_the_material_on_their_left() -> None:
    exterior, hole = seen_in(picture(hole=True).picture, "auto").rings
    for ring, sign in ((exterior, 1.0), (hole, -1.0)):
        following = np.roll(ring.coarse, -1, axis=0)
        area = (ring.coarse[:, 0] * following[:, 1] - following[:, 0] * ring.coarse[:, 1]).sum()
        assert area * sign > 0
    assert hole.is_hole
    assert not exterior.is_hole


def test_no_walls_are_seen_in_what_hides_the_block() -> None:
    """On a grid over the picture: the witnesses go around it, and nothing else changes."""
    rendered = picture()
    plain = seen_in(rendered.picture, "auto").rings[0].points
    corner = plain[plain[:, 0].argmax()]
    hidden = np.zeros((150, 200), np.uint8)
    x, y = (corner / 4).astype(int)
    hidden[max(0, y - 15) : y + 15, max(0, x - 15) : x + 15] = 1
    found = see_block(see_walls(rendered.picture, wall_light(rendered.picture), "auto"), hidden=hidden).rings[0].points
    assert np.abs(found - corner).max(axis=1).min() > 50
    far = np.abs(plain - corner).max(axis=1) > 120
    nearest = np.hypot(*np.moveaxis(plain[far][:, None] - found, 2, 0)).min(axis=1)
    assert nearest.max() < 0.5


def test_chips_and_dust_beside_the_block_are_no_witnesses() -> None:
    rendered = picture(clutter=True)
    ring = seen_in(rendered.picture, "auto").rings[0]
    assert np.mean(signed_distance(rendered.truth_px, ring.points) < -1.5) < 0.03


def test_a_bright_perforated_table_is_not_taken_for_walls() -> None:
    scene = Scene(
        BLOCK, camera(), CellGeometry(pitch_mm=8.0, wall_mm=0.6), table=Table(level=0.3, perforation_pitch_mm=12.0)
    )
    rendered = render(scene)
    ring = seen_in(rendered.picture, "auto").rings[0]
    assert np.mean(np.abs(signed_distance(rendered.truth_px, ring.points)) < 1.5) > 0.75


def test_walls_as_bright_as_the_table_are_seen_by_colour() -> None:
    scene = Scene(
        BLOCK,
        camera(),
        CellGeometry(pitch_mm=9.0, wall_mm=0.7),
        material=Material(top=0.4, side=0.3, texture=0.1, glints=0.0, colour=(0.4, 0.6, 2.0)),
        table=Table(level=0.36, colour=(1.6, 1.0, 0.4)),
        sensor=Sensor(colour=True),
    )
    rendered = render(scene)
    ring = seen_in(rendered.picture, "auto").rings[0]
    assert np.mean(np.abs(signed_distance(rendered.truth_px, ring.points)) < 1.0) > 0.8


def test_outermost_walls_of_a_thick_dark_block_are_not_drawn_in_by_the_sides_it_shows() -> None:
    rendered = render(
        Scene(
            BLOCK,
            camera(),
            CellGeometry(pitch_mm=9.0, wall_mm=0.7, offset_mm=(1.0, 2.0)),
            thickness_mm=20.0,
            material=Material(top=0.12, side=0.09, glints=0.0),
            table=Table(level=0.72),
        )
    )
    ring = seen_in(rendered.picture, "dark").rings[0]
    outermost = ring.points[ring.kind == WitnessKind.OUTERMOST]
    assert abs(np.median(signed_distance(rendered.truth_px, outermost))) < 0.6


@pytest.mark.parametrize("size_mm", [10.0, 30.0, 50.0])
def test_where_walls_fade_there_are_cells_and_no_hole(size_mm: float) -> None:
    faded = replace(plain_scene(), things=(Fade((150.0, 112.0), 0.92, size_mm),))
    seen = seen_in(render(faded).picture, "auto")
    assert (len(seen.rings), len(seen.openings)) == (1, 0)


def test_dark_walls_that_a_lamp_makes_as_light_as_the_table_elsewhere_are_walls() -> None:
    rendered = picture(dark=True)
    corner = max(rendered.truth_px.exterior.tolist(), key=sum)
    y, x = np.mgrid[: rendered.picture.shape[0], : rendered.picture.shape[1]]
    away = np.hypot(x - corner[0], y - corner[1]) / (3.0 * rendered.pitch_px)
    lit = np.clip(rendered.picture + 150.0 * np.exp(-0.5 * away**2), 0, 255).astype(np.uint8)
    seen = seen_in(lit, "auto")
    assert seen.polarity == "dark"
    assert np.hypot(*(seen.rings[0].coarse - corner).T).min() < rendered.pitch_px


def test_where_glare_drowns_walls_of_the_mask_there_are_cells_and_no_hole() -> None:
    rendered = render(shop_floor_scene("glare", 2600001, alone=True).scene)
    assert [ring.is_hole for ring in seen_in(rendered.picture, "auto").rings] == [False]


@pytest.mark.parametrize("radius_mm", [11.0, 26.0])
def test_a_hole_in_faded_walls_stays_one(radius_mm: float) -> None:
    outline = with_holes(BLOCK, disc_ring((150.0, 112.0), radius_mm))
    faded = replace(plain_scene(), outline=outline, things=(Fade((130.0, 112.0), 0.9, 30.0),))
    seen = seen_in(render(faded).picture, "auto")
    assert [ring.is_hole for ring in seen.rings] == [False, True]


def test_an_empty_mask_is_no_block() -> None:
    with pytest.raises(NoBlockFound, match="no block found"):
        coarse_block(np.zeros((300, 400), np.uint8), np.zeros((300, 400), np.uint8), 20.0)


@pytest.mark.parametrize("shape", [(600, 800, 4), (8, 800), (600,)])
def test_an_unusable_array_is_an_error_that_names_its_shape(shape: tuple[int, ...]) -> None:
    with pytest.raises(PictureError, match=str(shape[0])):
        seen_in(np.zeros(shape, np.uint8), "auto")


def test_where_a_coloured_picture_shows_no_table_its_light_is_kept() -> None:
    """Cells up to its border: nothing is known of a table's colour, which a channel could part from walls."""
    walls = np.zeros((240, 320), np.uint8)
    for first in (6, 7, 8):
        walls[first:-6:8], walls[6:-6, first::8] = 255, 255
    walls[:, :6], walls[:, -6:] = 0, 0
    picture = np.dstack([walls, walls // 2, walls // 4])
    assert light_from_table(picture, walls, walls, 1) is None


def test_where_no_cells_are_it_is_told_what_both_readings_showed() -> None:
    table = np.random.default_rng(3).normal(90.0, 4.0, (300, 400))
    with pytest.raises(NoBlockFound, match=r"cells.* between bright walls and .*cells.* between dark walls, expected"):
        probe(np.clip(table, 0, 255).astype(np.uint8), "auto")


def test_a_shaving_beside_the_block_is_told_from_it() -> None:
    rendered = picture()
    ring, pitch = rendered.truth_px.exterior, rendered.pitch_px
    begin, end = ring[0], ring[1]
    along = (end - begin) / np.hypot(*(end - begin))
    out = np.array([-along[1], along[0]])
    out = out if out @ (begin - ring.mean(axis=0)) > 0 else -out
    steps = np.arange(6.0)[:, None]
    strip = 0.5 * (begin + end) + 0.4 * pitch * steps * along + (0.5 + 0.25 * (steps % 2)) * pitch * out
    swarf = rendered.picture.copy()
    cv2.polylines(swarf, [np.rint(strip).astype(np.int32)], False, (200, 200, 200), 3)
    seen = seen_in(swarf, "auto")
    assert seen.loose is not None
    middle = np.rint(strip[2]).astype(int)
    near = seen.loose[middle[1] - 6 : middle[1] + 7, middle[0] - 6 : middle[0] + 7]
    assert near.any()
    assert signed_distance(rendered.truth_px, seen.rings[0].points).min() > -0.1 * pitch


def test_beside_a_light_table_the_border_of_the_blocks_shadow_is_no_outermost_wall() -> None:
    rendered = render(Scene(BLOCK, camera(), CellGeometry(pitch_mm=8.0), table=Table(level=0.8), seed=5))
    block = np.zeros(rendered.picture.shape[:2], np.uint8)
    cv2.fillPoly(block, [np.rint(rendered.truth_px.exterior).astype(np.int32)], 1)
    teeth = 12 - 5 * (np.arange(block.shape[1]) // 9 % 2)
    shadow = np.stack([np.roll(np.roll(block, 12, 1)[:, x], -high) for x, high in enumerate(teeth)], axis=1)
    shade = cv2.GaussianBlur(np.where(shadow > block, np.float32(0.45), np.float32(1.0)), (0, 0), 0.8)
    seen = seen_in(np.where(block > 0, rendered.picture, rendered.picture * shade).astype(np.uint8), "bright").rings[0]
    outermost = seen.points[seen.kind == WitnessKind.OUTERMOST]
    beyond = -depth_inside(rendered.truth_px.exterior, outermost) > 0.35 * rendered.pitch_px
    assert len(outermost) > 10
    assert np.count_nonzero(beyond) < 3, "it has a corner or two"
