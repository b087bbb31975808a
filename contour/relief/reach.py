"""Where an outline is reached by what differs from a known table: an edge was cut through walls all along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Float64s, median, medians, quantile, rolled
from contour.geometry.rectifier import Rectifier
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring
from contour.image.pixel_sampling import sample_at
from contour.relief.relief import Relief

# Pitches: places along an outline, and what is looked at across it, inwards and beyond.
_APART, _STEP, _INSIDE, _BEYOND = 0.1, 0.05, (-1.0, -0.15), (0.2, 0.8)
# Walls end within so much of a right outline. They stand out of the table beside it by this share of what comb does.
_AT, _STANDS_OUT = 0.2, 0.25


@dataclass(frozen=True, eq=False)
class Reach:
    """An outline's lengths, places along it at equal steps, pixels, and at which of them walls reach it, (N,)."""

    lengths: RingLengths
    at: Float64s
    reached: Bools
    plain: Bools
    """At which the table beyond looks as it was taught."""

    def gaps(self, least_px: float) -> Float64s:
        """Where the outline is not reached over so many pixels or more: first and last place along it, (K, 2); the last
        may lie beyond its first vertex.
        """
        here = self.at[self.reached]
        if not len(here):
            return np.array([[0.0, self.lengths.length]])
        on = np.append(here[1:], here[0] + self.lengths.length)
        return np.column_stack((here, on))[on - here > least_px]

    def plain_between(self, first: float, last: float) -> bool:
        """Whether the table beyond looks as it was taught from one length to a later one, for the most part."""
        return median(self.plain[(self.at - first) % self.lengths.length <= last - first].astype(np.float64)) > 0.5


def reach(relief: Relief, ring: Ring, pitch_px: float, rectifier: Rectifier | None = None) -> Reach:
    """Where walls reach a ring, shape (M, 2), pixels, that has the material on its left; straight between its vertices
    in the rectified plane, where that is given.
    """
    lengths = RingLengths.of(ring)
    count = max(8, round(lengths.length / (_APART * pitch_px)))
    at = np.linspace(0.0, lengths.length, count, endpoint=False, dtype=np.float64)
    out = lengths.normals(at, _AT * pitch_px)
    across = np.arange(_INSIDE[0], _BEYOND[1] + 0.5 * _STEP, _STEP)
    place, steps = lengths.at(at), pitch_px * across
    if rectifier is not None:
        flat, (edge, share) = rectifier.rectify(ring), lengths.places(at)
        place = rectifier.unrectify(flat[edge] + share[:, None] * (rolled(flat, -1) - flat)[edge])
    light = sample_at(relief.apart, place[:, :1] + out[:, :1] * steps, place[:, 1:] + out[:, 1:] * steps)
    beyond = medians(light[:, across > _BEYOND[0]], axis=1)
    table = median(beyond)
    rise = _STANDS_OUT * max(quantile(light[:, across < _INSIDE[1]], 0.8) - table, 0.0)
    there = light[:, np.abs(across) < _AT + 0.5 * _STEP].max(axis=1)
    return Reach(lengths, at, there > beyond + rise, beyond < table + rise)
