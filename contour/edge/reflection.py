"""Where a polished table shows a block's walls once more beyond its edge: the line between the two is that edge.

A place beside the block is light there where the one as far within it is, only less so, all along the edge. Comb that
goes on, chips, labels and tape are no mirror image of the block, and no outline a tenth of a cell off is the axis of
one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.edge.ring_places import runs_of
from contour.geometry.arrays import Bools, Bytes, Float64s, median, with_sides
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, signed_area
from contour.image.pixel_sampling import light_beside

# Cell pitches: along the outline, out of it and into the block.
_SPACING, _AWAY = 0.1, np.arange(0.15, 0.8, 0.1)
# How much alike light is on both sides, as a correlation, over so many pitches along the edge: on the true edges of 24
# mirrored blocks, corners included, nowhere less than that over more than a tenth of a pitch; on plain tables 0.2 at
# most, and about 0.2 a tenth of a pitch off the edge. Tape across an edge looks alike on both sides, too, where light
# beside it is taken into account: so less of it is looked at as well, with as much change of light as comb has.
_OVER, _ALIKE, _NEARBY, _ALIKE_NEARBY, _OF_COMB = 3.0, 0.5, 1.5, 0.3, 0.1
# A mirror image is fainter than the block.
_FAINTER, _GAP_PITCHES = 0.8, 0.5
# How far the axis is looked for from an outline that misses it: over less of it, for it may be askew.
_SHIFTS = np.array([0.0, *(sign * 0.05 * step for step in range(1, 11) for sign in (-1, 1))])


@dataclass(frozen=True, eq=False)
class Reflection:
    """Places along each ring of a contour (N, 2), pixels, and which of them lie on the axis of a mirror image (N,)."""

    places: tuple[Float64s, ...]
    shown: tuple[Bools, ...]

    @property
    def whole(self) -> bool:
        """Whether it is that all along."""
        longest = max(max(map(len, runs_of(~shown)), default=0) for shown in self.shown)
        return longest * _SPACING <= _GAP_PITCHES

    @property
    def share(self) -> float:
        """Along how much of the contour."""
        return float(np.concatenate(self.shown).mean())


def reflection(light: Bytes, contour: Contour, pitch_px: float) -> Reflection:
    """Where a contour is the axis of a mirror image in `light`, (H, W).

    The contour's holes run the other way around than its exterior.
    """
    places = [_places(ring, out_px) for ring, out_px in _rings(contour, pitch_px)]
    return Reflection(tuple(place for place, _ in places), tuple(_shown(light, *one) for one in places))


def axis_beside(light: Bytes, contour: Contour, pitch_px: float) -> Reflection:
    """The axes of mirror images nearby: the places of `reflection`, moved onto them."""
    moved, found = [], []
    for place, outward in (_places(ring, out_px) for ring, out_px in _rings(contour, pitch_px)):
        likeness = np.stack([_likeness(_sides(light, place + by * outward, outward), _NEARBY)[0] for by in _SHIFTS])
        own = _shown(light, place, outward)
        known = own | (likeness.max(axis=0) > _ALIKE)
        shift = np.where(known & ~own, _SHIFTS[likeness.argmax(axis=0)], 0.0)
        moved.append(place + shift[:, None] * outward)
        found.append(known)
    return Reflection(tuple(moved), tuple(found))


def _rings(contour: Contour, pitch_px: float) -> list[tuple[Float64s, float]]:
    """The contour's rings with the pitch, negative where material lies to the right of their direction."""
    side = float(np.sign(signed_area(contour.exterior)))
    return [(ring, side * pitch_px) for ring in contour.rings]


def _places(ring: Float64s, out_px: float) -> tuple[Float64s, Float64s]:
    """Places along a ring, and vectors of one pitch outwards there, (N, 2) both, pixels."""
    lengths = RingLengths.of(ring)
    at = np.arange(0.0, lengths.length, _SPACING * abs(out_px))
    return lengths.at(at), out_px * lengths.normals(at, 3.0 * _SPACING * abs(out_px))


def _shown(light: Bytes, place: Float64s, outward: Float64s) -> Bools:
    """At which places light beyond is the mirror image of comb within, (N,)."""
    sides = _sides(light, place, outward)
    (alike, _), (nearby, change) = _likeness(sides, _OVER), _likeness(sides, _NEARBY)
    return np.asarray((alike > _ALIKE) & (nearby > _ALIKE_NEARBY) & (change > _OF_COMB * median(change)))


def _sides(light: Bytes, place: Float64s, outward: Float64s) -> tuple[Float64s, Float64s]:
    """Light beyond places and as far within, (K, N) both."""
    return light_beside(light, place, outward, _AWAY), light_beside(light, place, outward, -_AWAY)


def _likeness(sides: tuple[Float64s, Float64s], over: float) -> tuple[Float64s, Float64s]:
    """Correlation of both sides over so many pitches about each place, 0 where the first is no fainter, and how much
    the second changes there, (N,) both.
    """
    beyond, within = sides

    def covariance(one: Float64s, other: Float64s) -> Float64s:
        product, first, second = (
            with_sides(values, over / _SPACING).mean(axis=2) for values in (one * other, one, other)
        )
        return np.asarray((product - first * second).sum(axis=0))

    both, out, into = covariance(beyond, within), covariance(beyond, beyond), covariance(within, within)
    return np.where(both < _FAINTER * into, both / np.sqrt(np.maximum(out * into, 1e-6)), 0.0), into
