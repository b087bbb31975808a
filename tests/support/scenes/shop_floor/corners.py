"""Rectangles whose corners are each sharp, cut off or rounded, by less than a cell to six."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from contour.geometry.arrays import Float64s
from contour.synthetic import Scene, moved, polygon
from tests.support.scenes.shop_floor.blocks import placed
from tests.support.scenes.shop_floor.places import extent

LEAST, MOST = 0.8, 6.0
"""Pitches."""


def corners(rng: np.random.Generator, scene: Scene) -> Scene:
    """A block as large as the scene's, in its place."""
    pitch = scene.cells.pitch_mm
    half = 0.5 * max(extent(scene), 2.2 * MOST * pitch) * np.array([1.0, rng.uniform(0.6, 1.0)])
    tips = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    ring = [
        point
        for tip, before, after in zip(tips, np.roll(tips, 1, axis=0), np.roll(tips, -1, axis=0), strict=True)
        for point in _corner(rng, tip, before - tip, after - tip, min(MOST * pitch, 0.9 * half.min()), LEAST * pitch)
    ]
    outline = moved(polygon([(float(x), float(y)) for x, y in ring]), (0.0, 0.0), float(rng.uniform(0.0, 360.0)))
    return placed(rng, replace(scene, outline=outline))


def _corner(
    rng: np.random.Generator, tip: Float64s, back: Float64s, on: Float64s, most: float, least: float
) -> list[Float64s]:
    """The places of a corner between two edges at right angles, that lead `back` and `on` from it."""
    form, size = str(rng.choice(["sharp", "cut", "round"])), math.exp(rng.uniform(math.log(least), math.log(most)))
    back, on = (way * size / np.hypot(*way) for way in (back, on))
    if form == "sharp":
        return [tip]
    if form == "cut":
        return [tip + back, tip + on]
    return list(rounding(tip, back, on))


def rounding(tip: Float64s, back: Float64s, on: Float64s) -> Float64s:
    """The arc that touches both edges of a right angle so far from its tip, (N, 2)."""
    turn = np.linspace(0.0, 0.5 * np.pi, 30)[:, None]
    return tip + (back + on) - np.sin(turn) * back - np.cos(turn) * on
