"""How far a contour is from another account of the block: where the picture is busy at the scale of a cell.

The other account knows the cell pitch and nothing else of what the tracing saw: the picture is reduced to about six
pixels a pitch, what stands out from the mean over a pitch is averaged over a pitch, and the block is where that average
is more than half of what it is in busy places nearby. Such an outline is good to about half a pitch, to one where a
scratch or a shadow lies against the block, and has no sense of edges and corners; it is no contour to cut along, but it
shows a part of the block left out, or table taken for block.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.geometry import Contour, Ring

Picture = NDArray[np.uint8]
Mask = NDArray[np.uint8]

_PITCH_PX = 6
_SHARE_OF_LEVEL = 0.5
_NEARBY_PITCHES = 8.0
# Of the busiest places in the picture: less is table, however quiet its surroundings.
_LEAST_SHARE = 0.3
_BUSIEST_PERCENT = 98.0
# A missing cell is no opening, and a scratch is no part of the block.
_OPENING_PITCHES = 2.2
_SCRATCH_PITCHES = 1.8
# How far the busy region reaches beyond the block's edge: half of the window it is averaged over.
_BLUR_PITCHES = 0.5
_FRACTION_BITS = 4


@dataclass(frozen=True)
class Disagreement:
    """Width of the widest place where contour and busy region differ, in pitches, and where it is, pixels (x, y).

    claimed: whether the contour has block there where the picture is quiet; else it leaves busy picture out.
    """

    pitches: float
    place_px: tuple[float, float]
    claimed: bool

    def moved(self, x: float, y: float) -> Disagreement:
        """The same in a picture whose first pixel lies at (-x, -y) of this one's."""
        return Disagreement(self.pitches, (self.place_px[0] + x, self.place_px[1] + y), self.claimed)


def disagreement(picture: Picture, contour: Contour, pitch_px: float) -> Disagreement:
    """The widest disagreement between the contour, in pixels, and the busy part of `picture`, grey or BGR, uint8.

    Width is that of the largest disc that fits into the difference. Busy parts that the contour does not reach do not
    count: several blocks are another finding.
    """
    shrink = max(1, int(pitch_px / _PITCH_PX))
    small = _reduced(picture, shrink)
    pitch = pitch_px / shrink
    busy = _without_small_gaps(_busy(small, pitch), (_OPENING_PITCHES * pitch) ** 2)
    ours = _drawn(contour, busy.shape[:2], shrink)
    opened = np.asarray(cv2.morphologyEx(busy, cv2.MORPH_OPEN, _disc(_SCRATCH_PITCHES * pitch)), np.uint8)
    theirs = _touched(opened, ours)
    around = np.asarray(cv2.dilate(ours, _disc(2.0 * _BLUR_PITCHES * pitch)), np.uint8)
    claimed, left_out = _widest(_but(ours, busy)), _widest(_but(theirs, around))
    (width, place), claims = (claimed, True) if claimed[0] >= left_out[0] else (left_out, False)
    x, y = ((value + 0.5) * shrink - 0.5 for value in place)
    return Disagreement(width / pitch, (x, y), claims)


def _reduced(picture: Picture, shrink: int) -> Picture:
    if shrink == 1:
        return picture
    size = (max(1, picture.shape[1] // shrink), max(1, picture.shape[0] // shrink))
    # A whole number of pixels each: averaging them is several times faster then.
    whole = picture[: size[1] * shrink, : size[0] * shrink]
    return np.asarray(cv2.resize(whole, size, interpolation=cv2.INTER_AREA), np.uint8)


def _busy(small: Picture, pitch: float) -> Mask:
    """Where the picture differs from its mean over a pitch as it does in comb, 0 or 255."""
    window = _odd(pitch)
    off = cv2.absdiff(small, cv2.blur(small, (window, window)))
    if off.ndim == 3:
        off = off.max(axis=2)
    average = cv2.boxFilter(off, cv2.CV_32F, (window, window))
    nearby = _odd(_NEARBY_PITCHES * pitch)
    squares = cv2.boxFilter(average * average, cv2.CV_32F, (nearby, nearby))
    # The mean that weighs busy places by how busy they are: beside the block it is the block's.
    level = squares / np.maximum(cv2.boxFilter(average, cv2.CV_32F, (nearby, nearby)), 1e-3)
    least = _LEAST_SHARE * float(np.percentile(level[::4, ::4], _BUSIEST_PERCENT))
    busy = average > np.maximum(_SHARE_OF_LEVEL * level, least)
    return np.asarray(busy, np.uint8) * np.uint8(255)


def _without_small_gaps(mask: Mask, area_px2: float) -> Mask:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(cv2.bitwise_not(mask), connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] < area_px2
    small[0] = False
    return np.asarray(np.where(small[labels], np.uint8(255), mask), np.uint8)


def _drawn(contour: Contour, shape: tuple[int, int], shrink: int) -> Mask:
    mask = np.zeros(shape, np.uint8)
    rings = [_fixed_point((ring + 0.5) / shrink - 0.5) for ring in contour.rings]
    cv2.fillPoly(mask, rings, 255, cv2.LINE_8, _FRACTION_BITS)
    return mask


def _fixed_point(ring: Ring) -> NDArray[np.int32]:
    return np.asarray(np.rint(ring * (1 << _FRACTION_BITS)), np.int32)


def _touched(mask: Mask, ours: Mask) -> Mask:
    """The parts of `mask` that meet `ours`."""
    count, labels, _, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    meets = np.bincount(labels[ours > 0], minlength=count) > 0
    meets[0] = False
    return np.asarray(np.where(meets[labels], np.uint8(255), np.uint8(0)), np.uint8)


def _but(mask: Mask, other: Mask) -> Mask:
    """What is in `mask` and not in `other`."""
    return np.asarray(cv2.bitwise_and(mask, cv2.bitwise_not(other)), np.uint8)


def _widest(difference: Mask) -> tuple[float, tuple[float, float]]:
    """Diameter of the largest disc inside, in pixels, and its middle (x, y)."""
    # The picture's border ends a difference too.
    depth = cv2.distanceTransform(cv2.copyMakeBorder(difference, 1, 1, 1, 1, cv2.BORDER_CONSTANT), cv2.DIST_L2, 3)
    y, x = np.unravel_index(int(depth.argmax()), depth.shape)
    return 2.0 * float(depth[y, x]), (float(x - 1), float(y - 1))


def _disc(diameter: float) -> Mask:
    size = _odd(diameter)
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)), np.uint8)


def _odd(length: float) -> int:
    return 2 * round(0.5 * length) + 1
