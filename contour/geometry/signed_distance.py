"""How deep points lie inside a ring."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Float64s
from contour.geometry.rings import Ring


def depth_inside(ring: Ring, points: Float64s) -> Float64s:
    """Distance of points (N, 2) from the ring, shape (N,), positive inside, negative outside, in the ring's unit."""
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
