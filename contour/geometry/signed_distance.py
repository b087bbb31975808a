"""How deep points lie inside a ring, and how far from each other."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Float64s
from contour.geometry.rectifier import Rectifier
from contour.geometry.rings import Ring

_AT_ONCE = 256


def depth_inside(ring: Ring, points: Float64s, rectifier: Rectifier | None = None) -> Float64s:
    """Distance of points (N, 2) from the ring, shape (N,), positive inside, negative outside, in the ring's unit.

    With a rectifier, ring and points are raw pixels and the distance is that in the rectified plane.
    """
    if rectifier is not None:
        ring, points = rectifier.rectify(ring), rectifier.rectify(points)
    start, following = ring, np.roll(ring, -1, axis=0)
    along = following - start
    square = np.maximum((along**2).sum(axis=1), 1e-12)
    off = points[:, None, :] - start[None, :, :]
    part = np.clip((off * along).sum(axis=2) / square, 0.0, 1.0)
    distance = np.sqrt(((off - part[:, :, None] * along) ** 2).sum(axis=2).min(axis=1, initial=np.inf))
    # Even-odd rule along the ray to the right.
    y = points[:, 1, None]
    spans = (start[:, 1] <= y) != (following[:, 1] <= y)
    rise = np.where(along[:, 1] == 0, 1.0, along[:, 1])
    crossing = start[:, 0] + (y - start[:, 1]) / rise * along[:, 0]
    inside = np.count_nonzero(spans & (crossing > points[:, 0, None]), axis=1) % 2 == 1
    return np.asarray(np.where(inside, distance, -distance), np.float64)


def nearest(points: Float64s, others: Float64s) -> Float64s:
    """Distance of each of `points` (N, 2) from the nearest of `others` (M, 2), shape (N,); inf where there is none."""
    if not len(others):
        return np.full(len(points), np.inf)
    parts = np.array_split(points, max(1, len(points) // _AT_ONCE))
    square = [((part[:, None, :] - others[None, :, :]) ** 2).sum(axis=2).min(axis=1) for part in parts]
    return np.asarray(np.sqrt(np.concatenate(square)), np.float64)
