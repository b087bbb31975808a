"""Steps that take vertices out of a contour by giving up material, those that shift least first.

With the material on a ring's left, two kinds of steps make it smaller and never larger: a corner that turns left is cut
off by the chord between its neighbours; an edge between two corners that turn right goes, and its neighbours are
prolonged into the material until they meet. Many are taken at once, in rounds. Each edge knows the traced vertices that
it stands for, so a shift is measured against what was traced, however many steps have passed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Bools, Float64s, Indices
from contour.geometry.rings import Contour, Ring
from contour.geometry.segments import BoxTree, distances_to_segments, near_pairs, segments_meet, self_meetings, turns

_SHARE = 0.25
"""Of the steps that are allowed in a round, the share of the cheapest that is taken: near enough to one at a time."""

_LEAST_COSINE = 0.2
"""Of half the turn at a new tip, about 157 degrees: a sharper one runs far into the material."""


@dataclass(frozen=True, eq=False)
class _Ring:
    """A ring on its way. Edge i runs from points[i] to the next point, and stands for the traced vertices from
    traced[first[i]] to traced[first[i + 1]], both included, all cyclic.
    """

    traced: Ring
    points: Ring
    first: Indices

    def lengths(self) -> Indices:
        """Traced edges that each edge stands for, 1 or more."""
        return np.asarray((np.roll(self.first, -1) - self.first - 1) % len(self.traced) + 1)


@dataclass(frozen=True, eq=False)
class _Step:
    """Vertex `at` of ring `ring` goes, or, with a tip, the edge that begins there; `first`: as in `_Ring`, at the tip.

    `given_up` are the corners of the triangle by which the ring shrinks.
    """

    ring: int
    at: int
    shift: float
    given_up: Float64s
    tip: Float64s | None = None
    first: int = 0

    def footprint(self, count: int) -> tuple[int, ...]:
        """The vertices that it changes or leans on, of `count`."""
        return tuple((self.at + k) % count for k in range(-1, 2 if self.tip is None else 3))

    @property
    def name(self) -> tuple[int, bytes]:
        """The same for the same step in the same place."""
        return self.ring, self.given_up.tobytes()


def reduced(contour: Contour, max_vertices: int, bound: float) -> Contour:
    """A contour within `contour`, of at most `max_vertices` vertices, or as few as steps of at most `bound` allow.

    Exterior counter-clockwise, holes clockwise (y up), fit to be cut; the result is so too.
    """
    rings = [_Ring(ring, ring, np.arange(len(ring))) for ring in contour.rings]
    forbidden: set[tuple[int, bytes]] = set()
    while (excess := sum(len(ring.points) for ring in rings) - max_vertices) > 0:
        steps = [step for k, ring in enumerate(rings) for step in _steps(k, ring, bound) if step.name not in forbidden]
        chosen = _apart(rings, steps, excess)
        if not chosen:
            break
        after, makers = zip(*(_applied(k, ring, chosen) for k, ring in enumerate(rings)), strict=True)
        clashing = _clashing(after, makers, chosen)
        forbidden |= {chosen[k].name for k in clashing}
        if not clashing:
            rings = list(after)
    return Contour(rings[0].points, tuple(ring.points for ring in rings[1:]))


def _apart(rings: Sequence[_Ring], steps: list[_Step], most: int) -> list[_Step]:
    """The cheapest steps that have no vertex in common; at most `most`, and a share of what there is."""
    taken: list[set[int]] = [set() for _ in rings]
    room = [len(ring.points) - 3 for ring in rings]
    chosen: list[_Step] = []
    for step in sorted(steps, key=lambda step: step.shift)[: max(int(len(steps) * _SHARE), 1)]:
        footprint = step.footprint(len(rings[step.ring].points))
        if room[step.ring] > 0 and taken[step.ring].isdisjoint(footprint):
            taken[step.ring].update(footprint)
            room[step.ring] -= 1
            chosen.append(step)
        if len(chosen) == most:
            break
    return chosen


# --- what can be done -------------------------------------------------------------------------------------------------


def _steps(number: int, ring: _Ring, bound: float) -> list[_Step]:
    """All steps of a ring that shift by at most `bound`."""
    if len(ring.points) <= 3:
        return []
    before, after = np.roll(ring.points, 1, axis=0), np.roll(ring.points, -1, axis=0)
    turn = turns(before, ring.points, after)
    return [*_cuts(number, ring, np.flatnonzero(turn >= 0), bound), *_merges(number, ring, turn, bound)]


def _cuts(number: int, ring: _Ring, at: Indices, bound: float) -> list[_Step]:
    """Corners that a chord cuts off."""
    count, lengths = len(ring.points), ring.lengths()
    before, after = ring.points[at - 1], ring.points[(at + 1) % count]
    owner, vertices, begins = _stretches(ring, ring.first[at - 1], lengths[at - 1] + lengths[at])
    shift = _largest(distances_to_segments(vertices, before[owner], after[owner]), begins)
    return [
        _Step(number, int(at[k]), float(shift[k]), np.array([before[k], ring.points[at[k]], after[k]]))
        for k in np.flatnonzero(shift <= bound)
    ]


def _merges(number: int, ring: _Ring, turn: NDArray[np.int8], bound: float) -> list[_Step]:
    """Edges between two corners that turn right, whose neighbours meet in front of them."""
    count = len(ring.points)
    at = np.flatnonzero((turn < 0) & (np.roll(turn, -1) < 0))
    before, here = ring.points[at - 1], ring.points[at]
    there, after = ring.points[(at + 1) % count], ring.points[(at + 2) % count]
    tips, good = _tips(before, here, there, after)
    at, tips = at[good], tips[good]
    before, here, there, after = before[good], here[good], there[good], after[good]
    if len(at) == 0:
        return []
    owner, vertices, begins = _stretches(ring, ring.first[at], ring.lengths()[at])
    # The stretch is divided at its vertex nearest to the tip.
    to_tip = np.hypot(*(vertices - tips[owner]).T)
    nearest = np.minimum.reduceat(to_tip, begins)
    hits = np.flatnonzero(to_tip == nearest[owner])
    once = np.flatnonzero(np.diff(owner[hits], prepend=-1))
    divide = hits[once]
    place = np.arange(len(owner))
    off = np.maximum(
        np.where(place <= divide[owner], distances_to_segments(vertices, before[owner], tips[owner]), 0.0),
        np.where(place >= divide[owner], distances_to_segments(vertices, tips[owner], after[owner]), 0.0),
    )
    away = distances_to_segments(tips[owner], vertices, np.roll(vertices, -1, axis=0))
    away[np.append(begins[1:], len(owner)) - 1] = np.inf  # from the last vertex of one stretch to the first of the next
    shift = np.maximum(_largest(off, begins), np.minimum.reduceat(away, begins))
    first = (ring.first[at] + divide - begins) % len(ring.traced)
    return [
        _Step(number, int(at[k]), float(shift[k]), np.array([here[k], tips[k], there[k]]), tips[k], int(first[k]))
        for k in np.flatnonzero(shift <= bound)
    ]


def _tips(before: Float64s, here: Float64s, there: Float64s, after: Float64s) -> tuple[Float64s, Bools]:
    """Where the edges before -> here and after -> there meet when prolonged, and for which they do, not too far off.

    The tip is exactly on their lines or left of them, so that the new edges take no point from beyond the old ones.
    """
    one, two = here - before, after - there
    one, two = one / np.hypot(*one.T)[:, None], two / np.hypot(*two.T)[:, None]
    cross = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    half = np.hypot(*(one + two).T) / 2
    good = (cross < 0) & (half > _LEAST_COSINE)
    gap = there - here
    along = (gap[:, 0] * two[:, 1] - gap[:, 1] * two[:, 0]) / np.where(good, cross, 1.0)
    inwards = (one - two) / np.where(good, np.hypot(*(one - two).T), 1.0)[:, None]
    ulp = np.spacing(np.abs(np.stack([before, here, there, after])).max(axis=(0, 2)))
    tips = here + one * along[:, None] + inwards * (16 * ulp / np.maximum(half, _LEAST_COSINE))[:, None]
    good &= (turns(before, here, tips) >= 0) & (turns(tips, there, after) >= 0) & (along > 0)
    return tips, np.asarray(good)


def _stretches(ring: _Ring, first: Indices, lengths: Indices) -> tuple[Indices, Float64s, Indices]:
    """The traced vertices of several stretches one after another: whose each is, where it lies, where each begins."""
    begins = np.cumsum(lengths + 1) - (lengths + 1)
    owner = np.repeat(np.arange(len(first)), lengths + 1)
    index = first[owner] + np.arange(len(owner)) - begins[owner]
    return owner, ring.traced[index % len(ring.traced)], begins


def _largest(values: Float64s, begins: Indices) -> Float64s:
    return np.maximum.reduceat(values, begins) if len(begins) else np.zeros(0)


# --- doing it ---------------------------------------------------------------------------------------------------------


def _applied(number: int, ring: _Ring, chosen: list[_Step]) -> tuple[_Ring, Indices]:
    """The ring after its steps, and for each edge the index of the step that made it, -1 for none."""
    points, first = ring.points.copy(), ring.first.copy()
    keep = np.ones(len(points), np.bool_)
    maker = np.full(len(points), -1, np.intp)
    for k, step in enumerate(chosen):
        if step.ring != number:
            continue
        maker[step.at - 1] = k
        if step.tip is None:
            keep[step.at] = False
        else:
            points[step.at], first[step.at], maker[step.at] = step.tip, step.first, k
            keep[(step.at + 1) % len(points)] = False
    return _Ring(ring.traced, points[keep], first[keep]), maker[keep]


def _clashing(rings: Sequence[_Ring], makers: Sequence[Indices], chosen: list[_Step]) -> set[int]:
    """Indices of the steps by which rings meet themselves or each other, or lose a ring that lies within."""
    clashing: set[int] = set()
    trees = [BoxTree.of_ring(ring.points) for ring in rings]
    for k, tree in enumerate(trees):
        for pairs in self_meetings(tree):
            clashing.update(makers[k][pairs].reshape(-1).tolist())
        for m in range(k + 1, len(trees)):
            for i, j in near_pairs(tree, trees[m]):
                meets = segments_meet(tree.start[i], tree.end[i], trees[m].start[j], trees[m].end[j])
                clashing.update(makers[k][i[meets]].tolist() + makers[m][j[meets]].tolist())
    if len(rings) > 1:
        clashing |= _swallowing(rings, chosen)
    return clashing - {-1}


def _swallowing(rings: Sequence[_Ring], chosen: list[_Step]) -> set[int]:
    """Indices of the steps whose triangle holds a vertex of another ring."""
    triangles = np.array([step.given_up for step in chosen])
    owner = np.array([step.ring for step in chosen])
    found: set[int] = set()
    for k, ring in enumerate(rings):
        offset = triangles - ring.points[0]
        onward = np.roll(offset, -1, axis=1)
        side = np.sign(offset[..., 0] * onward[..., 1] - offset[..., 1] * onward[..., 0])
        holds = np.abs(side.sum(axis=1)) == 3
        found.update(np.flatnonzero(holds & (owner != k)).tolist())
    return found
