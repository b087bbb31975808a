"""What a camera model leaves over: residuals that point the same way in one part of the picture, beyond noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contour.geometry.arrays import Float64s

COLUMNS, ROWS = 8, 6
_FEWEST = 6


def structure_px(pixels: Sequence[Float64s], misses: Sequence[Float64s], size: tuple[int, int]) -> float:
    """Root mean square over zones of the mean residual, what noise alone would give taken off, pixels.

    Independent noise of variance v leaves v / n in the mean of n; what is more has one cause throughout its zone.
    """
    places, rest = np.concatenate(pixels), np.concatenate(misses)
    column = np.clip((places[:, 0] + 0.5) * COLUMNS / size[0], 0, COLUMNS - 1).astype(np.int64)
    row = np.clip((places[:, 1] + 0.5) * ROWS / size[1], 0, ROWS - 1).astype(np.int64)
    zone = row * COLUMNS + column
    excess, weight = 0.0, 0
    for number in np.unique(zone):
        there = rest[zone == number]
        if len(there) < _FEWEST:
            continue
        noise = float(there.var(axis=0, ddof=1).sum()) / len(there)
        excess += len(there) * (float((there.mean(axis=0) ** 2).sum()) - noise)
        weight += len(there)
    return float(np.sqrt(max(excess / weight, 0.0))) if weight else 0.0
