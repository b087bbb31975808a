"""Places, levels and colours for what lies about. No thing looks just like the table under it, but what is asked to."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from contour.geometry.arrays import Float64s
from contour.geometry.rings import densified
from contour.synthetic import (
    Scene,
    Thing,
)

NEAR = 12.0
"""Grey levels between a thing and the table under it, at least; a quarter of the things keep twice that at most."""


@dataclass(frozen=True)
class Place:
    """A place on the exterior, the unit vectors along it and out of the block, millimetres."""

    at: Float64s
    along: Float64s
    out: Float64s

    def point(self, along: float, out: float) -> tuple[float, float]:
        """The place this far along the edge and out of it."""
        x, y = (self.at + along * self.along + out * self.out).tolist()
        return (x, y)

    @property
    def out_deg(self) -> float:
        """The direction out of the block."""
        return math.degrees(math.atan2(self.out[1], self.out[0]))


def a_place(rng: np.random.Generator, scene: Scene) -> Place:
    """A place anywhere on the exterior, which runs counter-clockwise."""
    ring = densified(scene.outline.exterior, 0.25 * scene.cells.pitch_mm)
    k = int(rng.integers(len(ring)))
    along = ring[(k + 1) % len(ring)] - ring[k]
    along = along / np.hypot(*along)
    return Place(ring[k], along, np.array([along[1], -along[0]]))


def a_level(rng: np.random.Generator, scene: Scene, low: float = 0.02, high: float = 0.95) -> float:
    """A level whose grey is `NEAR` or more away from the table's, shaded or not, in the scene's light."""
    grey = scene.light.level * np.array([scene.table.level * (1.0 - scene.light.shadow), scene.table.level])
    below, above = 255.0 * np.clip(grey, 0.0, 1.0) ** scene.sensor.gamma
    off = NEAR * float(rng.uniform(1.0, 2.0))
    near = [grey for grey in (below - off, above + off) if 3.0 < grey < 250.0]
    if rng.random() < 0.25 and near:
        return _level_of(scene, float(rng.choice(near)))
    for _ in range(50):
        level = float(rng.uniform(low, high))
        seen = 255.0 * min(1.0, level * scene.light.level) ** scene.sensor.gamma
        if not below - NEAR < seen < above + NEAR:
            return level
    return _level_of(scene, near[-1])


def a_level_like(rng: np.random.Generator, scene: Scene) -> float:
    """A level whose grey is a third of `NEAR` to all of it away from the table's, in the scene's light."""
    grey = 255.0 * min(1.0, scene.light.level * scene.table.level) ** scene.sensor.gamma
    off = NEAR * float(rng.uniform(1.0 / 3.0, 1.0))
    lighter = rng.random() < 0.5 or grey < off + 3.0
    return _level_of(scene, grey + off if lighter and grey + off < 250.0 else grey - off)


def _level_of(scene: Scene, grey: float) -> float:
    """The level that is seen as this grey level."""
    return float((grey / 255.0) ** (1.0 / scene.sensor.gamma) / scene.light.level)


def a_colour(rng: np.random.Generator, spread: float = 0.35) -> tuple[float, float, float]:
    """Factors of blue, green and red about 1."""
    tint = np.exp(rng.normal(0.0, spread, 3))
    blue, green, red = (tint / tint.mean()).tolist()
    return (blue, green, red)


def with_things(scene: Scene, *things: Thing) -> Scene:
    """The scene with these over what it has."""
    return replace(scene, things=(*scene.things, *things))


def extent(scene: Scene) -> float:
    """Diagonal of the block's box, millimetres."""
    return float(np.hypot(*np.ptp(scene.outline.exterior, axis=0)))
