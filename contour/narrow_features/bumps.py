"""Bumps and dents of an outline too narrow to be told from a chip that clings to the block, or from cells lost; and
wider bumps that stand upright on an edge, as a strip of cells does that was cut off, or a printed label.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Float64s, Indices, rolled
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring
from contour.geometry.segments import turns
from contour.narrow_features.feature import DEPTH, NOTCH, WIDTH, NarrowFeature

# In cell pitches. A wider bump is a strip or a label where it fills so much of the rectangle over its foot: an arm's
# end fills half, and what stands farther out is an arm.
_WIDE, _UPRIGHT, _HIGH = 10.0, 0.6, 4.5
# Beside its foot the outline runs along it over so much, but for this angle; a corner between two such edges stands
# out by half its width times the tangent. On a curve or a corner it turns out at both feet, by so much over a pitch. A
# dent turns in there; but with right angles, within so much, of its own sides and of the edges beside it, it is the
# missing corner of an L.
_BESIDE, _ANGLE_DEG, _OUT_DEG, _RIGHT_DEG = 2.0, 22.0, 25.0, 15.0
_SLOPE = 0.5 * float(np.tan(np.radians(_ANGLE_DEG)))
# What stands out by no more than this times what the edges on its two sides are apart is a step from one to the other.
_STEP = 1.5
# Where both sides run along the foot, a low one tells as well, if it stands out by more than they lean over its width:
# of 400 right outlines none has one; along a splice, over a slot and where a curve had a spike there was one.
_LOW = 0.35
_SPACING, _LONGEST = 0.25, 20.0
# From foot to foot the narrowest is told: a wider one, farther out on the same edge, is no deeper by this.
_DEEPER = 0.05


@dataclass(frozen=True, eq=False)
class _Beside:
    """The outline beside each place of a ring, on one side of it, in two halves: their unit directions, and the middle
    of the farther one, (N, 2) each.
    """

    near: Float64s
    far: Float64s
    middle: Float64s

    @classmethod
    def of(cls, places: Float64s, way: int, half: int) -> _Beside:
        """Before (-1) or after (1) each place, halves of so many places."""
        one, two = (rolled(places, -way * reach) for reach in (half, 2 * half))
        return cls(_unit(way * (one - places)), _unit(way * (two - one)), (one + two) / 2)

    def take(self, chosen: Indices) -> _Beside:
        """What lies beside some of the places."""
        return _Beside(*(part[chosen] for part in (self.near, self.far, self.middle)))

    def turning_to(self, after: _Beside) -> Float64s:
        """By how much the outline turns at each place, radians, positive to the right as seen with y down."""
        one, two = self.near, after.near
        return np.asarray(
            np.arctan2(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0], (one * two).sum(axis=1)), np.float64
        )

    def along(self, foot: Float64s) -> Float64s:
        """Cosine of the angle to the foot, of the half that runs less along it."""
        return np.asarray(np.minimum((self.near * foot).sum(axis=1), (self.far * foot).sum(axis=1)), np.float64)

    def across(self, other: _Beside) -> Bools:
        """Whether the farther halves are at right angles."""
        return np.asarray(np.abs((self.far * other.far).sum(axis=1)) < np.sin(np.radians(_RIGHT_DEG)))

    def apart(self, other: _Beside) -> Float64s:
        """How far apart the lines of the edge on both sides are."""
        mean, way = _unit(self.far + other.far), other.middle - self.middle
        return np.asarray(np.abs(mean[:, 0] * way[:, 1] - mean[:, 1] * way[:, 0]), np.float64)


def deepest_bump(ring: Ring, pitch_px: float, *, notches: bool) -> NarrowFeature | None:
    """The deepest bump or dent of a ring in pixels, None without one; `notches`: of dents that cannot have been cut."""
    if _convex(ring):
        return None
    lengths = RingLengths.of(ring)
    count = max(16, int(lengths.length / (_SPACING * pitch_px)))
    places = lengths.at(np.linspace(0.0, lengths.length, count, endpoint=False, dtype=np.float64))
    spacing = lengths.length / count
    half = max(1, round(0.5 * _BESIDE * pitch_px / spacing))
    before, after = _Beside.of(places, -1, half), _Beside.of(places, 1, half)
    aligned = float(np.cos(np.radians(_ANGLE_DEG)))
    # All feet at once: of so many steps, shape (S, 1), from each place, shape (S, N).
    steps = np.arange(2, min(int(_LONGEST * pitch_px / spacing), count // 2))[:, None]
    ends = (np.arange(count) + steps) % count
    foot_x, foot_y = (place.take(ends) - place for place in places.T.copy())
    width = np.hypot(foot_x, foot_y)
    # A path so long reaches no farther out of its foot than half of it would, bent in its middle.
    reach = 0.5 * np.sqrt(np.maximum((steps * spacing) ** 2 - width**2, 0.0))
    far = np.where(width < WIDTH * pitch_px, _LOW * pitch_px, np.maximum(DEPTH * pitch_px, _SLOPE * width))
    long, starts = np.nonzero((width < _WIDE * pitch_px) & (reach > far))
    feet = np.stack([foot_x[long, starts], foot_y[long, starts]], axis=1)
    width, reach = width[long, starts], reach[long, starts]
    one, other = before.take(starts), after.take(ends[long, starts])
    along = feet / np.maximum(width, 1e-9)[:, None]
    leaning = np.minimum(one.along(along), other.along(along))
    least = np.maximum(DEPTH * pitch_px, _SLOPE * width)
    lean = np.tan(np.arccos(np.clip(leaning, aligned, 1.0)))
    straight = leaning > aligned
    low = straight & (width < WIDTH * pitch_px)
    least = np.where(low, np.minimum(least, np.maximum(_LOW * pitch_px, width * lean)), least)
    least = np.maximum(least, _STEP * one.apart(other))
    # Which way bumps may lie: 0 either, as seen along the outline 1 to the right and -1 to the left, nan none.
    side = np.where(straight, 0.0, np.nan)
    turning = before.turning_to(after)
    turn = np.stack([turning[at] for at in (starts, ends[long, starts])])
    sides = after.take(starts), before.take(ends[long, starts])
    inwards = (turn.max(axis=0) < -np.radians(_OUT_DEG)) & ~(one.across(other) & sides[0].across(sides[1]))
    outwards = turn.min(axis=0) > np.radians(_OUT_DEG)
    side = np.where(np.isnan(side) & (outwards | inwards), np.sign(turn[0]), side)
    chosen = np.flatnonzero((reach > least) & ~np.isnan(side))
    best: NarrowFeature | None = None
    for some in np.split(chosen, np.flatnonzero(np.diff(long[chosen])) + 1):
        if len(some):
            run = starts[some], int(steps[long[some[0]], 0])
            foot = along[some], width[some], least[some], side[some]
            best = _deeper(best, places, run, foot, pitch_px, notches=notches)
    return best


def _deeper(
    best: NarrowFeature | None,
    places: Float64s,
    run: tuple[Indices, int],
    foot: tuple[Float64s, Float64s, Float64s, Float64s],
    pitch_px: float,
    *,
    notches: bool,
) -> NarrowFeature | None:
    """The deepest of those that begin at `run`'s places and are its steps long, or `best` where none is deeper."""
    starts, steps = run
    along, width, least, side = foot
    path = places[(starts[:, None] + np.arange(steps + 1)) % len(places)] - places[starts][:, None, :]
    off = path[:, :, 0] * along[:, 1:] - path[:, :, 1] * along[:, :1]
    farthest = np.abs(off).argmax(axis=1)
    row = np.arange(len(starts))
    depth = np.abs(off[row, farthest])
    # Contours in pixels have the block on their left as seen with y down: what lies on the right is out.
    middle = off.mean(axis=1)
    out = middle < 0
    upright = out & (depth < _HIGH * pitch_px) & (np.abs(_areas(path)) > _UPRIGHT * width * depth)
    narrow = width < WIDTH * pitch_px
    if notches:
        narrow &= out | (np.minimum(depth, width) < NOTCH * pitch_px)
    depth = np.where((depth > least) & (side * middle <= 0.0) & (upright | narrow), depth, 0.0)
    one = int(depth.argmax())
    if depth[one] <= ((best.depth_pitches + _DEEPER) * pitch_px if best else 0.0):
        return best
    x, y = places[(starts[one] + farthest[one]) % len(places)].tolist()
    return NarrowFeature(float(depth[one]) / pitch_px, float(width[one]) / pitch_px, (x, y), bool(out[one]))


def _areas(path: Float64s) -> Float64s:
    """Areas between paths (N, M, 2) and their feet, signed, shape (N,)."""
    following = path[:, 1:] - path[:, :-1]
    return np.asarray(0.5 * (path[:, :-1, 0] * following[:, :, 1] - path[:, :-1, 1] * following[:, :, 0]).sum(axis=1))


def _convex(ring: Ring) -> bool:
    """Whether a simple ring turns one way alone: then nothing stands out of it, or goes in, between edges in line."""
    turn = turns(rolled(ring, 1), ring, rolled(ring, -1))
    return bool((turn >= 0).all() or (turn <= 0).all())


def _unit(vectors: Float64s) -> Float64s:
    return np.asarray(vectors / np.maximum(np.hypot(*vectors.T)[:, None], 1e-9), np.float64)
