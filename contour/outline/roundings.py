"""Corners that are rounded: an arc that touches both edges explains the wall ends in a corner better than its tip."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from contour.geometry.arrays import Bools, Complexes, Float64s, Indices
from contour.outline.corners import Joints, intersections
from contour.outline.labelling import PRICE_ARC, PRICE_LINE
from contour.outline.lines_and_arcs import Models, distance, feet, join
from contour.outline.runs import Segments
from contour.outline.witnesses import Witnesses, cost

# Nats for a rounding: where and how it lies follows from its edges, so that only its radius is its own. More than a
# single witness can save: one that lies deep is a broken wall.
PRICE_ROUNDING = 6.0
# Radii that are tried, pitches: even in their logarithm, then about the best so far.
_RADII = np.geomspace(0.6, 20.0, 30)
_FINER = np.geomspace(0.9, 1.11, 9), np.geomspace(0.98, 1.02, 5)
_NEAR_KNOWN = np.geomspace(0.9, 1.11, 5)
# An arc without a wall end is as long as this where one cell hides it, pitches; what each pitch more costs, nats.
_UNSEEN_ARC, _UNSEEN_PER_PITCH = 2.5, 4.0
# Nats by which a rounding is likelier where there is no other corner.
_LONELY = 3.0
# Nats for a corner that is not as the others are.
_UNLIKE = 2.0
_TIGHTEST = 0.95
# Witnesses of either edge that are looked at to tell whether it is worth the trouble.
_NEXT = 6
# A corner may as well be round where an arc that passes it by so many pitches costs no more than so many nats above it;
# radii that are tried, times the least of these.
_APART, _AS_WELL, _LARGER = 0.5, 2.5, np.geomspace(1.0, 4.0, 40)
# A smaller turn is no corner, and about a larger one goes no arc, radians.
LEAST_TURN, MOST_TURN = 0.3, 2.6


@dataclass(frozen=True, eq=False)
class _Ring:
    """A ring's segments, their joints, and which of them are arcs that were put in here, shape (S,)."""

    segments: Segments
    found: Joints
    made: Bools


@dataclass(frozen=True, eq=False)
class _Corner:
    """Segment `k` and the one `after` it, between which an arc may go instead of the corner and what is `between`.

    edges: models of both. near, far, turn: where the one ends, where the other begins, and the angle between them.
    ends: where the one begins and the other ends. index: witnesses of all, of which `part` says 0, 1 or 2: from the
    one edge, from between, from the other. present: what they cost now; fixed: what else is saved.
    """

    k: int
    after: int
    edges: Models
    near: complex
    far: complex
    turn: float
    ends: tuple[complex, complex]
    index: Indices
    part: Indices
    present: Float64s
    fixed: float

    @cached_property
    def told_by(self) -> Hashable:
        """What the arcs in it depend on: all but where in its ring it lies."""
        own = (self.edges.origin, self.edges.tangent, self.edges.curvature, self.index, self.part, self.present)
        return (*(values.tobytes() for values in own), self.near, self.far, self.ends, self.fixed)

    @property
    def unexplained(self) -> float:
        """What the witnesses next to the corner cost now: about the most that an arc may save."""
        own, others = int((self.part == 0).sum()), int((self.part == 2).sum())
        return float(self.present[max(own - _NEXT, 0) : len(self.part) - max(others - _NEXT, 0)].sum())


@dataclass(frozen=True, eq=False)
class _Arcs:
    """Arcs of several radii in one corner, shape (R,): nats that each saves, where it leaves the one edge and meets the
    other, its model, and which witnesses lie along it (R, M).
    """

    gain: Float64s
    leaves: Complexes
    meets: Complexes
    models: Models
    along: Bools


def rounded(witnesses: Witnesses, segments: Segments, found: Joints) -> tuple[Segments, Joints, Bools]:
    """Segments and joints with an arc in each corner that is told better by one, and which segments are such arcs.

    First those that gain by themselves, most first, then those that do together, with one radius for all: what cut one
    corner of a block mostly cut the others, too.
    """
    ring = _Ring(segments, found, np.zeros(len(segments), dtype=bool))
    known: dict[Hashable, _Arcs | None] = {}
    while len(ring.segments) >= 3:
        corners = _corners(witnesses, ring, (0, 1))
        # An arc that was put in changes the corners beside it alone.
        known.update((one.told_by, _best_arc(witnesses, one)) for one in corners if one.told_by not in known)
        better = [(corner, arc) for corner in corners if (arc := known[corner.told_by]) is not None]
        if not better:
            break
        ring = _inserted(witnesses, ring, *max(better, key=lambda one: float(one[1].gain[0])))
    corners = _corners(witnesses, ring, (0,))
    for sign in (1.0, -1.0):
        radius = _common_radius(witnesses, ring, corners, sign)
        while radius is not None:
            alike = [
                (corner, arcs)
                for corner in corners
                if corner.turn * sign > 0.0
                and (arcs := _arcs(witnesses, corner, np.array([radius]))).gain[0] + PRICE_ROUNDING > -_UNLIKE
            ]
            if not alike:
                break
            ring = _inserted(witnesses, ring, *alike[0])
            corners = _corners(witnesses, ring, (0,))
    return ring.segments, ring.found, ring.made


def maybe_round(witnesses: Witnesses, segments: Segments, found: Joints, made: Bools) -> Complexes:
    """Corners between straight edges that may as well be round, shape (K,), in the fitting plane."""
    places = []
    for corner in _corners(witnesses, _Ring(segments, found, made), (0,)):
        if segments.bend[[corner.k, corner.after]].any() or corner.unexplained + corner.fixed < -_AS_WELL:
            continue
        least = _APART * witnesses.pitch_px / (1.0 / np.cos(0.5 * corner.turn) - 1.0)
        if _arcs(witnesses, corner, np.copysign(least * _LARGER, corner.turn)).gain.max() > -_AS_WELL:
            places.append(corner.near)
    return np.array(places, np.complex128)


def _common_radius(witnesses: Witnesses, ring: _Ring, every: list[_Corner], sign: float) -> float | None:
    """Radius that those of the remaining corners that are of one sense share with each other or with those that were
    rounded, negative for reflex ones; None where they are better left as they are.
    """
    corners = [corner for corner in every if corner.turn * sign > 0.0]
    if not corners or len(ring.segments) < 3:
        return None
    if not ring.made.any() and sum(corner.unexplained for corner in corners) < PRICE_ROUNDING - _LONELY:
        return None
    curvature = ring.segments.models.curvature[ring.made]
    known = (_NEAR_KNOWN[:, None] / curvature[curvature * sign > 0.0]).ravel()
    radii = np.concatenate([sign * _RADII * witnesses.pitch_px, known])
    price = np.where(np.arange(len(radii)) < len(_RADII), PRICE_ROUNDING - _LONELY * (len(every) == 1), 0.0)
    gains = [_arcs(witnesses, corner, radii).gain + PRICE_ROUNDING for corner in corners]
    together = np.maximum(gains, -_UNLIKE).sum(axis=0) - price
    best = int(together.argmax())
    return float(radii[best]) if together[best] > 0.0 else None


def _corners(witnesses: Witnesses, ring: _Ring, between: tuple[int, ...]) -> list[_Corner]:
    """All that may be rounded, over so many segments each."""
    segments = ring.segments
    nats = cost(witnesses, distance(segments.models.take(segments.owner(len(witnesses))), witnesses.points))
    tried = [
        _corner(ring, nats, k, inner)
        for k in range(len(segments))
        for inner in between
        if len(segments) >= 3 + inner and not ring.made[(k + np.arange(inner + 2)) % len(segments)].any()
    ]
    return [corner for corner in tried if corner is not None]


def _corner(ring: _Ring, nats: Float64s, k: int, between: int) -> _Corner | None:
    """What may be rounded after segment `k`, None where there is no corner; `nats`: what each witness costs now."""
    segments, found, total = ring.segments, ring.found, len(ring.segments)
    members = (k + np.arange(between + 2)) % total
    after = int(members[-1])
    near, far = complex(found.end[k]), complex(found.begin[members[-2]])
    edges = segments.models.take(members[[0, -1]])
    tangent = feet(edges, np.array([near, far]))[1]
    turn = float(np.angle(tangent[0].conjugate() * tangent[1]))
    if not LEAST_TURN < abs(turn) < MOST_TURN or (not between and near != far):
        return None
    length = segments.length[members]
    if length.sum() < 3:
        return None
    index = (segments.first[k] + np.arange(int(length.sum()))) % len(nats)
    part = np.repeat([0, *[1] * between, 2], length)
    fixed = sum(PRICE_ARC if segments.bend[m] else PRICE_LINE for m in members[1:-1]) - PRICE_ROUNDING
    ends = complex(found.begin[k - 1]), complex(found.end[after])
    return _Corner(k, after, edges, near, far, turn, ends, index, part, nats[index], fixed)


def _best_arc(witnesses: Witnesses, corner: _Corner) -> _Arcs | None:
    """The arc that saves most in a corner, None where none saves anything."""
    if corner.unexplained + corner.fixed <= 0.0:
        return None
    radii = np.copysign(_RADII * witnesses.pitch_px, corner.turn)
    for finer in (*_FINER, None):
        arcs = _arcs(witnesses, corner, radii)
        best = int(arcs.gain.argmax())
        # Between straight edges radii that are tried first may well lie on both sides of one that is told.
        if arcs.gain[best] <= 0.0 and (finer is None or corner.edges.curvature.any()):
            return None
        if finer is not None:
            radii = radii[best] * finer
    one = slice(best, best + 1)
    return _Arcs(arcs.gain[one], arcs.leaves[one], arcs.meets[one], arcs.models.take(one), arcs.along[one])


def _arcs(witnesses: Witnesses, corner: _Corner, radii: Float64s) -> _Arcs:
    """The arcs of these radii (R,), positive where the corner is convex, that touch both edges."""
    points = witnesses.points[corner.index]
    one, other = (corner.edges.take(np.full(len(radii), side)) for side in (0, 1))
    tangent = feet(corner.edges, np.array([corner.near, corner.far]))[1]
    centre, met = intersections(
        _inside(one, radii),
        _inside(other, radii),
        corner.near + 1j * tangent[0] * radii,
        corner.far + 1j * tangent[1] * radii,
    )
    (leaves, leaving), (meets, meeting) = feet(one, centre), feet(other, centre)
    arcs = Models(leaves, leaving, 1.0 / radii)
    ahead = ((points - leaves[:, None]) * leaving.conj()[:, None]).real > 0.0
    behind = ((points - meets[:, None]) * meeting.conj()[:, None]).real < 0.0
    along = ahead & behind
    along[:, [0, -1]] = False  # either edge keeps a witness of its own
    on_arc = cost(witnesses, distance(arcs.take((slice(None), None)), points), corner.index)
    beside = corner.present
    if (corner.part == 1).any():
        on_edge = [cost(witnesses, distance(corner.edges.take(side), points), corner.index) for side in (0, 1)]
        beside = np.where(corner.part == 1, np.where(ahead, on_edge[1], on_edge[0]), corner.present)
    # An outline that goes on and on where nothing is seen would have lost more cells than one.
    seen = (along & (on_arc < 0.5 * witnesses.cap_inside[corner.index])).sum(axis=1)
    beyond = np.maximum(((leaves - corner.near) * leaving.conj()).real, 0.0)
    beyond += np.maximum(((corner.far - meets) * meeting.conj()).real, 0.0)
    unseen = (np.abs(corner.turn * radii) + beyond) / witnesses.pitch_px - _UNSEEN_ARC - seen
    saved = (corner.present - np.where(along, on_arc, beside)).sum(axis=1)
    gain = corner.fixed + saved - _UNSEEN_PER_PITCH * np.maximum(unseen, 0.0)
    # No circle touches a smaller one from inside.
    room = (one.curvature * radii < _TIGHTEST) & (other.curvature * radii < _TIGHTEST)
    room &= ((leaves - corner.ends[0]) * leaving.conj()).real > 0.0
    room &= ((corner.ends[1] - meets) * meeting.conj()).real > 0.0
    room &= ((meets - leaves) * (leaving + meeting).conj()).real > 0.0
    return _Arcs(np.where(met & room, gain, -np.inf), leaves, meets, arcs, along)


def _inside(models: Models, distances: Float64s) -> Models:
    """The models, shape (R,), moved inwards by so much each."""
    share = np.maximum(1.0 - models.curvature * distances, 1.0 - _TIGHTEST)
    return Models(models.origin + 1j * models.tangent * distances, models.tangent, models.curvature / share)


def _inserted(witnesses: Witnesses, ring: _Ring, corner: _Corner, arc: _Arcs) -> _Ring:
    """The ring with the arc in place of what is between the corner's edges; it comes last."""
    segments, found, count = ring.segments, ring.found, len(witnesses)
    kept = (corner.after + np.arange((corner.k - corner.after) % len(segments) + 1)) % len(segments)
    begins, lengths = segments.first[kept], segments.length[kept]
    own = np.flatnonzero(arc.along[0] | (corner.part == 1))
    if not len(own):  # nothing was seen along it, but no segment is without a witness
        own = np.array([max(int(lengths[-1]) - 1, 1)])
    first, last = int(own[0]), int(own[-1])
    taken = max(0, last + 1 - int((corner.part < 2).sum()))
    begins[0], lengths[0] = (begins[0] + taken) % count, lengths[0] - taken
    lengths[-1] = min(first, int(lengths[-1]))
    start, length = begins[-1] + lengths[-1], len(corner.index) - int(lengths[-1]) - int(lengths[0])
    end, begin = found.end[kept], found.begin[kept]
    end[-1] = begin[-1] = arc.leaves[0]
    return _Ring(
        Segments(
            join([segments.models.take(kept), arc.models]),
            np.append(segments.bend[kept], True),
            np.append(begins, start % count),
            np.append(lengths, length),
        ),
        Joints(np.append(end, arc.meets), np.append(begin, arc.meets), np.append(found.kink[kept], 0.0)),
        np.append(ring.made[kept], True),
    )
