"""What crops are drawn by: lines, places, slopes and surfaces of their size."""

from __future__ import annotations

import math

import cv2
import numpy as np

from benchmarks.segmentation.patterns import noise, pattern
from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, median

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
    along, off = along_and_off(np.full(2, 0.5 * SIZE), turn)
    wave = bend * np.sin(along / rng.uniform(20.0, 60.0) + rng.uniform(0.0, 6.0))
    return np.asarray(off + wave - rng.uniform(-0.3, 0.3) * SIZE, np.float32)


def along_and_off(middle: Float64s, turn: float) -> Float64s:
    """How far each sample lies from a place in that direction, and across it, (2, SIZE, SIZE)."""
    y, x = np.mgrid[:SIZE, :SIZE] - middle[::-1, None, None]
    return np.stack((x * math.cos(turn) + y * math.sin(turn), y * math.cos(turn) - x * math.sin(turn)))


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


def depth(mask: Float32s) -> Float32s:
    """How deep each sample lies in a mask of shares, pixels; `SIZE` in one that covers all."""
    far = cv2.distanceTransform((mask > 0.5).astype(np.uint8), cv2.DIST_L2, 5)
    return np.asarray(np.minimum(far, np.float32(SIZE)), np.float32)


def table_light(light: Float32s, comb: Float32s, thing: Float32s) -> float | None:
    """The light of the table in the part; None if it hardly shows any."""
    own = light[(1.0 - comb) * (1.0 - thing) > SURE]
    return median(own) if len(own) > 50 else None


def share(mask: Bytes) -> Float32s:
    return mask.astype(np.float32) / np.float32(255.0)


def slope(rng: np.random.Generator) -> Float32s:
    """What falls evenly over the part, −1…1."""
    return np.clip(line(rng) / np.float32(0.5 * SIZE), -1.0, 1.0)
