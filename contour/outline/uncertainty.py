"""How sure an outline is: a 95 % bound in pixels on its distance from the truth, from the picture itself.

Between each two witnesses that lie on the outline there is a stretch of it. Its error is taken as normal, with a
variance that is a sum of squares:

- blur: a blurred edge shifts as one where light, side walls and table differ; no number of witnesses averages that out;
- clipped: once more where walls are at full scale, for half of what can be seen of their height lies farther out;
- leverage: witnesses scatter as they show; a fit divides that by the root of their number, less so beyond the last of
  them and at the corners of short edges;
- gap: where no witness lies for more than a pitch, the outline is a guess that grows with the gap, if slowly: most gaps
  lie in straight edges;
- misfit: neighbours in a row that lie off on one side, farther than scatter has them, say that the outline has left
  the cut; and a corner of which ends on both sides lie inside may be a round one, though most are none;
- outside: a wall end beyond the outline is material that the outline leaves out, even if it is a single one.

The bound is the length within which these normal laws together put 95 % of the outline. All terms are lengths in the
picture: twice the pixels, twice the bound. The coefficients come from
`python -m benchmarks.accuracy.uncertainty --calibrate`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from contour.geometry.arrays import Bools, Complexes, Float64s, Indices, medians, rolled
from contour.geometry.ring_lengths import RingLengths
from contour.outline.fit import FittedRing
from contour.walls.wall_evidence import RingEvidence, WitnessKind

SHARE = 0.95
LEAST_PX = 0.15
"""No bound below this: pixels, and the lens model, are not known better."""

_CAP_PITCHES = 0.5
"""A witness farther off than half a cell is debris or an inner wall; it says that much and no more."""

_OF_SCATTER = 0.8
"""Of the scatter of single witnesses: in four of five cases the middle ones of five lie no farther off by chance."""

_ENDS = np.array([True, True, False, False])
"""Kinds of witnesses that are ends of walls, by `WitnessKind`: one that lies inside may be where the edge runs."""

_BEYOND = 1.1
"""Times as far as such an end: beyond it the edge may run on as it came."""

_NORMAL = 1.96
"""Standard deviations within which 95 % of what is normal lies."""

_OBTUSE, _INSIDE_PITCHES = (math.radians(20.0), math.radians(75.0)), 0.03
"""A corner between these turns may as well be round, where witnesses lie so far inside of it."""

_SHARP, _DEEP_PITCHES = math.radians(100.0), 0.2
"""And so may a right one, where they lie as far inside as this."""

_ROUND = 0.5
"""Of such corners so many, at most, are round ones."""

_WIDEST_PITCHES = 1.0
"""A corner that an arc on a known table may pass by so much is not told: how much more it may is of no account."""

_HALVINGS = 24
_REACH = np.linspace(0.0, 6.0, 601)
_WITHIN = np.array([math.erf(reach / math.sqrt(2.0)) for reach in _REACH])


@dataclass(frozen=True)
class Coefficients:
    """Standard deviation that one pixel of each cause stands for.

    Fitted as `python -m benchmarks.accuracy.uncertainty --calibrate` does, on fewer scenes, but for three things: it
    all but leaves `gap` out, which is kept, for a longer gap must state more; all are a tenth larger, for of a fresh
    set 90 % had held; and `clipped` is half as large again: of 34 bounds on blown out blocks 5 had not held.
    """

    blur: float = 0.374
    clipped: float = 0.8
    leverage: float = 1.155
    gap: float = 0.0046
    misfit: float = 1.21
    outside: float = 1.43


@dataclass(frozen=True, eq=False)
class Stretches:
    """Stretches of outline between neighbouring witnesses on it, shape (S,) each, pixels.

    length: along the coarse ring. blunt: how far off it may run, since a corner may be round. inside: how far inside of
    the outline ends of walls tell that the edge may run. corner: how far at most, on a known table, since it may be
    round there. The others are the causes of `Coefficients`, by the same names.
    """

    length: Float64s
    blur: Float64s
    clipped: Float64s
    leverage: Float64s
    gap: Float64s
    misfit: Float64s
    outside: Float64s
    blunt: Float64s
    inside: Float64s
    corner: Float64s

    def sigma(self, coefficients: Coefficients) -> Float64s:
        """Standard deviation of the outline's place in each stretch."""
        terms = [getattr(coefficients, one.name) * getattr(self, one.name) for one in fields(coefficients)]
        return np.asarray(np.sqrt(np.sum(np.square(terms), axis=0)), np.float64)

    def bound(self, coefficients: Coefficients) -> float:
        """The distance within which 95 % of the outline lies. Where a corner may be round, a share of the length is
        as unsure as that makes it, and the rest as sure as it looks.
        """
        sure, doubt = self.sigma(coefficients), np.maximum(self.blunt, self.corner)
        unsure = np.hypot(sure, coefficients.misfit * doubt)
        doubted = np.where(doubt > 0.0, _ROUND, 0.0) * self.length
        return bound(np.concatenate([sure, unsure]), np.concatenate([self.length - doubted, doubted]))

    @classmethod
    def joined(cls, parts: Sequence[Stretches]) -> Stretches:
        """The stretches of several rings."""
        return cls(*[np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(cls)])


@dataclass(frozen=True, eq=False)
class RingBounds:
    """95 % bounds along one ring, pixels: `own_px` around each of the witnesses on it, `places` (K, 2), shape (K,).

    None is below the bound of all rings together, `whole_px`: where ends of walls lie inside of the outline, or little
    is seen, it is less sure.
    """

    whole_px: float
    places: Float64s
    own_px: Float64s

    def at(self, points: Float64s) -> Float64s:
        """The bound at points on the ring (N, 2), pixels: that around the nearest witness, shape (N,)."""
        x, y = np.subtract.outer(points[:, 0], self.places[:, 0]), np.subtract.outer(points[:, 1], self.places[:, 1])
        return np.asarray(self.own_px[(x * x + y * y).argmin(axis=1)])


def uncertainty(
    rings: Sequence[tuple[RingEvidence, FittedRing]],
    *,
    pitch_px: float,
    blur_px: float,
    clipped: float = 0.0,
    unreached: Sequence[Float64s] | None = None,
) -> tuple[RingBounds, ...]:
    """How sure the outline is: each ring by place, and all of them as a whole.

    clipped: share of the witnesses beside which walls are at full scale. unreached: of an outline on a table that was
    taught, so that nothing of it passes for a wall, where none reaches it: along each ring from and to, (K, 2), pixels.
    """
    gaps: Sequence[Float64s | None] = unreached or [None] * len(rings)
    stretches = [
        ring_stretches(*ring, pitch_px=pitch_px, blur_px=blur_px, clipped=clipped, unreached=one)
        for ring, one in zip(rings, gaps, strict=True)
    ]
    causes = Coefficients()
    whole = max(Stretches.joined(stretches).bound(causes), LEAST_PX)
    found = []
    for (evidence, fitted), stretch in zip(rings, stretches, strict=True):
        deviation = np.hypot(stretch.sigma(causes), causes.misfit * stretch.blunt)
        own = np.maximum(_NORMAL * deviation, whole) + _BEYOND * np.maximum(stretch.inside, stretch.corner)
        places = evidence.points[_on_line(evidence, fitted)]
        # A witness lies between two stretches.
        found.append(RingBounds(whole, places, np.maximum(own, rolled(own, 1))))
    return tuple(found)


def bound(sigma: Float64s, length: Float64s) -> float:
    """The distance within which normal errors of standard deviation `sigma` keep 95 % of the stretches' length."""
    share = length / max(float(length.sum()), 1e-12)
    sigma = np.maximum(sigma, 1e-6)
    low, high = 0.0, float(_REACH[-1] * sigma.max())
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if float(share @ np.interp(middle / sigma, _REACH, _WITHIN)) < SHARE:
            low = middle
        else:
            high = middle
    return high


def ring_stretches(
    evidence: RingEvidence,
    fitted: FittedRing,
    *,
    pitch_px: float,
    blur_px: float,
    clipped: float = 0.0,
    unreached: Float64s | None = None,
) -> Stretches:
    """The stretches of one ring and the causes of error in each.

    Where walls are seen to reach the outline, ends of others within it are no edge.
    """
    on_line = _on_line(evidence, fitted)
    position = evidence.position[on_line]
    coarse = evidence.coarse
    around = float(np.hypot(*(rolled(coarse, -1) - coarse).T).sum())
    length = np.maximum(np.diff(position, append=position[0] + around), 0.0)
    leverage = _leverage(evidence, fitted, np.mod(position + 0.5 * length, around), around)
    residual = np.clip(fitted.residual, -_CAP_PITCHES * pitch_px, _CAP_PITCHES * pitch_px)
    blunt = _blunt_corners(evidence, fitted, on_line, pitch_px, None if unreached is None else blur_px)
    together, corner = _largest_between(np.abs(_middle_of_five(residual)), on_line), np.zeros(len(length))
    inside = _inside(evidence, fitted, on_line, _CAP_PITCHES * pitch_px)
    if unreached is not None:
        free = _within(evidence, fitted, on_line, unreached)
        together, inside = np.where(free, together, 0.0), np.where(free, inside, 0.0)
        blunt, corner = corner, blunt
    left_out = ~fitted.inlier & (evidence.kind != WitnessKind.OUTERMOST)
    return Stretches(
        length=length,
        blur=np.full(len(length), blur_px),
        clipped=np.full(len(length), clipped * blur_px),
        leverage=leverage * fitted.spread_px,
        gap=np.maximum(length - pitch_px, 0.0),
        misfit=np.sqrt(np.maximum(together**2 - (_OF_SCATTER * fitted.spread_px) ** 2, 0.0)),
        outside=_largest_between(np.where(left_out, np.maximum(residual, 0.0), 0.0), on_line),
        blunt=blunt,
        inside=inside,
        corner=corner,
    )


def _within(evidence: RingEvidence, fitted: FittedRing, on_line: Indices, parts: Float64s) -> Bools:
    """Which stretches share a place with parts of the fitted ring, from and to along it, (K, 2), shape (S,)."""
    lengths = RingLengths.of(fitted.ring)
    start = lengths.feet(evidence.points[on_line])
    long = (rolled(start, -1) - start) % lengths.length
    first, wide = parts[:, 0], parts[:, 1] - parts[:, 0]
    before = (first - start[:, None]) % lengths.length < long[:, None]
    behind = (start[:, None] - first) % lengths.length < wide
    return np.asarray((before | behind).any(axis=1))


def _inside(evidence: RingEvidence, fitted: FittedRing, on_line: Indices, deepest_px: float) -> Float64s:
    """How far inside of the outline the edge may run in each stretch, since ends of walls lie there, shape (S,).

    A single one is an inner wall, but where the outline bulges: there it may run from witness to witness. Two are not,
    unless they lie `deepest_px` inside.
    """
    start = evidence.points[on_line]
    along = rolled(start, -1) - start
    square = np.maximum((along**2).sum(axis=1), 1e-12)
    length = np.sqrt(square)
    off = fitted.ring[:, None] - start
    share = (off * along).sum(axis=2) / square
    apart = np.abs(off[..., 0] * along[:, 1] - off[..., 1] * along[:, 0]) / length
    bulge = np.where((share > 0.0) & (share < 1.0) & (apart < length), apart, 0.0).max(axis=0)
    deepest, second = np.zeros(len(on_line)), np.zeros(len(on_line))
    inner = (fitted.residual < 0.0) & (fitted.residual > -deepest_px)
    ends = np.flatnonzero(~fitted.inlier & _ENDS[evidence.kind] & inner)
    for end in ends.tolist():
        stretch, depth = int(np.searchsorted(on_line, end)) - 1, -float(fitted.residual[end])
        second[stretch] = max(second[stretch], min(depth, deepest[stretch]))
        deepest[stretch] = max(deepest[stretch], depth)
    return np.asarray(np.maximum(np.minimum(deepest, bulge), second))


def _on_line(evidence: RingEvidence, fitted: FittedRing) -> Indices:
    """The witnesses between which stretches lie: those on the outline, or all where it has hardly any."""
    on_line = np.flatnonzero(fitted.inlier)
    return on_line if len(on_line) >= 2 else np.arange(len(evidence.points))


def _leverage(evidence: RingEvidence, fitted: FittedRing, place: Float64s, around: float) -> Float64s:
    """Standard deviation of the fit over that of one witness, at places along the coarse ring, between its vertices."""
    ring, points = fitted.ring, evidence.points
    nearest = np.concatenate(
        [((part[:, None, :] - points[None, :, :]) ** 2).sum(axis=2).argmin(axis=1) for part in np.array_split(ring, 8)]
    )
    at = evidence.position[nearest]
    order = np.argsort(at, kind="stable")
    ratio = fitted.vertex_sigma_px / max(fitted.spread_px, 1e-6)
    return np.asarray(np.interp(place, at[order], ratio[order], period=around), np.float64)


def _blunt_corners(
    evidence: RingEvidence, fitted: FittedRing, on_line: Indices, pitch_px: float, walls_within_px: float | None
) -> Float64s:
    """How far each stretch's corner lies from the arc that may run there instead, pixels, shape (S,); 0 without one.

    Between the witnesses on both sides of an obtuse corner others may lie inside of it and be left out as broken walls:
    they are those of a round corner. An arc that leaves both lines at a distance a from a corner that turns by t passes
    it by a tan(t / 4). Where it is known within how many pixels walls are seen, none leaves any of them outside, nor an
    end that the outline was laid through.
    """
    found = np.zeros(len(on_line))
    ring = fitted.ring
    lengths = RingLengths.of(ring)
    edges = rolled(ring, -1) - ring
    heading = edges[:, 0] + 1j * edges[:, 1]
    turn = np.angle(heading / rolled(heading, 1))
    corners = np.flatnonzero((np.abs(turn) > _OBTUSE[0]) & (np.abs(turn) < _SHARP))
    if not len(corners):
        return found
    feet = lengths.feet(evidence.points)
    inside = np.where(fitted.inlier, 0.0, -fitted.residual)
    known = np.concatenate([evidence.walls.points, evidence.points[fitted.inlier]])
    most = _CAP_PITCHES if walls_within_px is None else _WIDEST_PITCHES
    for corner in corners.tolist():
        ahead = (feet - lengths.starts[corner]) % lengths.length
        after, before = on_line[ahead[on_line].argmin()], on_line[ahead[on_line].argmax()]
        reach = ahead[after], lengths.length - ahead[before]
        between = (ahead < reach[0]) | (lengths.length - ahead < reach[1])
        least = _INSIDE_PITCHES if abs(turn[corner]) < _OBTUSE[1] else _DEEP_PITCHES
        if np.any(between & (inside > least * pitch_px)):
            leaves = 0.5 * sum(reach)
            if walls_within_px is not None:
                if turn[corner] < 0.0:
                    continue
                inwards = heading[corner] / abs(heading[corner]) - heading[corner - 1] / abs(heading[corner - 1])
                inwards /= abs(inwards)
                off = known - ring[corner]
                walls = (off[:, 0] + 1j * off[:, 1]) * inwards.conjugate() + walls_within_px
                leaves = min(leaves, _farthest_around(walls, float(turn[corner])))
            passed = leaves * math.tan(abs(turn[corner]) / 4.0)
            stretch = int(np.searchsorted(on_line, before))
            found[stretch] = max(found[stretch], min(passed, most * pitch_px))
    return found


def _farthest_around(points: Complexes, turn: float) -> float:
    """How far from a corner of that turn an arc may leave both lines and have none of the points (N,) outside; they are
    as seen from the corner, real: along the line that halves it, inwards. Inf without any within both lines.

    The circle of radius r around r / cos(t / 2) on that line goes through a point twice: where it first takes it in,
    and where it leaves it in the corner. It leaves the lines at r tan(t / 2).
    """
    cosine, tangent = math.cos(0.5 * turn), math.tan(0.5 * turn)
    within = points[points.real * cosine > np.abs(points.imag) * math.sin(0.5 * turn)]
    along = within.real / cosine
    square = np.maximum(along**2 - (tangent * np.abs(within)) ** 2, 0.0)
    return float(((along + np.sqrt(square)) / tangent).min(initial=np.inf))


def _middle_of_five(residual: Float64s) -> Float64s:
    """Median of each residual and its two neighbours on either side, around the ring."""
    return medians(np.stack([rolled(residual, shift) for shift in range(-2, 3)]), axis=0)


def _largest_between(values: Float64s, on_line: Indices) -> Float64s:
    """Largest of the values from each witness on the outline up to and with the next one on it, around the ring."""
    turned = rolled(values, -int(on_line[0]))
    largest = np.maximum.reduceat(turned, on_line - on_line[0])
    return np.asarray(np.maximum(largest, rolled(values[on_line], -1)), np.float64)
