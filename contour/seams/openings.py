"""Openings between a block's walls: cells, and where walls are missing several of them as one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, Int32s, median
from contour.image.opencv import pieces_and_middles
from contour.image.pixel_grid import averaged, samples_of
from contour.walls.see_block import SeenWalls
from contour.walls.wall_evidence import BlockEvidence

# A sample is wall where so much of it is.
_COVERAGE = 100
# Cell pitches. What lies nearer to the outline are cells that were cut open.
OPENED = 0.9
# The outline is known to so many samples a pitch.
_SAMPLES = 6.0
# Of the median area; and of a cell's, what is counted for it.
_USUAL, _LEAST_CELL = (0.5, 1.6), 0.15


@dataclass(frozen=True, eq=False)
class Openings:
    """Openings on a grid of `step` mask pixels a sample, (h, w), whose first covers mask pixels from `first` (x, y).

    numbers: which one each sample lies in, 0 in none, (h, w). long, area, centre: how long each is, pitches, its
    samples and their middle, (N,), (N,), (N, 2), none's 0. depth: within the block's outline, pitches, (h, w).
    pitch: of its cells, in samples.
    """

    step: int
    first: tuple[int, int]
    pitch: float
    depth: Float32s
    numbers: Int32s
    long: Float64s
    area: Int32s
    centre: Float64s

    @cached_property
    def cells(self) -> Bools:
        """Which openings are single cells, (N,)."""
        large = self.area > _LEAST_CELL * self.pitch**2
        usual = median(self.area[large]) if large.any() else 0.0
        return np.asarray(large & (self.area > _USUAL[0] * usual) & (self.area < _USUAL[1] * usual))


def openings(walls: SeenWalls, seen: BlockEvidence, mask: Bytes, step: int) -> Openings:
    """Openings in a wall mask (H, W), uint8, 255 on walls, of a block that was seen among them."""
    rings = [samples_of(ring.coarse, walls.scale) for ring in seen.rings]
    left, top = (np.maximum(rings[0].min(axis=0), 0.0) // step * step).astype(int).tolist()
    right, bottom = np.ceil(rings[0].max(axis=0)).astype(int).tolist()
    covered = averaged(mask[top : bottom + 1, left : right + 1], step)
    pitch = seen.pitch_px / walls.scale / step
    every = step * max(1, int(pitch / _SAMPLES))
    drawn = np.zeros([-(-size * step // every) for size in covered.shape], np.uint8)
    for ring, one in zip(rings, seen.rings, strict=True):
        corners = np.rint(samples_of(ring - [left, top], every)).astype(np.int32)
        cv2.fillPoly(drawn, [corners], 0 if one.is_hole else 1)
    within = np.asarray(cv2.distanceTransform(drawn, cv2.DIST_L2, 5), np.float32) * np.float32(every / step / pitch)
    fine = cv2.resize(within, None, fx=every // step, fy=every // step, interpolation=cv2.INTER_LINEAR)
    depth = np.asarray(fine[: covered.shape[0], : covered.shape[1]], np.float32)
    free = ((covered < _COVERAGE) & (depth > OPENED)).astype(np.uint8)
    numbers, stats, centre = pieces_and_middles(free, 4)
    long = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) / pitch
    return Openings(step, (left, top), pitch, depth, numbers, long, stats[:, cv2.CC_STAT_AREA], centre)
