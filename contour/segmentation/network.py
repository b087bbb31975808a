"""The networks, and what they tell of every pixel at one size of cells."""

from __future__ import annotations

import math
import pkgutil
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s
from contour.image.opencv import grown, shrunk_to

PITCH_PX = 16.0
"""The pitch at which the network has learnt what cells look like; cells half or twice as large are told as well."""
LIGHT_PITCH_PX = 8.0
"""That of the light network, which takes a tenth of the time and tells of no walls."""

# By so much networks make the picture smaller, and one of them, which halves it once more.
_HALVED, _HALVED_MORE = 8, 16
# Tiles, and what is seen around each of them: a quarter of a gigabyte, where a whole picture of 2 MP took 1.4.
_TILE_PX, _LARGER_TILE_PX = (504, 48), (512, 128)
# Grey levels: what spreads less is noise.
LEAST_SPREAD = 4.0


@dataclass(frozen=True, eq=False)
class Segments:
    """How surely each pixel of a picture at the network's size is the top of a wall, comb, and a thing that lies over
    it, 0…1, (h, w), float32.
    """

    wall: Float32s
    comb: Float32s
    thing: Float32s


def segments(light: Bytes, pitch_px: float, box: tuple[slice, slice] | None = None) -> Segments:
    """What the picture, (H, W), shows of cells of that pitch, at `PITCH_PX` a pitch, its sides multiples of 8; nothing
    outside of a box of it, rows and columns, if one is given.
    """
    even = _evened(light, PITCH_PX / pitch_px)[1]
    if box is None:
        return Segments(*_told("comb.onnx", 3, even))
    told = np.zeros((3, *even.shape), np.float32)
    rows, columns = (
        slice(_HALVED * int(one.start * small / side / _HALVED), _HALVED * math.ceil(one.stop * small / side / _HALVED))
        for one, small, side in zip(box, even.shape, light.shape, strict=True)
    )
    told[:, rows, columns] = _told("comb.onnx", 3, even[rows, columns])
    return Segments(*told)


def comb_and_things(light: Bytes, pitch_px: float) -> Float32s:
    """How surely each pixel of the picture, (H, W), at `LIGHT_PITCH_PX` a pitch, its sides multiples of 8, is comb, and
    a thing over it, by the light network: 0…1, (2, h, w), float32.
    """
    return _told("comb_beyond.onnx", 2, _evened(light, LIGHT_PITCH_PX / pitch_px)[1])


def comb_things_and_seams(light: Bytes, pitch_px: float) -> tuple[Bytes, Float32s, Float32s]:
    """The picture at the light network's size, (h, w), uint8, what that tells of it, and how surely each pixel is comb,
    a thing over it, and a seam between two blocks, by one that was taught on from it: 0…1, (3, h, w), float32.
    """
    sized, even = _evened(light, LIGHT_PITCH_PX / pitch_px)
    return sized, _told("comb_beyond.onnx", 2, even), _told("seams.onnx", 3, even)


def comb_and_laid(light: Bytes, pitch_px: float) -> Float32s:
    """As `comb_and_things`, by a network that was taught on from that one with holes, and with what looks like one and
    is a thing that lies on the comb.
    """
    return _told("holes.onnx", 2, _evened(light, LIGHT_PITCH_PX / pitch_px)[1])


def comb_and_covers(light: Bytes, pitch_px: float) -> Float32s:
    """As `comb_and_things`, by a network that sees more of the picture around each pixel, and knows more things."""
    even = _evened(light, LIGHT_PITCH_PX / pitch_px, _HALVED_MORE)[1]
    return _told("covers.onnx", 2, even, _LARGER_TILE_PX)


def _evened(light: Bytes, size: float, halved: int = _HALVED) -> tuple[Bytes, Float32s]:
    """The picture, (H, W), at so many times its size, its sides multiples of that, (h, w), as it is and of mean 0 and
    unit spread.
    """
    shape = tuple(halved * max(_HALVED, round(side * size / halved)) for side in light.shape)
    sized = (shrunk_to if size < 1.0 else grown)(light, shape)
    even = sized.astype(np.float32)
    even -= even.mean()
    even /= max(float(even.std()), LEAST_SPREAD)
    return sized, even


def _told(name: str, channels: int, even: Float32s, tile_px: tuple[int, int] = _TILE_PX) -> Float32s:
    """What the network in that file tells of each pixel of an evened picture, (h, w): (channels, h, w), float32; in
    tiles of so many pixels, with so many around them.
    """
    shape, (side, around) = even.shape, tile_px
    # A net of OpenCV's holds what it computes, all layers of it: each thread has one of its own, for a tile at a time.
    network = cv2.dnn.readNetFromONNX(_network(name))
    told = np.empty((channels, *shape), np.float32)
    for top in range(0, shape[0], side):
        for left in range(0, shape[1], side):
            above, before = max(0, top - around), max(0, left - around)
            tile = even[above : top + side + around, before : left + side + around]
            network.setInput(np.ascontiguousarray(tile)[None, None])
            rows, columns = slice(top - above, top - above + side), slice(left - before, left - before + side)
            part = np.asarray(network.forward(), np.float32)[0, :, rows, columns]
            told[:, top : top + side, left : left + side] = part
    return told


@cache
def _network(name: str) -> Bytes:
    data = pkgutil.get_data("contour.segmentation", name)
    assert data is not None
    return np.frombuffer(data, np.uint8)
