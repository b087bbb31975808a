"""What speaks against an outline: a second opinion, of a network that knows of no outline and no wall's end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s
from contour.geometry.rings import Contour
from contour.image.opencv import pieces_and_areas, pieces_of, within
from contour.image.pixel_grid import fill_finely
from contour.segmentation.glare import glare
from contour.segmentation.network import LIGHT_PITCH_PX, comb_and_things
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


class Doubt(NamedTuple):
    """How far something reaches, pitches, and where, pixels (x, y)."""

    pitches: float
    place_px: tuple[float, float]

    def moved(self, x: float, y: float) -> Doubt:
        """The same in a picture whose first pixel lies at (-x, -y) of this one's."""
        return self._replace(place_px=(self.place_px[0] + x, self.place_px[1] + y))


class SecondOpinion(NamedTuple):
    """What speaks against an outline: how far comb reaches `beyond` it, and along how much of it something seems to lie
    `over` it. None where it reaches less than about half a cell, and along less than that.
    """

    beyond: Doubt | None
    over: Doubt | None

    def moved(self, x: float, y: float) -> SecondOpinion:
        """The same in a picture whose first pixel lies at (-x, -y) of this one's."""
        return SecondOpinion(*(None if doubt is None else doubt.moved(x, y) for doubt in self))


def second_opinion(
    picture: Bytes,
    contour: Contour,
    pitch_px: float,
    loose: Callable[[Float64s], Bools],
    told: Sequence[Float64s] = (),
) -> SecondOpinion:
    """What the picture, grey (H, W) or BGR (H, W, 3), uint8, shows against the outline, in its pixels, of a block with
    cells of that pitch. `loose` tells of points, (N, 2), which lie on pieces of comb that are told from the block,
    (N,): these are none of it unless a thing parts them from it. Along paths that are `told`, (M, 2) each, it is known
    what lies over the edge.
    """
    around = _AROUND * pitch_px
    left, top = np.maximum(contour.exterior.min(axis=0) - around, 0.0).astype(int).tolist()
    right, bottom = np.ceil(contour.exterior.max(axis=0) + around).astype(int).tolist()
    part = np.ascontiguousarray(picture[top:bottom, left:right])
    comb, thing = comb_and_things(wall_light(part), pitch_px)
    grid = _Grid(np.array([left, top]), np.array(comb.shape[::-1]) / part.shape[1::-1])
    block = np.zeros(comb.shape, np.uint8)
    fill_finely(block, [grid.there(ring) for ring in contour.rings], 1)
    over = _over(block, thing, glare(part, block > 0, LIGHT_PITCH_PX), [grid.there(path) for path in told], grid)
    return SecondOpinion(_beyond(block, comb, thing, loose, grid), over)


class _Grid(NamedTuple):
    """The network's map of a part of a picture: the part's first pixel, (2,), and samples of the map a pixel, (2,)."""

    first: Float64s
    size: Float64s

    def there(self, points: Float64s) -> Float64s:
        """Places in the map of places in the picture, (N, 2)."""
        return (points - self.first + 0.5) * self.size - 0.5

    def back(self, samples: Float64s) -> Float64s:
        """Places in the picture of places in the map, (N, 2)."""
        return (samples + 0.5) / self.size - 0.5 + self.first


def _beyond(
    block: Bytes, comb: Float32s, thing: Float32s, loose: Callable[[Float64s], Bools], grid: _Grid
) -> Doubt | None:
    """How far comb reaches beyond the block, and where it reaches farthest in the first piece that reaches too far."""
    beyond = ((comb > _SURE) & (block == 0)).astype(np.uint8)
    beyond = np.asarray(cv2.morphologyEx(beyond, cv2.MORPH_OPEN, np.ones((_LEAST_PX, _LEAST_PX), np.uint8)), np.uint8)
    away = np.asarray(cv2.distanceTransform(1 - block, cv2.DIST_L2, 5), np.float32)
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


def _over(block: Bytes, thing: Float32s, blinds: Bools, told: Sequence[Float64s], grid: _Grid) -> Doubt | None:
    """The longest part of the edge over which a thing lies, or glare beside it; `told` in places of the map."""
    deep = _DEEP * LIGHT_PITCH_PX
    lies = (block > 0) & (within(1 - block, deep) > 0) & (thing > _SURE)
    lies |= (block == 0) & (within(block, 2.0 * deep) > 0) & blinds
    if told and lies.any():
        known = np.zeros(block.shape, np.uint8)
        paths = [np.rint(path).astype(np.int32) for path in told]
        cv2.polylines(known, paths, False, 1, 2 * round(_KNOWN * LIGHT_PITCH_PX) + 1)
        lies &= known == 0
    pieces, area = pieces_and_areas(lies.astype(np.uint8), 8)
    long = float(area.max()) / (deep * LIGHT_PITCH_PX)
    if long < _LONG:
        return None
    rows, columns = np.nonzero(pieces == area.argmax())
    x, y = grid.back(np.array([columns.mean(), rows.mean()])).tolist()
    return Doubt(long, (x, y))
