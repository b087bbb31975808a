"""What a block lies on: light, (H, W) float32, and colour, (3,), of tables."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from benchmarks.other_hand.drawings import share, stroke
from benchmarks.other_hand.fields import Field, Rng, Shape, axes, noise, tint, turned
from benchmarks.other_hand.outlines import across, curve, direction
from contour.geometry.arrays import Float32s


class _Plain(NamedTuple):
    """Light, colour and what varies: fine noise from least to most, grain, and streaks by size and strength."""

    light: tuple[float, float]
    colour: tuple[float, float, float]
    fine: tuple[float, float]
    grain: float
    streaks: tuple[float, float, float]


_PLAIN = (
    _Plain((0.10, 0.28), (1.05, 1.0, 0.97), (0.01, 0.04), 0.0, (36.0, 36.0, 0.05)),  # steel
    _Plain((0.025, 0.1), (1.0, 1.0, 1.0), (0.02, 0.08), 0.05, (30.0, 30.0, 0.0)),  # rubber
    _Plain((0.2, 0.45), (1.08, 1.0, 0.9), (0.004, 0.025), 0.0, (60.0, 60.0, 0.02)),  # paint
    _Plain((0.26, 0.46), (0.62, 0.85, 1.15), (0.02, 0.06), 0.03, (14.0, 3.0, 0.03)),  # fibreboard
    _Plain((0.28, 0.5), (1.02, 1.0, 0.98), (0.01, 0.03), 0.0, (60.0, 2.0, 0.03)),  # aluminium
)


def table(rng: Rng, kind: str, shape: Shape, top: float) -> tuple[Float32s, Float32s]:
    """The table of a kind of picture, of which walls' tops have that light; on most now and then some scratches."""
    light, colour = _TABLES.get(kind, _plain)(rng, shape, top)
    if kind != "undisturbed" and rng.random() < 0.35:
        scratches = np.zeros(shape, np.uint8)
        for _ in range(rng.integers(2, 20)):
            start = rng.uniform(0.0, shape[::-1])
            end = start + rng.standard_normal(2) * rng.uniform(10.0, 150.0)
            stroke(scratches, np.stack([start, end]), int(rng.integers(40, 160)))
        light = light * (1.0 + rng.uniform(-0.4, 0.5) * share(scratches))
    return np.asarray(np.clip(light, 0.004, 1.5), np.float32), colour


def _plain(rng: Rng, shape: Shape, top: float) -> tuple[Field, Float32s]:
    one = _PLAIN[int(rng.integers(len(_PLAIN)))]
    long, high, strength = one.streaks
    light = 1.0 + rng.uniform(0.01, 0.05) * noise(rng, shape, rng.uniform(150.0, 500.0))
    light += rng.uniform(*one.fine) * noise(rng, shape, rng.uniform(1.2, 4.0))
    light += one.grain * rng.standard_normal(shape, np.float32)
    streaks = turned(lambda square: noise(rng, square, long, high), shape, rng.uniform(0.0, math.pi))
    light += rng.uniform(0.0, strength) * streaks
    return light * min(rng.uniform(*one.light), 0.6 * top), tint(*(np.array(one.colour) * rng.uniform(0.92, 1.08, 3)))


def _wood(rng: Rng, shape: Shape, top: float) -> tuple[Field, Float32s]:
    light = turned(lambda square: _grain(rng, square), shape, rng.uniform(0.0, 3.14))
    return top * rng.uniform(0.6, 1.0) * light, tint(0.6, 0.85, 1.15)


def _grain(rng: Rng, shape: Shape) -> Float32s:
    """Growth rings, fibres, pores, knots and the gaps between planks."""
    x, y = axes(shape)
    bent = y + rng.uniform(10.0, 45.0) * noise(rng, shape, 500.0, 90.0)
    bent += rng.uniform(0.0, 4.0) * noise(rng, shape, 120.0, 30.0)
    rings = (0.5 + 0.5 * np.sin(2.0 * math.pi / rng.uniform(18.0, 90.0) * bent)) ** rng.uniform(0.6, 2.0)
    wood = 1.0 - 0.28 * rings + 0.06 * noise(rng, shape, rng.uniform(24.0, 80.0), 1.6)
    wood -= 0.22 * (noise(rng, shape, 18.0, 1.5) > 1.9)
    for _ in range(rng.integers(0, 3)):
        row, column = rng.uniform(0.0, shape).tolist()
        away = np.hypot((x - column) / 2.2, y - row) / rng.uniform(10.0, 40.0)
        wood -= 0.4 * np.exp(-(away**2)) * (1.0 + 0.3 * np.sin(9.0 * away))
    if rng.random() < 0.4:
        wide = rng.uniform(120.0, 400.0)
        wood *= np.where((y + 0.5 * wide) % wide < rng.uniform(2.0, 5.0), 0.35, 1.0)
    return np.asarray(wood, np.float32)


def _brushed(rng: Rng, shape: Shape, top: float) -> tuple[Field, Float32s]:
    def lines(square: Shape) -> Float32s:
        fine = 0.7 * noise(rng, square, rng.uniform(100.0, 400.0), 1.3) + 0.5 * noise(rng, square, 60.0, 1.2)
        return np.asarray(fine + 0.5 * noise(rng, square, 250.0, 4.0), np.float32)

    brushed = rng.uniform(0.06, 0.25) * turned(lines, shape, rng.uniform(0.0, 3.14))
    bands = turned(lambda square: noise(rng, square, 3000.0, rng.uniform(60.0, 250.0)), shape, rng.uniform(0.0, 3.14))
    return top * rng.uniform(0.3, 0.85) * (1.0 + brushed + 0.1 * bands), tint(1.04, 1.0, 0.97)


def _slots(rng: Rng, shape: Shape, top: float) -> tuple[Field, Float32s]:
    """A plain table with dark slots that have light lips, a quarter of them crosswise too."""
    light, colour = _plain(rng, shape, top)
    spacing, lip, bright = rng.uniform((90.0, 1.0, 1.1), (330.0, 4.0, 2.2)).tolist()
    wide = spacing * rng.uniform(0.1, 0.3)
    inner = wide * rng.uniform(0.25, 0.4)

    def slots(square: Shape) -> Field:
        place = (axes(square)[1] + rng.uniform(0.0, spacing)) % spacing
        cut = np.where(place < wide, rng.uniform(0.1, 0.4), 1.0)
        cut = np.where((place > inner) & (place < wide - inner), cut * rng.uniform(0.4, 0.8), cut)
        cut = np.where((place >= wide) & (place < wide + lip), bright, cut)
        cut = np.where(place > spacing - lip, bright * rng.uniform(0.5, 1.0), cut)
        return np.asarray(np.broadcast_to(cut, square), np.float32)

    angle = float(rng.choice([rng.uniform(0.0, math.pi), rng.uniform(0.0, math.pi), 0.03, 1.59]))
    cut = turned(slots, shape, angle)
    if rng.random() < 0.25:
        cut = np.minimum(cut, turned(slots, shape, angle + 0.5 * math.pi))
    return np.clip(light * cut, 0.004, 1.2), colour


def _old_cuts(rng: Rng, shape: Shape, top: float) -> tuple[Field, Float32s]:
    """Board with cuts, straight or bent, three of ten light ones."""
    light = 1.0 + 0.04 * noise(rng, shape, 2.5) + 0.05 * noise(rng, shape, 90.0)
    light += 0.03 * rng.standard_normal(shape, np.float32)
    cuts, scars = np.zeros((2, *shape), np.uint8)
    for _ in range(rng.integers(15, 160)):
        angle, half = rng.uniform(0.0, math.pi), rng.uniform(0.05, 0.65) * shape[1]
        if rng.random() < 0.5:
            angle = 0.5 * math.pi * round(angle / (0.5 * math.pi)) + rng.uniform(-0.02, 0.02)
        along = half * direction(angle)
        bow = rng.uniform(-0.6, 0.6) * (rng.random() < 0.4)
        points = rng.uniform(0.0, shape[::-1]) + np.stack([-along, bow * across(along), along])
        thick = int(rng.integers(1, 8)) if rng.random() < 0.5 else int(rng.integers(1, 3))
        stroke(cuts if rng.random() < 0.7 else scars, curve(points, 40), int(rng.integers(60, 255)), thick)
    light = top * rng.uniform(0.3, 0.75) * light * (1.0 - rng.uniform(0.4, 0.85) * share(cuts))
    return light + rng.uniform(0.1, 0.45) * share(scars), tint(0.65, 0.87, 1.13)


def _lit_from_below(rng: Rng, shape: Shape, top: float) -> tuple[Field, Float32s]:
    light = 1.0 + 0.01 * noise(rng, shape, 3.0) + 0.03 * noise(rng, shape, 400.0)
    return max(rng.uniform(0.75, 1.1), top) * light, tint(*rng.uniform(0.93, 1.07, 3))


def _polished(rng: Rng, shape: Shape, top: float) -> tuple[Field, Float32s]:
    light = 1.0 + 0.06 * noise(rng, shape, 300.0) + 0.02 * noise(rng, shape, 3.0)
    return rng.uniform(0.06, 0.35) * top * light, tint(1.0, 1.0, 1.0)


_TABLES: dict[str, Callable[[Rng, Shape, float], tuple[Field, Float32s]]] = {
    "wood": _wood,
    "brushed": _brushed,
    "slots": _slots,
    "old_cuts": _old_cuts,
    "light_table": _lit_from_below,
    "mirror": _polished,
}
