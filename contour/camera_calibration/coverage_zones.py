"""Where in the picture corners of the board were seen, and where never."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Float64s, Int64s
from contour.image.opencv_boards import convex_hull, inside_ring

COLUMNS, ROWS = 16, 12


@dataclass(frozen=True, eq=False)
class Zones:
    """The picture in COLUMNS x ROWS zones: corners seen in each, shape (ROWS, COLUMNS), and the hull of all, (N, 2)."""

    counts: Int64s
    hull_px: Float64s
    covered_share: float

    @property
    def text(self) -> str:
        """How much of the picture the corners enclose, and between which columns and rows."""
        (left, top), (right, bottom) = self.hull_px.min(axis=0), self.hull_px.max(axis=0)
        return (
            f"{100 * self.covered_share:.0f} % of the picture, within x {left:.0f} to {right:.0f} and y {top:.0f} to "
            f"{bottom:.0f} px"
        )

    def inside(self, points_px: Float64s) -> Bools:
        """True for each pixel within the hull of all corners."""
        return inside_ring(self.hull_px, points_px)


def covered_zones(pixels: Sequence[Float64s], size: tuple[int, int]) -> Zones:
    """The zones of a picture of (width, height) px in which the corners lie; the share is the hull's of the picture."""
    corners = np.concatenate(pixels)
    column = np.clip((corners[:, 0] + 0.5) * COLUMNS / size[0], 0, COLUMNS - 1).astype(np.int64)
    row = np.clip((corners[:, 1] + 0.5) * ROWS / size[1], 0, ROWS - 1).astype(np.int64)
    counts = np.zeros((ROWS, COLUMNS), np.int64)
    np.add.at(counts, (row, column), 1)
    hull = convex_hull(corners)
    x, y = hull.T
    area = 0.5 * abs(float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))))
    return Zones(counts, hull, area / (size[0] * size[1]))
