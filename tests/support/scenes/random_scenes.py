"""Scenes with random parameters, one a seed: what nobody thought of. All are labelled traceable before any method runs.

Bounds: pitch 8 to 100 px, walls 0.9 px wide or more, arms of about 5 pitches or more, holes of 3.5, a border of 14 px
around the block, chips a pitch away from it, blur 0.5 to 1.6 px but no more than a twentieth of a pitch, the darkest
walls 7 times the noise or more (below 10 times: labelled dim).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from contour.geometry.rings import Contour
from contour.synthetic import (
    CellGeometry,
    Clutter,
    Light,
    Material,
    Scene,
    Sensor,
    Table,
    blob,
    broken_off,
    camera_above,
    convex,
    crescent,
    disc_ring,
    l_shape,
    rectangle,
    truth_px,
    u_shape,
    with_holes,
)
from tests.support.scenes.bench_scenes import DIM_BELOW, BenchScene, contrast_to_noise

WIDTH, HEIGHT = 1280, 960
BORDER_PX = 14.0
LEAST_CONTRAST = 7.5
_TORN = 0.14
_SHAPES = ("rectangle", "convex", "l", "u", "crescent", "blob", "rectangle-hole", "blob-hole", "broken-off")


def random_scenes(first: int, count: int) -> Iterator[BenchScene]:
    """The scenes of seeds first … first + count − 1."""
    return (random_scene(seed) for seed in range(first, first + count))


def random_scene(seed: int) -> BenchScene:
    """The scene of this seed; the same seed gives the same scene."""
    rng = np.random.default_rng([seed, 77])
    scale = float(rng.uniform(0.1, 0.45))
    tilt = rng.uniform(-3.0, 3.0, 2) * (3.0 if rng.random() < 0.15 else 1.0)
    camera = camera_above(
        WIDTH,
        HEIGHT,
        scale,
        distance_mm=max(float(rng.uniform(700.0, 1600.0)), WIDTH * scale * 1.6),
        plane_mm=20.0,
        tilt_deg=(float(tilt[0]), float(tilt[1])),
        roll_deg=float(rng.uniform(-4.0, 4.0)),
        distortion=(float(rng.uniform(-0.15, 0.06)), float(rng.uniform(-0.02, 0.03)), *rng.normal(0, 4e-4, 2), 0.0),
    )
    middle = (0.5 * WIDTH * scale, 0.5 * HEIGHT * scale)
    size = float(rng.uniform(0.62, 1.0))
    kind = str(rng.choice(_SHAPES))
    outline = _outline(rng, kind, middle, 0.43 * HEIGHT * scale * size, seed)
    dim = bool(rng.random() < 0.08)
    dark = not dim and bool(rng.random() < 0.2)
    cells = _cells(rng, scale, _narrowest(kind, 0.43 * HEIGHT * scale * size))
    scene = Scene(
        outline,
        camera,
        cells,
        # in deep narrow cells on a bright table dark walls stand before darkness: nothing to see there
        thickness_mm=min(float(rng.uniform(3.0, 40.0)), 1.2 * cells.pitch_mm if dark else 40.0),
        material=_material(rng, dark),
        table=_table(rng, dark),
        light=_light(rng, dim),
        clutter=Clutter(specks=int(rng.integers(0, 150)), debris=int(rng.integers(0, 45))),
        sensor=_sensor(rng, dim, cells.pitch_mm / scale),
        seed=seed,
        name=f"random-{seed}",
    )
    scene = _quiet_enough(_fitted(scene))
    return BenchScene(scene, dim=contrast_to_noise(scene) < DIM_BELOW)


def _quiet_enough(scene: Scene) -> Scene:
    """The scene with as much less noise as its darkest walls need."""
    share = min(1.0, contrast_to_noise(scene) / LEAST_CONTRAST)
    sensor = replace(
        scene.sensor, shot_noise=scene.sensor.shot_noise * share, read_noise=scene.sensor.read_noise * share
    )
    return replace(scene, sensor=sensor)


def _outline(rng: np.random.Generator, kind: str, at: tuple[float, float], radius: float, seed: int) -> Contour:
    angle, aspect = float(rng.uniform(0.0, 360.0)), float(rng.uniform(0.6, 1.0))
    long = 2.0 * radius / math.hypot(1.0, aspect)
    wide = long * aspect
    whole = rectangle(at, long, wide, angle)
    if kind == "convex":
        whole = convex(at, radius, seed, int(rng.integers(5, 10)))
    elif kind == "l":
        whole = l_shape(at, long, wide, float(rng.uniform(0.4, 0.55)) * wide, angle)
    elif kind == "u":
        whole = u_shape(at, long, wide, 0.33 * long, float(rng.uniform(0.35, 0.5)) * wide, angle)
    elif kind == "crescent":
        whole = crescent(at, radius, 0.75 * radius, float(rng.uniform(0.55, 0.75)) * radius, angle)
    elif kind.startswith("blob"):
        whole = blob(at, 0.75 * radius, seed)
    elif kind == "broken-off":
        start = _away_from_corners(rng, long, wide, 0.2 * radius)
        whole = broken_off(whole, start, start + _TORN, 0.06 * long, seed, pieces=int(rng.integers(2, 4)))
    if kind == "rectangle-hole":
        whole = with_holes(whole, disc_ring((at[0] + 0.05 * long, at[1] - 0.04 * wide), 0.18 * wide))
    elif kind == "blob-hole":
        whole = with_holes(whole, rectangle(at, 0.3 * radius, 0.36 * radius, angle).exterior)
    return whole


def _away_from_corners(rng: np.random.Generator, long: float, wide: float, least: float) -> float:
    """Where on a rectangle's outline a tear begins, so that both its ends keep a distance to the corners.

    A short rest of an edge beside a tear could as well be a corner whose cells are lost.
    """
    around = 2.0 * (long + wide)
    corners = np.array([0.0, long, long + wide, 2.0 * long + wide, around]) / around
    while True:
        start = float(rng.uniform(0.02, 0.98 - _TORN))
        if min(np.abs(corners - start).min(), np.abs(corners - start - _TORN).min()) >= least / around:
            return start


def _narrowest(kind: str, radius: float) -> float:
    """Least width of the block's arms, mm (a crescent's horns and a hole's surroundings apart)."""
    share = {
        "rectangle": 1.0,
        "convex": 1.0,
        "l": 0.4,
        "u": 0.36,
        "crescent": 0.5,
        "rectangle-hole": 0.32,
        "blob-hole": 0.4,
        "broken-off": 0.3,
    }
    return radius * share.get(kind, 0.5)


def _cells(rng: np.random.Generator, scale: float, narrowest: float) -> CellGeometry:
    most = min(100.0 * scale, narrowest / 5.0)
    least = 8.0 * scale
    pitch = float(np.exp(rng.uniform(math.log(least), math.log(max(most, 1.2 * least)))))
    wall = max(0.9 * scale, pitch * float(rng.uniform(0.045, 0.11)))
    irregular = rng.random() < 0.12
    return CellGeometry(
        kind="irregular" if irregular else "honeycomb",
        pitch_mm=pitch,
        wall_mm=wall,
        doubled=float(rng.uniform(1.0, 2.0)),
        expansion_deg=float(rng.choice([60.0, 60.0, 60.0, rng.uniform(50.0, 70.0), rng.uniform(70.0, 80.0)])),
        ribbon_deg=float(rng.uniform(0.0, 180.0)),
        offset_mm=(float(rng.uniform(0.0, pitch)), float(rng.uniform(0.0, pitch))),
        jitter=float(rng.uniform(0.1, 0.35)) if irregular else 0.0,
        warp=float(rng.uniform(0.0, 0.18)),
        wobble=float(rng.uniform(0.0, 0.04)),
        broken=float(rng.choice([0.0, rng.uniform(0.0, 0.02), rng.uniform(0.01, 0.04)])),
    )


def _material(rng: np.random.Generator, dark: bool) -> Material:
    if dark:
        return Material(top=0.13, side=0.09, glints=0.01, sparks=0.05, spread=0.1)
    top = float(rng.uniform(0.5, 0.85))
    return Material(
        top=top,
        side=top * float(rng.uniform(0.25, 0.55)),
        texture=float(rng.uniform(0.05, 0.22)),
        glints=float(rng.uniform(0.0, 0.08)),
        sheen=float(rng.uniform(0.0, 0.2)),
        sparks=float(rng.uniform(0.0, 0.4)),
    )


def _table(rng: np.random.Generator, dark: bool) -> Table:
    vacuum = not dark and rng.random() < 0.2
    return Table(
        level=0.72 if dark else float(rng.uniform(0.05, 0.17)),
        texture=float(rng.uniform(0.003, 0.018)),
        scratches=int(rng.integers(0, 20)),
        perforation_pitch_mm=float(rng.uniform(15.0, 40.0)) if vacuum else 0.0,
        groove_pitch_mm=80.0 if vacuum and rng.random() < 0.5 else 0.0,
    )


def _light(rng: np.random.Generator, dim: bool) -> Light:
    return Light(
        level=float(rng.uniform(0.22, 0.3)) if dim else float(rng.uniform(0.6, 1.05)),
        gradient=float(rng.uniform(0.0, 0.5)),
        gradient_deg=float(rng.uniform(0.0, 360.0)),
        vignetting=float(rng.uniform(0.0, 0.35)),
        shadow=float(rng.uniform(0.0, 0.3)),
        direction_deg=float(rng.uniform(0.0, 360.0)),
        patches=float(rng.uniform(0.0, 0.5)),
        glare=0.0 if dim else float(rng.choice([0.0, rng.uniform(0.0, 0.2)])),
        glare_at=(float(rng.uniform(0.0, 1.0)), float(rng.uniform(0.0, 1.0))),
    )


def _sensor(rng: np.random.Generator, dim: bool, pitch_px: float) -> Sensor:
    return Sensor(
        blur_px=min(float(rng.uniform(0.5, 1.6)), max(0.5, 0.05 * pitch_px)),
        shot_noise=0.03 if dim else float(rng.uniform(0.003, 0.015)),
        read_noise=float(rng.uniform(0.002, 0.008)),
        jpeg_quality=int(rng.choice([0, 0, 80, 90, 95])),
    )


def _fitted(scene: Scene) -> Scene:
    """The scene with its block shrunk about its middle until its outline keeps the border, and no more."""
    outline = scene.outline
    low, high = outline.exterior.min(axis=0), outline.exterior.max(axis=0)
    target = scene.camera.back_project(np.array([[(WIDTH - 1) / 2.0, (HEIGHT - 1) / 2.0]]), scene.thickness_mm)[0]
    for _ in range(30):
        rings = [ring - 0.5 * (low + high) + target for ring in outline.rings]
        placed = replace(scene, outline=Contour(rings[0], tuple(rings[1:])))
        seen = truth_px(placed).exterior
        if min(seen.min(), WIDTH - 1 - seen[:, 0].max(), HEIGHT - 1 - seen[:, 1].max()) >= BORDER_PX:
            return placed
        outline = Contour(outline.exterior * 0.96, tuple(hole * 0.96 for hole in outline.holes))
        low, high = outline.exterior.min(axis=0), outline.exterior.max(axis=0)
    return placed
