"""Where a picture is as light as the block and never the table, or as the table and never the block; and how busy it is
where it shows the table.
"""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s, Float64s, median, quantile, quantiles

# What is usual for one, and what the other one ever has: lowest, highest, as shares of it.
_USUAL = (0.04, 0.96)
_EVER = (0.005, 0.995)
# Scratches and dust shift a level: so much of the way to the other's is still one's own.
_NEAR = 0.25
_FEW = 50
_HOP = 3
# Walls differ from the table by so much, of what it usually shows and of most. In the middle of holes it is 1.1 times
# the usual, of faded walls 1.5 (row noise) to 11.
_FAINT, _FAINT_OVER = 1.6, 0.95


def exclusive_levels(level: Bytes, block: Bytes, table: Bytes) -> tuple[Bytes, Bytes]:
    """Pixels (0 or 255) whose level only the block has, and those whose level only the table has.

    level: the picture's mean over a cell, grey (H, W) or BGR (H, W, 3). block, table: samples of both (not 0). Where
    one has hardly a sample nothing is told.
    """
    of_block, of_table = (level[::_HOP, ::_HOP][mask[::_HOP, ::_HOP] > 0] for mask in (block, table))
    if min(len(of_block), len(of_table)) < _FEW:
        return np.zeros(level.shape[:2], np.uint8), np.zeros(level.shape[:2], np.uint8)
    return _only(level, of_block, of_table), _only(level, of_table, of_block)


def table_activity(activity: Float32s, around: Bytes) -> float:
    """How busy nothing is that shows the table, by how busy a picture is, (H, W); `around` is not 0 near the block."""
    table = activity[::2, ::2][around[::2, ::2] == 0]
    return max(_FAINT * median(table), quantile(table, _FAINT_OVER)) if len(table) else np.inf


def _only(level: Bytes, own: Bytes, others: Bytes) -> Bytes:
    """Where the level is usual for `own`, or near to that, and no other has it; samples, shape (N,) or (N, 3)."""
    (low, high), (least, most) = _bounds(own, _USUAL), _bounds(others, _EVER)
    slack = _NEAR * np.maximum(np.maximum(low - most, least - high), 0.0)
    usual = cv2.inRange(level, low - slack, high + slack)
    return np.asarray(cv2.bitwise_and(usual, cv2.bitwise_not(cv2.inRange(level, least, most))), np.uint8)


def _bounds(samples: Bytes, shares: tuple[float, float]) -> tuple[Float64s, Float64s]:
    """What two shares of the samples lie below, one figure a channel each."""
    low, high = quantiles(samples.reshape(len(samples), -1), shares)
    return low, high
