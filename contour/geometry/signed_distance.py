"""How deep points lie inside a ring, and how far from each other."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Float64s, rolled
from contour.geometry.rectifier import Rectifier
from contour.geometry.rings import Ring

_AT_ONCE = 256


def depth_inside(ring: Ring, points: Float64s, rectifier: Rectifier | None = None) -> Float64s:
    """Distance of points (N, 2) from the ring, shape (N,), positive inside, negative outside, in the ring's unit.

    With a rectifier, ring and points are raw pixels and the distance is that in the rectified plane.
    """
    if rectifier is not None:
        ring, points = rectifier.rectify(ring), rectifier.rectify(points)
    # Few at once: what fits the processor's cache takes a third of the time.
    parts = np.array_split(points, max(1, len(points) // _AT_ONCE))
    return np.concatenate([_depth_inside(ring, part) for part in parts])


def _depth_inside(ring: Ring, points: Float64s) -> Float64s:
    start, following = ring, rolled(ring, -1)
    along = following - start
    square = np.maximum((along**2).sum(axis=1), 1e-12)
    # x and y apart: a last axis of two takes several times longer.
    x, y = points[:, 0, None], points[:, 1, None]
    off_x, off_y = x - start[:, 0], y - start[:, 1]
    # Even-odd rule along the ray to the right.
    spans = (start[:, 1] <= y) != (following[:, 1] <= y)
    rise = np.where(along[:, 1] == 0, 1.0, along[:, 1])
    crossing = start[:, 0] + off_y / rise * along[:, 0]
    inside = np.count_nonzero(spans & (crossing > x), axis=1) % 2 == 1
    part = off_x * along[:, 0] + off_y * along[:, 1]
    part /= square
    np.minimum(np.maximum(part, 0.0, out=part), 1.0, out=part)
    off_x -= part * along[:, 0]
    off_y -= part * along[:, 1]
    distance = np.sqrt((off_x**2 + off_y**2).min(axis=1, initial=np.inf))
    return np.asarray(np.where(inside, distance, -distance), np.float64)


def nearest(points: Float64s, others: Float64s) -> Float64s:
    """Distance of each of `points` (N, 2) from the nearest of `others` (M, 2), shape (N,); inf where there is none."""
    if not len(others):
        return np.full(len(points), np.inf)
    parts = np.array_split(points, max(1, len(points) // _AT_ONCE))
    square = [
        ((part[:, 0, None] - others[:, 0]) ** 2 + (part[:, 1, None] - others[:, 1]) ** 2).min(axis=1) for part in parts
    ]
    return np.asarray(np.sqrt(np.concatenate(square)), np.float64)
