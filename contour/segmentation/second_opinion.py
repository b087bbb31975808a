"""What speaks against an outline: a second opinion, of a network that knows of no outline and no wall's end."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import cv2
import numpy as np

from contour.geometry.agreement import places_along
from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, median, quantile, rolled
from contour.geometry.rings import Contour, signed_area
from contour.image.opencv import box_mean, opened, pieces_and_areas, pieces_of, sized, within
from contour.image.pixel_grid import fill_finely
from contour.segmentation.glare import glare
from contour.segmentation.network import LIGHT_PITCH_PX, comb_and_covers, comb_and_laid, comb_things_and_seams
from contour.walls.lightness import wall_light

_SURE = 0.5
# What is looked at around the outline, pitches. A piece that comes within a rim of it was left out where it reaches so
# far. A thing on the rim, so far about a piece, parts it from the block. Narrower than so many pixels it is the
# network's own uncertainty.
_AROUND, _RIM, _FAR, _BESIDE, _LEAST_PX = 3.0, 0.38, 0.55, 0.75, 3
# A thing lies over the edge where it lies on the block so near to it, along so much of it, and farther than that from
# where it is known what does: of 360 right outlines of all kinds on one it lies along more. Glare lies beside, up to
# twice as far.
_DEEP, _LONG, _KNOWN = 0.375, 0.8, 1.0
# Cells are missing within the edge where, so deep in the block, there surely is no comb, over more than that; narrower
# than so many pixels it is what lies between walls. It is as light as what lies beyond up to so much of what light
# changes by in the block.
_WITHIN, _NO_COMB, _LONG_BARE, _LEAST_WIDE_PX = (0.3, 0.9), 0.25, 1.15, 4
_ALIKE, _CONTRAST = 0.3, (0.05, 0.95)
# So is a hole that was not traced, which holds a disc of that diameter, pitches; what lies on the block is seldom so.
_HOLE, _AS_LIGHT = 2.2, 0.2
# An opening was left out where two networks see no comb over so many square pitches, and the one that knows things none
# that would fill it. Of 167 right outlines by seven hands two have one, of ten that left out slots or holes of one cell
# to two six.
_OPENING, _FILLS = 1.0, 0.12
# A thing lies where a hole was traced if a quarter of what is so far within the rim seems to be one so surely, in the
# picture so far around it, pitches. Of 32 cut holes that quarter has 0.33 at most, of 33 things 31 have 0.36 or more; a
# flat strip of tape, as light as the table, has 0.06.
_LAID, _QUARTER, _WITHIN_RIM = 0.35, 0.75, 0.25
# A corner, where the outline turns by so much from so many pitches before to as many after, in steps of so many; beyond
# comb it is as light as the table up to so much.
_TURN, _LEG, _STEP, _NEAR_TABLE = math.radians(35.0), 6, 0.1, 0.5
# A seam parts what lies so far within the outline into pieces of so many square pitches; its parts may be twice so far
# apart.
_INNER, _CELLS, _LINK = 1.0, 6.0, 0.8
# In the middle of a seam, without half so many pixels at both sides, at most so many times as much is as light as a
# wall as in comb so far from it, pitches: of 19 seams 1.37 times at most, of eight splices and rows of crushed cells
# 1.55 at least.
_RIMS_PX, _FILLED, _BESIDE_SEAM = 5, 1.45, (1.0, 4.0)


class Doubt(NamedTuple):
    """How far something reaches, pitches, and where, pixels (x, y)."""

    pitches: float
    place_px: tuple[float, float]

    def moved(self, x: float, y: float) -> Doubt:
        """The same in a picture whose first pixel lies at (-x, -y) of this one's."""
        return self._replace(place_px=(self.place_px[0] + x, self.place_px[1] + y))


class SecondOpinion(NamedTuple):
    """What speaks against an outline: how far comb reaches `beyond` it, along how much of it something seems to lie
    `over` it or no cells within it (`bare`), how wide a `hole` may be that was left out, how far a `corner` reaches
    beyond comb, how long a `seam` is that parts the block, and how wide a thing that was traced as a hole.
    None where it reaches less than about half a cell, and along less than that.
    """

    beyond: Doubt | None = None
    over: Doubt | None = None
    bare: Doubt | None = None
    hole: Doubt | None = None
    corner: Doubt | None = None
    seam: Doubt | None = None
    laid: Doubt | None = None

    def moved(self, x: float, y: float) -> SecondOpinion:
        """The same in a picture whose first pixel lies at (-x, -y) of this one's."""
        return SecondOpinion(*(None if doubt is None else doubt.moved(x, y) for doubt in self))


def second_opinion(
    picture: Bytes,
    contour: Contour,
    pitch_px: float,
    loose: Callable[[Float64s], Bools],
    told: Sequence[Float64s] = (),
    *,
    dark: bool = False,
) -> SecondOpinion:
    """What the picture, grey (H, W) or BGR (H, W, 3), uint8, shows against the outline, in its pixels, of a block with
    cells of that pitch. `loose` tells of points, (N, 2), which lie on pieces of comb that are told from the block,
    (N,): these are none of it unless a thing parts them from it. Along paths that are `told`, (M, 2) each, it is known
    what lies over the edge. dark: whether walls are darker than what lies between them.
    """
    part, first = _around(picture, contour.exterior, pitch_px)
    all_light = wall_light(part)
    light, (comb, thing), (sure_comb, _, seam) = comb_things_and_seams(all_light, pitch_px)
    grid = _Grid.over(part, first, comb)
    block = np.zeros(comb.shape, np.uint8)
    fill_finely(block, [grid.there(ring) for ring in contour.rings], 1)
    deep, away = (np.asarray(cv2.distanceTransform(side, cv2.DIST_L2, 5), np.float32) for side in (block, 1 - block))
    known = _known(block.shape, [grid.there(path) for path in told])
    over = _over(block, thing, glare(part, block > 0, LIGHT_PITCH_PX), known, grid)
    sides = _Sides(deep, away, sure_comb, light)
    none = opened(sides.none, _LEAST_WIDE_PX)
    return SecondOpinion(
        _beyond(block, away, comb, thing, loose, grid),
        over,
        _bare(sides, none, known, grid) if over is None else None,
        _hole(sides, none, grid) or _opening(all_light, pitch_px, sides, known, grid),
        _corner(sides, grid.there(contour.exterior), known, grid),
        _seam(deep, sure_comb, seam, 255 - light if dark else light, grid),
        _laid(picture, contour.holes, pitch_px),
    )


class _Grid(NamedTuple):
    """The network's map of a part of a picture: the part's first pixel, (2,), and samples of the map a pixel, (2,)."""

    first: Float64s
    size: Float64s

    @staticmethod
    def over(part: Bytes, first: Float64s, told: Float32s) -> _Grid:
        """That of what is told, (h, w), of a part of a picture whose first pixel lies there."""
        return _Grid(first, np.array(told.shape[::-1]) / part.shape[1::-1])

    def there(self, points: Float64s) -> Float64s:
        """Places in the map of places in the picture, (N, 2)."""
        return (points - self.first + 0.5) * self.size - 0.5

    def back(self, samples: Float64s) -> Float64s:
        """Places in the picture of places in the map, (N, 2)."""
        return (samples + 0.5) / self.size - 0.5 + self.first

    def place(self, x: float, y: float) -> tuple[float, float]:
        """A place in the picture of one in the map."""
        there_x, there_y = self.back(np.array([x, y])).tolist()
        return there_x, there_y


def _beyond(
    block: Bytes, away: Float32s, comb: Float32s, thing: Float32s, loose: Callable[[Float64s], Bools], grid: _Grid
) -> Doubt | None:
    """How far comb reaches beyond the block, and where it reaches farthest in the first piece that reaches too far."""
    beyond = opened(((comb > _SURE) & (block == 0)).astype(np.uint8), _LEAST_PX)
    count, pieces = pieces_of(beyond, 8)
    rows, columns = np.nonzero(beyond)
    places = grid.back(np.column_stack((columns, rows)).astype(np.float64))
    piece, far = pieces[rows, columns], away[rows, columns] / np.float32(LIGHT_PITCH_PX)
    reach = np.zeros(count, np.float32)
    np.maximum.at(reach, piece, far)
    area, own = np.bincount(piece, minlength=count), np.bincount(piece, ~loose(places), count)
    touches = np.bincount(piece, far < _RIM, count) > 0
    rim = (block == 0) & (within(block, _RIM * LIGHT_PITCH_PX) > 0)
    for number in np.flatnonzero(touches & (reach > _FAR)).tolist():
        between = rim & (within(pieces == number, _BESIDE * LIGHT_PITCH_PX) > 0)
        if own[number] > _SURE * area[number] or np.mean(thing[between]) > _SURE:
            x, y = places[np.where(piece == number, far, np.float32(0.0)).argmax()].tolist()
            return Doubt(float(reach[number]), (x, y))
    return None


def _known(shape: tuple[int, ...], told: Sequence[Float64s]) -> Bools:
    """Where it is known what lies over the edge, about these paths in the map, (h, w)."""
    known = np.zeros(shape, np.uint8)
    paths = [np.rint(path).astype(np.int32) for path in told]
    cv2.polylines(known, paths, False, 1, 2 * round(_KNOWN * LIGHT_PITCH_PX) + 1)
    return known > 0


def _over(block: Bytes, thing: Float32s, blinds: Bools, known: Bools, grid: _Grid) -> Doubt | None:
    """The longest part of the edge over which a thing lies, or glare beside it."""
    deep = _DEEP * LIGHT_PITCH_PX
    lies = (block > 0) & (within(1 - block, deep) > 0) & (thing > _SURE)
    lies |= (block == 0) & (within(block, 2.0 * deep) > 0) & blinds
    return _longest(lies & ~known, _DEEP, _LONG, grid)


class _Sides(NamedTuple):
    """How deep in the block, and how far away from it, a place lies, samples, how surely it is comb, and its light,
    (h, w) each.
    """

    deep: Float32s
    away: Float32s
    comb: Float32s
    light: Bytes

    @property
    def none(self) -> Bytes:
        """1 where within the block surely is no comb."""
        return ((self.deep > 0.0) & (self.comb < _NO_COMB)).astype(np.uint8)

    @property
    def contrast(self) -> float:
        """What light changes by in the block."""
        return float(np.ptp(np.quantile(self.light[self.deep > 0.0], _CONTRAST)))

    @property
    def beside(self) -> Bools:
        """What lies beyond the outline and near it."""
        near, far = (share * LIGHT_PITCH_PX for share in _WITHIN)
        return np.asarray((self.away > near) & (self.away < far))

    def as_beside(self, part: Bools, most: float) -> Bools:
        """Where a part is as light as what lies beside, within a cell, up to that share of the contrast, (h, w)."""
        step = np.abs(_light_of(self.light, part) - _light_of(self.light, self.beside))
        return np.asarray(step < most * self.contrast)


def _bare(sides: _Sides, none: Bytes, known: Bools, grid: _Grid) -> Doubt | None:
    """The longest part of the edge within which there are no cells, and that is as light within as beyond: compound
    that was cut with the block ends there.
    """
    near, far = (share * LIGHT_PITCH_PX for share in _WITHIN)
    bare = (none > 0) & (sides.deep > near) & (sides.deep < far) & ~known
    if not bare.any():
        return None
    return _longest(bare & sides.as_beside(bare, _ALIKE), _WITHIN[1] - _WITHIN[0], _LONG_BARE, grid)


def _hole(sides: _Sides, none: Bytes, grid: _Grid) -> Doubt | None:
    """The widest part within the block without cells, if a hole would be as wide and it is as light as the table."""
    room = np.asarray(cv2.distanceTransform(none, cv2.DIST_L2, 5), np.float32)
    as_wide = room > 0.5 * _HOLE * LIGHT_PITCH_PX
    if not as_wide.any():
        return None
    pieces, table = pieces_of(none, 8)[1], median(sides.light[sides.beside])
    there = np.zeros_like(room)
    at_edge = np.unique(pieces[sides.deep < _WITHIN[0] * LIGHT_PITCH_PX])
    for number in np.setdiff1d(pieces[as_wide], at_edge):
        core = (pieces == number) & (room > _RIM * LIGHT_PITCH_PX)
        if abs(median(sides.light[core]) - table) < _AS_LIGHT * sides.contrast:
            there[core] = room[core]
    if not there.any():
        return None
    return _widest(there, grid)


def _opening(light: Bytes, pitch_px: float, sides: _Sides, known: Bools, grid: _Grid) -> Doubt | None:
    """The largest opening in the block, of any width, without comb and without what would fill it; light: that of the
    part of the picture that the grid lies over, (H, W).
    """
    shape = sides.deep.shape
    comb, thing = (np.asarray(sized(plane, shape), np.float32) for plane in comb_and_covers(light, pitch_px))
    bare = (sides.deep > _WITHIN[0] * LIGHT_PITCH_PX) & (comb < _SURE)
    pieces, area = pieces_and_areas(bare.astype(np.uint8), 8)
    filled, told, seen = (
        np.bincount(pieces.ravel(), plane.ravel()) / np.maximum(area, 1) for plane in (thing, known, sides.comb)
    )
    open_there = (area > _OPENING * LIGHT_PITCH_PX**2) & (filled < _FILLS) & (told < _SURE) & (seen < _SURE)
    if not open_there.any():
        return None
    return _extent(pieces == np.where(open_there, area, 0).argmax(), grid)


def _widest(room: Float32s, grid: _Grid) -> Doubt:
    """How wide the largest disc is that has room somewhere, and where; room: its radius, samples, (h, w)."""
    y, x = np.unravel_index(int(room.argmax()), room.shape)
    return Doubt(2.0 * float(room.max()) / LIGHT_PITCH_PX, grid.place(float(x), float(y)))


def _corner(sides: _Sides, ring: Float64s, known: Bools, grid: _Grid) -> Doubt | None:
    """The corner of a ring, (N, 2) in the map, that reaches farthest beyond comb, if it reaches too far over what is as
    light as the table: a rounding was taken for a corner, or a wall that is none of the block's for its end.
    """
    places = places_along(Contour(ring), _STEP * LIGHT_PITCH_PX)
    path = places[:, 0] + 1j * places[:, 1]
    before, after = path - rolled(path, _LEG), rolled(path, -_LEG) - path
    turns = np.angle(after * before.conj()) * np.sign(signed_area(ring))
    comb = opened((sides.comb > _SURE).astype(np.uint8), _LEAST_PX)
    reach = np.asarray(cv2.distanceTransform(1 - comb, cv2.DIST_L2, 5), np.float32) / np.float32(LIGHT_PITCH_PX)
    x, y = np.clip(np.rint(places).astype(int), 0, np.array(reach.shape[::-1]) - 1).T
    far = np.where((turns > _TURN) & ~known[y, x], reach[y, x], np.float32(0.0))
    number = int(far.argmax())
    if far[number] < _FAR or not sides.as_beside(sides.none > 0, _NEAR_TABLE)[y[number], x[number]]:
        return None
    return Doubt(float(far[number]), grid.place(*places[number].tolist()))


def _laid(picture: Bytes, holes: Sequence[Float64s], pitch_px: float) -> Doubt | None:
    """The widest of the things that were traced as holes, (N, 2) each, in pixels of the picture."""
    laid = []
    for hole in holes:
        part, first = _around(picture, hole, pitch_px)
        _, thing = comb_and_laid(wall_light(part), pitch_px)
        grid = _Grid.over(part, first, thing)
        inside = np.zeros(thing.shape, np.uint8)
        fill_finely(inside, [grid.there(hole)], 1)
        depth = np.asarray(cv2.distanceTransform(inside, cv2.DIST_L2, 5), np.float32)
        within_rim = thing[depth > _WITHIN_RIM * LIGHT_PITCH_PX]
        if len(within_rim) and quantile(within_rim, _QUARTER) > _LAID:
            laid.append(_widest(depth, grid))
    return max(laid, default=None)


def _around(picture: Bytes, ring: Float64s, pitch_px: float) -> tuple[Bytes, Float64s]:
    """The picture around a ring in its pixels, (N, 2), and the place of its first one."""
    around = _AROUND * pitch_px
    left, top = np.maximum(ring.min(axis=0) - around, 0.0).astype(int).tolist()
    right, bottom = np.ceil(ring.max(axis=0) + around).astype(int).tolist()
    return np.ascontiguousarray(picture[top:bottom, left:right]), np.array([left, top], np.float64)


def _light_of(light: Bytes, part: Bools) -> Float32s:
    """The mean light of a part within a cell of each place, (h, w)."""
    side = 2 * round(LIGHT_PITCH_PX) + 1
    share = box_mean(part.astype(np.float32), side)
    return np.asarray(box_mean(np.where(part, light, 0).astype(np.float32), side) / np.maximum(share, 1e-6), np.float32)


def _longest(part: Bools, wide: float, least: float, grid: _Grid) -> Doubt | None:
    """The largest piece of a part of a band so wide along the edge, pitches, if it is longer than that."""
    pieces, area = pieces_and_areas(part.astype(np.uint8), 8)
    long = float(area.max()) / (wide * LIGHT_PITCH_PX**2)
    if long < least:
        return None
    rows, columns = np.nonzero(pieces == area.argmax())
    return Doubt(long, grid.place(columns.mean(), rows.mean()))


def _extent(piece: Bools, grid: _Grid) -> Doubt:
    """How long a piece is from corner to corner, and where its middle lies."""
    rows, columns = np.nonzero(piece)
    long = float(np.hypot(np.ptp(rows), np.ptp(columns))) / LIGHT_PITCH_PX
    return Doubt(long, grid.place(float(np.median(columns)), float(np.median(rows))))


def _seam(deep: Float32s, comb: Float32s, seam: Float32s, light: Bytes, grid: _Grid) -> Doubt | None:
    """The longest part of a seam that parts the block, well within its outline, into pieces of many cells, and is no
    lighter than these: adhesive in a splice is, and a row of cells that were pressed together.
    """
    line = (deep > 0.0) & (seam > _SURE)
    if not line.any() or _fills(deep > 0.0, comb, line, light):
        return None
    inner = deep > _INNER * LIGHT_PITCH_PX
    rest = inner & (within(line, _LINK * LIGHT_PITCH_PX) == 0)
    count, whole = pieces_of(inner.astype(np.uint8), 8)
    pieces, areas = pieces_and_areas(rest.astype(np.uint8), 8)
    large = areas > _CELLS * LIGHT_PITCH_PX**2
    large[0] = False
    of_whole = np.zeros(len(areas), np.intp)
    of_whole[pieces[rest]] = whole[rest]
    if np.bincount(of_whole[large], minlength=count).max() < 2:
        return None
    lines, lengths = pieces_and_areas(line.astype(np.uint8), 8)
    return _extent(lines == lengths.argmax(), grid)


def _fills(block: Bools, comb: Float32s, line: Bools, light: Bytes) -> bool:
    """Whether more of a seam is as light as walls than of the comb beside it."""
    middle = cv2.erode(line.astype(np.uint8), np.ones((_RIMS_PX, _RIMS_PX), np.uint8)) > 0
    near, far = (within(line, pitches * LIGHT_PITCH_PX) > 0 for pitches in _BESIDE_SEAM)
    beside = far & ~near & block & (comb > _SURE)
    if not (middle.any() and beside.any()):
        return False
    wall = float(np.mean(np.quantile(light[beside], (0.1, 0.9))))
    return bool(np.mean(light[middle] > wall) > _FILLED * np.mean(light[beside] > wall))
