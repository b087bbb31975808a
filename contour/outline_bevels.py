"""Corners that the wall ends seen behind them speak against, cut part of the way back to those ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contour.outline_joints import Flags, Joints, ends
from contour.outline_models import Complex, Index, feet
from contour.outline_segments import Segments
from contour.outline_witnesses import Witnesses

# Of the way from the chord to the corner: of a cut-off corner no witness reached more than four tenths, of other
# corners they did six tenths and more (600 random scenes).
_LOW = 0.45
# Sharper corners (chord over depth of a right angle: 2), as a crescent's horns, are narrower than a cell for more than
# a pitch, and show little of their walls.
_SHARP = 1.2
# A corner nearer than this to what was seen is drawn whole: less is at stake than by cutting it, pitches.
_AT_STAKE = 0.85
# The most that a bevel leaves out of a corner that is there after all, pitches.
_LEAVES_OUT = 0.9
# Farther out than this a cut shows so many ends that the fit sees an edge in them, pitches.
_CUT_SHOWS = 1.25


def bevelled(witnesses: Witnesses, segments: Segments, found: Joints, inlier: Flags) -> Joints:
    """The joints with doubtful convex corners cut parallel to the chord between the last witnesses on their edges.

    A corner is doubtful where it lies far outside of all that was seen of it, while something was seen between that
    chord and the corner, near the chord. Either the corner was cut off there, or its cell is missing; the labelling
    holds the two for about equally likely. Corners behind which nothing was seen were all there (600 random scenes).
    """
    first, last = ends(witnesses, segments, inlier)
    begin, end = found.begin.copy(), found.end.copy()
    for k in range(len(segments)):
        after = (k + 1) % len(segments)
        corner, near, far = complex(found.end[k]), complex(last[k]), complex(first[after])
        chord = far - near
        if found.begin[k] != corner or not abs(chord):
            continue
        outwards = -1j * chord / abs(chord)
        depth = ((corner - near) * outwards.conjugate()).real
        if depth <= 0.5 * witnesses.pitch or abs(chord) < _SHARP * depth:
            continue
        behind = _between(segments, inlier, k, after)
        height = ((witnesses.points[behind] - near) * outwards.conjugate()).real
        if not (height > 0.0).any() or height.max() > _LOW * depth:
            continue
        at_stake = _distance(corner, near, far, witnesses.points[behind[height > 0.0]]) / witnesses.pitch
        left_out = _left_out(at_stake, bool(witnesses.clean[behind].all())) * witnesses.pitch
        if left_out <= 0.0:
            continue
        share = 1.0 - left_out / _distance(corner, near, far, np.zeros(0, dtype=np.complex128))
        cut = np.array([near + share * (corner - near), far + share * (corner - far)])
        end[k], begin[k] = feet(segments.models.take(np.array([k, after])), cut)[0]
    return replace(found, end=end, begin=begin)


def _left_out(at_stake: float, only_ends: bool) -> float:
    """How much of a doubtful corner is cut off, all in pitches; `at_stake` is how far it lies off what was seen.

    Torn out cells leave ends of the walls that led to them, so where only ends were seen the corner is cut no further
    than less than a pitch is wrong if it is a cut. Where the side of a whole cell stands behind it, halfway.
    """
    if at_stake <= _AT_STAKE:
        return 0.0
    if only_ends:
        return at_stake - _AT_STAKE if at_stake < _CUT_SHOWS else 0.0
    return min(0.5 * at_stake, _LEAVES_OUT)


def _distance(corner: complex, near: complex, far: complex, between: Complex) -> float:
    """Distance of a corner from the convex chain that runs from `near` to `far` around the points between them."""
    along = (far - near) / abs(far - near)
    points = between[np.argsort(((between - near) * along.conjugate()).real)]
    chain = [near]
    for point in (*points, far):
        # Material lies on the left: what turns left at its last point bulges outwards.
        while len(chain) > 1 and ((chain[-1] - chain[-2]).conjugate() * (point - chain[-1])).imag <= 0.0:
            chain.pop()
        chain.append(complex(point))
    start, stop = np.array(chain[:-1]), np.array(chain[1:])
    way = stop - start
    share = np.clip(((corner - start) * way.conj()).real / np.maximum(np.abs(way) ** 2, 1e-12), 0.0, 1.0)
    return float(np.abs(corner - start - share * way).min())


def _between(segments: Segments, inlier: Flags, before: int, after: int) -> Index:
    """Witnesses after the last inlier of one segment and before the first of the next; none where either has none."""
    of_before, of_after = ((segments.first[k] + np.arange(segments.length[k])) % len(inlier) for k in (before, after))
    if not inlier[of_before].any() or not inlier[of_after].any():
        return np.zeros(0, dtype=np.intp)
    ending = int(np.flatnonzero(inlier[of_before])[-1]) + 1
    beginning = int(np.flatnonzero(inlier[of_after])[0])
    return np.concatenate([of_before[ending:], of_after[:beginning]])
