"""Walls that an outline leaves outside though they hang on the block at two places: what it must not cut off."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Float64s, Indices, distinct, rolled
from contour.geometry.rings import Ring
from contour.geometry.signed_distance import depth_inside
from contour.walls.wall_evidence import RingEvidence, WitnessKind

# From where a wall's boundary counts as outside, and how far out some of it must lie, pitches: walls behind a zigzag
# edge lie less than 0.15 outside.
_OUTSIDE = 0.1
_FAR_OUTSIDE = 0.2
# How far apart a wall's boundary must leave the outline and come back to it, pitches: ends of walls and specks that
# touch the block come back within 0.4, also those of debris.
_SPAN = 0.6
# Cells stand out by less than half of that span; a streak that a wall's side makes below its top stands out farther.
_HIGH_PER_SPAN = 0.75
# Neighbours on one chain are an eighth of a pitch apart.
_CHAIN_BREAKS = 0.4
_BOUNDS_APART = 0.3


def overlooked(walls: Float64s, ring: Ring, pitch_px: float, *, is_hole: bool) -> tuple[Indices, float]:
    """Indices of the points of walls, shape (N, 2), that bound the outline from inside where `ring` leaves walls out,
    and how far it does in all, pitches; both in the fitting plane.

    A cut through a wall leaves an end of it, which sticks out at one place. A wall that leaves the outline at one place
    and comes back to it at another is the side of a cell.
    """
    if not len(walls):
        return np.zeros(0, dtype=np.intp), 0.0
    height = (1.0 if is_hole else -1.0) * depth_inside(ring, walls) / pitch_px
    outside = height > _OUTSIDE
    apart = np.hypot(*(walls - rolled(walls, 1)).T) > _CHAIN_BREAKS * pitch_px
    starts = np.flatnonzero(outside & (~rolled(outside, 1) | apart))
    stops = np.flatnonzero(outside & (~rolled(outside, -1) | rolled(apart, -1)))
    if len(stops) and stops[0] < starts[0]:
        stops = rolled(stops, -1)
    found, total = [np.zeros(0, dtype=np.intp)], 0.0
    for start, stop in zip(starts, stops, strict=True):
        run = (start + np.arange((stop - start) % len(walls) + 1)) % len(walls)
        high, span = float(height[run].max()), float(np.hypot(*(walls[stop] - walls[start]))) / pitch_px
        if high < _FAR_OUTSIDE or span < max(_SPAN, high / _HIGH_PER_SPAN):
            continue
        found.append(_spaced(run, walls, height, pitch_px))
        total += high
    return distinct(np.concatenate(found)), total


def _spaced(run: Indices, walls: Float64s, height: Float64s, pitch_px: float) -> Indices:
    """The run's farthest points, none within a third of a pitch of another."""
    kept: list[int] = []
    for index in run[np.argsort(-height[run], kind="stable")]:
        if all(np.hypot(*(walls[index] - walls[other])) > _BOUNDS_APART * pitch_px for other in kept):
            kept.append(int(index))
    return np.array(kept, dtype=np.intp)


def with_bounds(evidence: RingEvidence, bounds: Indices) -> tuple[RingEvidence, Indices]:
    """The evidence with its wall points at `bounds` among the witnesses, and where its own came to lie, shape (N,)."""
    more, order = evidence.joined_by(evidence.walls.take(bounds), 1.0, WitnessKind.BOUND)
    return more, np.argsort(order, kind="stable")[: len(evidence.points)].astype(np.intp)
