"""Undisturbed blocks of many kinds, one a seed, for things to be laid on: a family of its own.

Bounds: pitch 12 to 60 px, 12 to 60 cells across, arms of 5 pitches or more, a border of 40 px or more around the block.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from contour.geometry.rings import Contour, Ring, area
from contour.synthetic import (
    CellGeometry,
    Clutter,
    Light,
    Material,
    Scene,
    Sensor,
    Table,
    blob,
    camera_above,
    convex,
    disc_ring,
    l_shape,
    moved,
    polygon,
    rectangle,
    truth_px,
    u_shape,
    with_holes,
)
from tests.support.scenes.bench_scenes import contrast_to_noise

SIZES = ((1280, 1024), (1440, 1080), (1600, 1200), (1296, 972))
BORDER_PX = 40.0
LEAST_CONTRAST = 9.0
LEAST_WIDE = 10.5
"""Root of the block's area, in pitches, at least: a disc 12 cells across has 10.6."""
_DRAWN = 1_204_711
"""Keeps these numbers apart from other families' of the same seed."""

_SHAPES = ("rectangle", "rectangle", "rounded", "bulged", "convex", "blob", "ellipse", "l", "u", "holes")


def shop_floor_block(seed: int) -> Scene:
    """The undisturbed scene of this seed; the same seed gives the same scene."""
    rng = np.random.default_rng([seed, _DRAWN])
    width, height = SIZES[int(rng.integers(len(SIZES)))]
    pitch_px = math.exp(rng.uniform(math.log(12.0), math.log(60.0)))
    across = float(np.clip(rng.uniform(0.35, 0.95) * (height - 2.0 * BORDER_PX) / pitch_px, 12.0, 60.0))
    scale = float(rng.uniform(0.15, 0.5))
    camera = camera_above(
        width,
        height,
        scale,
        distance_mm=max(float(rng.uniform(600.0, 1500.0)), width * scale * 1.5),
        plane_mm=20.0,
        tilt_deg=(float(rng.normal(0.0, 1.2)), float(rng.normal(0.0, 1.2))),
        roll_deg=float(rng.uniform(-5.0, 5.0)),
        distortion=(float(rng.uniform(-0.12, 0.05)), float(rng.uniform(-0.02, 0.02)), *rng.normal(0, 3e-4, 2), 0.0),
    )
    dark, coloured = bool(rng.random() < 0.12), bool(rng.random() < 0.3)
    pitch_mm = pitch_px * scale
    scene = Scene(
        _outline(rng, across, seed, 0.5 * across * pitch_mm),
        camera,
        _cells(rng, pitch_mm, scale),
        thickness_mm=float(rng.uniform(0.4, 1.2) if dark else rng.uniform(0.4, 3.0)) * pitch_mm,
        material=_material(rng, dark, coloured),
        table=_table(rng, dark, coloured),
        light=_light(rng),
        clutter=Clutter(specks=int(rng.integers(0, 30)), debris=int(rng.choice([0, 0, rng.integers(0, 8)]))),
        sensor=_sensor(rng, pitch_px, coloured),
        seed=seed,
        name=f"floor-{seed}",
    )
    return quiet(placed(rng, scene), LEAST_CONTRAST)


def _outline(rng: np.random.Generator, across: float, seed: int, radius: float) -> Contour:
    """A block of this radius about the origin, millimetres."""
    kinds = [kind for kind in _SHAPES if across >= {"l": 22.0, "u": 30.0, "holes": 24.0}.get(kind, 0.0)]
    kind = str(rng.choice(kinds))
    aspect = float(rng.uniform(0.55, 1.0))
    long = 2.0 * radius * min(1.0, 1.2 / math.hypot(1.0, aspect))
    plain = rectangle((0.0, 0.0), long, long * aspect)
    turn = float(rng.uniform(0.0, 360.0))
    if kind == "rounded":
        plain = Contour(rounded(plain.exterior, float(rng.uniform(0.05, 0.5)) * long * aspect))
    elif kind == "bulged":
        corners = convex((0.0, 0.0), 0.85 * radius, seed, int(rng.integers(4, 7))).exterior
        plain = Contour(bulged(corners, rng.uniform(-0.12, 0.3, len(corners)) * rng.integers(0, 2, len(corners))))
    elif kind == "convex":
        plain = convex((0.0, 0.0), radius, seed, int(rng.integers(5, 9)))
    elif kind == "blob":
        plain = blob((0.0, 0.0), 0.8 * radius, seed, float(rng.uniform(0.06, 0.16)), int(rng.integers(3, 6)))
    elif kind == "ellipse":
        plain = Contour(disc_ring((0.0, 0.0), radius) * [1.0, float(rng.uniform(0.6, 1.0))])
    elif kind == "l":
        plain = l_shape((0.0, 0.0), long, long * aspect, float(rng.uniform(0.42, 0.6)) * long * aspect)
    elif kind == "u":
        plain = u_shape((0.0, 0.0), long, long * aspect, 0.32 * long, float(rng.uniform(0.38, 0.5)) * long * aspect)
    elif kind == "holes":
        plain = _with_hole(rng, plain, long, aspect, across)
    wide = math.sqrt(area(plain)) * across / (2.0 * radius)
    larger = max(1.0, LEAST_WIDE / wide)
    return moved(Contour(plain.exterior * larger, tuple(hole * larger for hole in plain.holes)), (0.0, 0.0), turn)


def _with_hole(rng: np.random.Generator, plain: Contour, long: float, aspect: float, across: float) -> Contour:
    """With one hole, round or square, 4 cells wide at least and 5 cells from the rim."""
    wide = long * aspect
    cell = long / across
    size = float(rng.uniform(4.5 * cell, max(4.6 * cell, wide - 12.0 * cell)))
    free = np.maximum(0.0, np.array([long, wide]) / 2.0 - 0.71 * size - 5.0 * cell)
    x, y = (rng.uniform(-1.0, 1.0, 2) * free).tolist()
    if rng.random() < 0.5:
        return with_holes(plain, disc_ring((x, y), size / 2.0))
    return with_holes(plain, rectangle((x, y), size, size, float(rng.uniform(0.0, 90.0))).exterior)


def bulged(ring: Ring, sagittas: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Ring:
    """The ring whose edges are arcs, each as high as this share of its chord, outwards where positive, shape (N, 2)."""
    parts = []
    for a, b, share in zip(ring, np.roll(ring, -1, axis=0), sagittas, strict=True):
        if abs(share) < 0.02:
            parts.append(a[None])
            continue
        angle = 4.0 * math.atan(2.0 * float(share))  # the arc's whole angle
        chord = b - a
        outward = np.array([chord[1], -chord[0]])
        centre = 0.5 * (a + b) - outward * (0.5 / math.tan(angle / 2.0))
        turn = np.linspace(0.0, angle, 120)[:-1]
        cos, sin, off = np.cos(turn), np.sin(turn), a - centre
        parts.append(centre + np.column_stack((cos * off[0] - sin * off[1], sin * off[0] + cos * off[1])))
    return np.concatenate(parts)


def rounded(ring: Ring, radius: float) -> Ring:
    """A convex ring whose corners are arcs of this radius, or as large a one as fits, shape (N, 2)."""
    parts = []
    for before, corner, after in zip(np.roll(ring, 1, axis=0), ring, np.roll(ring, -1, axis=0), strict=True):
        to, on = before - corner, after - corner
        room = 0.49 * min(float(np.hypot(*to)), float(np.hypot(*on)))
        to, on = to / np.hypot(*to), on / np.hypot(*on)
        half = 0.5 * math.acos(float(np.clip(to @ on, -1.0, 1.0)))
        cut = min(room, radius / math.tan(half))
        middle = (to + on) / np.hypot(*(to + on))
        centre = corner + middle * cut / math.cos(half)
        share = np.linspace(0.0, 1.0, 60)[:, None]
        way = (corner + to * cut) * (1.0 - share) + (corner + on * cut) * share - centre
        parts.append(centre + way / np.hypot(way[:, 0], way[:, 1])[:, None] * cut * math.tan(half))
    return polygon([(float(x), float(y)) for x, y in np.concatenate(parts)]).exterior


def _cells(rng: np.random.Generator, pitch: float, scale: float) -> CellGeometry:
    irregular = rng.random() < 0.15
    return CellGeometry(
        kind="irregular" if irregular else "honeycomb",
        pitch_mm=pitch,
        wall_mm=max(1.2 * scale, pitch * float(rng.uniform(0.05, 0.12))),
        doubled=float(rng.uniform(1.0, 2.0)),
        expansion_deg=float(rng.choice([60.0, 60.0, rng.uniform(52.0, 68.0), rng.uniform(68.0, 79.0)])),
        ribbon_deg=float(rng.uniform(0.0, 180.0)),
        offset_mm=(float(rng.uniform(0.0, pitch)), float(rng.uniform(0.0, pitch))),
        jitter=float(rng.uniform(0.1, 0.33)) if irregular else 0.0,
        warp=float(rng.uniform(0.0, 0.15)),
        wobble=float(rng.uniform(0.0, 0.04)),
        broken=float(rng.choice([0.0, rng.uniform(0.0, 0.02)])),
    )


def _material(rng: np.random.Generator, dark: bool, coloured: bool) -> Material:
    if dark:
        return Material(top=float(rng.uniform(0.08, 0.16)), side=0.08, glints=0.01, sparks=0.05, spread=0.1)
    top = float(rng.uniform(0.5, 0.9))
    warm = float(rng.uniform(0.0, 0.25)) if coloured else 0.0
    return Material(
        top=top,
        side=top * float(rng.uniform(0.25, 0.55)),
        spread=float(rng.uniform(0.1, 0.25)),
        texture=float(rng.uniform(0.05, 0.2)),
        glints=float(rng.uniform(0.0, 0.07)),
        sheen=float(rng.uniform(0.0, 0.2)),
        sparks=float(rng.uniform(0.0, 0.35)),
        colour=(1.0 - warm, 1.0, 1.0 + warm),
    )


def _table(rng: np.random.Generator, dark: bool, coloured: bool) -> Table:
    level = float(rng.uniform(0.6, 0.85)) if dark else float(rng.uniform(0.04, 0.22))
    tint = np.exp(rng.normal(0.0, 0.18 if coloured else 0.0, 3))
    blue, green, red = (tint / tint.mean()).tolist()
    return Table(
        level=level,
        texture=float(rng.uniform(0.003, 0.016)),
        scratches=int(rng.integers(0, 12)),
        colour=(blue, green, red),
    )


def _light(rng: np.random.Generator) -> Light:
    return Light(
        level=float(rng.uniform(0.65, 1.05)),
        gradient=float(rng.uniform(0.0, 0.5)),
        gradient_deg=float(rng.uniform(0.0, 360.0)),
        vignetting=float(rng.uniform(0.0, 0.35)),
        shadow=float(rng.uniform(0.0, 0.3)),
        direction_deg=float(rng.uniform(0.0, 360.0)),
        patches=float(rng.uniform(0.0, 0.4)),
    )


def _sensor(rng: np.random.Generator, pitch_px: float, coloured: bool) -> Sensor:
    return Sensor(
        blur_px=min(float(rng.uniform(0.5, 1.4)), max(0.5, 0.05 * pitch_px)),
        shot_noise=float(rng.uniform(0.003, 0.014)),
        read_noise=float(rng.uniform(0.002, 0.007)),
        jpeg_quality=int(rng.choice([0, 0, 85, 92])),
        colour=coloured,
    )


def placed(rng: np.random.Generator, scene: Scene) -> Scene:
    """The scene with its block somewhere in the picture, shrunk until it keeps the border."""
    camera, outline = scene.camera, scene.outline
    corner = np.array([camera.width - 1, camera.height - 1])
    at = rng.uniform(0.0, 1.0, 2)
    for _ in range(40):
        half = 0.5 * (outline.exterior.max(axis=0) - outline.exterior.min(axis=0))
        middle = 0.5 * (outline.exterior.max(axis=0) + outline.exterior.min(axis=0))
        scale = camera.mm_per_px((0.0, 0.0), scene.thickness_mm)
        room = np.maximum(0.0, 0.5 * corner - BORDER_PX - 1.08 * half / scale)
        pixel = 0.5 * corner + (2.0 * at - 1.0) * room
        target = camera.back_project(pixel[None], scene.thickness_mm)[0]
        placed = replace(scene, outline=moved(outline, (float(target[0] - middle[0]), float(target[1] - middle[1]))))
        seen = truth_px(placed).exterior
        if min(seen.min(), (corner - seen.max(axis=0)).min()) >= BORDER_PX:
            return placed
        outline = Contour(outline.exterior * 0.96, tuple(hole * 0.96 for hole in outline.holes))
    return placed


def quiet(scene: Scene, least: float) -> Scene:
    """The scene with as much less noise as its darkest walls need to stand out of it by `least` sigmas."""
    share = min(1.0, contrast_to_noise(scene) / least)
    sensor = scene.sensor
    return replace(
        scene, sensor=replace(sensor, shot_noise=sensor.shot_noise * share, read_noise=sensor.read_noise * share)
    )
