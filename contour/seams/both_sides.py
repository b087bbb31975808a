"""What lies on both sides of a line through a block, and along it: light as in comb, cells in one order or in two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bytes, quantile
from contour.seams.openings import NEAR_OUTLINE, NEIGHBOURS, Openings
from contour.seams.parting import Parted

# Light within so many pitches of the line is held against that of the comb beside it, of so much of which it is as dark
# as the floors of cells, as light as walls, and blacker.
_BAND, _BESIDE = 1.5, (2.0, 4.0)
_FLOOR, _WALL, _BLACK = 0.35, 0.92, 0.05
# Floors reach up to the first share of the contrast between both, walls down to the second. Of how much of comb that is
# floor or wall as much of a seam is, and how little of it is blacker: of 103 seams at least 0.98 and 0.75, at most
# 0.07. Of 36 splices that are lighter than cells the first is 0.70 at most.
_DARK, _LIGHT = 0.12, 0.5
_FLOORS, _WALLS, _BLACKER = 0.85, 0.68, 0.1
# Cells within so many pitches of the line, and what the step between two neighbours leads to: a cell so many steps on.
_ROWS, _STEPS = 2.0, (2, 3, 4)
_FEWEST, _FEWEST_A_SIDE = 12, 10
# How often it does on the same side of the line at the least for another order across to be told, or the same: one of
# five places lies as near to some cell by chance, and of irregular cells two or three of five.
_ORDERLY, _IN_SOME_ORDER = 0.5, 0.35
# Of how often it does on the same side, how often it does across a seam at the most: of 60 seams 0.51 and less, but for
# three whose blocks lie alike by chance (0.68 to 0.79); across lines through accepted single blocks, drawn anywhere,
# 0.62 and more in 599 of 600, 0.54 once. And how often it does across one block at the least: in nine of ten 0.88.
_OTHER, _SAME = 0.5, 0.82
# Between parts that their order alone makes of one block it does in 0.49 at the least, where three arms meet; across
# seams mostly in 0.3 and less.
_SURELY_OTHER = 0.45


def comb_along(light: Bytes, free: Openings, found: Parted) -> bool:
    """Whether light along a line, bright where walls are, is that of comb: floors as dark as cells', none blacker, and
    walls. Cells of one block may look into another light than those of the other, so each side has its own.
    """
    inside = free.depth > NEAR_OUTLINE
    near, beside = inside & (found.away < _BAND), inside & (found.away > _BESIDE[0]) & (found.away < _BESIDE[1])
    both = [(light[near & side], light[beside & side]) for side in (found.part, ~found.part)]
    if min(len(light) for side in both for light in side) == 0:
        return False
    black = min(quantile(comb, _BLACK) for _, comb in both)
    count, usual = np.zeros(3), np.zeros(2)
    for seam, comb in both:
        floor, wall = quantile(comb, _FLOOR), quantile(comb, _WALL)
        dark, bright = (floor + share * (wall - floor) for share in (_DARK, _LIGHT))
        count += [np.count_nonzero(seam < black), np.count_nonzero(seam < dark), np.count_nonzero(seam > bright)]
        usual += len(seam) * np.array([np.mean(comb < dark), np.mean(comb > bright)])
    blacker = count[0] / sum(len(seam) for seam, _ in both)
    return bool(blacker < _BLACKER and count[1] > _FLOORS * usual[0] and count[2] > _WALLS * usual[1])


@dataclass(frozen=True)
class Order:
    """How often the step from one cell to its neighbour leads to others on the same side of a line, and across it;
    whether that was seen on both sides.
    """

    own: float
    across: float
    on_both: bool = False

    @property
    def known(self) -> bool:
        """Whether there are cells enough to say."""
        return self.own > 0.0

    @property
    def other(self) -> bool:
        """Whether cells lie in good order on both sides, and not in the same."""
        return self.on_both and self.own > _ORDERLY and self.across < _OTHER * self.own

    @property
    def some_other(self) -> bool:
        """As `other`, where cells lie in some order only, as irregular ones do: where openings tell as well."""
        return self.on_both and self.own > _IN_SOME_ORDER and self.across < _OTHER * self.own

    @property
    def surely_other(self) -> bool:
        """As `other`, where nothing but the order tells."""
        return self.other and self.across < _SURELY_OTHER * self.own

    @property
    def same(self) -> bool:
        """Whether they lie in one order."""
        return self.own > _IN_SOME_ORDER and self.across > _SAME * self.own


def cell_order(free: Openings, found: Parted) -> Order:
    """The order of cells on both sides of a line; none where they are too few to say."""
    side, distance = found.at(free.centre)
    away = np.where(free.cells, distance, np.inf)
    near, about = np.flatnonzero(away < _ROWS), np.flatnonzero(away < _ROWS + NEIGHBOURS[1])
    apart = free.centre[near][:, None] - free.centre[about]
    far = np.hypot(apart[:, :, 0], apart[:, :, 1]) / free.pitch
    start, other = np.nonzero((far > NEIGHBOURS[0]) & (far < NEIGHBOURS[1]) & (side[near][:, None] == side[about]))
    step, start = apart[start, other], near[start]
    hits: tuple[list[bool], list[bool]] = ([], [])
    seen = np.zeros(2, np.intp)
    for steps in _STEPS:
        aim = free.centre[start] + steps * step
        number, inside = free.at(aim)
        # What lies in a merged cell or beyond the edge says nothing, a wall that there is no cell.
        said = (free.cells[number] | (number == 0)) & inside
        hit = free.met(aim[said], number[said])
        across = found.at(aim[said])[0] != side[start][said]
        seen += np.bincount(side[start][said], minlength=2)
        hits[0].extend(hit[~across].tolist())
        hits[1].extend(hit[across].tolist())
    if min(map(len, hits)) < _FEWEST:
        return Order(0.0, 0.0)
    return Order(float(np.mean(hits[0])), float(np.mean(hits[1])), bool(seen.min() >= _FEWEST_A_SIDE))
