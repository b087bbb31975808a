"""Cells in two sizes, each in a part of its own: there another block begins, of other core."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Float64s, Indices
from contour.seams.openings import Openings
from contour.seams.parting import Parted, parted_by_kind
from contour.seams.two_kinds import two_kinds

# The size of a cell is that of most of so many about it: irregular ones, and two that run together, differ one by one.
_ABOUT = 9
# So many cells tell it.
_ASKED = 400
# How large the step between both sizes is, of the size, how much of it parts most of one from most of the other, and
# what share of cells lies among the other kind. In 360 single blocks no step is so large with more than 0.41 and less
# than 0.03, where motion does not make cells run together; of 25 pairs of other core 17 have 0.5 and less than 0.01.
_STEP, _GAP, _ASTRAY = 0.12, 0.5, 0.015


def parted_by_size(free: Openings) -> Parted | None:
    """The part of a block whose cells are larger than the others; None where they are of one size, or lie among each
    other.
    """
    cells = free.of_any_block
    middles = free.centre[cells]
    if len(middles) < _ABOUT:
        return None
    asked = np.arange(0, len(middles), -(-len(middles) // _ASKED))
    kinds = two_kinds(_sizes(middles, 0.5 * np.log(free.area[cells]), asked))
    if kinds is None or kinds.step < _STEP or kinds.gap < _GAP:
        return None
    return parted_by_kind(free, middles[asked], kinds.more, _ASTRAY)


def _sizes(middles: Float64s, size: Float64s, asked: Indices) -> Float64s:
    """The middle of the sizes about cells at places (N, 2), (N,), of those asked for, (M,)."""
    x, y = middles.T
    away = (x[asked, None] - x) ** 2 + (y[asked, None] - y) ** 2
    about = np.argpartition(away, _ABOUT - 1, axis=1)[:, :_ABOUT]
    return np.asarray(np.median(size[about], axis=1), np.float64)
