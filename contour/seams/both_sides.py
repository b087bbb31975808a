"""What lies on both sides of a line through a block, and along it: light as in comb, cells in one order or in two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bytes, quantile
from contour.seams.openings import Openings
from contour.seams.parting import NEAR_OUTLINE, Parted

# Light within so many pitches of the line is held against that of the comb beside it, of so much of which it is as dark
# as the floors of cells, as light as walls, and blacker.
_BAND, _BESIDE = 1.5, (2.0, 4.0)
_FLOOR, _WALL, _BLACK = 0.35, 0.92, 0.05
# Floors reach up to the first share of the contrast between both, walls down to the second. Of how much of comb that is
# floor or wall as much of a seam is, and how little of it is blacker: of 103 seams at least 0.98 and 0.75, at most
# 0.07. Of 36 splices that are lighter than cells the first is 0.70 at most.
_DARK, _LIGHT = 0.12, 0.5
_FLOORS, _WALLS, _BLACKER = 0.85, 0.68, 0.1
# Cells within so many pitches of the line, the distances of neighbours, and what the step between two of them leads to:
# the cell so many steps on, within a share of a pitch.
_ROWS, _NEIGHBOURS, _STEPS, _MET = 2.0, (0.6, 1.45), (2, 3, 4), 0.25
_FEWEST = 12
# How often it does on the same side of the line at the least for another order across to be told, or the same: one of
# five places lies as near to some cell by chance, and of irregular cells two or three of five.
_ORDERLY, _IN_SOME_ORDER = 0.6, 0.35
# Of how often it does on the same side, how often it does across a seam at the most: of 60 seams 0.51 and less, but for
# three whose blocks lie alike by chance (0.68 to 0.79); across lines through accepted single blocks, drawn anywhere,
# 0.62 and more in 599 of 600, 0.54 once. And how often it does across one block at the least: in nine of ten 0.88.
_OTHER, _SAME = 0.5, 0.82


def comb_along(light: Bytes, free: Openings, found: Parted) -> bool:
    """Whether light along a line, bright where walls are, is that of comb: floors as dark as cells', none blacker, and
    walls.
    """
    inside = free.depth > NEAR_OUTLINE
    near, beside = inside & (found.away < _BAND), inside & (found.away > _BESIDE[0]) & (found.away < _BESIDE[1])
    seam, sides = light[near], [light[beside & side] for side in (found.part, ~found.part)]
    if min(map(len, (seam, *sides))) == 0:
        return False
    comb = np.concatenate(sides)
    # Cells of one block may look into another light than those of the other.
    floor, wall = max(quantile(side, _FLOOR) for side in sides), quantile(comb, _WALL)
    dark, bright = (floor + share * (wall - floor) for share in (_DARK, _LIGHT))
    blacker = np.mean(seam < min(quantile(side, _BLACK) for side in sides)) < _BLACKER
    floors = np.mean(seam < dark) > _FLOORS * np.mean(comb < dark)
    return bool(blacker and floors and np.mean(seam > bright) > _WALLS * np.mean(comb > bright))


@dataclass(frozen=True)
class Order:
    """How often the step from one cell to its neighbour leads to others on the same side of a line, and across it."""

    own: float
    across: float

    @property
    def known(self) -> bool:
        """Whether there are cells enough to say."""
        return self.own > 0.0

    @property
    def other(self) -> bool:
        """Whether cells lie in good order on both sides, and not in the same."""
        return self.own > _ORDERLY and self.across < _OTHER * self.own

    @property
    def same(self) -> bool:
        """Whether they lie in one order."""
        return self.own > _IN_SOME_ORDER and self.across > _SAME * self.own


def cell_order(free: Openings, found: Parted) -> Order:
    """The order of cells on both sides of a line; none where they are too few to say."""
    column, row = np.rint(free.centre).astype(np.intp).T
    away = np.where(free.cells, found.away[row, column], np.inf)
    near, about = np.flatnonzero(away < _ROWS), np.flatnonzero(away < _ROWS + _NEIGHBOURS[1])
    side = found.part[row, column]
    apart = free.centre[near][:, None] - free.centre[about]
    far = np.hypot(apart[:, :, 0], apart[:, :, 1]) / free.pitch
    start, other = np.nonzero((far > _NEIGHBOURS[0]) & (far < _NEIGHBOURS[1]) & (side[near][:, None] == side[about]))
    step, start = apart[start, other], near[start]
    hits: tuple[list[bool], list[bool]] = ([], [])
    for steps in _STEPS:
        aim = free.centre[start] + steps * step
        x, y = np.rint(aim).astype(np.intp).T
        within = (x >= 0) & (y >= 0) & (x < free.depth.shape[1]) & (y < free.depth.shape[0])
        x, y, aim, own = x[within], y[within], aim[within], side[start][within]
        number = free.numbers[y, x]
        # What lies in a merged cell or beyond the edge says nothing, a wall that there is no cell.
        said = (free.cells[number] | (number == 0)) & (free.depth[y, x] > NEAR_OUTLINE)
        hit = free.cells[number] & (np.hypot(*(aim - free.centre[number]).T) < _MET * free.pitch)
        across = found.part[y, x] != own
        hits[0].extend(hit[said & ~across].tolist())
        hits[1].extend(hit[said & across].tolist())
    if min(map(len, hits)) < _FEWEST:
        return Order(0.0, 0.0)
    return Order(float(np.mean(hits[0])), float(np.mean(hits[1])))
