"""What is drawn with points (N, 2) float64 of x and y, pixels, and how it is painted on a picture."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from benchmarks.other_hand.drawings import share
from benchmarks.other_hand.fields import Field, Rng, Shape
from contour.geometry.arrays import Bytes, Float32s, Float64s, Int32s

FINE = 3  # masks are drawn this much finer than the picture
SHIFT = 4


def fixed_points(points: Float64s) -> Int32s:
    """Points, (..., 2), as OpenCV draws them with a shift of 4 where it is `FINE` times as fine."""
    fine = (points + 0.5) * FINE - 0.5
    return np.clip(np.rint(fine * (1 << SHIFT)), -2e6, 2e6).astype(np.int32)


def shrink(drawn: Bytes, shape: Shape) -> Float32s:
    """How much of each pixel of a picture of this shape is drawn, (H, W) float32 from 0 to 1."""
    return share(np.asarray(cv2.resize(drawn, shape[::-1], interpolation=cv2.INTER_AREA), np.uint8))


def polygon_cover(shape: Shape, polygons: Sequence[Float64s]) -> Float32s:
    """How much of each pixel lies within polygons, of which one inside another is a hole, (H, W) float32 from 0 to
    1.
    """
    drawn = np.zeros((shape[0] * FINE, shape[1] * FINE), np.uint8)
    cv2.fillPoly(drawn, [fixed_points(polygon) for polygon in polygons], 255, cv2.LINE_AA, SHIFT)
    return shrink(drawn, shape)


def stroke_cover(shape: Shape, path: Float64s, width: float) -> Float32s:
    """How much of each pixel lies on a path of a width, its ends round, (H, W) float32 from 0 to 1."""
    drawn = np.zeros((shape[0] * FINE, shape[1] * FINE), np.uint8)
    cv2.polylines(drawn, [fixed_points(path)], False, 255, max(1, round(width * FINE)), cv2.LINE_AA, SHIFT)
    return shrink(drawn, shape)


def paint(canvas: Float32s, alpha: Field, light: Field | float, tint: Float64s) -> None:
    """Lay light of a tint, (3,), over the canvas, (H, W, 3), as far as alpha, (H, W), is 1, in place."""
    colour = np.asarray(light, np.float32)[..., None] * tint.astype(np.float32)
    canvas += (colour - canvas) * alpha[..., None]


def darken(canvas: Float32s, alpha: Field, strength: float) -> None:
    """Take a share of the light from the canvas, (H, W, 3), where alpha, (H, W), is 1, in place."""
    canvas *= (1.0 - np.float32(strength) * alpha)[..., None]


def swept(mask: Float32s, move: Float64s) -> Float32s:
    """All that the mask, (H, W) float32, passes over while it moves by (x, y) pixels."""
    steps = max(2, int(np.hypot(*move) / 3) + 1)
    small = (mask * 255).astype(np.uint8)
    total = small.copy()
    for step in np.linspace(0, 1, min(steps, 24) + 1)[1:]:
        x, y = move * step
        shift = np.array([[1, 0, x], [0, 1, y]], np.float64)
        np.maximum(total, cv2.warpAffine(small, shift, small.shape[::-1]), out=total)
    return share(total)


def blurred(mask: Field, sigma: float) -> Field:
    """The mask under a Gaussian of so many pixels, large ones through a smaller picture."""
    if sigma < 0.3:
        return mask
    if sigma < 6:
        return np.asarray(cv2.GaussianBlur(mask, (0, 0), sigma), mask.dtype)
    small = cv2.resize(mask, None, fx=0.25, fy=0.25, interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), sigma / 4)
    return np.asarray(cv2.resize(small, mask.shape[::-1], interpolation=cv2.INTER_LINEAR), mask.dtype)


def random_tint(rng: Rng, strength: float = 0.6) -> Float64s:
    """A colour that leaves light about as it is, (3,): often grey, at times of a hue."""
    if rng.random() < 0.45:
        return np.ones(3) + rng.normal(0, 0.03, 3)
    tint = 1 + strength * rng.uniform(-1, 1, 3) * rng.uniform(0.1, 1)
    return np.asarray(tint / tint.mean())
