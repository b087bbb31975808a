"""Lines that part a block: along long openings, whatever their form, and straight ones along many short openings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, Indices, median
from contour.image.pixel_grid import averaged, enlarged
from contour.seams.openings import NEAR_OUTLINE, OPENED, Openings

# Pitches. Of 150 single blocks without compound, ink or splice the longest opening is 2 to 4 cells long, where walls
# are broken or dim; moved and faded ones have up to 5.8.
LONG, _SHORT = 4.2, 2.5
# So many samples a pitch tell what is parted.
_SAMPLES = 6.0
# Openings of one seam are no farther apart than twice this.
_LINK = 1.25
# Cells in one order are no farther apart than twice this, and what joins two parts of them is wider than twice that: a
# cell or two that lie alike by chance join none. A part has so many square pitches at the least.
_IN_ORDER, _NECK, _LEAST_IN_ORDER = 0.75, 0.3, 4.0
# What is less of the block than this is no part.
_LEAST_PART = 0.02
# An opening parts a strip from the block where so many pitches lead from its ends to the outline, on along it (cosine):
# walls of both touch there. The strip has so many cells, of so many square pitches, as much of it at the least, and so
# much of the block at most.
_TO_OUTLINE, _STRAIGHT_ON = 2.4, 0.6
_STRIP_CELLS, _CELL_SHARE, _STRIP_PITCHES2, _STRIP_SHARE = 2, 0.25, 2.0, 0.15
# How near to long openings a line lies where it runs along them; and what counts for the line itself.
_BY, _ON_IT = 0.5, 0.2
# How much of the line runs along openings: of 103 seams 0.62 and more along long ones, in 120 single blocks without a
# splice 0.18 at most, but for one whose walls are lost. Along short ones, which cells that run into each other make by
# chance as well, seams whose blocks touch have 0.7 and more.
_ALONG, _ALONG_SHORT = 0.38, 0.6
# Longer than single cells by this; places in them that are looked at, a pitch; how far from a line, in so many
# directions, those on it lie; the best lines of all that are looked at; how long one is at the least, and how far one
# is followed beyond the last place.
_MERGED, _PLACES, _ON_LINE, _DIRECTIONS, _BEST, _LEAST_LINE, _BEYOND = 1.5, 3.0, 0.6, 60, 4, 4.0, 6.0
# Nothing asks how far from a line a place is that lies farther, pitches.
_ASKED = 4.0
# In a window of so many pitches both ways most cells decide.
_MOST_OF_PITCHES = 1.2
# Half a step of such a line is left over at each end.
_END = 0.5


@dataclass(frozen=True, eq=False)
class Parted:
    """A part of the block: how much of the line that parts it from the rest runs along openings, and, kept for every so
    manieth sample of (h, w), where it lies and the distance from that line, pitches, inf far from it.
    """

    along: float
    every: int
    shape: tuple[int, ...]
    _part: Bools
    _away: Float32s

    @cached_property
    def part(self) -> Bools:
        """Where it lies, (h, w)."""
        return enlarged(self._part, self.every, self.shape)

    @cached_property
    def away(self) -> Float32s:
        """The distance from the line, pitches, (h, w)."""
        return enlarged(self._away, self.every, self.shape)

    def at(self, places: Float64s) -> tuple[Bools, Float32s]:
        """Of samples (N, 2), x and y: whether each lies in the part, and how far from the line, pitches, (N,) both."""
        column, row = np.rint(places).astype(np.intp).T // self.every
        return self._part[row, column], self._away[row, column]


def parted(free: Openings) -> Parted | None:
    """The part of a block that long openings part most surely from the rest; None where they part none."""
    if free.long.max(initial=0.0) < LONG:
        return None
    found = max(_parts(free), key=lambda one: one.along, default=None)
    return found if found is not None and found.along > _ALONG else None


def runs_along(free: Openings, found: Parted) -> bool:
    """Whether a line that was found among others runs along long openings."""
    if free.long.max(initial=0.0) < LONG:
        return False
    near = _away(free.long[free.numbers] < LONG) < _BY * free.pitch
    return float(np.mean(near[(found.away < _ON_IT) & (free.depth > NEAR_OUTLINE)])) > _ALONG


def parted_strip(free: Openings) -> Parted | None:
    """The strip of cells that a long opening parts from the rest of a block, from outline to outline; None without any.

    A strip of swarf whose walls touch the block's at a place or two is traced as a part of it.
    """
    every = max(1, int(free.pitch / _SAMPLES))
    depth, numbers, pitch = free.depth[::every, ::every], free.numbers[::every, ::every], free.pitch / every
    block = depth > 0.0
    for number in np.flatnonzero(free.long >= LONG).tolist():
        barrier = _to_outline(numbers == number, block, pitch)
        if barrier is None:
            continue
        for part in _pieces(block & (barrier == 0), _STRIP_PITCHES2 * pitch**2):
            strip = part & block
            cells = np.bincount(numbers[strip], minlength=len(free.area)) > _CELL_SHARE * pitch**2
            cells[[0, number]] = False
            few = np.count_nonzero(strip) < _STRIP_SHARE * np.count_nonzero(block)
            if few and np.count_nonzero(cells) >= _STRIP_CELLS:
                return _parted(free, every, 1.0, strip, barrier == 0)
    return None


def _to_outline(opening: Bools, block: Bools, pitch: float) -> Bytes | None:
    """An opening, (h, w), and what leads from both of its ends straight on to the outline of the block, 1 there; None
    where that is far, or lies aside, or the opening lies between samples.
    """
    row, column = np.nonzero(opening)
    if len(row) < 2:
        return None
    place = np.column_stack([column, row]).astype(np.float64)
    middle = place.mean(axis=0)
    axis = np.linalg.eigh(np.cov((place - middle).T))[1][:, 1]
    at = (place - middle) @ axis
    edge_row, edge_column = np.nonzero(~block)
    outside = np.column_stack([edge_column, edge_row]).astype(np.float64)
    barrier = opening.astype(np.uint8)
    for end, ahead in ((place[at.argmin()], -axis), (place[at.argmax()], axis)):
        way = outside - end
        far = np.hypot(*way.T)
        onward = way @ ahead > _STRAIGHT_ON * far
        if not onward.any() or far[onward].min() > _TO_OUTLINE * pitch:
            return None
        nearest = outside[onward][far[onward].argmin()]
        cv2.line(barrier, np.rint(end).astype(int).tolist(), np.rint(nearest).astype(int).tolist(), 1, 2)
    return np.asarray(cv2.dilate(barrier, np.ones((3, 3), np.uint8)), np.uint8)


def parted_by_row(free: Openings) -> Parted | None:
    """The part of a block on one side of a straight line along merged cells; None where none runs along many."""
    usual = median(free.long[free.cells]) if free.cells.any() else np.inf
    every = max(1, int(free.pitch / _PLACES))
    numbers = free.numbers[every // 2 :: every, every // 2 :: every]
    row, column = np.nonzero((free.long > _MERGED * usual)[numbers])
    if not len(row):
        return None
    place = np.column_stack([column, row]) * (every / free.pitch)
    turn = np.arange(_DIRECTIONS) * (math.pi / _DIRECTIONS)
    normal = np.stack([np.cos(turn), np.sin(turn)])
    strip = np.floor((place @ normal) / _ON_LINE).astype(np.intp)
    strip -= strip.min()
    wide = int(strip.max()) + 2
    # Long openings count for more: of two cells each there are as many in a row through a large block as along a seam.
    weight = np.repeat(free.long[numbers[row, column]] - usual, _DIRECTIONS)
    cell = (np.arange(_DIRECTIONS) * wide + strip).ravel()
    total = np.bincount(cell, weight, _DIRECTIONS * wide).reshape(_DIRECTIONS, wide)
    total[:, :-1] += total[:, 1:]
    lines = []
    for number in np.argsort(total, axis=None)[: -_BEST - 1 : -1].tolist():
        one, first = divmod(number, wide)
        on = (strip[:, one] == first) | (strip[:, one] == first + 1)
        lines.append(_line(free, place[on], normal[:, one]))
    share, start, stop = max(lines, key=lambda line: line[0])
    return beside(free, share, start, stop) if share > _ALONG_SHORT else None


def _line(free: Openings, place: Float64s, normal: Float64s) -> tuple[float, Float64s, Float64s]:
    """Of a line through places (K, 2), pitches, by its unit `normal`: the stretch from outline to outline along which
    most of it has such a place beside it, how much that is, and its ends.
    """
    along = np.array([-normal[1], normal[0]])
    at = place @ along
    first, count = float(at.min()) - _BEYOND, int(np.ptp(at) + 2.0 * _BEYOND) * 2
    line = float(np.mean(place @ normal)) * normal + (first + 0.5 * np.arange(count))[:, None] * along
    column, row = np.rint(line * free.pitch).astype(np.intp).T
    inside = (column >= 0) & (row >= 0) & (column < free.depth.shape[1]) & (row < free.depth.shape[0])
    inside[inside] = free.depth[row[inside], column[inside]] > OPENED
    covered = np.bincount(np.rint(2.0 * (at - first)).astype(np.intp), minlength=count)[:count] > 0
    ends = np.flatnonzero(np.diff(np.r_[False, inside, False].astype(np.int8))).reshape(-1, 2)
    stretches = [
        (float(np.mean(covered[a:b])), line[a], line[b - 1]) for a, b in ends.tolist() if b - a > 2.0 * _LEAST_LINE
    ]
    return max(stretches, key=lambda one: one[0], default=(0.0, line[0], line[0]))


def beside(free: Openings, share: float, start: Float64s, stop: Float64s, least: float | None = None) -> Parted | None:
    """What a line from start to stop, pitches, parts from the rest of the block; None where that is nothing, as between
    a hole and the edge, or less than `least`, squares of the pitch.
    """
    every = max(1, int(free.pitch / _SAMPLES))
    depth, pitch = free.depth[::every, ::every], free.pitch / every
    along = (stop - start) / np.hypot(*(stop - start))
    first, last = (np.rint(end * pitch).astype(int).tolist() for end in (start - _END * along, stop + _END * along))
    off_line = cv2.line(np.ones(depth.shape, np.uint8), first, last, 0, 1, cv2.LINE_4) > 0
    samples = _LEAST_PART * np.count_nonzero(depth) if least is None else least * pitch**2
    part = next(_pieces((depth > OPENED) & off_line, samples), None)
    if part is None:
        return None
    return _parted(free, every, share, part, off_line)


def parted_by_kind(free: Openings, cells: Float64s, kind: Bools, astray: float) -> Parted | None:
    """The part of the block in which most cells, (N, 2), are of a kind, (N,); None where that is nothing, or more than
    a share of cells lies astray.
    """
    every = max(1, int(free.pitch / _SAMPLES))
    depth, pitch = free.depth[::every, ::every], free.pitch / every
    row, column = _samples(cells, every, depth.shape)
    apart = np.ones(depth.shape, np.uint8)
    apart[row, column] = 0
    _, nearest = cv2.distanceTransformWithLabels(apart, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    of_kind = np.zeros(int(nearest.max()) + 1, np.uint8)
    of_kind[nearest[row, column]] = kind
    part = cv2.medianBlur(of_kind[nearest], 2 * round(_MOST_OF_PITCHES * pitch) + 1) > 0
    line = (depth > NEAR_OUTLINE) & _border(part)
    found = _parted(free, every, 0.0, part, ~line) if line.any() else None
    return None if found is None or np.mean(found.at(cells)[0] != kind) > astray else found


def _parts(free: Openings) -> Iterator[Parted]:
    """Parts of the block that openings part from the rest of it: long ones alone, and with shorter ones."""
    every = max(1, int(free.pitch / _SAMPLES))
    depth, pitch = free.depth[::every, ::every], free.pitch / every
    inside = depth > NEAR_OUTLINE
    longest, longer = (
        _away(averaged(np.where(free.long >= least, np.uint8(255), np.uint8(0))[free.numbers], every) == 0) / pitch
        for least in (LONG, _SHORT)
    )
    for away in (longest, longer):
        for part, line in _pieces_and_lines(inside & (away > _LINK), inside, _LEAST_PART * np.count_nonzero(depth)):
            yield _parted(free, every, float(np.mean(longest[line] < _BY)), part, ~line)


def parted_by_order(free: Openings) -> Iterator[Parted]:
    """Parts of the block that no cells in one order join, be there openings between them or none; all but the largest,
    which the others' lines part from them.
    """
    every = max(1, int(free.pitch / _SAMPLES))
    depth, pitch = free.depth[::every, ::every], free.pitch / every
    inside = depth > NEAR_OUTLINE
    middles = np.zeros(depth.shape, np.bool_)
    middles[_samples(free.orderly, every, depth.shape)] = True
    near = inside & (_away(~middles) < _IN_ORDER * pitch)
    pieces = list(_pieces_and_lines(_away(near) > _NECK * pitch, inside, _LEAST_IN_ORDER * pitch**2))
    pieces.sort(key=lambda piece: np.count_nonzero(piece[0]))
    for part, line in pieces[:-1] or pieces:
        yield _parted(free, every, 0.0, part, ~line)


def _parted(free: Openings, every: int, along: float, part: Bools, off_line: Bools) -> Parted:
    """A part and what is not the line around it, both on every so manieth sample."""
    pitch = free.pitch / every
    away = np.full(off_line.shape, np.float32(np.inf))
    left, top, wide, high = cv2.boundingRect((~off_line).astype(np.uint8))
    margin = math.ceil(_ASKED * pitch)
    about = np.s_[max(0, top - margin) : top + high + margin, max(0, left - margin) : left + wide + margin]
    away[about] = _away(off_line[about]) / np.float32(pitch)
    return Parted(along, every, free.numbers.shape, part, away)


def _pieces_and_lines(rest: Bools, inside: Bools, least: float) -> Iterator[tuple[Bools, Bools]]:
    """Pieces of the rest, as `_pieces`, and the lines around them."""
    for part in _pieces(rest, least):
        line = inside & _border(part)
        if line.any():
            yield part, line


def _pieces(rest: Bools, least: float) -> Iterator[Bools]:
    """Each piece of the rest, (h, w), of more than `least` samples, with all that is nearer to it than to others; none
    where there is only one.
    """
    # As nearest pieces are labelled: parts that touch at a corner are one.
    _, pieces, stats, _ = cv2.connectedComponentsWithStats(rest.astype(np.uint8), connectivity=8)
    large = stats[:, cv2.CC_STAT_AREA] > least
    large[0] = False
    if np.count_nonzero(large) < 2:
        return
    none: Bytes = (~large[pieces]).astype(np.uint8)
    _, nearest = cv2.distanceTransformWithLabels(none, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_CCOMP)
    yield from (nearest == number for number in range(1, int(nearest.max()) + 1))


def _samples(places: Float64s, every: int, shape: tuple[int, ...]) -> tuple[Indices, Indices]:
    """Rows and columns of places (N, 2) on every so manieth sample, (h, w), (N,) each."""
    column, row = np.rint(places / every).astype(np.intp).T
    return np.minimum(row, shape[0] - 1), np.minimum(column, shape[1] - 1)


def _border(part: Bools) -> Bools:
    """The samples on the border of a part, (h, w)."""
    return np.asarray(cv2.morphologyEx(part.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((2, 2), np.uint8)) > 0)


def _away(free: Bools) -> Float32s:
    """Distance of each sample from the nearest that is not free, samples, (h, w)."""
    return np.asarray(cv2.distanceTransform(free.astype(np.uint8), cv2.DIST_L2, 3), np.float32)
