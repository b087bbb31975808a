"""The outline of a block straight from what networks tell: the border of comb, where they and the picture agree."""

from __future__ import annotations

import math

import cv2
import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.agreement import distances_to
from contour.geometry.arrays import Bools, Bytes, Complexes, Float32s, Float64s, Indices, Int32s, Int64s, median
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, Ring, signed_area
from contour.image.opencv import opened, pieces_and_areas, within
from contour.image.pixel_grid import drawn
from contour.image.pixel_sampling import sample_at
from contour.segmentation.network import PITCH_PX, Segments

_SURE, _SPECK_PX = 0.5, 3
# Holes have so many square pitches at least; what is smaller is a cell. Below some more, a disc of 2.2 cells, it may be
# cells that are lost. So large a piece beside the block is another; a block lies so far from the picture's border.
_HOLE, _SURE_HOLE, _ANOTHER, _FROM_BORDER = 1.0, 3.8, 0.02, 0.5
# The borders that two networks tell lie no farther apart, pitches. A disc without walls in it, in the block, has that
# radius at most. Where walls are drawn the picture shows some: they go together that well, within so many pitches.
_APART, _BARE, _SEEN_WALL, _TOGETHER, _EVEN_PITCHES, _WALL_PITCHES = 0.45, 0.7, 0.3, 0.5, 0.5, 0.375
# Walls surer than this part cells, none of which is so many times as large as most: of 45 right outlines two have one
# that is, rows of crushed cells, and all of five that left out a slot of two cells.
_PARTS, _LARGEST = 0.24, 2.5
# Walls that hardly show part none of them, where all of such a room, but for its rim, is comb so surely: of nine slots
# and holes that were left out none is by 0.2, of eight right outlines with such a room half are.
_ALL_COMB, _RIM_PX = 0.4, 3
# A place is not asked about walls nearer to the border than that, pitches, nor light that changes by less, grey levels.
_WITHIN, _LEAST_LIGHT = 0.6, 1.0
# Places along a ring, pitches; over how many of them at each side its noise is averaged; and how far from the pixels at
# the block's border it is looked for where the map falls through half, samples.
_STEP, _EVEN, _ACROSS_PX = 0.125, 3, np.arange(-1.5, 2.01, 0.25)
# Sides of a corner are straight so far from it, pitches, up to so much, and turn by that at least; they meet so near.
# Networks round corners off, and a rounding looks like one: halfway to where the sides meet is wrong by half of that.
_NEAR, _FAR, _STRAIGHT, _TURN, _MEET = 0.75, 2.0, 0.05, math.radians(25.0), 0.8
# Where sides that turn by more meet farther away, but no farther than that, a tip was left out; not where they are that
# far apart still, as at the round end of a notch.
_POINTED, _TIP, _BLUNT = math.radians(60.0), 3.0, 0.95


def comb_outline(light: Bytes, seen: Segments, other: Float32s) -> tuple[Contour, float]:
    """The outline of the one block that a network sees in a picture of its size, (h, w), samples, and within what 95 %
    of it surely lie, pitches. other: how surely another network sees comb, 0…1, (h, w).

    Raises NoBlockFound where these, or the walls that are drawn and the picture, do not agree.
    """
    block = _block_of(seen.comb)
    apart = _apart(block, _same_of(other, block))
    far = float(apart.max(initial=0.0))
    if far > _APART:
        raise NoBlockFound(f"no block found: two networks see its border up to {min(far, 99.0):.1f} cells apart")
    _check_walls(light, seen.wall, seen.comb, block)
    return _outline(block, seen.comb), float(np.quantile(apart, 0.95))


def farthest_from(outline: Contour, comb: Float32s) -> float:
    """How far from an outline the border of the comb that lies in it is at most, pitches: samples, (h, w)."""
    pieces, _ = _pieces(comb)
    within_it = np.bincount(pieces[drawn(outline.rings, comb.shape, 1.0) > 0], minlength=2)
    within_it[0] = 0
    block, _ = _whole(pieces == int(within_it.argmax()) if within_it.any() else np.zeros(comb.shape, np.bool_))
    edges = cv2.findContours(block.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)[0]
    places = np.concatenate([np.empty((0, 2)), *(edge[:, 0] for edge in edges)])
    return float(distances_to(places, outline).max(initial=0.0 if len(places) else math.inf)) / PITCH_PX


def _block_of(comb: Float32s) -> Bools:
    """The largest piece of comb, (h, w), with what is too small for a hole. Raises NoBlockFound where another piece is
    no speck beside it, where it goes on to the picture's border, and where a hole may be cells that are lost.
    """
    pieces, area = _pieces(comb)
    *_, another, largest = sorted((*area.tolist(), 0))
    if another > _ANOTHER * largest:
        raise NoBlockFound("no block found: a network sees more than one piece of comb")
    block, holes = _whole(pieces == int(area.argmax()) if largest else np.zeros(comb.shape, np.bool_))
    rim = round(_FROM_BORDER * PITCH_PX)
    if np.count_nonzero(block) > np.count_nonzero(block[rim:-rim, rim:-rim]):
        raise NoBlockFound("no block found: comb goes on to the last pixels of what a network was asked about")
    if (holes < _SURE_HOLE * PITCH_PX**2).any():
        raise NoBlockFound("no block found: a network sees a hole so small that cells may be lost there")
    return block


def _same_of(comb: Float32s, block: Bools) -> Bools:
    """All pieces of comb that have a part in a block, (h, w), with what is too small for a hole."""
    pieces, area = _pieces(comb)
    there = np.bincount(pieces[block], minlength=len(area)) > 0
    there[0] = False
    return _whole(there[pieces])[0]


def _pieces(comb: Float32s) -> tuple[Int32s, Int64s]:
    """The pieces of comb, specks left out, (h, w), 0 elsewhere, and the area of each."""
    return pieces_and_areas(opened((comb > _SURE).astype(np.uint8), _SPECK_PX), 8)


def _whole(block: Bools) -> tuple[Bools, Int64s]:
    """A block with what is too small for a hole in it, and the areas of what is not, what lies around it too."""
    gaps, size = pieces_and_areas((~block).astype(np.uint8), 4)
    small = size < _HOLE * PITCH_PX**2
    return np.asarray(block | small[gaps], np.bool_), size[1:][~small[1:]]


def _apart(one: Bools, other: Bools) -> Float32s:
    """How far from the border of each of two blocks, (h, w), that of the other lies, pitches, (N,)."""
    edges = [
        cv2.morphologyEx(block.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
        for block in (one, other)
    ]
    if not all(edge.any() for edge in edges):
        return np.array([math.inf], np.float32)
    away = [cv2.distanceTransform(1 - edge, cv2.DIST_L2, 5) for edge in edges]
    both = np.concatenate([away[1][edges[0] > 0], away[0][edges[1] > 0]])
    return np.asarray(both / np.float32(PITCH_PX), np.float32)


def _check_walls(light: Bytes, wall: Float32s, comb: Float32s, block: Bools) -> None:
    """Raise NoBlockFound where a block shows no walls, or none where walls are drawn."""
    inner = cv2.distanceTransform(block.astype(np.uint8), cv2.DIST_L2, 5)
    bare, asked = (inner > _BARE * PITCH_PX) & without_walls(wall, _BARE), inner > _WITHIN * PITCH_PX
    if bare.any() or not asked.any():
        raise NoBlockFound("no block found: a network sees comb where it sees no walls")
    rooms, area = pieces_and_areas((block & (wall < _PARTS)).astype(np.uint8), 4)
    cells = area[area > _SPECK_PX**2]
    unsure = cv2.erode((rooms > 0).astype(np.uint8), np.ones((_RIM_PX, _RIM_PX), np.uint8)) > 0
    unsure &= comb < _ALL_COMB
    if not len(cells) or (area[rooms[unsure]] > _LARGEST * median(cells)).any():
        raise NoBlockFound("no block found: a network sees comb with cells missing, or with a hole too small to tell")
    together = _together(light.astype(np.float32), wall)[asked]
    least = float((together * np.sign(np.median(together))).min())
    if least < _TOGETHER:
        raise NoBlockFound(f"no block found: a network sees walls where the picture hardly shows any ({least:.2f})")


def without_walls(wall: Float32s, pitches: float) -> Bools:
    """Where no wall surely is within so many pitches in a map of them, (h, w)."""
    return np.asarray(within(wall > _SEEN_WALL, pitches * PITCH_PX) == 0, np.bool_)


def _together(light: Float32s, wall: Float32s) -> Float32s:
    """How well light and walls go together about each place, −1…1, (h, w)."""

    def even(plane: Float32s, pitches: float) -> Float32s:
        return np.asarray(cv2.GaussianBlur(plane, (0, 0), pitches * PITCH_PX), np.float32)

    light, wall = light - even(light, _WALL_PITCHES), wall - even(wall, _WALL_PITCHES)
    change = np.maximum(even(light * light, _EVEN_PITCHES), np.float32(_LEAST_LIGHT))
    drawn = np.maximum(even(wall * wall, _EVEN_PITCHES), np.float32(1e-4))
    return np.asarray(even(light * wall, _EVEN_PITCHES) / np.sqrt(change * drawn), np.float32)


def _outline(block: Bools, comb: Float32s) -> Contour:
    """The border of a block in a map of comb, (h, w) each, samples."""
    found = cv2.findContours(block.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)[0]
    even = np.asarray(cv2.GaussianBlur(comb, (0, 0), 1.0), np.float32)
    pixels = [ring[:, 0].astype(np.float64) for ring in found]
    ways = np.split(outward(even, np.concatenate(pixels)), np.cumsum([len(ring) for ring in pixels])[:-1])
    rings = [_with_corners(_evened(_on_border(*ring, even))) for ring in zip(pixels, ways, strict=True)]
    rings.sort(key=lambda ring: -abs(signed_area(ring)))
    return Contour.of(rings)


def outward(comb: Float32s, points: Float64s) -> Float64s:
    """Which way a map of comb, (h, w), falls at points, (N, 2): unit vectors, (N, 2)."""
    slopes = [np.asarray(cv2.Sobel(comb, cv2.CV_32F, *axis), np.float32) for axis in ((1, 0), (0, 1))]
    falls = -np.column_stack([sample_at(slope, points[:, 0], points[:, 1]) for slope in slopes])
    return np.asarray(falls / np.maximum(np.hypot(falls[:, :1], falls[:, 1:]), 1e-6), np.float64)


def _on_border(ring: Ring, ways: Float64s, comb: Float32s) -> Ring:
    """The pixels at a block's border, (N, 2), each moved that way to where an even map falls through half."""
    there = ring[:, None] + _ACROSS_PX[:, None] * ways[:, None]
    sure = sample_at(comb, there[..., 0], there[..., 1])
    ends = (sure[:, 1:] <= _SURE) & (sure[:, :-1] > _SURE)
    first, row = np.argmax(ends, axis=1), np.arange(len(ring))
    before, after = sure[row, first], sure[row, first + 1]
    far = _ACROSS_PX[first] + np.diff(_ACROSS_PX)[first] * (before - _SURE) / np.maximum(before - after, 1e-6)
    return np.asarray(ring + np.where(ends.any(axis=1), far, 0.5)[:, None] * ways, np.float64)


def _evened(ring: Ring) -> Ring:
    """The ring in even steps, without its noise."""
    lengths = RingLengths.of(ring)
    count = max(8, round(lengths.length / (_STEP * PITCH_PX)))
    places = lengths.at(np.arange(count) * lengths.length / count)
    return np.asarray(np.mean([np.roll(places, by, axis=0) for by in range(-_EVEN, _EVEN + 1)], axis=0), np.float64)


def _with_corners(ring: Ring) -> Ring:
    """The ring, in even steps, with corners where straight sides of it meet nearby."""
    near, far = round(_NEAR / _STEP), round(_FAR / _STEP)
    path = ring[:, 0] + 1j * ring[:, 1]
    if len(path) < 4 * far:
        return ring
    (one, way, off), (other, next_way, next_off) = (
        _side(path, sign * np.arange(near, far + 1, dtype=np.intp)) for sign in (-1, 1)
    )
    turn = np.angle(next_way * way.conj())
    across = np.where(np.abs(turn) > _TURN, (way.conj() * next_way).imag, 1.0)
    meet = one + way * ((other - one).conj() * next_way).imag / across
    away = np.abs(meet - path)
    straight = np.maximum(off, next_off) < _STRAIGHT * PITCH_PX
    narrow = 2.0 * away / np.maximum(np.tan(0.5 * np.abs(turn)), 1e-6) < _BLUNT * PITCH_PX
    if (straight & narrow & (np.abs(turn) > _POINTED) & (away > _MEET * PITCH_PX) & (away < _TIP * PITCH_PX)).any():
        raise NoBlockFound("no block found: a network tells too little of a tip of its border")
    corner = (np.abs(turn) > _TURN) & straight & (away < _MEET * PITCH_PX)
    corners, kept = path.copy(), np.ones(len(path), np.bool_)
    free = corner.copy()
    while free.any():
        first = int(np.where(free, away, np.inf).argmin())
        kept[(first + np.arange(-near, near + 1)) % len(path)] = False
        free[(first + np.arange(-far, far + 1)) % len(path)] = False
        corners[first], kept[first] = 0.5 * (meet[first] + path[first]), True
    return np.column_stack([corners[kept].real, corners[kept].imag])


def _side(path: Complexes, steps: Indices) -> tuple[Complexes, Complexes, Float64s]:
    """Of each place along a ring, (N,), the middle of its part so many steps on, its direction there, and how far that
    part lies off a line at worst.
    """
    points = path[(np.arange(len(path))[:, None] + steps) % len(path)]
    middle = points.mean(axis=1)
    local = points - middle[:, None]
    way = np.sqrt((local**2).mean(axis=1))
    way /= np.maximum(np.abs(way), 1e-9)
    along = (points[:, -1] - points[:, 0]) * np.sign(steps[-1])
    way = np.where((way * along.conj()).real < 0.0, -way, way)
    return middle, way, np.abs((local * way.conj()[:, None]).imag).max(axis=1)
