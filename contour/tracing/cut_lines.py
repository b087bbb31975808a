"""Straight cuts through a border that closes its cells elsewhere: where material touches a line at every cell and what
lies between differs, or ends of walls lie in a row, from the first thing that touches their line to the last.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float64s
from contour.geometry.rings import densified
from contour.geometry.segments import BoxTree, distances_to_ring, distances_to_tree
from contour.image.opencv import fewer_vertices
from contour.material.closed_cells import MaterialEdge, closed_along
from contour.tracing.edge_kind import side_px, sure_ends
from contour.walls.wall_evidence import BlockEvidence

# Ends of walls and corners of cells lie within this of the line they were cut along, and nothing stands out of it.
_NEAR_PX, _NEAR_PITCHES = 1.2, 0.04
# Pixels of a wall's end, which blur rounds, lie inside of it.
_OUT_PX, _ROUND_PX = 1.0, 1.0
# Over an opened cell nothing touches the line for as long: over-expanded ones are 1.45 pitches wide.
_OPEN_PITCHES = 2.0
# A line through two ends is always found; through three only along a cut.
_FEWEST_ENDS, _FEWEST_MORE = 2, 3
_LEAST_APART_PITCHES = 0.5
_FITS = 3
# Ends that are left lie at the corners, and the outline passes these.
_LEFT_PX, _CORNER_PITCHES = 3.0, 0.4
# A cut as long as the first is touched at every cell, so far apart at most (of 80 lattices cut once the most is 1.12).
# So are rows of closed cells, whose openings are alike: of those so deep the second deepest and the second shallowest
# differ by 0.09 at most in 78 closed borders, by 0.11 or more in cut ones. In pitches: a lens bends rows by as much as
# still counts as near. And by more than pixels make of what is alike: closed cells of 6 to 12 px passed for cut. Rows
# of flexed cells wave, but leave shallow openings: 0.31 where they differed by more; the second deepest of 27 cuts is
# 0.51 or more. Along a cut that runs nearly along a row openings grow by as much, steadily, from one end to the other;
# those of 56 closed borders by 0.07 at most where they are so deep.
_LEAST_LONG, _TOUCHED, _OPENING, _DIFFER, _DEEP = 4.0, 1.25, 0.15, 0.1, 0.4
_DIFFER_PX, _OPENING_PX, _ALONG_PX = 3.0, 1.0, 0.5
_FEWEST_OPENINGS, _FEWEST_GROWING, _STEADY = 4, 5, 0.25
# A closed sheet has no openings along its edges (none of 80), so that two tell of a cut, also of a short one.
_LEAST_LONG_ALIKE, _FEWEST_ALIKE = 2.0, 2
# Teeth of closed triangles are as deep as these are high, 0.73 of that where blur rounds tips and roots (of four); what
# is shallower was cut (0.47 and 0.51 of two). Blur takes pixels, more of fine ones: 0.59 of 13 px was left of one, 0.53
# of 11 px was cut.
_SHALLOW, _FEWEST_SHALLOW, _BLUNT_PX = 0.6, 3, 1.0


def with_cuts(material: MaterialEdge, seen: BlockEvidence, touched: list[Float64s]) -> MaterialEdge | None:
    """The outline around material along straight cuts where these opened its cells, those that are `touched` or else
    those that ends of walls lie on; None where ends lie on no such cut, or beyond its last corner, or where the outline
    leaves out a corner: a sliver of a wall.
    """
    ring = seen.rings[0]
    sure = sure_ends(material, ring, seen)
    lines = touched or straight_cuts(
        material, ring.points[sure], ring.normal[sure], seen.pitch_px, open_px=_OPEN_PITCHES * side_px(seen)
    )
    if not lines:
        return None
    cuts = np.concatenate(lines)
    closed = closed_along(material, cuts, seen.pitch_px)
    left = ring.points[sure_ends(closed, ring, seen)]
    off = distances_to_tree(left, BoxTree.of_segments(cuts[:, 0], cuts[:, 1])) if len(left) else np.empty(0)
    corners = distances_to_ring(cuts.reshape(-1, 2), closed.contour.exterior)
    return None if (off > _LEFT_PX).any() or (corners > _CORNER_PITCHES * seen.pitch_px).any() else closed


def touched_cuts(
    material: MaterialEdge, pitch_px: float, *, alike: bool = False, tooth_px: float = 0.0
) -> list[Float64s]:
    """Straight cuts along edges of the material's convex hull, pixels, (1, 2, 2) each: touched at every cell, with
    openings between that differ, or may be `alike`, as where what is closed has none, or are shallower than those
    between `tooth_px` deep teeth of closed cells.

    They need no ends of walls: where walls meet a saw at a slant, none is seen to end. A closed border that runs along
    rows of cells is touched as often, but its openings are alike; along other directions it is touched more seldom.
    """
    near = _NEAR_PX + _NEAR_PITCHES * pitch_px
    border = np.concatenate([densified(ring, 0.5) for ring in material.border])
    hull = cv2.convexHull(border.astype(np.float32))[:, 0].astype(np.float64)
    corners = fewer_vertices(hull, near)
    least = near + _OPENING_PX if alike else max(_OPENING * pitch_px, near + _OPENING_PX)
    cuts = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        length = float(np.hypot(*(end - start)))
        along = (end - start) / length
        out = np.array([along[1], -along[0]])
        line = _Line(start, along, out * np.sign(out @ (start - corners.mean(axis=0))), np.zeros(0, np.bool_))
        long = length > (_LEAST_LONG_ALIKE if alike else _LEAST_LONG) * pitch_px
        openings = _openings(material.apart.region, line, length, near, pitch_px) if long else np.empty((0, 3))
        if _opened(openings[openings[:, 1] > least], pitch_px, tooth_px, alike=alike):
            cuts.append(_from_corner_to_corner(border, np.empty((0, 2)), line, near, _OPEN_PITCHES * pitch_px))
    return [cut for cut in cuts if len(cut)]


def _opened(openings: Float64s, pitch_px: float, tooth_px: float, *, alike: bool) -> bool:
    """Whether `openings` so deep, (N, 3), pixels, were cut into cells: they differ or grow, and two are deep, or may be
    `alike`, or one at most is as deep as those between teeth.
    """
    depths = np.sort(openings[:, 1])
    shallow = np.count_nonzero(depths < _SHALLOW * (tooth_px - _BLUNT_PX))
    if shallow >= _FEWEST_SHALLOW and shallow >= len(depths) - 1:
        return True
    if alike:
        return len(depths) >= _FEWEST_ALIKE
    if len(depths) < _FEWEST_OPENINGS or depths[-2] <= _DEEP * pitch_px:
        return False
    differ = max(_DIFFER * pitch_px, _DIFFER_PX)
    return bool(depths[-2] - depths[1] >= differ or _growth(openings[:, 0], openings[:, 2]) >= differ)


def _growth(place: Float64s, depth: Float64s) -> float:
    """By how much openings grow from one end of a line to the other, by place and depth, (N,), pixels; 0 where they do
    not steadily.
    """
    if len(place) < _FEWEST_GROWING:
        return 0.0
    slope, first = np.polyfit(place, depth, 1)
    growth = abs(float(slope)) * float(np.ptp(place))
    return growth if np.std(depth - first - slope * place) < _STEADY * growth else 0.0


def _openings(region: Bytes, line: _Line, length: float, near: float, pitch_px: float) -> Float64s:
    """Where openings are along a line, how deep they are behind it, and behind what touches it on both sides, (N, 3),
    in its direction, where the region touches the line within `near` at every cell over its `length` from its point on,
    all in pixels; none where it does not.
    """
    # How far behind the line the region begins.
    depth = np.arange(-near, 1.5 * pitch_px, _ALONG_PX)
    place = np.arange(0.0, length, _ALONG_PX)
    x, y = (line.middle[k] + place[:, None] * line.along[k] - depth * line.out[k] for k in (0, 1))
    there = cv2.remap(region, x.astype(np.float32), y.astype(np.float32), cv2.INTER_NEAREST) > 0
    begins = np.where(there.any(axis=1), depth[there.argmax(axis=1)], depth[-1])
    runs = np.split(np.arange(len(begins)), np.flatnonzero(np.diff(begins > near)) + 1)
    openings = [run for run in runs if begins[run[0]] > near]
    touching = [run for run in runs if begins[run[0]] <= near]
    if not openings or not touching or max(map(len, openings)) * _ALONG_PX > _TOUCHED * pitch_px:
        return np.empty((0, 3))
    tips = np.array([(run.mean(), begins[run].min()) for run in touching])
    middle, deepest = np.array([(run.mean(), begins[run].max()) for run in openings]).T
    return np.column_stack([middle * _ALONG_PX, deepest, deepest - np.interp(middle, *tips.T)])


def straight_cuts(
    material: MaterialEdge, ends: Float64s, normals: Float64s, pitch_px: float, *, open_px: float
) -> list[Float64s]:
    """Straight cuts that `ends` of walls, (N, 2), pixels, lie on: for each line, most ends first, from corner to corner
    of the material, (K, 2, 2), more than one where it crosses a dent.

    normals: unit vectors outwards at each end, (N, 2). A line that material stands out of is no cut, and a cut ends
    where nothing touches it for `open_px` pixels.
    """
    border = np.concatenate([densified(ring, 0.5) for ring in material.border])
    near = _NEAR_PX + _NEAR_PITCHES * pitch_px
    lines: list[Float64s] = []
    while len(ends) >= (_FEWEST_MORE if lines else _FEWEST_ENDS):
        line = _line(ends, normals, near, _LEAST_APART_PITCHES * pitch_px)
        if line is None or line.on_it.sum() < (_FEWEST_MORE if lines else _FEWEST_ENDS):
            break
        cuts = _from_corner_to_corner(border, ends, line, near, open_px)
        if not len(cuts):
            break
        lines.append(cuts)
        ends, normals = ends[~line.on_it], normals[~line.on_it]
    return lines


@dataclass(frozen=True, eq=False)
class _Line:
    """A point of a line, the unit vectors along it and out of the material, (2,) each, and which ends lie on it."""

    middle: Float64s
    along: Float64s
    out: Float64s
    on_it: Bools


def _line(ends: Float64s, normals: Float64s, near: float, apart: float) -> _Line | None:
    """The line that most ends lie on, of all through two that are `apart` pixels apart."""
    one, other = np.triu_indices(len(ends), 1)
    step = ends[other] - ends[one]
    far = np.hypot(step[:, 0], step[:, 1]) > apart
    if not far.any():
        return None
    one, step = one[far], step[far] / np.hypot(step[far, 0], step[far, 1])[:, None]
    across = np.stack([-step[:, 1], step[:, 0]], axis=1)
    off = ends @ across.T - (ends[one] * across).sum(axis=1)
    on_it = np.abs(off[:, np.argmax((np.abs(off) < near).sum(axis=0))]) < near
    for _ in range(_FITS):
        middle = ends[on_it].mean(axis=0)
        along = np.linalg.svd(ends[on_it] - middle)[2][0]
        out = np.array([-along[1], along[0]])
        again = np.abs((ends - middle) @ out) < near
        if np.count_nonzero(again) < _FEWEST_ENDS:
            break
        on_it = again
    outwards = 1.0 if out @ normals[on_it].sum(axis=0) > 0 else -1.0
    return _Line(middle, along, outwards * out, on_it)


def _from_corner_to_corner(border: Float64s, ends: Float64s, line: _Line, near: float, gap: float) -> Float64s:
    """Where the border, (M, 2), touches the line first and last without `gap` pixels between, (K, 2, 2); empty where
    one of its ends is not among that, or material stands out of the line there.

    Where nothing stands out of the line anywhere, all that touches it was cut along it; else what has ends.
    """
    place, off = (border - line.middle) @ line.along, (border - line.middle) @ line.out
    touching = np.sort(place[(off < near) & (off > -near - _ROUND_PX)])
    own = (ends[line.on_it] - line.middle) @ line.along
    beyond = place[off > near + _OUT_PX]
    cuts, left = [], np.ones(len(own), np.bool_)
    for run in np.split(touching, np.flatnonzero(np.diff(touching) > gap) + 1):
        its = (own > run[0] - gap) & (own < run[-1] + gap) if len(run) else left & False
        if not len(run) or (len(beyond) and not its.any()):
            continue
        if ((beyond > run[0]) & (beyond < run[-1])).any():
            return np.empty((0, 2, 2))
        left &= ~its
        cuts.append(line.middle + np.outer([run[0], run[-1]], line.along))
    return np.empty((0, 2, 2)) if left.any() else np.array(cuts).reshape(-1, 2, 2)
