"""Straight cuts through a border that closes its cells elsewhere, by what touches an edge of its hull: something at
every cell, and what lies between differs, or floors of cells all along, and no wall.
"""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s, Float64s, median
from contour.material.closed_cells import MaterialEdge
from contour.tracing.cut_lines import OPEN_PITCHES, Line, border_and_hull, from_corner_to_corner

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
_FEWEST_WALLS, _THICKER, _THICKER_PX, _GROWING, _GROWING_PX = 3, 0.5, 2.0, 0.2, 1.25
_THICKEST, _WALL_PX, _SIDE, _DEEP_THIN = 0.5, 3.0, 0.35, 0.33
# A closed sheet has no openings along its edges (none of 80), so that two tell of a cut, also of a short one.
_LEAST_LONG_ALIKE, _FEWEST_ALIKE = 2.0, 2
# Teeth of closed triangles are as deep as these are high, 0.73 of that where blur rounds tips and roots (of four); what
# is shallower was cut (0.47 and 0.51 of two). Blur takes pixels, more of fine ones: 0.59 of 13 px was left of one, 0.53
# of 11 px was cut.
_SHALLOW, _FEWEST_SHALLOW, _BLUNT_PX = 0.6, 3, 1.0
# Where floors of cells differ from the table, a closed border still has a wall all along what is straight of it (of 100
# lattices none less where material touches that far), a cut one where it crosses walls (0.24 to 0.63 of its length).
_LONG_BARE, _TOUCHED_BARE, _TOUCHED_PX, _WALLED = 2.5, 0.95, 1.0, 0.8
_NOTHING = np.empty((0, 3)), np.empty((0, 2))


def touched_cuts(
    material: MaterialEdge,
    pitch_px: float,
    *,
    alike: bool = False,
    tooth_px: float = 0.0,
    walls: Bytes | None = None,
    wall_px: float = 0.0,
) -> list[Float64s]:
    """Straight cuts along edges of the material's convex hull, pixels, (1, 2, 2) each: touched at every cell, with
    openings between that differ, or may be `alike`, as where what is closed has none, or are shallower than those
    between `tooth_px` deep teeth of closed cells; or touched all along, by floors of cells, where of `walls`, (H, W),
    255, none of `wall_px` runs.

    They need no ends of walls: where walls meet a saw at a slant, none is seen to end. A closed border that runs along
    rows of cells is touched as often, but its openings are alike; along other directions it is touched more seldom.
    """
    border, corners, near = border_and_hull(material, pitch_px)
    least = near + _OPENING_PX if alike else max(_OPENING * pitch_px, near + _OPENING_PX)
    cuts = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        length = float(np.hypot(*(end - start)))
        along = (end - start) / length
        out = np.array([along[1], -along[0]])
        line = Line(start, along, out * np.sign(out @ (start - corners.mean(axis=0))), np.zeros(0, np.bool_))
        long = length > (_LEAST_LONG_ALIKE if alike else _LEAST_LONG) * pitch_px
        openings, thick = _openings(material, line, length, near, pitch_px) if long else _NOTHING
        opened = _opened(openings[openings[:, 1] > least], thick, pitch_px, tooth_px, alike=alike)
        if not opened and walls is not None and length > _LONG_BARE * pitch_px:
            opened = _bare(material, walls, line, length, near, wall_px)
        if opened:
            cuts.append(from_corner_to_corner(border, np.empty((0, 2)), line, near, OPEN_PITCHES * pitch_px))
    return [cut for cut in cuts if len(cut)]


def _bare(material: MaterialEdge, walls: Bytes, line: Line, length: float, near: float, wall_px: float) -> bool:
    """Whether material touches a line all along its length from its point on, and a wall does not."""

    def touching(mask: Bytes, depth: Float64s) -> float:
        x, y = _places(line, length, depth)
        return float((cv2.remap(mask, x, y, cv2.INTER_NEAREST) > 0).any(axis=1).mean())

    region = touching(material.apart.region, np.arange(-near, near + _TOUCHED_PX, _ALONG_PX))
    return region > _TOUCHED_BARE and touching(walls, np.arange(0.0, near + wall_px, _ALONG_PX)) < _WALLED


def _places(line: Line, length: float, depth: Float64s) -> tuple[Float32s, Float32s]:
    """The x and y of places along a line from its point on, at depths behind it, (N, M), pixels."""
    place = np.arange(0.0, length, _ALONG_PX)
    x, y = (line.middle[k] + place[:, None] * line.along[k] - depth * line.out[k] for k in (0, 1))
    return x.astype(np.float32), y.astype(np.float32)


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
    usual, growth = median(thick), _growth(place, thick)
    # At a corner another wall runs inwards behind the last one.
    spread = float(np.ptp(np.append(thick[1:-1], np.minimum(thick[[0, -1]], usual))))
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
    material: MaterialEdge, line: Line, length: float, near: float, pitch_px: float
) -> tuple[Float64s, Float64s]:
    """Where openings are along a line, how deep they are behind it, and behind what touches it on both sides, (N, 3),
    in its direction, where material touches the line within `near` at every cell over its `length` from its point on;
    and where and how thick what touches it is before the cell behind it, (M, 2): all in pixels; none where it does not.
    """
    # How far behind the line the material begins, and the cells behind that.
    depth = np.arange(-near, 1.5 * pitch_px, _ALONG_PX)
    x, y = _places(line, length, depth)

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
