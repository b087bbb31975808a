"""Cell pitch and wall width of a honeycomb, read from its wall mask: from the areas of the cells its walls enclose."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bytes, Int32s, median
from contour.image.opencv import region_boxes_and_areas

HEXAGON = 2 / math.sqrt(3)
"""Pitch² over area of a hexagonal cell (1.1547)."""

FEWEST_CELLS = 6
"""Fewer regular cells than this are as likely letters, screws or scratches as a honeycomb."""

_SMALLEST_PX2 = 9
"""Enclosed spots below 3 x 3 px are noise in the mask, not cells of the smallest pitch (6 px)."""

_REGULAR = (0.5, 1.7)
"""Areas, against the typical cell's, that count as whole cells: two that lost the wall between them do not."""

_ALIKE = 1.3
"""Areas within this factor of each other support one another when the typical area is sought."""

_LONGEST = 3.0
"""Longest side of a cell's box over its shortest: over-expanded cells reach 2, gaps beside a block far more."""


@dataclass(frozen=True)
class EnclosedCells:
    """A honeycomb's measures. `pitch_px` is that of the regular honeycomb with the same area a cell.

    `wall_px` is the mean wall width, `wall_share` the share of a cell's area that is wall, `count` the whole cells
    that were found, `area_px2` what they enclose together, `box` (left, top, right, bottom) where they lie.
    """

    pitch_px: float
    wall_px: float
    wall_share: float
    count: int
    area_px2: float
    box: tuple[int, int, int, int]

    def enlarged(self, factor: int) -> EnclosedCells:
        """The measures in a picture `factor` times as large."""
        if factor == 1:
            return self
        left, top, right, bottom = (factor * side for side in self.box)
        return EnclosedCells(
            self.pitch_px * factor,
            self.wall_px * factor,
            self.wall_share,
            self.count,
            self.area_px2 * factor**2,
            (left, top, right, bottom),
        )

    @property
    def cell_px2(self) -> float:
        """Area of one cell, its share of the walls included, px²."""
        return self.pitch_px**2 / HEXAGON


def measure_cells(mask: Bytes) -> EnclosedCells | None:
    """The measures of the cells in a wall mask, shape (H, W), walls 255; None if it has too few regular cells."""
    boxes, areas = region_boxes_and_areas(mask)
    left, top, width, height = boxes.T
    inside = (left > 0) & (top > 0) & (left + width < mask.shape[1]) & (top + height < mask.shape[0])
    sides = np.maximum(width, height), np.minimum(width, height)
    plausible = inside & (areas >= _SMALLEST_PX2) & (sides[0] <= _LONGEST * sides[1])
    if np.count_nonzero(plausible) < FEWEST_CELLS:
        return None
    typical = _typical_area(areas[plausible])
    regular = plausible & (areas >= _REGULAR[0] * typical) & (areas <= _REGULAR[1] * typical)
    if np.count_nonzero(regular) < FEWEST_CELLS:
        return None
    x0, y0 = int(left[regular].min()), int(top[regular].min())
    x1, y1 = int((left + width)[regular].max()), int((top + height)[regular].max())
    wall = _wall_width(mask[y0:y1, x0:x1])
    inner = median(areas[regular])
    pitch_px = math.sqrt(HEXAGON * inner) + wall
    return EnclosedCells(
        pitch_px=pitch_px,
        wall_px=wall,
        wall_share=1 - HEXAGON * inner / pitch_px**2,
        count=int(np.count_nonzero(regular)),
        area_px2=float(areas[regular].sum()),
        box=(x0, y0, x1, y1),
    )


def _typical_area(areas: Int32s) -> float:
    """The area that most areas are alike to, each counting by its root.

    Counted alike, a thousand noise spots would outvote the cells; by area, a few cells that have run together would.
    """
    ordered = np.sort(areas).astype(np.float64)
    votes = np.concatenate([[0.0], np.cumsum(np.sqrt(ordered))])
    low = np.searchsorted(ordered, ordered / _ALIKE)
    high = np.searchsorted(ordered, ordered * _ALIKE, side="right")
    return float(ordered[np.argmax(votes[high] - votes[low])])


def _wall_width(mask: Bytes) -> float:
    """Mean width of the white bands: area over half the boundary's length (Crofton: from changes along both axes)."""
    changes = np.count_nonzero(mask[1:] != mask[:-1]) + np.count_nonzero(mask[:, 1:] != mask[:, :-1])
    return float(2 * np.count_nonzero(mask) / (math.pi / 4 * max(int(changes), 1)))
