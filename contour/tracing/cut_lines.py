"""Straight cuts through a border that closes its cells elsewhere: where material touches a line at every cell and what
lies between differs, or ends of walls lie in a row, from the first thing that touches their line to the last.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float64s, median
from contour.geometry.rings import densified
from contour.geometry.segments import BoxTree, distances_to_ring, distances_to_tree
from contour.image.opencv import fewer_vertices
from contour.material.closed_cells import MaterialEdge, closed_along
from contour.tracing.edge_kind import border_tips, side_px, sure_ends
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
# Ends that are left lie at the corners, and the outline passes these. Blur moves ends of walls off the line by more
# than still touches it.
_LEFT_PX, _CORNER_PITCHES, _SHORT_PITCHES = 3.0, 0.4, 0.25
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
# Closed cells that touch the line have walls as thick as each other there, within 1.2 px (of 23 rows with openings as
# deep as a cut's), whatever their openings are like; a saw leaves less and less of them, or little of one and much of
# the next. What touches it over a pixel or two is no wall's side, nor is a wall's end at a corner, which another cut
# left.
_FEWEST_WALLS, _THICKER, _THICKER_PX, _GROWING, _GROWING_PX = 3, 0.5, 2.0, 0.2, 0.75
_THICKEST, _WALL_PX, _SIDE, _DEEP_THIN = 0.5, 3.0, 0.35, 0.33
# A closed sheet has no openings along its edges (none of 80), so that two tell of a cut, also of a short one.
_LEAST_LONG_ALIKE, _FEWEST_ALIKE = 2.0, 2
# Teeth of closed triangles are as deep as these are high, 0.73 of that where blur rounds tips and roots (of four); what
# is shallower was cut (0.47 and 0.51 of two). Blur takes pixels, more of fine ones: 0.59 of 13 px was left of one, 0.53
# of 11 px was cut.
_SHALLOW, _FEWEST_SHALLOW, _BLUNT_PX = 0.6, 3, 1.0
_NOTHING = np.empty((0, 3)), np.empty((0, 2))


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
    closed = closed_along(material, _to_walls(cuts, material, seen), seen.pitch_px)
    left = ring.points[sure_ends(closed, ring, seen)]
    off = distances_to_tree(left, BoxTree.of_segments(cuts[:, 0], cuts[:, 1])) if len(left) else np.empty(0)
    corners = distances_to_ring(cuts.reshape(-1, 2), closed.contour.exterior)
    return None if (off > _LEFT_PX).any() or (corners > _CORNER_PITCHES * seen.pitch_px).any() else closed


def _to_walls(cuts: Float64s, material: MaterialEdge, seen: BlockEvidence) -> Float64s:
    """Cuts, (N, 2, 2), and from the ends of walls that stop short of them, as blur moves ends, to them, (M, 2, 2)."""
    tips = border_tips(material, seen)
    short = []
    for start, end in cuts:
        step = end - start
        place = np.clip((tips - start) @ step / max(float(step @ step), 1e-9), 0.0, 1.0)
        foot = start + place[:, None] * step
        near = np.hypot(*(tips - foot).T) < _SHORT_PITCHES * seen.pitch_px
        short.append(np.stack([tips[near], foot[near]], axis=1))
    return np.concatenate([cuts, *short])


def touched_cuts(
    material: MaterialEdge, pitch_px: float, *, alike: bool = False, tooth_px: float = 0.0
) -> list[Float64s]:
    """Straight cuts along edges of the material's convex hull, pixels, (1, 2, 2) each: touched at every cell, with
    openings between that differ, or may be `alike`, as where what is closed has none, or are shallower than those
    between `tooth_px` deep teeth of closed cells.

    They need no ends of walls: where walls meet a saw at a slant, none is seen to end. A closed border that runs along
    rows of cells is touched as often, but its openings are alike; along other directions it is touched more seldom.
    """
    border, corners, near = _border(material, pitch_px)
    least = near + _OPENING_PX if alike else max(_OPENING * pitch_px, near + _OPENING_PX)
    cuts = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        length = float(np.hypot(*(end - start)))
        along = (end - start) / length
        out = np.array([along[1], -along[0]])
        line = _Line(start, along, out * np.sign(out @ (start - corners.mean(axis=0))), np.zeros(0, np.bool_))
        long = length > (_LEAST_LONG_ALIKE if alike else _LEAST_LONG) * pitch_px
        openings, walls = _openings(material, line, length, near, pitch_px) if long else _NOTHING
        if _opened(openings[openings[:, 1] > least], walls, pitch_px, tooth_px, alike=alike):
            cuts.append(_from_corner_to_corner(border, np.empty((0, 2)), line, near, _OPEN_PITCHES * pitch_px))
    return [cut for cut in cuts if len(cut)]


def _opened(openings: Float64s, walls: Float64s, pitch_px: float, tooth_px: float, *, alike: bool) -> bool:
    """Whether `openings` so deep, (N, 3), pixels, were cut into cells: they differ or grow, or `walls` between them do,
    (M, 2), pixels, and two are deep, or may be `alike`, or one at most is as deep as those between teeth.
    """
    depths = np.sort(openings[:, 1])
    shallow = np.count_nonzero(depths < _SHALLOW * (tooth_px - _BLUNT_PX))
    if shallow >= _FEWEST_SHALLOW and shallow >= len(depths) - 1:
        return True
    if alike:
        return len(depths) >= _FEWEST_ALIKE
    second = depths[-2] if len(depths) > 1 else 0.0
    differ = max(_DIFFER * pitch_px, _DIFFER_PX)
    deep = second > _DEEP * pitch_px and len(depths) >= _FEWEST_OPENINGS
    unlike = deep and (depths[-2] - depths[1] >= differ or _growth(openings[:, 0], openings[:, 2]) >= differ)
    # Tips of triangles touch it, whose thickness is that of teeth.
    thinned = second > _DEEP_THIN * pitch_px and tooth_px == 0.0 and _thinned(walls)
    return bool(unlike or thinned)


def _thinned(walls: Float64s) -> bool:
    """Whether a saw took some of walls, where they are and how thick, (M, 2), pixels: more and more, or much of one."""
    if len(walls) < _FEWEST_WALLS:
        return False
    place, thick = walls.T
    usual = median(thick)
    spread, growth = float(np.ptp(thick)), _growth(place, thick)
    return spread > max(_THICKER_PX, _THICKER * usual) or growth > max(_GROWING_PX, _GROWING * usual)


def _growth(place: Float64s, depth: Float64s) -> float:
    """By how much openings grow from one end of a line to the other, by place and depth, (N,), pixels; 0 where they do
    not steadily.
    """
    if len(place) < _FEWEST_GROWING:
        return 0.0
    slope, first = np.polyfit(place, depth, 1)
    growth = abs(float(slope)) * float(np.ptp(place))
    return growth if np.std(depth - first - slope * place) < _STEADY * growth else 0.0


def _openings(
    material: MaterialEdge, line: _Line, length: float, near: float, pitch_px: float
) -> tuple[Float64s, Float64s]:
    """Where openings are along a line, how deep they are behind it, and behind what touches it on both sides, (N, 3),
    in its direction, where material touches the line within `near` at every cell over its `length` from its point on;
    and where and how thick what touches it is before the cell behind it, (M, 2): all in pixels; none where it does not.
    """
    # How far behind the line the material begins, and the cells behind that.
    depth = np.arange(-near, 1.5 * pitch_px, _ALONG_PX)
    place = np.arange(0.0, length, _ALONG_PX)
    x, y = ((line.middle[k] + place[:, None] * line.along[k] - depth * line.out[k]).astype(np.float32) for k in (0, 1))

    def first(region: Bytes) -> Float64s:
        there = cv2.remap(region, x, y, cv2.INTER_NEAREST) > 0
        return np.asarray(np.where(there.any(axis=1), depth[there.argmax(axis=1)], depth[-1]), np.float64)

    begins = first(material.apart.region)
    runs = np.split(np.arange(len(begins)), np.flatnonzero(np.diff(begins > near)) + 1)
    openings = [run for run in runs if begins[run[0]] > near]
    touching = [run for run in runs if begins[run[0]] <= near]
    if not openings or not touching or max(map(len, openings)) * _ALONG_PX > _TOUCHED * pitch_px:
        return _NOTHING
    tips = np.array([(run.mean(), begins[run].min()) for run in touching])
    middle, deepest = np.array([(run.mean(), begins[run].max()) for run in openings]).T
    found = np.column_stack([middle * _ALONG_PX, deepest, deepest - np.interp(middle, *tips.T)])
    cells = first(material.apart.openings)
    sides = [
        run
        for run in touching
        if len(run) * _ALONG_PX > (_SIDE * pitch_px if run is touching[0] or run is touching[-1] else _WALL_PX)
    ]
    inner = [run[len(run) // 4 : len(run) - len(run) // 4] for run in sides]
    walls = np.array([(run.mean() * _ALONG_PX, median(cells[run] - begins[run])) for run in inner]).reshape(-1, 2)
    return found, walls[walls[:, 1] < _THICKEST * pitch_px]


def straight_cuts(
    material: MaterialEdge, ends: Float64s, normals: Float64s, pitch_px: float, *, open_px: float
) -> list[Float64s]:
    """Straight cuts that `ends` of walls, (N, 2), pixels, lie on: for each line, most ends first, from corner to corner
    of the material, (K, 2, 2), more than one where it crosses a dent.

    normals: unit vectors outwards at each end, (N, 2). A line that material stands out of is no cut, and a cut ends
    where nothing touches it for `open_px` pixels.
    """
    border, corners, near = _border(material, pitch_px)
    lines: list[Float64s] = []
    while len(ends) >= (_FEWEST_MORE if lines else _FEWEST_ENDS):
        line = _line(ends, normals, near, _LEAST_APART_PITCHES * pitch_px)
        if line is None or line.on_it.sum() < (_FEWEST_MORE if lines else _FEWEST_ENDS):
            break
        line = _along_hull(corners, ends, line, near)
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


def _border(material: MaterialEdge, pitch_px: float) -> tuple[Float64s, Float64s, float]:
    """Material's border, half a pixel apart, (N, 2), corners of its convex hull, (M, 2), and how near to a line is on
    it, which corners stand out farther than; pixels.
    """
    near = _NEAR_PX + _NEAR_PITCHES * pitch_px
    border = np.concatenate([densified(ring, 0.5) for ring in material.border])
    return border, fewer_vertices(cv2.convexHull(border.astype(np.float32))[:, 0].astype(np.float64), near), near


def _along_hull(corners: Float64s, ends: Float64s, line: _Line, near: float) -> _Line:
    """The edge of a hull, by its corners, (M, 2), that a line's ends lie on, which knows more of it than a few ends at
    one of its own; the line where there is none.
    """
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = (end - start) / np.hypot(*(end - start))
        out = np.array([-along[1], along[0]])
        if (np.abs((ends[line.on_it] - start) @ out) < near).all():
            return _Line(start, along, out * np.sign(out @ line.out), line.on_it)
    return line


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
