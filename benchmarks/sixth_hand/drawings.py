"""What is drawn with points (N, 2) float64 of x and y, pixels: lines, and rings whose first point is not repeated."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from benchmarks.other_hand.drawings import share
from benchmarks.other_hand.fields import Rng, Shape
from contour.geometry.arrays import Bytes, Float32s, Float64s, Int32s

FINE = 2  # masks are drawn this much finer than the picture


def _sixteenths(points: Float64s, finer: int) -> Int32s:
    """Points of the picture as OpenCV draws them with a shift of 4 where it is so much finer."""
    return np.round((points * finer + (finer - 1) / 2) * 16).astype(np.int32)


def blank(shape: Shape, finer: int = FINE) -> Bytes:
    """An empty drawing, so much finer than a picture of this shape."""
    return np.zeros((shape[0] * finer, shape[1] * finer), np.uint8)


def fill(drawn: Bytes, rings: Sequence[Float64s], finer: int = FINE) -> None:
    """Draw 255 within the rings, of which one inside another is a hole, in place."""
    cv2.fillPoly(drawn, [_sixteenths(ring, finer) for ring in rings], 255, cv2.LINE_8, 4)


def stroke(drawn: Bytes, points: Float64s, width: float) -> None:
    """Draw a line of a width, pixels of the picture, with round ends, in place."""
    cv2.polylines(drawn, [_sixteenths(points, FINE)], False, 255, max(1, round(width * FINE)), cv2.LINE_8, 4)


def shrink(drawn: Bytes, finer: int = FINE) -> Float32s:
    """How much of each pixel of the picture is drawn, (H, W) float32 from 0 to 1."""
    size = (drawn.shape[1] // finer, drawn.shape[0] // finer)
    return share(np.asarray(cv2.resize(drawn, size, interpolation=cv2.INTER_AREA), np.uint8))


def coverage(shape: Shape, rings: Sequence[Float64s], finer: int = FINE) -> Float32s:
    """How much of each pixel lies within the rings, (H, W) float32 from 0 to 1.

    OpenCV fills half a pixel of the drawing too far, so that exact outlines need a finer one.
    """
    drawn = blank(shape, finer)
    fill(drawn, rings, finer)
    return shrink(drawn, finer)


def turn(angle: float) -> Float64s:
    """The matrix that turns by radians from x to y, (2, 2)."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def resample(ring: Float64s, step: float) -> Float64s:
    """The ring with points so many pixels apart."""
    closed = np.vstack([ring, ring[:1]])
    run = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    at = np.linspace(0, run[-1], max(8, int(run[-1] / step)), endpoint=False)
    return np.stack([np.interp(at, run, closed[:, 0]), np.interp(at, run, closed[:, 1])], axis=1)


def lobes(rng: Rng, rough: float, count: int = 90) -> Float64s:
    """A wavy ring of so many points about the origin, its mean radius 1."""
    theta = np.linspace(0, 2 * np.pi, count, endpoint=False)
    radius = np.ones(count)
    for order in range(2, 7):
        radius += rough * rng.normal() / order * np.cos(order * theta + rng.uniform(0, 6.3))
    radius = np.clip(radius, 0.35, 2)
    return np.stack([radius * np.cos(theta), radius * np.sin(theta)], axis=1)
