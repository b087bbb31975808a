"""What happens to cells and walls: compound, a splice, crushed cells, writing, strips that were cut off."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from contour.geometry.rings import Contour, densified
from contour.synthetic import (
    Crush,
    Filling,
    Ink,
    Scene,
    Slip,
    Strip,
    Thing,
    blob,
    moved,
    rectangle,
    signed_distance,
    thick_line,
)
from tests.support.scenes.shop_floor.places import a_colour, a_level, a_place, extent, with_things


def compound(rng: np.random.Generator, scene: Scene) -> Scene:
    """Potting compound in patches of cells, one or two of them at the edge, flush with the cut."""
    pitch = scene.cells.pitch_mm
    most = float(np.clip(0.16 * extent(scene) / pitch, 2.0, 5.0))
    things: list[Thing] = []
    for number in range(int(rng.integers(1, 4))):
        place = a_place(rng, scene)
        radius = float(rng.uniform(1.5, most)) * pitch
        out = float(rng.uniform(-0.5, 0.3)) * radius if number == 0 else -float(rng.uniform(0.0, 3.0)) * radius
        area = blob(place.point(0.0, out), radius, int(rng.integers(10_000)), 0.25)
        if rng.random() < 0.25:  # along the edge
            band = rectangle((0.0, 0.0), float(rng.uniform(4.0, 16.0)) * pitch, 1.5 * radius)
            area = moved(moved(band, (0.0, 0.0), place.out_deg + 90.0), place.point(0.0, 0.0))
        things.append(_filling(rng, scene, area))
    return with_things(scene, *things)


def _filling(rng: np.random.Generator, scene: Scene, area: Contour) -> Filling:
    walls = float(rng.choice([0.0, 1.0, rng.uniform(0.0, 1.0)]))
    share = float(rng.choice([1.0, 1.0, rng.uniform(0.7, 1.0)]))
    return Filling(area, a_level(rng, scene, 0.03, 0.85), a_colour(rng), walls, share)


def splice(rng: np.random.Generator, scene: Scene) -> Scene:
    """A seam of foaming adhesive across the whole block, one or two cells wide."""
    pitch, low, high = scene.cells.pitch_mm, scene.outline.exterior.min(axis=0), scene.outline.exterior.max(axis=0)
    middle = low + (high - low) * rng.uniform(0.3, 0.7, 2)
    angle, long = float(rng.uniform(0.0, math.pi)), extent(scene)
    along, across = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    share = np.linspace(-1.0, 1.0, 60)
    wave = float(rng.uniform(0.0, 0.4)) * pitch * np.sin(share * long / pitch + float(rng.uniform(0.0, 6.0)))
    path = middle + share[:, None] * long * along + wave[:, None] * across
    area = thick_line([(float(x), float(y)) for x, y in path], float(rng.uniform(1.0, 2.0)) * pitch)
    x, y = along.tolist()
    slip = Slip((float(middle[0]), float(middle[1])), (x, y), float(rng.uniform(0.0, 1.0)) * pitch)
    return with_things(scene, replace(_filling(rng, scene, area), share=1.0), slip)


def crushed(rng: np.random.Generator, scene: Scene) -> Scene:
    """One to three places at the edge where cells were pressed together over one or two cells."""
    pitch = scene.cells.pitch_mm
    things: list[Thing] = []
    for _ in range(int(rng.integers(1, 4))):
        place = a_place(rng, scene)
        deep = float(rng.uniform(1.0, 2.2)) * pitch
        x, y = place.out.tolist()
        things.append(
            Crush(
                place.point(0.0, 0.0),
                (-x, -y),
                float(rng.uniform(3.0, 12.0)) * pitch,
                deep,
                float(rng.uniform(0.25, 0.6)) * deep,
                float(rng.uniform(0.0, 0.3)) * pitch,
            )
        )
    return with_things(scene, *things)


def writing(rng: np.random.Generator, scene: Scene) -> Scene:
    """Letters of a felt pen on the walls, often across the edge, and then on the table as well or not."""
    pitch = scene.cells.pitch_mm
    size, width = float(rng.uniform(3.0, 9.0)) * pitch, float(rng.uniform(0.3, 1.3)) * pitch
    place, turn = a_place(rng, scene), float(rng.uniform(0.0, 360.0))
    out = float(rng.uniform(-1.5, 0.3)) * size
    level = a_level(rng, scene, *((0.8, 1.0) if rng.random() < 0.4 else (0.02, 0.3)))
    strokes = []
    letters = int(rng.integers(2, 6))
    for letter in range(letters):
        corners = np.cumsum(rng.uniform(-0.5, 0.5, (int(rng.integers(3, 6)), 2)), axis=0) * size
        at = np.linspace(0.0, len(corners) - 1.0, 40)
        path = np.column_stack([np.interp(at, np.arange(len(corners)), corners[:, axis]) for axis in (0, 1)])
        first = (letter - 0.5 * letters) * 0.9 * size
        area = thick_line([(float(x) + first, float(y)) for x, y in path], width)
        strokes.append(moved(moved(area, (0.0, 0.0), turn), place.point(0.0, out)))
    strength, on_table = float(rng.uniform(0.5, 1.0)), bool(rng.random() < 0.5)
    return with_things(scene, Ink(tuple(strokes), level, a_colour(rng, 0.5), strength, on_table))


def swarf(rng: np.random.Generator, scene: Scene) -> Scene:
    """Strips of one to three cells that were cut off lie beside the edge, a twentieth of a pitch to one from it."""
    pitch, things = scene.cells.pitch_mm, []
    for _ in range(40):
        place = a_place(rng, scene)
        long, wide = float(rng.uniform(2.0, 10.0)) * pitch, float(rng.uniform(1.0, 3.0)) * pitch
        turn = place.out_deg + 90.0 + float(rng.normal(0.0, 4.0))
        strip = moved(rectangle((0.0, 0.0), long, wide), (0.0, 0.0), turn)
        gap = float(rng.uniform(0.05, 1.0)) * pitch
        strip = moved(strip, place.point(0.0, 0.5 * wide))
        near = float(signed_distance(scene.outline, densified(strip.exterior, 0.1 * pitch)).max())
        x, y = ((near + gap) * place.out).tolist()
        strip = moved(strip, (x, y))
        reached = signed_distance(scene.outline, densified(strip.exterior, 0.1 * pitch)).max()
        if not -1.2 * gap - 0.05 * pitch < reached < -0.04 * pitch:
            continue
        x, y = rng.uniform(0.0, pitch, 2).tolist()
        ribbon = scene.cells.ribbon_deg + float(rng.normal(0.0, 6.0))
        things.append(Strip(strip, replace(scene.cells, offset_mm=(x, y), ribbon_deg=ribbon)))
        if rng.random() < 0.5:
            break
    return with_things(scene, *things[:3])
