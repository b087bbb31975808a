"""What lies about a block, as maps drawn by hand on a small grid."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.edge.table_look import TableLook
from tests.support.pictures.outline_scenes import PITCH

WIDTH, HEIGHT, STEP = 1400, 1000, 4


def drawn(*areas: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which samples of the grid lie in the areas, given in pixels."""
    mask = np.zeros((HEIGHT // STEP, WIDTH // STEP), np.uint8)
    for area in areas:
        cv2.fillPoly(mask, [np.rint((area + 0.5) / STEP - 0.5).astype(np.int32)], 1)
    return mask > 0


def look(
    block: NDArray[np.float64],
    *things: NDArray[np.float64],
    lighter: bool = True,
    shade: bool = False,
) -> TableLook:
    """A block on a table with things, all as rings in pixels: lighter than the table, or like a shadow on it."""
    foreign = drawn(*things)
    away = cv2.distanceTransform((~foreign).astype(np.uint8), cv2.DIST_L2, 3) * STEP if foreign.any() else None
    return TableLook(
        table=~drawn(block) & ~foreign,
        foreign=foreign,
        things=foreign,
        step=STEP,
        pitch_px=PITCH,
        lighter=foreign & lighter,
        shade=foreign & shade,
        light=np.where(foreign, np.uint8(150 if lighter else 20), np.uint8(40)),
        away=np.full(foreign.shape, 1e6, np.float32) if away is None else np.asarray(away, np.float32),
    )
