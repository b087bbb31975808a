"""Lines along an outline that are wider than walls: ink on the table beside the block, tape, a cable.

Walls of cells change their direction with every side, and a cut that runs along one is as wide as it. Along a line that
is wider, over two cells and more, nothing tells where the block ends.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from contour.edge.edge_parts import EdgePart, longest_part
from contour.edge.stretches import Stretch, hidden_or_filled
from contour.geometry.arrays import Bytes, quantile
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, signed_area
from contour.image.pixel_grid import drawn, samples_of
from contour.image.pixel_sampling import light_beside

# Walls measure wider by less than this where three of them meet, nineteen of twenty places of them by less than 1.2.
# Where these are wider themselves (six walls of triangles meet, blur) a line is that is wider than they.
_WIDER, _NEARLY_ALL = 1.45, 0.95
# Pitches: places along the outline, how far in and out of it lines are looked for, how near to what is filled or hidden
# they are not, and over how much. Of 904 right outlines one has one so long, at a splice.
_SPACING, _IN_AND_OUT, _BESIDE, _LONG = 0.1, np.arange(-0.6, 0.31, 0.1), 1.0, 2.0
_WIDE = 255


def wide_line(
    mask: Bytes, contour: Contour, evidence: Sequence[Stretch], *, pitch_px: float, wall_px: float, scale: int
) -> EdgePart | None:
    """The longest line along a contour, pixels, that is wider than walls in their mask, (h, w), of samples of `scale`
    pixels; None where none is long. What its evidence tells as hidden or filled is left out.
    """
    deep = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, 5), np.float32)
    own = deep[(drawn(contour.rings, mask.shape, scale) & mask) > 0]
    usual = quantile(own, _NEARLY_ALL) if own.size else 0.0
    wide = np.asarray((deep > max(_WIDER * 0.5 * wall_px / scale, usual)) * np.uint8(_WIDE), np.uint8)
    out_px = float(np.sign(signed_area(contour.exterior))) * pitch_px
    parts = []
    for number, ring in enumerate(contour.rings):
        lengths = RingLengths.of(ring)
        at = np.arange(0.0, lengths.length, _SPACING * pitch_px)
        outward = out_px / scale * lengths.normals(at, 5.0 * _SPACING * pitch_px)
        chosen = (light_beside(wide, samples_of(lengths.at(at), scale), outward, _IN_AND_OUT) > 0.5 * _WIDE).any(axis=0)
        chosen &= ~hidden_or_filled(evidence, number, at, _BESIDE * pitch_px)
        parts.append(longest_part(chosen, lengths, at, _SPACING))
    long = [part for part in parts if part is not None and part.length_pitches > _LONG]
    return max(long, key=lambda part: part.length_pitches, default=None)
