"""How deep points lie inside a ring, and how far from each other."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Float64s, rolled
from contour.geometry.rectifier import Rectifier, rectified
from contour.geometry.rings import Ring

_AT_ONCE = 256


def depth_inside(ring: Ring, points: Float64s, rectifier: Rectifier | None = None) -> Float64s:
    """Distance of points (N, 2) from the ring, shape (N,), positive inside, negative outside, in the ring's unit.

    With a rectifier, ring and points are raw pixels and the distance is that in the rectified plane.
    """
    ring, points = rectified(ring, rectifier), rectified(points, rectifier)
    # Few at once: what fits the processor's cache takes a third of the time.
    parts = np.array_split(points, max(1, len(points) // _AT_ONCE))
    return np.concatenate([_depth_inside(ring, part) for part in parts])


def _depth_inside(ring: Ring, points: Float64s) -> Float64s:
    start, following = ring, rolled(ring, -1)
    along = following - start
    square = np.maximum((along**2).sum(axis=1), 1e-12)[:, None]
    # x and y apart: a last axis of two takes several times longer. And points last: what is summed up of each is had
    # of many at once so.
    (x, y), (along_x, along_y), (start_x, start_y) = points.T.copy(), along.T[:, :, None], start.T[:, :, None]
    off_x, off_y = x - start_x, y - start_y
    # Even-odd rule along the ray to the right.
    spans = (start_y <= y) != (following[:, 1, None] <= y)
    rise = np.where(along_y == 0, 1.0, along_y)
    crossing = start_x + off_y / rise * along_x
    inside = np.logical_xor.reduce(spans & (crossing > x), axis=0)
    part = off_x * along_x + off_y * along_y
    part /= square
    np.minimum(np.maximum(part, 0.0, out=part), 1.0, out=part)
    off_x -= part * along_x
    off_y -= part * along_y
    off_x *= off_x
    off_y *= off_y
    off_x += off_y
    distance = np.sqrt(off_x.min(axis=0, initial=np.inf))
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
