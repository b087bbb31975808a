"""Places along a ring, and runs of them that have something in common."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Float64s, Indices
from contour.geometry.rectifier import Rectifier, rectified
from contour.geometry.rings import Ring


@dataclass(frozen=True, eq=False)
class Places:
    """Places along a ring, pixels (N, 2), their arc lengths along its chords from its first vertex on (N,), and its
    whole length.
    """

    points: Float64s
    at: Float64s
    whole: float


def places_along(ring: Ring, spacing: float, rectifier: Rectifier | None) -> Places:
    """Places no more than `spacing` pixels apart, all vertices among them; straight where the ring is without the
    lens.
    """
    following = np.roll(ring, -1, axis=0)
    length = np.hypot(*(following - ring).T)
    parts = np.maximum(np.ceil(length / spacing).astype(int), 1)
    share = np.concatenate([np.arange(count) / count for count in parts])
    owner = np.repeat(np.arange(len(ring)), parts)
    start = np.concatenate([[0.0], np.cumsum(length)])
    a, b = rectified(ring, rectifier), rectified(following, rectifier)
    points = a[owner] + share[:, None] * (b - a)[owner]
    if rectifier is not None:
        points = rectifier.unrectify(points)
    return Places(points, start[owner] + share * length[owner], float(start[-1]))


def turns_deg(path: Float64s) -> Float64s:
    """By how much a path (N, 2) turns at each of its inner points, shape (N - 2,), degrees, -180 to 180."""
    heading = np.angle(np.diff(path[:, 0] + 1j * path[:, 1]))
    return np.degrees(np.angle(np.exp(1j * np.diff(heading))))


def runs_of(chosen: Bools) -> list[Indices]:
    """Indices of each run of chosen places around the ring, in its order."""
    if chosen.all():
        return [np.arange(len(chosen))]
    shift = int(np.argmin(chosen))
    turned = np.roll(chosen, -shift).astype(np.int8)
    starts = np.flatnonzero(np.diff(turned, prepend=0) > 0)
    stops = np.flatnonzero(np.diff(turned, append=0) < 0)
    return [(np.arange(a, b + 1) + shift) % len(chosen) for a, b in zip(starts, stops, strict=True)]
