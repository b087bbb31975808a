"""Fields of light over a picture: noise, and what is blurred, shifted or turned; shapes are (height, width)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Float32s, Float64s

Rng = np.random.Generator
Shape = tuple[int, int]
Field = NDArray[np.floating[Any]]


def spread(rng: Rng, least: float, most: float) -> float:
    """A number between two, small ones as often as large ones."""
    return math.exp(rng.uniform(math.log(least), math.log(most)))


def noise(rng: Rng, shape: Shape, size: float, high: float | None = None) -> Float32s:
    """Smooth noise of about unit spread, (H, W), its grains so many pixels wide and, unless told, as high."""
    grain = np.array([size, high or size])
    width, height = np.ceil(np.array(shape[::-1]) / grain).astype(int).tolist()
    grains = rng.standard_normal((height + 3, width + 3), np.float32)
    matrix = np.column_stack([np.diag(grain), -rng.uniform(0.5, 1.5, 2) * grain])
    drawn = cv2.warpAffine(grains, matrix, shape[::-1], flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(np.float32(1.2) * drawn, np.float32)


def turned(drawn: Callable[[Shape], Field], shape: Shape, angle: float) -> Float32s:
    """The middle of what is drawn for a square that is large enough, turned by radians, (H, W)."""
    side = math.ceil(math.hypot(*shape)) + 4
    matrix = np.array(cv2.getRotationMatrix2D((0.5 * side, 0.5 * side), math.degrees(angle), 1.0), np.float64)
    matrix[:, 2] += 0.5 * (np.array(shape[::-1]) - side)
    square = np.asarray(drawn((side, side)), np.float32)
    return np.asarray(cv2.warpAffine(square, matrix, shape[::-1], borderMode=cv2.BORDER_REFLECT), np.float32)


def blurred(field: Field, size: float) -> Float32s:
    """The field under a Gaussian of so many pixels, large ones through a smaller picture."""
    if size < 0.2:
        return np.asarray(field, np.float32)
    height, width = field.shape[:2]
    part = max(1, int(size / 3.0)) if size > 8.0 else 1
    small = cv2.resize(field, (max(2, width // part), max(2, height // part)), interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), size / part, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(cv2.resize(small, (width, height)), np.float32)


def shifted(field: Field, by: Float64s) -> Float32s:
    """The field moved by (x, y) pixels."""
    matrix = np.column_stack([np.eye(2), by])
    return np.asarray(cv2.warpAffine(field, matrix, field.shape[1::-1], borderMode=cv2.BORDER_REPLICATE), np.float32)


def smoothstep(field: Field) -> Field:
    """From 0 to 1 as the field does, level at both ends."""
    share = np.clip(field, 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def axes(shape: Shape) -> tuple[Float32s, Float32s]:
    """The columns' x, (1, W), and the rows' y, (H, 1)."""
    y, x = np.ogrid[: shape[0], : shape[1]]
    return x.astype(np.float32), y.astype(np.float32)


def ramp(shape: Shape, point: Float64s, along: Float64s) -> Float32s:
    """How far pixels lie from a point along a unit vector, (H, W)."""
    (x, y), (right, down) = axes(shape), along.astype(np.float32)
    return np.asarray(x * right + y * down - np.float32(point @ along), np.float32)


def tint(blue: float, green: float, red: float) -> Float32s:
    """A colour that leaves grey as light as it is, (3,)."""
    return np.array([blue, green, red], np.float32) / np.float32(0.114 * blue + 0.587 * green + 0.299 * red)
