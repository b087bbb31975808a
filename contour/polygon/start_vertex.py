"""The vertex at which a ring begins, by the machine's frame: two pictures of one block begin at the same place."""

from __future__ import annotations

from typing import Literal

import numpy as np

from contour.geometry.rings import Contour, Ring

Corner = Literal["lower-left", "lower-right", "upper-left", "upper-right"]
Start = Corner | tuple[float, float]
"""A corner as seen with x right and y up, or a point: the nearest vertex to it."""

_TOWARDS: dict[str, tuple[float, float]] = {
    "lower-left": (1.0, 1.0),
    "lower-right": (-1.0, 1.0),
    "upper-left": (1.0, -1.0),
    "upper-right": (-1.0, -1.0),
}


def first_vertices(contour: Contour, start: Start, tie: float) -> list[int]:
    """The index of each ring's vertex to begin at; `contour` and `tie` in the unit of the frame that `start` is of.

    Of vertices that are within `tie` of the best, which noise may tell apart either way, the leftmost is taken, and of
    those within `tie` of the leftmost the lowest.
    """
    return [_first_vertex(ring, start, tie) for ring in contour.rings]


def _first_vertex(ring: Ring, start: Start, tie: float) -> int:
    score = ring @ np.array(_TOWARDS[start]) if isinstance(start, str) else np.hypot(*(ring - np.array(start)).T)
    candidates = np.arange(len(ring))
    for values in (score, ring[:, 0]):
        here = values[candidates]
        candidates = candidates[here <= here.min() + tie]
    return int(candidates[np.argmin(ring[candidates, 1])])


def begun_at(contour: Contour, first: list[int]) -> Contour:
    """The same rings, each beginning at its vertex of that index."""
    rings = [np.roll(ring, -k, axis=0) for ring, k in zip(contour.rings, first, strict=True)]
    return Contour(rings[0], tuple(rings[1:]))
