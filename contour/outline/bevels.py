"""Corners that what was seen behind them speaks against, cut part of the way back to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contour.geometry.arrays import Bools, Complexes, Float64s, Indices
from contour.outline.corners import Joints, ends
from contour.outline.lines_and_arcs import feet
from contour.outline.runs import Segments
from contour.outline.witnesses import Witnesses

# Unseen area of a corner, square pitches (a cell has 0.87). Up to the first it is what a lost cell and the edges
# beside it leave, or a horn that is narrower than a cell; from the second on, more than two cells would have to be lost
# in one place, and from the third on where nothing at all was seen behind the corner.
_ONE_CELL, _TWO_CELLS, _CELLS_UNSEEN = 1.0, 2.2, 2.6
# With the side of a whole cell behind it, a corner of which so much is unseen was always cut (600 random scenes).
_BEHIND_CELLS = 1.3
# A corner nearer than this to what was seen is drawn whole: less is at stake than by cutting it, pitches.
_AT_STAKE = 0.85
# One that lies farther from what was seen, and of which more is unseen, is drawn whole but not told. Of 240 right
# outlines one has 0.84 pitches and 0.71 square ones; a bevel that was drawn as a corner had 0.85 and 0.83.
_UNTOLD, _UNTOLD_AREA = 0.75, 0.75
# The most that a bevel leaves out of a corner that may be there after all, pitches, and where that is as likely as not.
_MOST_LEFT_OUT, _LEAVES_OUT = 0.95, 0.9
# Walls that stand no higher above the chord are those of the edges, and ends no lower stand at it, pitches.
_NEAR_CHORD = 0.05


@dataclass(frozen=True)
class _Corner:
    """What is unseen of a corner: area in square pitches; its distance from what was seen, at all and across the chord
    behind it, and from that chord, pitches. anything: whether anything was seen at that chord or beyond it. only_ends:
    nothing but clean wall ends was seen behind it.
    """

    area: float
    distance: float
    clear: float
    depth: float
    anything: bool
    only_ends: bool


def bevelled(
    witnesses: Witnesses, segments: Segments, found: Joints, inlier: Bools, material: Complexes
) -> tuple[Joints, Complexes]:
    """The joints with doubtful convex corners cut parallel to the chord between the last witnesses on their edges, and
    those corners, and others that may be cut as well, shape (K,): whole or cut, each may be up to a cell off.

    `material`: points of all walls near the edge, and of what else may be material. A corner of which much was not seen
    was cut off, or its cells are missing. Which of the two is told by how much that is: a cell, or more.
    """
    first, last = ends(witnesses, segments, inlier)
    begin, end = found.begin.copy(), found.end.copy()
    untold: list[complex] = []
    for k in range(len(segments)):
        after = (k + 1) % len(segments)
        corner, near, far = complex(found.end[k]), complex(last[k]), complex(first[after])
        if found.begin[k] != corner or abs(far - near) < 1e-9:
            continue
        unseen = _unseen(witnesses, between(segments, inlier, k, after), material, corner=corner, near=near, far=far)
        left_out = _left_out(unseen)
        if left_out > 0.0 or _may_be_cut(unseen):
            untold.append(corner)
        if left_out <= 0.0:
            continue
        share = 1.0 - left_out / unseen.depth
        cut = np.array([near + share * (corner - near), far + share * (corner - far)])
        end[k], begin[k] = feet(segments.models.take(np.array([k, after])), cut)[0]
    return replace(found, end=end, begin=begin), np.array(untold, np.complex128)


def _may_be_cut(corner: _Corner) -> bool:
    """Whether so much of a corner that is drawn whole is unseen that it may as well be cut off."""
    return corner.anything and corner.distance > _UNTOLD and corner.area > _UNTOLD_AREA


def _left_out(corner: _Corner) -> float:
    """How much of a corner is cut off across the chord behind it, pitches, at most back to what was seen.

    So that less than a pitch is wrong whether it is cut or whole, as long as there is room for that: torn out cells
    leave ends of the walls that led to them, so where only ends were seen no more is cut than that takes. Where the
    side of a whole cell stands behind the corner, half of it or the most; where more cells would be lost than ever are,
    the most.
    """
    if corner.distance <= _AT_STAKE or corner.area < (_ONE_CELL if corner.anything else _CELLS_UNSEEN):
        return 0.0
    if corner.area > _TWO_CELLS:
        hopeless = corner.distance > _MOST_LEFT_OUT + _AT_STAKE
        return corner.clear if hopeless else min(_MOST_LEFT_OUT, corner.clear)
    if corner.only_ends:
        return min(corner.distance - _AT_STAKE, corner.clear)
    likely = 1.0 if corner.area > _BEHIND_CELLS else 0.5
    return min(likely * corner.distance, _LEAVES_OUT, corner.clear)


def _unseen(
    witnesses: Witnesses, between: Indices, material: Complexes, *, corner: complex, near: complex, far: complex
) -> _Corner:
    """What lies between a corner and the convex chain from `near` to `far` around all that was seen in it."""
    along = (far - near) / abs(far - near)
    depth = ((corner - near) * (-1j * along).conjugate()).real
    if depth <= 0.0:
        return _Corner(0.0, 0.0, 0.0, 0.0, anything=False, only_ends=True)

    def height(points: Complexes) -> Float64s:
        """How far points lie beyond the chord, towards the corner."""
        return np.asarray(-((points - near) * along.conjugate()).imag, np.float64)

    ahead, behind = corner - near, far - corner
    within = (
        (height(material) > 0.0)
        & ((ahead.conjugate() * (material - near)).imag > 0.0)
        & ((behind.conjugate() * (material - corner)).imag > 0.0)
    )
    seen = np.concatenate([witnesses.points[between], material[within]])
    chain = _around(near, far, seen[height(seen) > 0.0])
    start, stop = chain[:-1], chain[1:]
    way = stop - start
    share = np.clip(((corner - start) * way.conj()).real / np.maximum(np.abs(way) ** 2, 1e-12), 0.0, 1.0)
    area = 0.5 * float(((start - corner).conj() * (stop - corner)).imag.sum())
    pitch_px = witnesses.pitch_px
    highest = float(height(chain).max())
    ends_at = height(witnesses.points[between]) > -_NEAR_CHORD * pitch_px
    return _Corner(
        abs(area) / pitch_px**2,
        float(np.abs(corner - start - share * way).min()) / pitch_px,
        (depth - highest) / pitch_px,
        depth / pitch_px,
        anything=highest > _NEAR_CHORD * pitch_px or bool(ends_at.any()),
        only_ends=bool(witnesses.clean[between].all()),
    )


def _around(near: complex, far: complex, points: Complexes) -> Complexes:
    """The convex chain from `near` to `far` around the points between them."""
    along = (far - near) / abs(far - near)
    chain = [near]
    for point in (*points[np.argsort(((points - near) * along.conjugate()).real)], far):
        # Material lies on the left: what turns left at its last point bulges outwards.
        while len(chain) > 1 and ((chain[-1] - chain[-2]).conjugate() * (point - chain[-1])).imag <= 0.0:
            chain.pop()
        chain.append(complex(point))
    return np.array(chain)


def between(segments: Segments, inlier: Bools, before: int, after: int) -> Indices:
    """Witnesses after the last inlier of one segment and before the first of the next; none where either has none."""
    of_before, of_after = (segments.members(k, len(inlier)) for k in (before, after))
    if not inlier[of_before].any() or not inlier[of_after].any():
        return np.zeros(0, dtype=np.intp)
    ending = int(np.flatnonzero(inlier[of_before])[-1]) + 1
    beginning = int(np.flatnonzero(inlier[of_after])[0])
    return np.concatenate([of_before[ending:], of_after[:beginning]])
