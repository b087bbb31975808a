"""Whether comb goes on beyond an outline: a second opinion, of a network that knows of no outline and no wall's end."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float64s
from contour.geometry.rings import Contour
from contour.image.opencv import pieces_of, within
from contour.image.pixel_grid import fill_finely
from contour.segmentation.network import tell
from contour.walls.lightness import wall_light

PITCH_PX = 8.0
"""The pitch at which this network has learnt what cells look like."""

_SURE = 0.5
# What is looked at around the outline, pitches. A piece that comes within a rim of it was left out where it reaches so
# far. A thing on the rim, so far about a piece, parts it from the block. Narrower than so many pixels it is the
# network's own uncertainty.
_AROUND, _RIM, _FAR, _BESIDE, _LEAST_PX = 3.0, 0.38, 0.55, 0.75, 3


class CombBeyond(NamedTuple):
    """How far comb reaches beyond an outline, pitches, and the place that lies farthest from it, pixels (x, y)."""

    pitches: float
    place_px: tuple[float, float]

    def moved(self, x: float, y: float) -> CombBeyond:
        """The same in a picture whose first pixel lies at (-x, -y) of this one's."""
        return self._replace(place_px=(self.place_px[0] + x, self.place_px[1] + y))


def comb_beyond(
    picture: Bytes, contour: Contour, pitch_px: float, loose: Callable[[Float64s], Bools]
) -> CombBeyond | None:
    """Where comb reaches farthest beyond the outline, in pixels of the picture, grey (H, W) or BGR (H, W, 3), uint8,
    its cells of that pitch. None where it reaches less than about half a cell. `loose` tells of points, (N, 2), which
    lie on pieces of comb that are told from the block, (N,): these are none of it unless a thing parts them from it.
    """
    around = _AROUND * pitch_px
    left, top = np.maximum(contour.exterior.min(axis=0) - around, 0.0).astype(int).tolist()
    right, bottom = np.ceil(contour.exterior.max(axis=0) + around).astype(int).tolist()
    light = wall_light(np.ascontiguousarray(picture[top:bottom, left:right]))
    sized, (comb, thing) = tell("comb_beyond.onnx", 2, light, PITCH_PX / pitch_px)
    size = np.array(sized.shape[::-1]) / light.shape[::-1]
    block = np.zeros(sized.shape, np.uint8)
    fill_finely(block, [(ring - (left, top) + 0.5) * size - 0.5 for ring in contour.rings], 1)
    beyond = ((comb > _SURE) & (block == 0)).astype(np.uint8)
    beyond = np.asarray(cv2.morphologyEx(beyond, cv2.MORPH_OPEN, np.ones((_LEAST_PX, _LEAST_PX), np.uint8)), np.uint8)
    away = np.asarray(cv2.distanceTransform(1 - block, cv2.DIST_L2, 5), np.float32)
    count, pieces = pieces_of(beyond, 8)
    rows, columns = np.nonzero(beyond)
    places = (np.column_stack((columns, rows)) + 0.5) / size - 0.5 + (left, top)
    piece, far = pieces[rows, columns], away[rows, columns] / np.float32(PITCH_PX)
    reach = np.zeros(count, np.float32)
    np.maximum.at(reach, piece, far)
    area, own = np.bincount(piece, minlength=count), np.bincount(piece, ~loose(places), count)
    touches = np.bincount(piece, far < _RIM, count) > 0
    rim = (block == 0) & (within(block, _RIM * PITCH_PX) > 0)
    for number in np.flatnonzero(touches & (reach > _FAR)).tolist():
        between = rim & (within(pieces == number, _BESIDE * PITCH_PX) > 0)
        if own[number] > _SURE * area[number] or np.mean(thing[between]) > _SURE:
            x, y = places[np.where(piece == number, far, np.float32(0.0)).argmax()].tolist()
            return CombBeyond(float(reach[number]), (x, y))
    return None
