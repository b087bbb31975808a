"""What joins two parts of one block: adhesive, or whatever lies across it, between comb and comb.

Walls do not show in it, so that each part is a piece of comb of its own. But no table lies between them: what is flat
there and unlike the table touches both.
"""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, median
from contour.image.opencv import pieces_of, within
from contour.image.pixel_grid import drawn
from contour.walls.pieces import STRIP_PITCHES, Piece
from contour.walls.wall_evidence import BlockEvidence

# How near to both parts it lies, and over how much of each, pitches.
_NEAR, _ALONG = 0.75, 2.0
# Of the block: no strip that was cut off is as large.
_LARGE = 0.25
# Grey levels from the table: between two blocks that lie near each other it is the same, or in their shade.
_UNLIKE = 6.0


def spliced(flat: Bools, table: Bools, light: Bytes, seen: BlockEvidence, step: float) -> tuple[Bools, Bools] | None:
    """Where something flat, (h, w), joins a block to another piece of comb, on that grid of `step` pixels a sample, and
    where this piece lies; None without any. Strips that were cut off are no such pieces. `table`, `light`: where the
    table lies, and the picture's light.
    """
    if not table.any():
        return None
    level = median(light[table])
    samples = seen.pitch_px / step
    own = drawn([ring.coarse for ring in seen.rings[:1]], flat.shape, step)
    reach = _NEAR * samples
    joining, parts = np.zeros_like(flat), np.zeros_like(flat)
    for piece in seen.others:
        if not _is_block(piece, seen.pitch_px, cv2.contourArea(seen.rings[0].coarse.astype(np.float32))):
            continue
        other = drawn([piece.outline_px], flat.shape, step)
        count, between = pieces_of(flat & (own == 0) & (other == 0), 8)
        beside = [
            np.bincount(between[(within(part, reach) > 0) & (part == 0)], minlength=count) for part in (own, other)
        ]
        joins = np.minimum(*beside) > _ALONG * samples * reach * 0.5
        joins[0] = False
        for number in np.flatnonzero(joins):
            joins[number] = abs(median(light[between == number]) - level) > _UNLIKE
        if joins.any():
            joining |= joins.take(between)
            parts |= within(other, samples) > 0
    return (joining, parts) if joining.any() else None


def _is_block(piece: Piece, pitch_px: float, area_px2: float) -> bool:
    wide = np.isfinite(piece.width_px) and piece.width_px > STRIP_PITCHES * pitch_px
    return len(piece.outline_px) > 0 and (wide or piece.area_px2 > _LARGE * area_px2)
