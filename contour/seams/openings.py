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
# Cell pitches. What lies nearer to the outline are cells that were cut open; and no nearer to it a seam ends, where
# cells of both blocks happen to close it.
OPENED, NEAR_OUTLINE = 0.9, 1.6
# The outline is known to so many samples a pitch.
_SAMPLES = 6.0
# Of the median area; and of a cell's, what is counted for it.
_USUAL, _OF_EITHER, _LEAST_CELL = (0.5, 1.6), (0.35, 2.5), 0.15
# Pitches: how far neighbours are apart, and within how much of where it is looked for a cell's middle lies.
NEIGHBOURS, _MET = (0.6, 1.45), 0.25
# A cell's neighbours are looked for in so many directions; so many of them must be seen, and so much of them lie
# opposite others.
_AROUND, _FEWEST, _OPPOSITE = 18, 5, 0.75
# By how much the pitch of hexagons grows with the root of their area.
_PITCH_OF_SIDE = 1.07


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
        return self._large(*_USUAL)

    @cached_property
    def of_any_block(self) -> Bools:
        """Which openings are single cells, of this block or of another one that lies against it, (N,)."""
        return self._large(*_OF_EITHER)

    def _large(self, least: float, most: float) -> Bools:
        """Which openings are so large of what is usual, (N,)."""
        large = self.area > _LEAST_CELL * self.pitch**2
        usual = median(self.area[large]) if large.any() else 0.0
        return np.asarray(large & (self.area > least * usual) & (self.area < most * usual))

    def at(self, places: Float64s) -> tuple[Int32s, Bools]:
        """What opening places lie in, (..., 2), 0 in none, and whether that is well within the outline, both (...)."""
        x, y = np.moveaxis(np.rint(places).astype(np.intp), -1, 0)
        high, wide = self.depth.shape
        within = (x >= 0) & (y >= 0) & (x < wide) & (y < high)
        x, y = np.where(within, x, 0), np.where(within, y, 0)
        return np.where(within, self.numbers[y, x], 0), within & (self.depth[y, x] > NEAR_OUTLINE)

    def met(self, aim: Float64s, number: Int32s) -> Bools:
        """Whether the opening in which a place lies, (..., 2), is a cell and has its middle there, (...)."""
        return np.asarray(self.cells[number] & self._centred(aim, number, self.pitch))

    def _centred(self, aim: Float64s, number: Int32s, pitch: float | Float64s) -> Bools:
        """Whether an opening has its middle, within a share of the pitch, at a place, (..., 2), shape (...)."""
        off = aim - self.centre[number]
        return np.asarray(np.hypot(off[..., 0], off[..., 1]) < _MET * pitch)

    @cached_property
    def orderly(self) -> Float64s:
        """Middles of cells whose neighbours lie opposite others, as they do in one lattice however it is stretched and
        turned, and not where another begins, (N, 2). Cells of either may be the larger ones.
        """
        cells = self.of_any_block
        middle = self.centre[cells][:, None]
        if not len(middle):
            return np.empty((0, 2))
        side = np.sqrt(self.area[cells])
        pitch = np.maximum(self.pitch + _PITCH_OF_SIDE * (side - median(side)), 1.0)[:, None]
        turn = np.arange(_AROUND) * (2.0 * np.pi / _AROUND)
        beside, _ = self.at(middle + pitch[..., None] * np.column_stack([np.cos(turn), np.sin(turn)]))
        step = self.centre[beside] - middle
        far = np.hypot(step[..., 0], step[..., 1]) / pitch
        opposite, inside = self.at(middle - step)
        seen = inside & cells[beside] & (far > NEIGHBOURS[0]) & (far < NEIGHBOURS[1])
        both = seen & cells[opposite] & self._centred(middle - step, opposite, pitch)
        count = np.count_nonzero(seen, axis=1)
        orderly = (count >= _FEWEST) & (np.count_nonzero(both, axis=1) > _OPPOSITE * count)
        return np.asarray(middle[orderly, 0])


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
