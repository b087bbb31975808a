"""Open cells at a block's edge, whose floor is a taught table in the block's shade: no things, though they look flat.

On a known table a dark thing's light may be a shade of it, so no shade is taken for one there. But a thing has a sharp
border, and a block's shade has none: where it is divided out the table is left, and differs from itself by nothing.
"""

from __future__ import annotations

import cv2
import numpy as np

from contour.edge.table_look import TableLook
from contour.geometry.arrays import median, quantile
from contour.image.opencv import pieces_of
from contour.relief.relief import Relief

# Of 18 such cells none has room for a disc of 0.9 pitches' radius, or differs from the table by more than 2.2 times
# what table does elsewhere. Of 40 tapes, clamps, hands, cables and compound one has so little room: it does by 5.
_ROOM_PITCHES, _DIFFERS = 0.95, 2.5
# Where a thing's border lies, samples from it and from the table.
_RIM = np.ones((5, 5), np.uint8)


def without_open_cells(look: TableLook, relief: Relief) -> TableLook:
    """The look at a block on a known table, without what is foreign in it but for being a cell's size, and plainly that
    table in a soft shade from its middle up to the table beside it.
    """
    count, pieces = pieces_of(look.foreign, 8)
    if count < 2 or not look.table.any():
        return look
    height, width = pieces.shape
    step = round(look.step)
    root = relief.apart[: height * step, : width * step].reshape(height, step, width, step).max(axis=(1, 3))
    most = np.sqrt(_DIFFERS) * median(root[look.table])
    room = cv2.distanceTransform(look.foreign.astype(np.uint8), cv2.DIST_L2, 3) * (step / look.pitch_px)
    beside_table = cv2.dilate(look.table.astype(np.uint8), _RIM) > 0
    cells = np.zeros_like(look.foreign)
    for number in range(1, count):
        piece = pieces == number
        rim = beside_table & (cv2.dilate(piece.astype(np.uint8), _RIM) > 0)
        if room[piece].max() > _ROOM_PITCHES or not rim.any():
            continue
        if median(root[piece]) < most and quantile(root[rim], 0.75) < most:
            cells |= piece
    return look.without(cells) if cells.any() else look
