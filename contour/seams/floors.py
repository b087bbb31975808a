"""Floors of cells in two kinds of light, each in a part of its own: there another block begins, whose cells are not as
deep, or hold another light.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float64s, Indices, median, quantile
from contour.seams.both_sides import cell_order
from contour.seams.openings import NEAR_OUTLINE, Openings
from contour.seams.parting import Parted, parted_by_kind
from contour.seams.two_kinds import FEWEST, Kinds, two_kinds

_DIRECTIONS = 72
# How large the step between both kinds is of the contrast of walls, how large of what floors of one kind differ by, how
# much of it parts most of one kind from most of the other, and what share of cells lies among the other kind.
# Of 440 single blocks 26 have such floors, most of them under glare, and cells in one order on both sides of the line.
_STEP, _SPREADS, _GAP, _ASTRAY = 0.1, 4.0, 0.4, 0.05
# And where that order is not told, as of irregular cells, with how much of the step between cells this near the line.
# Glare has a gap of 0.7 at most.
_SURE_SPREADS, _SURE_GAP, _SURE_ASTRAY, _NEAR, _NEAR_STEP = 6.0, 0.72, 0.02, 1.3, 0.7
_LEAST_SPREAD = 0.5
_WALL = 0.7


@dataclass(frozen=True, eq=False)
class _Line:
    """A line by its unit normal, (2,), and the distance along it, pitches; the share of cells on its wrong side."""

    normal: Float64s
    distance: float
    astray: float


def parted_by_floors(light: Bytes, free: Openings) -> Parted | None:
    """The part of a block whose cells' floors are lighter than the others'; None where they are of one kind, or lie
    among each other. light: bright where walls are, (h, w), on the openings' grid.
    """
    told = _of_two_kinds(light, free)
    if told is None:
        return None
    middles, floor, kinds = told
    found = parted_by_kind(free, middles, kinds.more, _ASTRAY)
    if found is None:
        return None
    order = cell_order(free, found)
    return found if order.surely_other or (not order.same and _surely(kinds, middles / free.pitch, floor)) else None


def floors_differ(light: Bytes, free: Openings, found: Parted) -> bool:
    """Whether floors are of two kinds, and a line parts these."""
    told = _of_two_kinds(light, free)
    if told is None:
        return False
    middles, _, kinds = told
    astray = float(np.mean(found.at(middles)[0] != kinds.more))
    return min(astray, 1.0 - astray) < _ASTRAY


def _of_two_kinds(light: Bytes, free: Openings) -> tuple[Float64s, Float64s, Kinds] | None:
    """Middles of cells, (N, 2), the light of their floors, (N,), and its kinds; None where these are not two. Cells of
    another block may be the larger ones.
    """
    walls = light[(free.numbers == 0) & (free.depth > NEAR_OUTLINE)]
    if not (free.cells.any() and len(walls)):
        return None
    floors, wall = _floors(light, free), quantile(walls, _WALL)
    for cells in (free.cells, free.of_any_block):
        floor = floors[cells]
        kinds = two_kinds(floor)
        if kinds is None or kinds.gap < _GAP:
            continue
        if kinds.step > max(_STEP * (wall - median(floor)), _SPREADS * (kinds.spread + _LEAST_SPREAD)):
            return free.centre[cells], floor, kinds
    return None


def _surely(kinds: Kinds, place: Float64s, floor: Float64s) -> bool:
    """Whether floors alone tell that two blocks meet, along a straight line."""
    if kinds.gap < _SURE_GAP or kinds.step < _SURE_SPREADS * (kinds.spread + _LEAST_SPREAD):
        return False
    line = _best_line(place, kinds.more)
    away = place @ line.normal - line.distance
    near = np.abs(away) < _NEAR
    one, other = floor[near & (away < 0.0)], floor[near & (away > 0.0)]
    if line.astray > _SURE_ASTRAY or not (len(one) and len(other)):
        return False
    return abs(median(other) - median(one)) > _NEAR_STEP * kinds.step


def _floors(light: Bytes, free: Openings) -> Float64s:
    """The light of each opening's darker half, (N,)."""
    inside = np.flatnonzero(free.numbers)
    number, level = free.numbers.ravel()[inside], light.ravel()[inside]
    mean = np.bincount(number, level, len(free.area)) / np.maximum(free.area, 1)
    dark = level <= mean[number]
    total, count = (np.bincount(number[dark], of, len(free.area)) for of in (level[dark], None))
    return np.asarray(total / np.maximum(count, 1), np.float64)


def _best_line(place: Float64s, lighter: Bools) -> _Line:
    """The line that leaves fewest cells, at places (N, 2), among those of the other kind."""
    turns = np.arange(_DIRECTIONS) * (math.pi / _DIRECTIONS)
    normals = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    away = place @ normals.T
    order = np.argsort(away, axis=0)
    before = np.cumsum(lighter[order], axis=0)[:-1]
    count = np.arange(1, len(place))[:, None]
    # Lighter ones before the line, and darker ones behind it, or the other way around.
    wrong = before + (len(place) - count) - (before[-1:] + lighter[order[-1:]] - before)
    wrong = np.minimum(wrong, len(place) - wrong)[FEWEST - 1 : len(place) - FEWEST]
    row, turn = (int(one) for one in np.unravel_index(wrong.argmin(), wrong.shape))
    split: Indices = order[row + FEWEST - 1 : row + FEWEST + 1, turn]
    return _Line(normals[turn], float(away[split, turn].mean()), float(wrong[row, turn]) / len(place))
