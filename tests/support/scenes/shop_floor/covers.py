"""What hides the edge: tape, sheets, clamps, cables, hands."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from contour.synthetic import (
    Cover,
    Scene,
    Thing,
    blob,
    moved,
    rectangle,
    thick_line,
)
from tests.support.scenes.shop_floor.places import a_colour, a_level, a_level_like, a_place, extent, with_things


def tape(rng: np.random.Generator, scene: Scene) -> Scene:
    """Tape or a label over the edge, 1 to 4 cells deep, at any angle; some are printed on."""
    pitch, place = scene.cells.pitch_mm, a_place(rng, scene)
    deep, wide = float(rng.uniform(1.0, 4.0)) * pitch, float(rng.uniform(1.5, 8.0)) * pitch
    beyond = float(rng.uniform(0.5, 8.0)) * pitch
    centre = place.point(0.0, 0.5 * (beyond - deep))
    turn = place.out_deg + float(rng.normal(0.0, 25.0))
    if rng.random() < 0.2:  # laid along the edge
        turn, wide, beyond = turn + 90.0, deep + min(beyond, 3.0 * pitch), float(rng.uniform(1.0, 6.0)) * pitch
        centre = place.point(0.0, float(rng.uniform(-0.3, 0.3)) * wide)
    tape = Cover(
        rectangle(centre, deep + beyond, wide, turn),
        a_level(rng, scene),
        a_colour(rng),
        texture=float(rng.uniform(0.0, 0.06)),
    )
    printed: list[Thing] = []
    if rng.random() < 0.35:
        ink = float(rng.choice([0.05, 0.9]))
        for row in np.linspace(-0.35, 0.35, int(rng.integers(2, 6))).tolist():
            bar = rectangle((0.0, row * wide), float(rng.uniform(0.3, 0.85)) * (deep + beyond), 0.07 * wide)
            printed.append(Cover(moved(moved(bar, (0.0, 0.0), turn), centre), ink, texture=0.0))
    return with_things(scene, tape, *printed)


def sheet(rng: np.random.Generator, scene: Scene) -> Scene:
    """Paper, film or long tape over the edge, mostly wider than the block is there; some hardly told from the table."""
    pitch, place = scene.cells.pitch_mm, a_place(rng, scene)
    deep, wide = float(rng.uniform(1.0, 6.0)) * pitch, float(rng.uniform(8.0, 60.0)) * pitch
    beyond = float(rng.uniform(2.0, 15.0)) * pitch
    centre = place.point(float(rng.uniform(-0.4, 0.4)) * wide, 0.5 * (beyond - deep))
    faint = rng.random() < 0.5
    level = a_level_like(rng, scene) if faint else a_level(rng, scene)
    area = rectangle(centre, deep + beyond, wide, place.out_deg + float(rng.normal(0.0, 15.0)))
    texture = float(rng.uniform(0.0, 0.06))
    return with_things(scene, Cover(area, level, a_colour(rng, 0.02 if faint else 0.2), texture=texture))


def clamp(rng: np.random.Generator, scene: Scene) -> Scene:
    """A clamp's bar from over the block to the picture's side, with its pad and its shadow."""
    pitch, place = scene.cells.pitch_mm, a_place(rng, scene)
    deep, wide = float(rng.uniform(1.0, 5.0)) * pitch, float(rng.uniform(2.0, 6.0)) * pitch
    camera = scene.camera
    long = 1.5 * math.hypot(camera.width, camera.height) * camera.mm_per_px(place.point(0.0, 0.0), scene.thickness_mm)
    turn = place.out_deg + float(rng.normal(0.0, 15.0))
    level, colour = a_level(rng, scene), a_colour(rng, float(rng.choice([0.0, 0.4])))
    angle = float(rng.uniform(0.0, 2.0 * math.pi))
    height = float(rng.uniform(0.2, 1.0)) * pitch
    metal = float(rng.choice([0.0, rng.uniform(0.03, 0.12)]))
    bar = rectangle((0.5 * long - deep, 0.0), long, wide)
    pad = rectangle((0.35 * wide - deep, 0.0), 0.7 * wide, 1.3 * wide)
    parts: list[Thing] = []
    for shape, tone in ((bar, level), (pad, level * float(rng.uniform(0.7, 1.2)))):
        area = moved(moved(shape, (0.0, 0.0), turn), place.point(0.0, 0.0))
        parts.append(
            Cover(
                area,
                tone,
                colour,
                texture=0.03,
                rounding_mm=float(rng.choice([0.1, rng.uniform(0.1, 0.5)])) * wide,
                streaks=metal,
                streaks_deg=turn,
                shadow=float(rng.uniform(0.0, 0.5)),
                shadow_mm=(height * math.cos(angle), height * math.sin(angle)),
            )
        )
    return with_things(scene, *parts[: int(rng.integers(1, 3))])


def hand_or_cable(rng: np.random.Generator, scene: Scene) -> Scene:
    """A cable, bent, over the edge and out of the picture's middle; or a hand: a palm with fingers."""
    return (_cable if rng.random() < 0.5 else _hand)(rng, scene)


def _cable(rng: np.random.Generator, scene: Scene) -> Scene:
    pitch, place = scene.cells.pitch_mm, a_place(rng, scene)
    width = float(rng.uniform(0.6, 2.5)) * pitch
    long = float(rng.uniform(0.8, 2.0)) * extent(scene)
    share = np.linspace(-float(rng.uniform(0.05, 0.5)), 1.0, 80)
    start = math.radians(place.out_deg + float(rng.uniform(-60.0, 60.0)))
    heading = start + float(rng.normal(0.0, 0.8)) * share + float(rng.normal(0.0, 0.25)) * np.sin(7.0 * share)
    steps = np.column_stack((np.cos(heading), np.sin(heading))) * (long / 80.0)
    path = np.cumsum(steps, axis=0)
    path += place.at - path[int(np.argmin(np.abs(share)))]
    area = thick_line([(float(x), float(y)) for x, y in path], width)
    cover = Cover(area, a_level(rng, scene), a_colour(rng), 0.02, rounding_mm=0.5 * width, shadow=0.3)
    return with_things(scene, replace(cover, shadow_mm=(0.3 * width, -0.3 * width)))


def _hand(rng: np.random.Generator, scene: Scene) -> Scene:
    pitch, place = scene.cells.pitch_mm, a_place(rng, scene)
    size = float(rng.uniform(2.0, 5.0)) * pitch
    level = a_level(rng, scene, 0.3, 0.8)
    colour = (0.75, 0.95, 1.3) if rng.random() < 0.6 else a_colour(rng)
    look = Cover(rectangle((0.0, 0.0), 1.0, 1.0), level, colour, 0.06, rounding_mm=0.3 * size)
    look = replace(look, shadow=float(rng.uniform(0.1, 0.5)), shadow_mm=(0.2 * size, 0.1 * size))
    reach = float(rng.uniform(0.0, 1.5)) * size
    palm = replace(look, area=blob(place.point(0.0, 1.2 * size - reach), 1.2 * size, int(rng.integers(10_000)), 0.12))
    parts: list[Thing] = []
    for number in range(int(rng.integers(2, 6))):
        angle = math.radians(place.out_deg + 180.0 - 40.0 + 25.0 * number)
        foot = np.array(place.point(0.0, 1.2 * size - reach))
        way = np.linspace(0.4, float(rng.uniform(1.8, 2.5)), 12)[:, None] * size
        path = foot + way * np.array([math.cos(angle), math.sin(angle)])
        finger = thick_line([(float(x), float(y)) for x, y in path], 0.5 * size)
        parts.append(replace(look, area=finger, rounding_mm=0.25 * size))
    return with_things(scene, *parts, palm)
