"""Corners that the walls seen behind them speak against, cut so far that neither reading is a pitch off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contour.outline_joints import Flags, Joints, ends
from contour.outline_models import Index, feet
from contour.outline_segments import Segments
from contour.outline_witnesses import Witnesses

# Of the way from the chord to the corner: of a cut-off corner no witness reached more than four tenths, of other
# corners they did six tenths and more (600 random scenes).
_LOW = 0.45
_FEWEST = 2
# What a bevel leaves out of a corner that is there after all, pitches.
_LEAVES_OUT = 0.85


def bevelled(witnesses: Witnesses, segments: Segments, found: Joints, inlier: Flags) -> Joints:
    """The joints with doubtful convex corners cut parallel to the chord between the last witnesses on their edges.

    A corner is doubtful where two or more witnesses lie on neither edge, all of them near that chord, and one is no
    wall end but the side of a whole cell. Either the corner was cut off there or its cell is missing; but a cell torn
    out takes its walls along, and those that led to it are left as ends. The labelling holds the two for about equally
    likely. The bevel follows the witnesses as closely as it may without leaving a pitch out of a corner that is whole.
    """
    first, last = ends(witnesses, segments, inlier)
    begin, end = found.begin.copy(), found.end.copy()
    for k in range(len(segments)):
        after = (k + 1) % len(segments)
        corner, near, far = found.end[k], last[k], first[after]
        chord = far - near
        if found.begin[k] != corner or not abs(chord):
            continue
        outwards = -1j * chord / abs(chord)
        depth = ((corner - near) * outwards.conjugate()).real
        if depth <= _LEAVES_OUT * witnesses.pitch:
            continue
        behind = _between(segments, inlier, k, after)
        height = ((witnesses.points[behind] - near) * outwards.conjugate()).real
        if len(behind) < _FEWEST or witnesses.clean[behind].all() or height.max() > _LOW * depth:
            continue
        share = max(float(height.max()), depth - _LEAVES_OUT * witnesses.pitch) / depth
        end[k] = feet(segments.models.take(k), near + share * (corner - near))[0]
        begin[k] = feet(segments.models.take(after), far + share * (corner - far))[0]
    return replace(found, end=end, begin=begin)


def _between(segments: Segments, inlier: Flags, before: int, after: int) -> Index:
    """Witnesses after the last inlier of one segment and before the first of the next; none where either has none."""
    of_before, of_after = ((segments.first[k] + np.arange(segments.length[k])) % len(inlier) for k in (before, after))
    if not inlier[of_before].any() or not inlier[of_after].any():
        return np.zeros(0, dtype=np.intp)
    ending = int(np.flatnonzero(inlier[of_before])[-1]) + 1
    beginning = int(np.flatnonzero(inlier[of_after])[0])
    return np.concatenate([of_before[ending:], of_after[:beginning]])
