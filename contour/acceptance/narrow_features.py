"""Bumps and dents of an outline too narrow to be told from a chip that clings to the block, or from cells lost; and
wider bumps that stand upright on an edge, as a strip of cells does that was cut off, or a printed label; and arms of
any length and direction that are as narrow as a cable, or as a strip and not pointed; and low steps near a corner, as a
strip of cells makes that lies against it; and horns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float64s, Indices
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, Ring
from contour.image.opencv import fewer_vertices

# All in cell pitches. Narrower than this at its foot, farther out than that.
_WIDTH, _DEPTH = 5.0, 0.75
# A wider bump is a strip or a label where it fills so much of the rectangle over its foot: an arm's end fills half,
# and what stands farther out is an arm.
_WIDE, _UPRIGHT, _HIGH = 10.0, 0.6, 4.5
# Beside its foot the outline runs along it over so much, but for this angle; a corner between two such edges stands
# out by half its width times the tangent. On a curve or a corner it turns out at both feet, by so much over a pitch.
_BESIDE, _ANGLE_DEG, _OUT_DEG = 2.0, 22.0, 25.0
_SLOPE = 0.5 * float(np.tan(np.radians(_ANGLE_DEG)))
# What stands out by no more than this times what the edges on its two sides are apart is a step from one to the other.
_STEP = 1.5
_SPACING, _LONGEST = 0.25, 20.0
# Arms: narrower than this, longer than that, and with room for a disc of that radius at the end. A corner of 13 degrees
# is as narrow as the first over as much; corners and horns as narrow as the second are pointed.
_ARMS = ((1.5, 6.0, 0.0), (5.0, 2.5, 0.9))
_ARM_END = 1.7
_PITCH_SAMPLES = 6.0
# A step: of outlines without what is smaller than this it turns in and out by so much, or the other way around, and
# goes on as before but for that; so low, and a corner comes so soon behind it.
_EVEN, _TURN_DEG, _TURNED_DEG, _STEP_HIGH, _STEP_LONG = 0.3, 45.0, 35.0, (0.75, 4.5), 10.0
# A horn: a corner so sharp, its interior angle, and so near to one that turns out by so much, as a wire makes or a mark
# on the table that leads away from the block. Of outlines followed so closely that no curve has such a corner.
_HORN_DEG, _HORN_LONG, _HORN_FOOT_DEG, _HORN_EVEN = 60.0, 5.0, 40.0, 0.1
# From foot to foot the narrowest is told: a wider one, farther out on the same edge, is no deeper by this.
_DEEPER = 0.05


@dataclass(frozen=True)
class NarrowFeature:
    """A bump (or dent) of the outline: how far it stands out of the line of its foot and how wide it is there, pitches;
    its middle, pixels (x, y).
    """

    depth_pitches: float
    width_pitches: float
    place_px: tuple[float, float]
    outwards: bool

    def moved(self, x: float, y: float) -> NarrowFeature:
        """The same in a picture whose first pixel lies at (-x, -y) of this one's."""
        return replace(self, place_px=(self.place_px[0] + x, self.place_px[1] + y))


def narrow_feature(contour: Contour, pitch_px: float) -> NarrowFeature | None:
    """The deepest bump or dent of a contour in pixels on an edge that goes on in its own direction, or that stands out
    of a curve or a corner at both its feet; None without one.

    A corner is none, nor is the end of an arm: there the edges beside it run another way, and no foot is beside them.
    """
    found = [one for ring in contour.rings for one in [_deepest(ring, pitch_px)] if one is not None]
    found += _arms(contour, pitch_px) + _slits(contour, pitch_px)
    found += [one for ring in contour.rings for one in (*_steps(ring, pitch_px), *_horns(ring, pitch_px))]
    return max(found, key=lambda one: one.depth_pitches) if found else None


def _arms(contour: Contour, pitch_px: float) -> list[NarrowFeature]:
    """Parts of a contour far from all that is wider than they are."""
    drawn, first = _drawn(contour.rings, pitch_px, 1.0)
    return _narrow_parts(drawn, first, pitch_px, _ARMS, outwards=True)


def _slits(contour: Contour, pitch_px: float) -> list[NarrowFeature]:
    """What goes into a contour as narrow as an arm, however deep: an outline had followed a cable in, and back."""
    drawn, first = _drawn([contour.exterior], pitch_px, _WIDTH)
    return _narrow_parts(1 - drawn, first, pitch_px, _ARMS[1:], outwards=False)


def _drawn(rings: Sequence[Ring], pitch_px: float, margin: float) -> tuple[Bytes, Float64s]:
    """1 inside of rings in pixels, exterior first, (h, w), with so many pitches around, and the grid's first pixel."""
    first = rings[0].min(axis=0) - margin * pitch_px
    step = pitch_px / _PITCH_SAMPLES
    width, height = np.ceil((rings[0].max(axis=0) + margin * pitch_px - first) / step).astype(int).tolist()
    drawn = np.zeros((height, width), np.uint8)
    cv2.fillPoly(drawn, [np.rint((ring - first) / step).astype(np.int32) for ring in rings], 1)
    return drawn, first


def _narrow_parts(
    drawn: Bytes, first: Float64s, pitch_px: float, kinds: Sequence[tuple[float, float, float]], *, outwards: bool
) -> list[NarrowFeature]:
    step = pitch_px / _PITCH_SAMPLES
    height, width = drawn.shape
    room = np.asarray(cv2.distanceTransform(drawn, cv2.DIST_L2, 5), np.float32) / np.float32(_PITCH_SAMPLES)
    end = round(_ARM_END * _PITCH_SAMPLES)
    disc = np.hypot(*np.ogrid[-end : end + 1, -end : end + 1]) < _ARM_END * _PITCH_SAMPLES
    framed = cv2.copyMakeBorder(room, end, end, end, end, cv2.BORDER_CONSTANT)
    found = []
    for narrow, long, blunt in kinds:
        wide = (room >= 0.5 * narrow).astype(np.uint8)
        away = np.minimum(cv2.distanceTransform(1 - wide, cv2.DIST_L2, 5), width + height) / _PITCH_SAMPLES
        away -= 0.5 * narrow
        _, parts, stats, _ = cv2.connectedComponentsWithStats((drawn & (away > 0.5 * long)).astype(np.uint8))
        for part, (left, top, wide_px, high_px, _) in enumerate(stats[1:].tolist(), 1):
            box = slice(top, top + high_px), slice(left, left + wide_px)
            y, x = np.unravel_index(int(np.where(parts[box] == part, away[box], 0.0).argmax()), (high_px, wide_px))
            y, x = y + top, x + left
            blunter = framed[y : y + 2 * end + 1, x : x + 2 * end + 1][disc].max() >= blunt
            if away[y, x] > long and blunter:
                place_x, place_y = (first + step * np.array([x, y])).tolist()
                found.append(NarrowFeature(float(away[y, x]), narrow, (place_x, place_y), outwards))
    return found


def _steps(ring: Ring, pitch_px: float) -> list[NarrowFeature]:
    """Low steps out of an edge that end in a corner soon."""
    even = fewer_vertices(ring, _EVEN * pitch_px)
    # Either way around; a contour in pixels has the block on its left as seen with y down: it turns left at corners.
    mirrored = np.stack([-even[::-1, 0], even[::-1, 1]], axis=1)
    return _steps_along(even, pitch_px) + [
        replace(step, place_px=(-step.place_px[0], step.place_px[1])) for step in _steps_along(mirrored, pitch_px)
    ]


def _steps_along(corners: Ring, pitch_px: float) -> list[NarrowFeature]:
    edges = np.roll(corners, -1, axis=0) - corners
    long, heading = np.hypot(*edges.T) / pitch_px, edges[:, 0] + 1j * edges[:, 1]
    turn = -np.angle(heading / np.roll(heading, 1))
    least, turned = np.radians([_TURN_DEG, _TURNED_DEG])
    after = np.roll(turn, -1)
    high = long * np.sin(np.abs(after))
    rises = (turn < -least) & (after > least) & (np.abs(turn + after) < turned)
    rises &= (high > _STEP_HIGH[0]) & (high < _STEP_HIGH[1])
    found = []
    for foot in np.flatnonzero(rises).tolist():
        top = np.roll(np.arange(len(corners)), -foot - 1)
        turned_by = np.cumsum(turn[top[1:]])  # a corner may be a round one
        end = int(np.argmax(np.abs(turned_by) > least)) + 1
        # At its foot: slanting sides are as wide as they are long there.
        sides = [foot, top[end]] if long[top[end]] < _STEP_HIGH[1] else [foot]
        wide = long[top[:end]].sum() + (long[sides] * np.cos(turn[[top[0], top[end]]][: len(sides)])).sum()
        if turned_by[end - 1] > least and wide < _STEP_LONG:
            x, y = corners[top[0]].tolist()
            found.append(NarrowFeature(float(high[foot]), float(wide), (x, y), True))
    return found


def _horns(ring: Ring, pitch_px: float) -> list[NarrowFeature]:
    """Sharp corners that stand out of the outline beside them."""
    corners = fewer_vertices(ring, _HORN_EVEN * pitch_px)
    edges = np.roll(corners, -1, axis=0) - corners
    long, heading = np.hypot(*edges.T) / pitch_px, edges[:, 0] + 1j * edges[:, 1]
    turn_deg = -np.degrees(np.angle(heading / np.roll(heading, 1)))
    found = []
    for tip in np.flatnonzero(turn_deg > 180.0 - _HORN_DEG).tolist():
        sides = ((long[tip - 1], turn_deg[tip - 1]), (long[tip], turn_deg[(tip + 1) % len(corners)]))
        feet = [side for side, foot_deg in sides if side < _HORN_LONG and foot_deg < -_HORN_FOOT_DEG]
        if feet and min(feet) > _DEPTH:
            wide = 2.0 * min(feet) * np.sin(np.radians(0.5 * (180.0 - turn_deg[tip])))
            x, y = corners[tip].tolist()
            found.append(NarrowFeature(float(min(feet)), float(wide), (x, y), True))
    return found


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
        one, two = (np.roll(places, -way * reach, axis=0) for reach in (half, 2 * half))
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

    def apart(self, other: _Beside) -> Float64s:
        """How far apart the lines of the edge on both sides are."""
        mean, way = _unit(self.far + other.far), other.middle - self.middle
        return np.asarray(np.abs(mean[:, 0] * way[:, 1] - mean[:, 1] * way[:, 0]), np.float64)


def _deepest(ring: Ring, pitch_px: float) -> NarrowFeature | None:
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
    foot = places[ends] - places
    width = np.hypot(foot[:, :, 0], foot[:, :, 1])
    # A path so long reaches no farther out of its foot than half of it would, bent in its middle.
    reach = 0.5 * np.sqrt(np.maximum((steps * spacing) ** 2 - width**2, 0.0))
    long, starts = np.nonzero((width < _WIDE * pitch_px) & (reach > np.maximum(_DEPTH * pitch_px, _SLOPE * width)))
    foot, width, reach = foot[long, starts], width[long, starts], reach[long, starts]
    one, other = before.take(starts), after.take(ends[long, starts])
    along = foot / np.maximum(width, 1e-9)[:, None]
    least = np.maximum(np.maximum(_DEPTH * pitch_px, _SLOPE * width), _STEP * one.apart(other))
    # Which way bumps may lie: 0 either, as seen along the outline 1 to the right and -1 to the left, nan none.
    side = np.where(np.minimum(one.along(along), other.along(along)) > aligned, 0.0, np.nan)
    turn = np.stack([before.turning_to(after)[feet] for feet in (starts, ends[long, starts])])
    side = np.where(
        np.isnan(side) & (np.abs(turn).min(axis=0) > np.radians(_OUT_DEG)) & (turn[0] * turn[1] > 0.0),
        np.sign(turn[0]),
        side,
    )
    chosen = np.flatnonzero((reach > least) & ~np.isnan(side))
    best: NarrowFeature | None = None
    for some in np.split(chosen, np.flatnonzero(np.diff(long[chosen])) + 1):
        if len(some):
            run = starts[some], int(steps[long[some[0]], 0])
            best = _deeper(best, places, run, (along[some], width[some], least[some], side[some]), pitch_px)
    return best


def _deeper(
    best: NarrowFeature | None,
    places: Float64s,
    run: tuple[Indices, int],
    foot: tuple[Float64s, Float64s, Float64s, Float64s],
    pitch_px: float,
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
    depth = np.where((depth > least) & (side * middle <= 0.0) & (upright | (width < _WIDTH * pitch_px)), depth, 0.0)
    one = int(depth.argmax())
    if depth[one] <= ((best.depth_pitches + _DEEPER) * pitch_px if best else 0.0):
        return best
    x, y = places[(starts[one] + farthest[one]) % len(places)].tolist()
    return NarrowFeature(float(depth[one]) / pitch_px, float(width[one]) / pitch_px, (x, y), bool(out[one]))


def _areas(path: Float64s) -> Float64s:
    """Areas between paths (N, M, 2) and their feet, signed, shape (N,)."""
    following = path[:, 1:] - path[:, :-1]
    return np.asarray(0.5 * (path[:, :-1, 0] * following[:, :, 1] - path[:, :-1, 1] * following[:, :, 0]).sum(axis=1))


def _unit(vectors: Float64s) -> Float64s:
    return np.asarray(vectors / np.maximum(np.hypot(*vectors.T)[:, None], 1e-9), np.float64)
