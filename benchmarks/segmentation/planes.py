"""What crops are drawn by: lines, places, slopes and surfaces of their size."""

from __future__ import annotations

import math

import cv2
import numpy as np

from benchmarks.segmentation.patterns import noise, pattern
from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s

SIZE = 192
"""A crop's sides, pixels."""
SURE = 0.9
"""A share of a pixel from which on it counts as whole."""


def place(places: Bools, rng: np.random.Generator) -> Float64s:
    """Somewhere about one of these places, of every fourth sample, (2,), x and y."""
    rows, columns = np.nonzero(places)
    number = int(rng.integers(len(rows)))
    return 4.0 * np.array([columns[number], rows[number]]) + rng.uniform(-60.0, 60.0, 2)


def line(rng: np.random.Generator) -> Float32s:
    """How far each sample lies from a line through the part, straight or not quite, to one side of it, (SIZE, SIZE)."""
    turn, bend = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.0, 12.0) * (rng.random() < 0.3)
    y, x = np.mgrid[:SIZE, :SIZE] - 0.5 * SIZE
    along, off = x * math.cos(turn) + y * math.sin(turn), y * math.cos(turn) - x * math.sin(turn)
    wave = bend * np.sin(along / rng.uniform(20.0, 60.0) + rng.uniform(0.0, 6.0))
    return np.asarray(off + wave - rng.uniform(-0.3, 0.3) * SIZE, np.float32)


def places(comb: Bytes | Float32s, which: float) -> Bools:
    """Seven of ten times the outline, else comb, or all else."""
    if which < 0.7:
        return cv2.morphologyEx(comb, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 100
    return comb > 100 if which < 0.85 else comb < 100


def surface(rng: np.random.Generator, coarsest: float) -> Float32s:
    """What a surface differs from even light by: patterns, or grains so many pixels wide at most."""
    return pattern(rng, SIZE) if rng.random() < 0.6 else noise(rng, SIZE, float(rng.uniform(1.0, coarsest)))


def aside(turn: float, far: float) -> Float64s:
    """What moves a plane so far in that direction, for cv2.warpAffine."""
    return np.array([[1.0, 0.0, far * math.cos(turn)], [0.0, 1.0, far * math.sin(turn)]])


def share(mask: Bytes) -> Float32s:
    return mask.astype(np.float32) / np.float32(255.0)


def slope(rng: np.random.Generator) -> Float32s:
    """What falls evenly over the part, −1…1."""
    return np.clip(line(rng) / np.float32(0.5 * SIZE), -1.0, 1.0)
