"""Arms of any length and direction as narrow as a cable, or as a strip and not pointed; and slits as narrow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float64s
from contour.geometry.rings import Contour, Ring
from contour.image.opencv import closed_by_disc, pieces_and_boxes
from contour.narrow_features.feature import WIDTH, NarrowFeature

# In cell pitches.
_ARM_END = 1.7
_PITCH_SAMPLES = 6.0
# Borders that close their cells go in no deeper where the edge of material is hardly told: a plate's 0.27, one around
# dark comb on wood 1.4.
_TORN = 0.75
# What a step aside and down counts for in a distance, and a little more.
_DIAGONAL = 1.42


@dataclass(frozen=True)
class _Kind:
    """Narrower than that, longer than that, and with room for a disc of that radius at the end; pitches."""

    narrow: float
    long: float
    blunt: float


# A corner of 13 degrees is as narrow as a thread over as much; corners and horns as narrow as a strip are pointed.
_THREAD, _STRIP = _Kind(1.5, 6.0, 0.0), _Kind(WIDTH, 2.5, 0.9)


def arms(contour: Contour, pitch_px: float, large: float) -> list[NarrowFeature]:
    """Parts of a contour in pixels far from all that is wider than they are: threads, and strips that are less than
    `large`, squares of the pitch. What lies between a hole and the exterior is no strip.
    """
    strips = _narrow_parts(*_drawn([contour.exterior], pitch_px, 1.0), pitch_px, _STRIP)
    return [
        *(thread for thread, _ in _narrow_parts(*_drawn(contour.rings, pitch_px, 1.0), pitch_px, _THREAD)),
        *(strip for strip, size in strips if size < large),
    ]


def slits(contour: Contour, pitch_px: float, narrow: float) -> list[NarrowFeature]:
    """What goes into a contour narrower than so many pitches, however deep: an outline had followed a cable in, and
    back.
    """
    drawn, first = _drawn([contour.exterior], pitch_px, WIDTH)
    kind = replace(_STRIP, narrow=narrow)
    return [replace(slit, outwards=False) for slit, _ in _narrow_parts(1 - drawn, first, pitch_px, kind)]


def torn(contour: Contour, pitch_px: float) -> bool:
    """Whether a contour in pixels goes in anywhere narrower than a pitch, and deeper than cells at a border do."""
    drawn, _ = _drawn(contour.rings, pitch_px, 1.0)
    closed = closed_by_disc(drawn, 0.5 * _PITCH_SAMPLES)
    depth = cv2.distanceTransform(closed, cv2.DIST_L2, 5) / _PITCH_SAMPLES
    return bool((depth[drawn == 0] > _TORN).any())


def _drawn(rings: Sequence[Ring], pitch_px: float, margin: float) -> tuple[Bytes, Float64s]:
    """1 inside of rings in pixels, exterior first, (h, w), with so many pitches around, and the grid's first pixel."""
    first = rings[0].min(axis=0) - margin * pitch_px
    step = pitch_px / _PITCH_SAMPLES
    width, height = np.ceil((rings[0].max(axis=0) + margin * pitch_px - first) / step).astype(int).tolist()
    drawn = np.zeros((height, width), np.uint8)
    cv2.fillPoly(drawn, [np.rint((ring - first) / step).astype(np.int32) for ring in rings], 1)
    return drawn, first


def _narrow_parts(drawn: Bytes, first: Float64s, pitch_px: float, kind: _Kind) -> list[tuple[NarrowFeature, float]]:
    """What is drawn of that kind, and how large it is, squares of the pitch."""
    step = pitch_px / _PITCH_SAMPLES
    height, width = drawn.shape
    room = np.asarray(cv2.distanceTransform(drawn, cv2.DIST_L2, 5), np.float32) / np.float32(_PITCH_SAMPLES)
    wide = (room >= 0.5 * kind.narrow).astype(np.uint8)
    # What is far from all of that lies amidst a square without any, and these are had at once.
    half = int(_PITCH_SAMPLES * 0.5 * (kind.narrow + kind.long) / _DIAGONAL)
    if not (drawn & (cv2.dilate(wide, np.ones((2 * half + 1, 2 * half + 1), np.uint8)) == 0)).any():
        return []
    end = round(_ARM_END * _PITCH_SAMPLES)
    disc = np.hypot(*np.ogrid[-end : end + 1, -end : end + 1]) < _ARM_END * _PITCH_SAMPLES
    framed = cv2.copyMakeBorder(room, end, end, end, end, cv2.BORDER_CONSTANT)
    away = np.minimum(cv2.distanceTransform(1 - wide, cv2.DIST_L2, 5), width + height) / _PITCH_SAMPLES
    away -= 0.5 * kind.narrow
    parts, stats = pieces_and_boxes((drawn & (away > 0.5 * kind.long)).astype(np.uint8), 8)
    found = []
    for part, (left, top, wide_px, high_px, _) in enumerate(stats[1:].tolist(), 1):
        box = slice(top, top + high_px), slice(left, left + wide_px)
        y, x = np.unravel_index(int(np.where(parts[box] == part, away[box], 0.0).argmax()), (high_px, wide_px))
        y, x = y + top, x + left
        blunter = framed[y : y + 2 * end + 1, x : x + 2 * end + 1][disc].max() >= kind.blunt
        if away[y, x] > kind.long and blunter:
            size, _, _, _ = cv2.floodFill((drawn & (away > 0.0)).astype(np.uint8), None, (int(x), int(y)), 2)
            place_x, place_y = (first + step * np.array([x, y])).tolist()
            one = NarrowFeature(float(away[y, x]), kind.narrow, (place_x, place_y), outwards=True)
            found.append((one, size / _PITCH_SAMPLES**2))
    return found
