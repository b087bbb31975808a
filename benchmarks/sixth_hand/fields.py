"""Fields over a picture: noise, ramps, and what is blurred, moved or laid over; shapes are (height, width)."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from benchmarks.other_hand.fields import Field, Rng, Shape
from contour.geometry.arrays import Float32s, Float64s


def noise(shape: Shape, cell: float | tuple[float, float], rng: Rng) -> Float32s:
    """Smooth noise of about unit spread, (H, W) float32, its grains so many pixels wide and, unless told, as high."""
    cell_x, cell_y = cell if isinstance(cell, tuple) else (cell, cell)
    height, width = shape
    small = rng.standard_normal((max(2, int(height / cell_y) + 2), max(2, int(width / cell_x) + 2)), dtype=np.float32)
    if max(cell_x, cell_y) <= 1:
        return np.asarray(cv2.resize(small, (width, height), interpolation=cv2.INTER_NEAREST), np.float32)
    return np.asarray(1.3 * cv2.resize(small, (width, height), interpolation=cv2.INTER_CUBIC), np.float32)


def fractal(shape: Shape, cell: float, rng: Rng) -> Float32s:
    """Noises, (H, W) float32, each with half the size and less of the strength of the one before."""
    total = np.zeros(shape, np.float32)
    for octave in range(3):
        total += noise(shape, max(1.0, cell / 2**octave), rng) * np.float32(0.6**octave)
    return total * np.float32(0.8)


def smoothstep(value: Field, low: float, high: float) -> Field:
    """From 0 where the value is low to 1 where it is high, level at both ends."""
    ramp = np.clip((value - low) / (high - low), 0, 1)
    return np.asarray(ramp * ramp * (3 - 2 * ramp))


def shift(mask: Float32s, vector: Float64s) -> Float32s:
    """The mask, (H, W) float32, moved by (x, y) pixels."""
    matrix = np.array([[1, 0, vector[0]], [0, 1, vector[1]]], np.float64)
    return np.asarray(cv2.warpAffine(mask, matrix, mask.shape[1::-1], flags=cv2.INTER_LINEAR), np.float32)


def sweep(mask: Float32s, vector: Float64s) -> Float32s:
    """All that the mask, (H, W) float32, covers while it moves by (x, y) pixels."""
    steps = max(1, int(np.ceil(np.log2(max(2.0, float(np.hypot(*vector)))))))
    swept = mask
    for step in range(steps):
        swept = np.maximum(swept, shift(swept, vector / 2 ** (step + 1)))
    return swept


def toward(mask: Float32s, foot: Float64s, scale: float) -> Float32s:
    """The mask, (H, W) float32, scaled about the point below the camera, as it looks deeper down."""
    matrix = np.array([[scale, 0, foot[0] * (1 - scale)], [0, scale, foot[1] * (1 - scale)]])
    return np.asarray(cv2.warpAffine(mask, matrix, mask.shape[1::-1], flags=cv2.INTER_LINEAR), np.float32)


def soften(field: Field, sigma: float) -> Field:
    """The field under a Gaussian of so many pixels, as it is where that is next to none."""
    return np.asarray(cv2.GaussianBlur(field, (0, 0), sigma), field.dtype) if sigma > 0.3 else field


def blend(picture: Field, body: Field, alpha: Field) -> None:
    """Lay a body, (H, W, 3), over the picture, (H, W, 3), as far as alpha, (H, W), is 1, in place."""
    picture += (body - picture) * alpha[..., None]


def any_of(rng: Rng, names: Sequence[str]) -> str:
    """One of the names."""
    return names[int(rng.integers(len(names)))]
