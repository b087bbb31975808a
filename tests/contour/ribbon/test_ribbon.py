"""The ribbon's direction is told where walls or cells tell it, and nothing where they do not."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour
from contour.ribbon.ribbon import CorePicture, Ribbon, read_ribbon
from contour.synthetic import CellGeometry, Material, Scene, Sensor, camera_above, rectangle, render
from contour.walls.cell_scale import probe
from contour.walls.lightness import wall_light
from tests.support.scenes.lattices import BORDERS, lattice
from tests.support.scenes.photographs import photographs
from tests.support.scenes.trials import calibration_for

BLOCK = rectangle((80.0, 60.0), 110.0, 85.0, 12.0)
REGULAR = CellGeometry(pitch_mm=5.0, wall_mm=0.45, doubled=2.0, ribbon_deg=17.0)


@cache
def core(cells: CellGeometry, *, tilt_deg: float = 0.0, motion_px: tuple[float, float] = (0.0, 0.0)) -> CorePicture:
    """What is seen of a block of these cells, about 20 px apart; no more light from foils of one direction."""
    camera = camera_above(640, 480, 0.25, tilt_deg=(tilt_deg, 0.0))
    sensor = Sensor(motion_px=motion_px)
    rendered = render(Scene(BLOCK, camera, cells, material=Material(sheen=0.0), sensor=sensor, seed=5))
    calibration, height_mm = calibration_for(camera), rendered.thickness_mm

    def to_mm(pixels: Float64s) -> Float64s:
        return calibration.to_work(pixels, height_mm)

    def lean_px(pixels: Float64s) -> Float64s:
        return calibration.to_pixels(to_mm(pixels), height_mm - 1.0) - pixels

    return CorePicture(rendered.picture, rendered.truth_px, rendered.pitch_px, True, to_mm, lean_px)


def off(told: Ribbon, true_deg: float) -> float:
    """Degrees between what was told and what is true; a direction has no sense."""
    assert told.angle_deg is not None, told.why
    return abs((told.angle_deg - true_deg + 90.0) % 180.0 - 90.0)


@pytest.mark.parametrize("ribbon_deg", [-20.0, 17.0, 90.0, 145.0])
def test_doubled_walls_tell_the_ribbon_of_regular_cells(ribbon_deg: float) -> None:
    told = read_ribbon(core(replace(REGULAR, ribbon_deg=ribbon_deg)))
    assert told.told_by == "walls"
    assert told.bound_deg is not None
    assert off(told, ribbon_deg) <= told.bound_deg < 2.0


@pytest.mark.parametrize("expansion_deg", [50.0, 70.0, 79.0])
def test_the_form_of_cells_tells_the_ribbon_where_no_wall_is_doubled(expansion_deg: float) -> None:
    told = read_ribbon(core(replace(REGULAR, doubled=1.0, expansion_deg=expansion_deg)))
    assert told.told_by == "cells"
    assert off(told, 17.0) < 0.5


def test_walls_and_cells_are_both_named_where_both_tell() -> None:
    assert read_ribbon(core(replace(REGULAR, expansion_deg=70.0))).told_by == "walls and cells"


def test_warped_cells_with_broken_walls_are_told_within_the_bound() -> None:
    told = read_ribbon(core(replace(REGULAR, warp=0.1, wobble=0.03, broken=0.02)))
    assert told.bound_deg is not None
    assert off(told, 17.0) < told.bound_deg


def test_the_direction_is_that_in_the_frame_of_millimetres() -> None:
    seen = core(REGULAR)
    turn = np.array([[math.cos(0.5), math.sin(0.5)], [-math.sin(0.5), math.cos(0.5)]])
    turned = replace(seen, to_mm=lambda pixels: seen.to_mm(pixels) @ turn + (300.0, -50.0))
    assert off(read_ribbon(turned), 17.0 + math.degrees(0.5)) < 0.5


@pytest.mark.parametrize(
    ("cells", "why"),
    [
        (replace(REGULAR, doubled=1.0), "look"),
        (replace(REGULAR, kind="irregular", jitter=0.3), "make no even lattice"),
        (replace(REGULAR, kind="foam", jitter=0.4), "make no even lattice"),
        (replace(REGULAR, pitch_mm=22.0, wall_mm=1.5), "whole cells are seen"),
    ],
)
def test_nothing_is_told_of_what_shows_no_ribbon(cells: CellGeometry, why: str) -> None:
    told = read_ribbon(core(cells))
    assert (told.angle_deg, told.bound_deg, told.told_by) == (None, None, None)
    assert why in told.why


@pytest.mark.parametrize("moved_px", [1.5, 3.0, 5.0])
def test_walls_that_look_wide_since_the_picture_moved_across_them_are_not_doubled(moved_px: float) -> None:
    across = math.radians(17.0 + 90.0 + 60.0)
    motion = (moved_px * math.cos(across), -moved_px * math.sin(across))
    assert read_ribbon(core(replace(REGULAR, doubled=1.0), motion_px=motion)).angle_deg is None


def test_walls_whose_sides_a_tilted_camera_shows_are_not_doubled() -> None:
    assert read_ribbon(core(replace(REGULAR, doubled=1.0, wall_mm=0.3), tilt_deg=9.0)).angle_deg is None


def test_walls_and_cells_that_tell_different_directions_tell_none() -> None:
    """Millimetres that are a fifth too long across another family of walls make its cells look over-expanded."""
    seen = core(REGULAR)
    across = np.array([math.cos(math.radians(167.0)), math.sin(math.radians(167.0))])
    stretched = replace(seen, to_mm=lambda pixels: _stretched(seen.to_mm(pixels), across, 1.2))
    assert read_ribbon(stretched).why == "the widest walls and the form of the cells tell different directions"


def _stretched(points: Float64s, way: Float64s, factor: float) -> Float64s:
    return np.asarray(points + np.outer(points @ way, way) * (factor - 1.0))


@pytest.mark.parametrize(("wide_px", "row_px", "node_px"), [(43.0, 15.6, 9.0), (40.0, 16.0, 7.0), (36.0, 12.0, 5.0)])
def test_cells_pulled_to_rectangles_are_not_read_as_turned_by_a_right_angle(
    wide_px: float, row_px: float, node_px: float
) -> None:
    """Their lattice is that of cells a little over-expanded along the ribbon; only the walls deny it."""
    light = np.zeros((700, 700), np.uint8)
    for row in range(10, 34):
        for column in range(2, 16):
            x, y = (column + 0.5 * (row % 2)) * wide_px, row * row_px
            ends = [(x, y + 0.5 * node_px)] * 2
            to = [(x + side * wide_px, y + row_px - 0.5 * node_px) for side in (-0.5, 0.5)]
            for a, b in [((x, y - 0.5 * node_px), ends[0]), *zip(ends, to, strict=True)]:
                cv2.line(light, _sixteenths(a), _sixteenths(b), 230, 2, cv2.LINE_AA, 4)
    light = np.asarray(cv2.GaussianBlur(light, (0, 0), 0.8), np.uint8)
    outline = Contour(np.array([[120.0, 180.0], [480.0, 180.0], [480.0, 350.0], [120.0, 350.0]]))
    pitch_px = math.sqrt(wide_px * row_px * 2.0 / math.sqrt(3.0))
    assert "too few walls" in read_ribbon(_flat(light, outline, pitch_px, bright=True)).why


def _sixteenths(place: tuple[float, float]) -> tuple[int, int]:
    return round(16 * place[0]), round(16 * place[1])


@pytest.mark.parametrize("border", BORDERS)
@pytest.mark.parametrize("cells", ["hexagonal", "square", "triangular", "over-expanded", "round"])
def test_of_lattices_only_those_that_were_pulled_tell_a_direction(cells: str, border: str) -> None:
    drawn = lattice(3, cells, border)  # type: ignore[arg-type]
    told = read_ribbon(_flat(drawn.picture, drawn.outline, drawn.pitch_px, bright=not drawn.bright_table))
    assert (
        told.angle_deg is None
        if drawn.ribbon_deg is None
        else told.angle_deg is None or off(told, drawn.ribbon_deg) < 1
    )


@pytest.mark.parametrize(
    "name", ["alfoam_closed", "fangrid_left", "lattice_ce12", "lattice_rpu", "nomexfin_dense", "protoboard_10x5"]
)
def test_nothing_is_told_of_photographs_that_show_no_ribbon(name: str) -> None:
    found, folder = photographs()
    photograph = next((one for one in found if one.name == name), None)
    if photograph is None:
        pytest.skip(f"{name} is not in {folder}; COMBTRACE_PHOTOS names another folder")
    light = wall_light(photograph.picture)
    cells = probe(light, "dark" if photograph.dark else "bright")
    assert read_ribbon(_flat(light, photograph.outline, cells.pitch_px, bright=cells.bright)).angle_deg is None


def _flat(light: np.ndarray, outline: Contour, pitch_px: float, *, bright: bool) -> CorePicture:  # type: ignore[type-arg]
    middle = (np.array(light.shape[1::-1]) - 1.0) / 2.0
    return CorePicture(
        light, outline, pitch_px, bright, lambda pixels: pixels * (0.3, -0.3), lambda pixels: (pixels - middle) / 1000.0
    )
