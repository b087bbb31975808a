"""How deep points lie inside a ring, and how far from each other."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Float64s, rolled
from contour.geometry.rectifier import Rectifier, rectified
from contour.geometry.rings import Ring

_AT_ONCE, _MANY_SIDES = 64, 128


def depth_inside(ring: Ring, points: Float64s, rectifier: Rectifier | None = None) -> Float64s:
    """Distance of points (N, 2) from the ring, shape (N,), positive inside, negative outside, in the ring's unit.

    With a rectifier, ring and points are raw pixels and the distance is that in the rectified plane.
    """
    ring, points = rectified(ring, rectifier), rectified(points, rectifier)
    start, following = ring, rolled(ring, -1)
    # Few at once: what fits the processor's cache takes a third of the time, and lies near few sides of a long ring.
    parts = np.array_split(points, max(1, len(points) // _AT_ONCE))
    if len(ring) < _MANY_SIDES or not len(points):
        return np.concatenate([_depth_inside(start, following, part) for part in parts])
    return np.concatenate([_depth_inside_long(start, following, part) for part in parts])


def _depth_inside_long(start: Float64s, following: Float64s, points: Float64s) -> Float64s:
    """The same by the sides of the ring that may be nearest to a point; of those at the right it is enough to count."""
    low, high = points.min(axis=0), points.max(axis=0)
    away = np.hypot(*(start - 0.5 * (low + high)).T)
    near = away - np.hypot(*(following - start).T) <= 1.001 * (away.min() + np.hypot(*(high - low)))
    least, most = np.minimum(start, following), np.maximum(start, following)
    right = (least[:, 1] <= high[1]) & (most[:, 1] >= low[1]) & (most[:, 0] >= low[0])
    asked = near | (right & (least[:, 0] <= high[0]))
    beyond = right & ~asked
    below = sum(np.searchsorted(np.sort(ends[beyond, 1]), points[:, 1], "right") for ends in (start, following))
    depth = _depth_inside(start[asked], following[asked], points)
    return np.asarray(np.where(below % 2 == 1, -depth, depth))


def _depth_inside(start: Float64s, following: Float64s, points: Float64s) -> Float64s:
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
