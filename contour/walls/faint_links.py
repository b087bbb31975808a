"""Strands of wall that hang together with the block by walls too faint for the wall mask."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from contour.geometry.arrays import Bytes
from contour.image.opencv import pieces_and_boxes, within
from contour.image.pixel_grid import averaged, coarse_step, enlarged

_COVERAGE = 0.12
# A wall is 0.58 pitch long: a strand any farther off hangs by more than one faint wall, or is a chip.
_REACH_PITCHES = 0.7
# Smaller pieces are specks, larger ones blocks of their own that lie against this one.
_STRAND_PITCHES = (0.8, 6.0)


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
