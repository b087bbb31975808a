"""The paper's direct scan: the block's left and right points, row by row, on the wall mask.

In a row the first white pixel is the left point; once more than `max_gap_px` black pixels follow one another, the
last white pixel before them is the right point. A pair closer than `min_width_px` is noise: the search goes on along
the row. One pair a row, so a second crossing of the block, a cavity or a concave side is lost: that is its nature.
"""

from __future__ import annotations

import math

import numpy as np

from contour.errors import NoBlockFound, ParameterError
from contour.geometry.arrays import Bytes, Float64s, Indices
from contour.tracing.paper_cells import EnclosedCells

GAP_PITCHES = 3.0
"""A cell is 1.15 pitches from corner to corner, two that lost the wall between them 2.15. Over 22 rendered blocks
smaller gaps break rows inside the block, larger ones reach for specks beside it."""

WIDTH_PITCHES = 2.0
"""Specks, and foil chips of a cell's size, are narrower; a block's corner loses no more than a cell."""


def default_gap_px(cells: EnclosedCells) -> int:
    """`max_gap_px` for a cell pitch, px."""
    return math.ceil(GAP_PITCHES * cells.pitch_px)


def default_width_px(cells: EnclosedCells) -> int:
    """`min_width_px` for a cell pitch, px."""
    return math.ceil(WIDTH_PITCHES * cells.pitch_px)


def scan_rows(mask: Bytes, max_gap_px: int, min_width_px: int) -> Float64s:
    """Left points from top to bottom, then right points from bottom to top: (x, y), shape (2 · rows with a pair, 2).

    `mask` is the binarised picture, shape (H, W), 0 = black. Raises ParameterError.
    """
    y, left, right = scan_pairs(mask, max_gap_px, min_width_px)[0].T
    x, y = np.concatenate([left, right[::-1]]), np.concatenate([y, y[::-1]])
    return np.column_stack([x, y]).astype(np.float64)


def scan_pairs(mask: Bytes, max_gap_px: int, min_width_px: int) -> tuple[Indices, Indices]:
    """The pair of each row that has one, and the pairs dropped as noise on the way to it: (y, left, right), (N, 3).

    Behind its pair a row is not looked at. Raises ParameterError.
    """
    for name, value in (("max_gap_px", max_gap_px), ("min_width_px", min_width_px)):
        if value < 0:
            raise ParameterError(f"{name} is {value}: expected 0 or more.")
    height, width = mask.shape
    # Runs of white end where the pixel's neighbour differs: far fewer places to look at than white pixels.
    white = np.flatnonzero(mask != 0)
    if len(white) == 0:
        return np.zeros((0, 3), np.intp), np.zeros((0, 3), np.intp)
    begins = np.empty(len(white), np.bool_)
    np.greater(white[1:] - white[:-1], max_gap_px + 1, out=begins[1:])
    # The first white pixel of each row that has one begins a run, however near the row above ended.
    firsts = np.searchsorted(white, np.arange(height) * width)
    begins[firsts[firsts < len(white)]] = True
    starts = np.flatnonzero(begins)
    left = white[starts]
    right = white[np.append(starts[1:], len(white)) - 1]
    pairs = np.column_stack([left // width, left % width, right % width])
    wide = np.flatnonzero(right - left >= min_width_px)
    rows, first = np.unique(pairs[wide, 0], return_index=True)
    kept = wide[first]
    kept_at = np.full(height, len(pairs))
    kept_at[rows] = kept
    noise = np.arange(len(pairs)) < kept_at[pairs[:, 0]]
    return pairs[kept], pairs[noise]


def direct_scan_ring(mask: Bytes, max_gap_px: int, min_width_px: int) -> Float64s:
    """The scan's points as a ring: those that repeat their neighbour left out. Raises NoBlockFound, ParameterError."""
    points = scan_rows(mask, max_gap_px, min_width_px)
    if len(points):
        points = points[(points != np.roll(points, 1, axis=0)).any(axis=1)]
    if len(points) < 4:
        raise NoBlockFound(
            f"Direct scan found {len(points) // 2} rows with white pixels at least {min_width_px} px apart, a block "
            "has more. Check the light, the polarity, and min_width_px."
        )
    return points
