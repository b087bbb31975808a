"""A straight line at which the floors of cells become lighter: there another block begins, whose cells are not as deep,
or hold another light.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float64s, median, quantile
from contour.seams.openings import NEAR_OUTLINE, Openings
from contour.seams.parting import Parted, beside

# Directions that are looked along, and how far apart lines are, pitches. Cells within so much of a line are beside it,
# and those as much farther out tell how floors differ anyway. They lie along most of the line.
_DIRECTIONS, _APART, _NEAR, _BAND = 36, 0.5, 0.3, 2.3
_FEWEST_CELLS, _FEWEST_BEYOND, _PARTS, _FEWEST_PARTS, _LEAST_LONG, _OF_CHORD = 8, 5, 4, 3, 4.0, 0.8
# How large the step is of the contrast of walls, of what floors beside the line differ by, and of it in each part of
# the line; and of it how floors farther out step, and of that of floors how much walls do, which a shadow darkens
# alike. Of 140 single blocks, glare, shadows, ink and compound among them, none has all: steps of 0.14 and more were
# glare's, 5.6 times the spread at most, 0.77 in the least part; of five seams none less than 0.16, 7.5 and 0.79.
_STEP, _SPREADS, _IN_EACH_PART, _BEYOND, _OF_WALLS = 0.14, 6.0, 0.7, 0.2, 0.5
# Compound fills some cells beside a line and leaves others as they were.
_LEAST_SPREAD, _LIKE_OTHER = 0.5, 0.08
# Glare grows with the distance from the line: of its step floors of so many cells farther out differ by 0.43 to 0.76
# from those near it, in six pictures, beside two seams by 0.14 at most.
_GROWS, _FEWEST_FARTHER = 0.25, 3
_WALL = 0.7


@dataclass(frozen=True, eq=False)
class _Line:
    """A line by its unit normal, (2,), and the distance along it, pitches; `step` in floors across it, grey levels."""

    normal: Float64s
    distance: float
    step: float

    @property
    def along(self) -> Float64s:
        """The unit vector along it, (2,)."""
        return np.array([-self.normal[1], self.normal[0]])

    def at(self, places: Float64s) -> Float64s:
        """The points at places along it, pitches, (N, 2)."""
        return self.distance * self.normal + places[:, None] * self.along


def parted_by_floors(light: Bytes, free: Openings) -> Parted | None:
    """The part of a block whose cells' floors are lighter or darker than the others' from a straight line on; None
    without any. light: bright where walls are, (h, w), on the openings' grid.
    """
    place, floor = free.centre[free.cells] / free.pitch, _floors(light, free)[free.cells]
    line = _best_line(place, floor) if len(place) >= 2 * _FEWEST_CELLS else None
    if line is None:
        return None
    away, at = place @ line.normal - line.distance, place @ line.along
    before, after = _beside(-away), _beside(away)
    if min(np.count_nonzero(before), np.count_nonzero(after)) < _FEWEST_CELLS:
        return None
    row, column = np.nonzero((free.numbers == 0) & (free.depth > NEAR_OUTLINE))
    walls = light[row, column]
    if abs(line.step) < _STEP * (quantile(walls, _WALL) - median(floor)):
        return None
    start, stop = max(at[before].min(), at[after].min()), min(at[before].max(), at[after].max())
    part = np.floor((at - start) / max(stop - start, 1e-9) * _PARTS)
    if not _is_step(floor, away, part) or stop - start < max(_LEAST_LONG, _OF_CHORD * _chord(free, line)):
        return None
    off = (column * line.normal[0] + row * line.normal[1]) / free.pitch - line.distance
    of_walls = _share(*(quantile(walls[_beside(side)], _WALL) for side in (-off, off)))
    of_floors = _share(median(floor[before]), median(floor[after]))
    if of_walls * math.copysign(1.0, of_floors) > _OF_WALLS * abs(of_floors):  # a shadow begins
        return None
    return beside(free, 0.0, *line.at(np.array([start - _BAND, stop + _BAND])))


def _chord(free: Openings, line: _Line) -> float:
    """How much of a line lies well within the block, pitches."""
    reach = math.hypot(*free.numbers.shape) / free.pitch
    places = line.at(np.arange(-reach, reach, _APART))
    return _APART * float(np.count_nonzero(free.at(places * free.pitch)[1]))


def _floors(light: Bytes, free: Openings) -> Float64s:
    """The light of each opening's darker half, (N,)."""
    inside = np.flatnonzero(free.numbers)
    number, level = free.numbers.ravel()[inside], light.ravel()[inside]
    mean = np.bincount(number, level, len(free.area)) / np.maximum(free.area, 1)
    dark = level <= mean[number]
    total, count = (np.bincount(number[dark], of, len(free.area)) for of in (level[dark], None))
    return np.asarray(total / np.maximum(count, 1), np.float64)


def _best_line(place: Float64s, floor: Float64s) -> _Line | None:
    """The line across which the means of floors step most, less what they do beside it; place (N, 2), pitches."""
    best, most = None, 0.0
    for turn in (np.arange(_DIRECTIONS) * (math.pi / _DIRECTIONS)).tolist():
        normal = np.array([math.cos(turn), math.sin(turn)])
        away = place @ normal
        order = np.argsort(away)
        sums = np.concatenate([[0.0], np.cumsum(floor[order])])
        lines = np.arange(float(away.min()), float(away.max()), _APART)
        bounds = np.array([-2.0 * _BAND - 2.0 * _NEAR, -_BAND - 2.0 * _NEAR, -_BAND - _NEAR, -_NEAR])
        bounds = np.searchsorted(away[order], lines[:, None] + np.concatenate([bounds, -bounds[::-1]]))
        first, last = bounds[:, ::2], bounds[:, 1::2]
        count = last - first
        mean = (sums[last] - sums[first]) / np.maximum(count, 1)
        step = mean[:, 2] - mean[:, 1]
        drift = np.abs(np.where(count[:, [0, 3]] < _FEWEST_BEYOND, 0.0, mean[:, [0, 3]] - mean[:, [1, 2]])).max(axis=1)
        score = np.where(count[:, 1:3].min(axis=1) < _FEWEST_CELLS, 0.0, np.abs(step) - drift / _BEYOND)
        one = int(score.argmax())
        if score[one] > most:
            best, most = _Line(normal, float(lines[one]), float(step[one])), float(score[one])
    return best


def _beside(away: Float64s) -> Bools:
    """Which cells so far beyond a line are beside it."""
    return np.asarray((away > _NEAR) & (away < _NEAR + _BAND))


def _grows(floor: Float64s, away: Float64s, step: float) -> bool:
    """Whether floors beside a line differ by much of the step across it the farther out they lie."""
    side, farther = _beside(away), away > _NEAR + 0.5 * _BAND
    near, far = floor[side & ~farther], floor[side & farther]
    return min(len(near), len(far)) >= _FEWEST_FARTHER and abs(median(far) - median(near)) > _GROWS * abs(step)


def _is_step(floor: Float64s, away: Float64s, part: Float64s) -> bool:
    """Whether floors, so far beyond a line, step all along it, by more than they differ on each side of it; part: which
    of the line's each lies in.
    """
    before, after = _beside(-away), _beside(away)
    low, high = median(floor[before]), median(floor[after])
    spread = median(np.abs(np.concatenate([floor[before] - low, floor[after] - high]))) * 1.4826 + _LEAST_SPREAD
    like_other = np.abs(floor - np.where(after, high, low)) > np.abs(floor - np.where(after, low, high))
    alike = max(np.mean(like_other[before]), np.mean(like_other[after]))
    if abs(high - low) < _SPREADS * spread or alike > _LIKE_OTHER:
        return False
    if _grows(floor, -away, high - low) or _grows(floor, away, high - low):
        return False
    seen = 0
    for number in range(_PARTS):
        one, other = floor[before & (part == number)], floor[after & (part == number)]
        if len(one) and len(other):
            seen += 1
            if (median(other) - median(one)) / (high - low) < _IN_EACH_PART:
                return False
    return seen >= _FEWEST_PARTS


def _share(one: float, other: float) -> float:
    """By how much of the lighter one the other is lighter."""
    return (other - one) / max(one, other, 1.0)
