"""Patterns that a table may have, drawn at random: what the network is to tell from comb."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s, Float64s

# Lines are drawn to an eighth of a pixel.
_SHIFT = 3
_PARTS = 8


def pattern(rng: np.random.Generator, size: int) -> Float32s:
    """One to three kinds of patterns over each other, turned at random, of about unit spread, (size, size)."""
    wide = math.ceil(1.45 * size)
    drawn = np.zeros((wide, wide), np.float32)
    for _ in range(int(rng.integers(1, 4))):
        kind = _KINDS[int(rng.integers(len(_KINDS)))]
        drawn += np.float32(rng.uniform(0.3, 1.2)) * kind(rng, wide)
    return turned(rng, drawn, size)


def noise(rng: np.random.Generator, size: int, grain: float, longer: float = 1.0) -> Float32s:
    """Noise of unit spread whose grains are so many pixels high, and so many times as long, (size, size)."""
    shape = (max(2, int(size / grain) + 2), max(2, int(size / (grain * longer)) + 2))
    grains = rng.standard_normal(shape).astype(np.float32)
    return np.asarray(cv2.resize(grains, (size, size), interpolation=cv2.INTER_CUBIC), np.float32)


def turned(rng: np.random.Generator, drawn: Float32s, size: int) -> Float32s:
    """The middle of what is drawn, turned at random, (size, size)."""
    half = 0.5 * len(drawn)
    matrix = cv2.getRotationMatrix2D((half, half), float(rng.uniform(0.0, 360.0)), 1.0)
    matrix[:, 2] += 0.5 * size - half
    return np.asarray(cv2.warpAffine(drawn, matrix, (size, size), borderMode=cv2.BORDER_REFLECT), np.float32)


def lay(drawn: Float32s | Bytes, corners: np.ndarray[tuple[int, ...], np.dtype[Any]], level: float) -> None:
    """Draw the convex hull of corners (N, 2) in that light, in place."""
    hull = cv2.convexHull((np.asarray(corners) * _PARTS).astype(np.int32))
    cv2.fillConvexPoly(drawn, hull, level, cv2.LINE_AA, _SHIFT)


def lay_disc(drawn: Float32s | Bytes, middle: Float64s, axes: Float64s, turn: float, level: float) -> None:
    """Draw an ellipse of these half axes, (2,), turned by so many degrees, in that light, in place."""
    places = [(one * _PARTS).astype(int).tolist() for one in (middle, axes)]
    cv2.ellipse(drawn, *places, turn, 0, 360, level, -1, cv2.LINE_AA, _SHIFT)


def _grid(size: int) -> tuple[Float32s, Float32s]:
    y, x = np.mgrid[:size, :size].astype(np.float32)
    return x, y


def _length(rng: np.random.Generator, least: float, most: float) -> float:
    """Between two lengths, small ones as often as large ones."""
    return math.exp(float(rng.uniform(math.log(least), math.log(most))))


def _level(rng: np.random.Generator, most: float) -> float:
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(0.25 * most, most))


def _mottled(rng: np.random.Generator, size: int) -> Float32s:
    return noise(rng, size, _length(rng, 1.0, 90.0))


def _brushed(rng: np.random.Generator, size: int) -> Float32s:
    return noise(rng, size, float(rng.uniform(1.0, 4.0)), float(rng.uniform(8.0, 80.0)))


def _grained(rng: np.random.Generator, size: int) -> Float32s:
    """Waving lines, soft or hard, as growth rings have."""
    turn = 2.0 * math.pi / _length(rng, 4.0, 120.0)
    wave = np.sin(_grid(size)[1] * turn + rng.uniform(0.0, 6.0) + noise(rng, size, 60.0) * rng.uniform(0.0, 2.5))
    return np.asarray(np.abs(wave) ** 3 * np.sign(wave) if rng.random() < 0.5 else wave, np.float32)


def _slots(rng: np.random.Generator, size: int) -> Float32s:
    """Dark slots, half of them with a light edge."""
    spacing, wide = float(rng.uniform(20.0, 200.0)), float(rng.uniform(0.05, 0.5))
    off = (_grid(size)[1] / spacing + rng.uniform()) % 1.0 - 0.5
    drawn = -2.0 * np.clip((0.5 * wide - np.abs(off)) * spacing + 0.5, 0.0, 1.0)
    if rng.random() < 0.5:
        drawn += np.exp(-(((off - 0.5 * wide) * spacing / 1.5) ** 2))
    return np.asarray(drawn, np.float32)


def _scratched(rng: np.random.Generator, size: int) -> Float32s:
    drawn = np.zeros((size, size), np.float32)
    for _ in range(int(rng.integers(1, 14))):
        (one, other), thick = rng.integers(0, size * _PARTS, (2, 2)).tolist(), int(rng.integers(1, 5))
        cv2.line(drawn, one, other, _level(rng, 2.0), thick, cv2.LINE_AA, _SHIFT)
    return drawn


def _curved(rng: np.random.Generator, size: int) -> Float32s:
    """Old cuts along arcs, and discs."""
    drawn = np.zeros((size, size), np.float32)
    for _ in range(int(rng.integers(1, 8))):
        middle, axes = rng.integers(0, size * _PARTS, 2).tolist(), (rng.uniform(4.0, 160.0, 2) * _PARTS).astype(int)
        thick = int(rng.integers(1, 4)) if rng.random() < 0.7 else -1
        turn, end = float(rng.uniform(0.0, 180.0)), float(rng.uniform(60.0, 360.0))
        cv2.ellipse(drawn, middle, axes.tolist(), turn, 0.0, end, _level(rng, 2.0), thick, cv2.LINE_AA, _SHIFT)
    return drawn


def _perforated(rng: np.random.Generator, size: int) -> Float32s:
    """Holes in even rows, side by side or between each other, dark or light, soft or sharp."""
    spacing = _length(rng, 6.0, 60.0)
    x, y = _grid(size)
    row = np.floor(y / spacing)
    shifted = 0.5 * spacing * (row % 2.0) if rng.random() < 0.6 else 0.0
    away = np.hypot((x + shifted) % spacing - 0.5 * spacing, y % spacing - 0.5 * spacing)
    soft = float(rng.uniform(0.8, 3.0))
    holes = np.clip((spacing * rng.uniform(0.1, 0.46) - away) / soft + 0.5, 0.0, 1.0)
    return np.asarray(float(rng.choice([-2.0, -2.0, -2.0, 1.5])) * holes, np.float32)


def _patched(rng: np.random.Generator, size: int) -> Float32s:
    """Flat shapes with corners."""
    drawn = np.zeros((size, size), np.float32)
    for _ in range(int(rng.integers(2, 12))):
        corners = rng.uniform(0.0, size, 2) + rng.uniform(-80.0, 80.0, (int(rng.integers(3, 6)), 2))
        lay(drawn, corners, float(rng.uniform(-1.5, 1.5)))
    return drawn


def _ruled(rng: np.random.Generator, size: int) -> Float32s:
    """Two sets of even lines that cross, as on a cutting mat, or between tiles, all of them of their own light."""
    spacing, wide = _length(rng, 8.0, 70.0), float(rng.uniform(0.5, 3.5))
    x, y = _grid(size)
    drawn = np.zeros((size, size), np.float32)
    level = _level(rng, 1.2)
    for turn in (0.0, math.radians(float(rng.choice([90.0, 90.0, 60.0, rng.uniform(30.0, 90.0)])))):
        across = (x * math.sin(turn) + y * math.cos(turn)) / spacing
        drawn += np.float32(level) * np.clip(0.5 * wide - np.abs(across % 1.0 - 0.5) * spacing + 0.5, 0.0, 1.0)
    if rng.random() < 0.3:
        tones = rng.normal(0.0, 0.6, (64, 64)).astype(np.float32)
        drawn += tones[(np.floor(y / spacing + 0.5) % 64).astype(int), (np.floor(x / spacing + 0.5) % 64).astype(int)]
    return drawn


def _littered(rng: np.random.Generator, size: int) -> Float32s:
    drawn = np.zeros((size, size), np.float32)
    for _ in range(int(rng.integers(20, 400))):
        middle = rng.integers(0, size * _PARTS, 2).tolist()
        radius = int(rng.uniform(0.5, 6.0) * _PARTS)
        cv2.circle(drawn, middle, radius, float(rng.uniform(-1.5, 1.5)), -1, cv2.LINE_AA, _SHIFT)
    return drawn


_KINDS: tuple[Callable[[np.random.Generator, int], Float32s], ...] = (
    _mottled,
    _brushed,
    _grained,
    _slots,
    _scratched,
    _curved,
    _perforated,
    _perforated,
    _patched,
    _ruled,
    _ruled,
    _littered,
)
