"""Walls too faint for the wall mask: those that strands hang on, and those that have faded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float32s, median, quantile
from contour.image.opencv import pieces_and_boxes, pieces_of, within
from contour.image.pixel_grid import averaged, coarse_step, enlarged
from contour.walls.coarse_rings import padded

_COVERAGE = 0.12
# A wall is 0.58 pitch long: a strand any farther off hangs by more than one faint wall, or is a chip.
_REACH_PITCHES = 0.7
# Smaller pieces are specks, larger ones blocks of their own that lie against this one.
_STRAND_PITCHES = (0.8, 6.0)

# Light differs from its mean over a cell, and changes by that over another. Beside a block as much of the table counts.
_CHANGE_PITCHES, _ABOUT_PITCHES, _BESIDE_PITCHES = 0.7, 0.9, 2.5
# Where walls have faded, those about the place have too: at four of five samples up to so far from it light changes by
# less than this share of what it does in the block. At the borders of 700 holes it does by 0.5 and more.
_RIM_PITCHES, _MOSTLY, _FADED = 1.0, 0.8, 0.45
# So far from its border a hole's own walls count no more. There light changes at nine of ten samples by so many times
# what it does at most places of the table (holes up to 0.9 times), and in a smaller opening somewhere by so many times.
_CLEAR_PITCHES, _CLEAR_IN_SMALL, _TENTH, _BUSIER, _STANDS_OUT = 0.6, 0.35, 0.1, 1.6, 1.8
_NEARLY_ALL = 0.98
# In glare walls about the place stand out. What changes by so many times what the table does, and at most places by
# this share of what the block does, is comb all the same: 34 holes have 0.36 at most, things that fill them 0.37.
_FAR_BUSIER, _AS_COMB = 4.0, 0.45


@dataclass(frozen=True, eq=False)
class FadedWalls:
    """What light still shows of walls in a block's openings: seen from straight above, or between lamps, they fade.

    change, busy: by how much light differs from its mean over a cell, and how much that is about each sample, grey
    levels and their squares, on the padded coarse grid, (H, W). filled: 1 in the block. samples: the pitch there.
    """

    change: Float32s
    busy: Float32s
    filled: Bytes
    samples: float

    @classmethod
    def of(cls, light: Bytes, step: int, filled: Bytes, samples: float) -> FadedWalls:
        """Of a picture, (h, w), uint8, with so many pixels a sample."""
        # Not in bytes: walls that have all but gone change it by less than a grey level.
        mean = averaged(light.astype(np.float32), step, cv2.BORDER_REPLICATE)
        cell, about = (2 * round(0.5 * pitches * samples) + 1 for pitches in (_CHANGE_PITCHES, _ABOUT_PITCHES))
        change = np.abs(mean - np.asarray(cv2.blur(mean, (cell, cell)), np.float32))
        busy = np.asarray(cv2.blur(change**2, (about, about)), np.float32)
        return cls(padded(change, cv2.BORDER_REPLICATE), padded(busy, cv2.BORDER_REPLICATE), filled, samples)

    def in_hole(self, hole: Bools) -> bool:
        """Whether an opening in the block, (H, W), is none of its holes but cells whose walls have faded."""
        inner = self.busy[hole & (within(self.filled, _CLEAR_PITCHES * self.samples) == 0)]
        table = self.busy[self._table]
        if min(inner.size, table.size) == 0:
            return False
        over = quantile(inner, _TENTH) / max(quantile(table, _MOSTLY), 1e-9)
        if over <= _BUSIER:
            return False
        if over > _FAR_BUSIER and median(inner) > _AS_COMB * self._of_block:
            return True
        return self._have_faded((self.filled > 0) & (within(hole, _RIM_PITCHES * self.samples) > 0))

    def in_small(self, column: float, row: float, radius: float) -> bool:
        """Whether cells whose walls have faded lie where a disc of so many samples fits between walls."""
        rows, columns = np.ogrid[: self.filled.shape[0], : self.filled.shape[1]]
        away = np.hypot(rows - row, columns - column)
        if not self._have_faded((away > radius) & (away < radius + _RIM_PITCHES * self.samples)):
            return False
        inner = self.change[away < max(1.0, radius - _CLEAR_IN_SMALL * self.samples)]
        table = self.change[self._table]
        return table.size > 0 and float(inner.max()) > _STANDS_OUT * quantile(table, _NEARLY_ALL)

    def _have_faded(self, rim: Bools) -> bool:
        return bool(rim.any()) and quantile(self.busy[rim], _MOSTLY) < _FADED * self._of_block

    @cached_property
    def _of_block(self) -> float:
        """How busy the block is."""
        return median(self.busy[self.filled > 0])

    @cached_property
    def _table(self) -> Bools:
        """The table beside the block."""
        _, labels = pieces_of(1 - self.filled, 4)
        close, near = (within(self.filled, reach * self.samples, 5) > 0 for reach in (_CLEAR_PITCHES, _BESIDE_PITCHES))
        return np.asarray((labels == labels[0, 0]) & near & ~close)


def with_faint_links(mask: Bytes, faint: Callable[[], Bytes], pitch_px: float, small: Bytes | None = None) -> Bytes:
    """The wall mask (H, W), uint8, with the walls that lead from its largest piece to strands beside it, of the mask by
    a lower threshold that `faint` makes. `small`: its `averaged` by samples of `coarse_step`, where it is known.

    Foils differ in brightness by a factor of three, and where a dim one ends at the cut, the bright walls of the
    outermost cells would hang on nothing and be taken for chips.
    """
    step = coarse_step(pitch_px)
    samples = pitch_px / step
    walls = _coarse(averaged(mask, step) if small is None else small)
    labels, stats = pieces_and_boxes(walls, 8)
    count = len(stats)
    if count < 3:
        return mask
    main = labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    size = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    strand = (size > _STRAND_PITCHES[0] * samples) & (size < _STRAND_PITCHES[1] * samples)
    strand[1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))] = False
    strand[0] = False
    if not strand.any():
        return mask
    near = within(main, _REACH_PITCHES * samples) > 0
    strand &= np.bincount(labels[near & (walls > 0) & ~main], minlength=count) > 0
    if not strand.any():
        return mask
    strands = strand.take(labels)
    weak = faint()
    links = near & (within(strands, _REACH_PITCHES * samples) > 0) & (_coarse(averaged(weak, step)) > 0) & (walls == 0)
    _, joined = cv2.connectedComponents((main | strands | links).astype(np.uint8), connectivity=8)
    count, parts = cv2.connectedComponents((strands | links).astype(np.uint8), connectivity=8)
    leads = np.bincount(parts[strands], minlength=count) > 0
    links &= (joined == joined[main][0]) & leads.take(parts)
    return np.asarray(np.where(enlarged(links, step, mask.shape), mask | weak, mask), np.uint8)


def _coarse(small: Bytes) -> Bytes:
    """1 where an eighth of a sample is wall."""
    return (small > 255 * _COVERAGE).astype(np.uint8)
