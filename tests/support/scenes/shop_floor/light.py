"""Light and shadow, camera, and the table as a whole."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from contour.synthetic import (
    Fade,
    Flare,
    Mirror,
    Scene,
    Shade,
    Structure,
    moved,
    pitch_px,
    rectangle,
)
from tests.support.scenes.shop_floor.blocks import quiet
from tests.support.scenes.shop_floor.places import a_colour, a_place, extent, with_things

Drawn = Callable[[np.random.Generator, Scene], Scene]
DIM_CONTRAST = 6.0
"""Sigmas of a pixel's noise by which walls stand out of their cells in little light."""


def mirror(rng: np.random.Generator, scene: Scene) -> Scene:
    """A polished table that mirrors walls half a cell to three cells beyond the edge."""
    reach = float(rng.uniform(0.5, 3.0)) * scene.cells.pitch_mm
    return with_things(scene, Mirror(float(rng.uniform(0.08, 0.55)), reach, float(rng.uniform(0.5, 3.0))))


def glare(rng: np.random.Generator, scene: Scene) -> Scene:
    """A lamp's image over the edge: a spot or a streak."""
    place, pitch = a_place(rng, scene), scene.cells.pitch_mm
    size = (float(rng.uniform(2.0, 10.0)) * pitch, float(rng.uniform(0.7, 4.0)) * pitch)
    level, share = float(rng.uniform(0.1, 0.6)), float(rng.uniform(0.0, 0.8))
    return with_things(scene, Flare(place.point(0.0, 0.0), level, size, float(rng.uniform(0.0, 180.0)), share))


def shadow(rng: np.random.Generator, scene: Scene) -> Scene:
    """The shadow of something beside the block, along or across its edge, soft or fairly sharp."""
    place, pitch = a_place(rng, scene), scene.cells.pitch_mm
    wide, long = float(rng.uniform(1.0, 6.0)) * pitch, float(rng.uniform(4.0, 20.0)) * pitch
    turn = place.out_deg + 90.0 + float(rng.choice([0.0, rng.normal(0.0, 40.0)]))
    centre = place.point(0.0, float(rng.uniform(-0.2, 0.6)) * wide)
    area = moved(moved(rectangle((0.0, 0.0), long, wide), (0.0, 0.0), turn), centre)
    soft = float(rng.choice([rng.uniform(0.03, 0.15), rng.uniform(0.3, 1.5)])) * pitch
    return with_things(scene, Shade(area, float(rng.uniform(0.25, 0.7)), soft, bool(rng.random() < 0.5)))


def fading(rng: np.random.Generator, scene: Scene) -> Scene:
    """Walls that fade in the middle of the block, which is seen from straight above."""
    x, y = scene.outline.exterior.mean(axis=0).tolist()
    size = float(rng.uniform(0.1, 0.2)) * extent(scene)
    return with_things(scene, Fade((x, y), float(rng.uniform(0.5, 0.95)), size))


def dust(rng: np.random.Generator, scene: Scene) -> Scene:
    """Specks everywhere, and up to forty chips on the table."""
    clutter = replace(scene.clutter, specks=int(rng.integers(200, 2500)), debris=int(rng.integers(0, 40)))
    return replace(scene, clutter=clutter)


def light_table(rng: np.random.Generator, scene: Scene) -> Scene:
    """A plain table about as light as the block's walls: at a cut their ends show by their shadows alone."""
    level = float(scene.material.top * rng.uniform(0.6, 1.3))
    return replace(scene, table=replace(scene.table, level=min(level, 1.0)))


_FINE = {"expanded": (0.6, 3.0), "ribbed": (0.4, 2.0), "cork": (0.3, 1.0)}
"""Pitches: as large as cells are, where other patterns are larger."""


def structured(kind: Literal["wood", "brushed", "slots", "old-cuts", "expanded", "ribbed", "cork"]) -> Drawn:
    """A table of this kind, about as bright as the walls (brighter than dark ones)."""

    def draw(rng: np.random.Generator, scene: Scene) -> Scene:
        pitch, dark = scene.cells.pitch_mm, scene.material.top < scene.table.level
        top = scene.material.top
        level = float(rng.uniform(0.55, 0.85)) if dark else float(rng.uniform(0.55, 1.1)) * top
        colour = scene.table.colour
        if kind in ("wood", "old-cuts"):
            colour = (0.62, 0.98, 1.4) if kind == "wood" else (0.75, 1.0, 1.25)
        scale = {"wood": rng.uniform(5.0, 25.0), "brushed": rng.uniform(4.0, 30.0)}.get(kind, rng.uniform(2.5, 10.0))
        contrast = {"wood": rng.uniform(0.08, 0.3), "brushed": rng.uniform(0.05, 0.2)}.get(kind, rng.uniform(0.1, 0.35))
        if kind in _FINE:
            scale = rng.uniform(*_FINE[kind])
        table = replace(scene.table, level=level, colour=colour)
        pattern = Structure(kind, float(scale) * pitch, float(contrast), float(rng.uniform(0.0, 180.0)))
        return with_things(replace(scene, table=table), pattern)

    return draw


def sensor(change: Callable[[np.random.Generator, Scene], dict[str, Any]]) -> Drawn:
    """The sensor changed as drawn."""

    def draw(rng: np.random.Generator, scene: Scene) -> Scene:
        return replace(scene, sensor=replace(scene.sensor, **change(rng, scene)))

    return draw


def motion(rng: np.random.Generator, scene: Scene) -> dict[str, Any]:
    """4 to 13 px, but within a third of a pitch."""
    most = min(13.0, pitch_px(scene) / 3.0)
    return _smear(rng, float(rng.uniform(min(4.0, most), most)))


def motion_far(rng: np.random.Generator, scene: Scene) -> dict[str, Any]:
    """Farther than a third of a pitch."""
    least = pitch_px(scene) / 3.0
    return _smear(rng, float(rng.uniform(least, max(13.0, 1.5 * least))))


def _smear(rng: np.random.Generator, length: float) -> dict[str, Any]:
    angle = float(rng.uniform(0.0, 2.0 * math.pi))
    return {"motion_px": (length * math.cos(angle), length * math.sin(angle))}


def gamma(rng: np.random.Generator, scene: Scene) -> dict[str, Any]:
    """An exponent of 0.45 to 2."""
    return {"gamma": math.exp(float(rng.uniform(math.log(0.45), math.log(2.0))))}


def blown_out(rng: np.random.Generator, scene: Scene) -> Scene:
    """So much light that walls read full scale; table (or cells) stay below two thirds of it."""
    darker = min(scene.table.level, scene.material.top)
    brighter = max(scene.table.level, scene.material.top)
    level = min(float(rng.uniform(1.15, 2.8)) / brighter, 0.6 / darker)
    sensor = replace(scene.sensor, bloom=float(rng.uniform(0.04, 0.2)))
    return replace(scene, light=replace(scene.light, level=max(level, scene.light.level)), sensor=sensor)


def dim(rng: np.random.Generator, scene: Scene) -> Scene:
    """About a fifth of the light; walls still stand out of the noise."""
    level = scene.light.level * float(rng.uniform(0.15, 0.3))
    return quiet(replace(scene, light=replace(scene.light, level=level)), DIM_CONTRAST)


def coloured(rng: np.random.Generator, scene: Scene) -> Scene:
    """Coloured light on a coloured table."""
    light, tint = a_colour(rng, 0.2), a_colour(rng, 0.4)
    material = replace(scene.material, colour=_product(scene.material.colour, light))
    table = replace(scene.table, colour=_product(tint, light))
    return replace(scene, material=material, table=table, sensor=replace(scene.sensor, colour=True))


def _product(one: tuple[float, float, float], other: tuple[float, float, float]) -> tuple[float, float, float]:
    return (one[0] * other[0], one[1] * other[1], one[2] * other[2])
