"""The comb of a picture as light walls on black, whatever table it lies on."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s
from contour.geometry.rings import Contour
from contour.image.opencv import box_mean, deep, grown, opened, pieces_and_areas, sized
from contour.image.pixel_grid import pixels_of, samples_of
from contour.segmentation.comb_outline import comb_outline, farthest_from, outward, without_walls
from contour.segmentation.glare import glare
from contour.segmentation.network import (
    LIGHT_PITCH_PX,
    PITCH_PX,
    Segments,
    comb_and_covers,
    comb_and_things,
    segments,
)
from contour.walls.cell_scale import probe
from contour.walls.dark_material import dark_beyond
from contour.walls.lightness import wall_light
from contour.walls.see_block import Outline, Source

# Pitches that are tried: cells may be half or twice as large as it has learnt. The light network is asked first, of
# large ones first, which cost least: a comb is a piece of so many cells, specks left out. One that takes so much of the
# picture is not looked for at the smallest, which costs most; nor at one at which it could not be drawn though cells
# were so many times as large.
_GUESSES, _CELLS, _SPECK_PX, _MUCH, _TWICE = (40.0, 20.0, 11.0), 100, 9, 0.2, 2.0
# The drawing network is asked about pieces of so much of the largest one, and so many guesses around them.
_PIECE, _AROUND = 0.02, 5.0
# A comb that is seen so well is not looked for at another size; one that is seen worse than this is none.
_GOOD, _LEAST = 0.3, 0.14
# Between these shares of the pitch that the network has learnt walls are drawn well enough.
_NEAR = (0.9, 1.4)
# Pixels that the network is asked about at most, half a second and two seconds: of more the middle is tried.
_TRIED_PX, _MOST_PX = 1e6, 4e6
# What is surer than this is there. A thing at the edge of comb, of which so many pixels are looked at, need not be so
# sure in the mean of so many: of 140 things over an edge on tables with structure, by two hands, none was drawn away.
_SURE, _LEAST_THING, _EDGE_PX, _MEAN_PX = 0.5, 0.25, 9, 7
# The network that knows more of them is asked, too. Above this by it there is one, whatever the first one says; where
# an outline rests on no ends of walls there is none below that, whatever it says. Of 83 pictures by three hands with a
# thing over the edge four pass so, ten by the first one alone; of right outlines, small holes let by, 66 and 61.
_SURE_COVER, _LEAST_COVER = 0.5, 0.1
# Outlines through ends of walls, or near the border of comb, lie that near to the border that each network sees,
# pitches. Of 69 right ones by three hands the farthest lies 0.35 from the first one's, and about one of 30 more than
# 0.6 from the other's; of three wrong ones two are told.
_FROM_FIRST, _FROM_OTHER = 0.37, 0.6
# Of so few pixels there it is none. Gaps in comb no deeper than that, pitches, are ink or print: holes are wider.
_FEW_PX, _GAP = 24, 0.6
_OVER = "no block found: a network sees no comb with nothing over its edge"
# The area of a cell, of its pitch's square.
_CELL = math.sqrt(0.75)
# Levels of black and, above it, of walls.
_DARK, _WALL = 12.0, 230.0
# The border of comb is told every so many samples, across its slope over so many; shorter ones are specks.
_BORDER_PX, _EVEN_PX, _SHORTEST_PX = 4, 2.0, 40
# No place in a cell is so many pitches from a wall; and the sum of waves along walls.
_ROOM, _ALONG_WALLS = 0.65, -0.8


@dataclass(frozen=True, eq=False)
class CombPicture:
    """The comb in a picture: `drawn` with light walls, all else dark, (H, W), uint8. `seen` is what a network tells of
    the picture's `light`, (H, W), at another size, (h, w), `whole` how surely there is comb, with ink on it.
    """

    picture: Bytes
    light: Bytes
    pitch_px: float
    seen: Segments
    whole: Float32s
    drawn: Bytes

    def walled(self) -> Source:
        """What it was drawn from, for ends of walls to tell. Raises NoBlockFound where a thing may lie over them."""
        if self._over:
            raise NoBlockFound(_OVER)
        return Source(self.picture)

    def bordered(self) -> Source:
        """What it was drawn from, with the border of comb. Raises NoBlockFound where a thing may lie over that."""
        return replace(self.walled(), border=pixels_of(_border(self.whole), self._step))

    def outlined(self) -> Source:
        """What it was drawn from, with the outline that two networks tell. Raises NoBlockFound where they do not agree,
        and where a thing may lie over it, which the one that knows more things does not rule out.
        """
        if self._over and self._lies(self._covers[1] > _LEAST_COVER):
            raise NoBlockFound(_OVER)
        shape = self.whole.shape
        contour, apart = comb_outline(sized(self.light, shape), self.seen, self._covers[0])
        outline = Contour.of(pixels_of(ring, self._step) for ring in contour.rings)
        return Source(self.picture, outline=Outline(outline, self.pitch_px, apart * self.pitch_px))

    def check(self, outline: Contour) -> None:
        """Raise NoBlockFound where a network sees the border of comb elsewhere than along an outline in the picture."""
        sampled = Contour.of(samples_of(ring, self._step) for ring in outline.rings)
        for comb, most in ((self.whole, _FROM_FIRST), (self._covers[0], _FROM_OTHER)):
            far = farthest_from(sampled, comb)
            if far > most:
                away = f"up to {min(far, 99.0):.1f} cells from the outline"
                raise NoBlockFound(f"no block found: a network sees the border of comb {away}")

    @cached_property
    def _covers(self) -> tuple[Float32s, Float32s]:
        """How surely each pixel is comb, and a thing over it, by the network that knows more things, (h, w) each."""
        comb, thing = comb_and_covers(self.light, self.pitch_px)
        return np.asarray(grown(comb, self.whole.shape), np.float32), box_mean(grown(thing, self.whole.shape), _MEAN_PX)

    @cached_property
    def _over(self) -> bool:
        """Whether what may be a thing, or glare, lies over the edge of the comb, or in a hole of it."""
        return self._lies(_things(self.seen)) or self._lies(self._covers[1] > _SURE_COVER)

    @cached_property
    def _edge(self) -> tuple[Bools, Bools]:
        """The edge of the comb and of its holes, and where glare is, (h, w) each."""
        block, _ = _large((self.whole > _SURE).astype(np.uint8))
        edge = cv2.morphologyEx(block.astype(np.uint8), cv2.MORPH_GRADIENT, np.ones((_EDGE_PX, _EDGE_PX), np.uint8)) > 0
        return np.asarray(edge, np.bool_), glare(self.picture, block, PITCH_PX)

    def _lies(self, thing: Bools) -> bool:
        """Whether such things, or glare, (h, w), lie at the edge of the comb, or in a hole of it."""
        edge, lit = self._edge
        return int(pieces_and_areas((edge & (thing | lit)).astype(np.uint8), 8)[1].max()) > _FEW_PX

    @property
    def _step(self) -> Float64s:
        """How many pixels of the picture a sample of what the network tells is across and down, (2,)."""
        return np.asarray(np.array(self.light.shape[::-1]) / self.whole.shape[::-1], np.float64)


def comb_picture(picture: Bytes) -> CombPicture | None:
    """The comb in a picture, grey (H, W) or BGR (H, W, 3), uint8; None where no comb is seen."""
    light = wall_light(picture)
    score, pitch_px, found, box = 0.0, 0.0, None, (slice(None), slice(None))
    for guess, there in _pitches(light):
        part = _middle(light[there], guess)
        seen = segments(part, guess)
        drawn = _drawn(seen)
        try:
            cells = probe(drawn, "bright")
        except NoBlockFound:
            continue
        if cells.score > score:
            near = _NEAR[0] < cells.pitch_px / PITCH_PX < _NEAR[1]
            score, pitch_px = cells.score, cells.pitch_px * part.shape[1] / drawn.shape[1]
            box, found = there, seen if near and part.shape == light.shape else None
        if score > _GOOD:
            break
    if score < _LEAST or light[box].size * (PITCH_PX / pitch_px) ** 2 > _MOST_PX:
        return None
    if found is None:
        found = segments(light, pitch_px, box)
        if _leaves(found.comb, box, light.shape):
            return None
    whole = replace(found, comb=_without_gaps(found.comb, _things(found)))
    return CombPicture(picture, light, pitch_px, found, whole.comb, sized(_drawn(whole), light.shape))


def _pitches(light: Bytes) -> list[tuple[float, tuple[slice, slice]]]:
    """At which pitches the light network sees comb, and rows and columns of all that it sees, with what lies around;
    that pitch first of which it sees most.
    """
    areas = dict[float, float]()
    boxes = dict[float, tuple[slice, slice]]()
    for guess in _GUESSES:
        if guess == _GUESSES[-1] and max(areas.values(), default=0.0) > _MUCH:
            break
        if light.size * (PITCH_PX / (_TWICE * guess)) ** 2 > _MOST_PX:
            continue
        comb = (comb_and_things(light, guess)[0] > _SURE).astype(np.uint8)
        large, most = _large(opened(comb, _SPECK_PX))
        if most > _CELLS * _CELL * LIGHT_PITCH_PX**2:
            areas[guess] = most / comb.size
            boxes[guess] = _box(large, light.shape, _AROUND * guess)
    return [(guess, boxes[guess]) for guess in sorted(areas, key=areas.__getitem__, reverse=True)]


def _box(part: Bools, shape: tuple[int, ...], around: float) -> tuple[slice, slice]:
    """Rows and columns of a picture of that shape, (H, W), in which part of a map of it lies, and so many more pixels
    around.
    """
    x, y, width, height = cv2.boundingRect(part.astype(np.uint8))
    ends = ((y, y + height), (x, x + width))
    rows, columns = (
        slice(max(0, int(first * side / small - around)), min(side, math.ceil(last * side / small + around)))
        for (first, last), side, small in zip(ends, shape, part.shape, strict=True)
    )
    return rows, columns


def _leaves(comb: Float32s, box: tuple[slice, slice], shape: tuple[int, ...]) -> bool:
    """Whether much of comb, (h, w), reaches the border of a box of the picture, of that shape, (H, W), where that is
    not the picture's.
    """
    inner = np.zeros(comb.shape, np.bool_)
    edges = []
    for one, small, side in zip(box, comb.shape, shape, strict=True):
        first, last = one.start * small / side + PITCH_PX, one.stop * small / side - PITCH_PX
        edges.append(slice(int(first) if one.start > 0 else 0, int(last) if one.stop < side else small))
    inner[edges[0], edges[1]] = True
    return bool((_large((comb > _SURE).astype(np.uint8))[0] & ~inner).any())


def _middle(light: Bytes, pitch_px: float) -> Bytes:
    """The picture, or as much of its middle as is tried at that pitch."""
    share = math.sqrt(_TRIED_PX / light.size) * pitch_px / PITCH_PX
    if share >= 1.0:
        return light
    inner = [slice(round(0.5 * (1.0 - share) * side), round(0.5 * (1.0 + share) * side)) for side in light.shape]
    return np.ascontiguousarray(light[inner[0], inner[1]])


def _things(seen: Segments) -> Bools:
    """Where the first network sees what may be a thing, (h, w)."""
    return np.asarray(box_mean(seen.thing, _MEAN_PX) > _LEAST_THING, np.bool_)


def _large(mask: Bytes) -> tuple[Bools, int]:
    """The large pieces of a mask of 0 and 1, (h, w), and the largest one's area."""
    pieces, area = pieces_and_areas(mask, 8)
    most = int(area.max())
    return np.asarray((area > _PIECE * most)[pieces], np.bool_), most


def _without_gaps(comb: Float32s, thing: Bools) -> Float32s:
    """The comb, (h, w), also where ink or a print hides it: in gaps narrower than a hole, without a thing in them."""
    gaps = comb <= _SURE
    pieces, area = pieces_and_areas(gaps.astype(np.uint8), 4)
    hides_comb = area > 0
    hides_comb[pieces[(deep(gaps, _GAP * PITCH_PX) > 0) | thing]] = False
    return np.where(hides_comb[pieces], np.float32(1.0), comb)


def _border(comb: Float32s) -> Float64s:
    """Where a map of how surely there is comb, (h, w), falls below half, (N, 2), samples."""
    sure = np.rint(255.0 * comb).astype(np.uint8)
    rings = cv2.findContours((comb > _SURE).astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)[0]
    every = [ring[::_BORDER_PX, 0] for ring in rings if len(ring) > _SHORTEST_PX]
    points = np.concatenate([np.empty((0, 2)), *every])
    even = cv2.GaussianBlur(sure.astype(np.float32), (0, 0), _EVEN_PX)
    ways = outward(np.asarray(even, np.float32), points)
    inner = points - _EVEN_PX * ways
    far = dark_beyond(np.asarray(255 - sure, np.uint8), inner, ways, midway=127.5, reach=2.0 * _EVEN_PX)
    found = np.isfinite(far) & (far > 0.0)
    return np.asarray(inner[found] + far[found, None] * ways[found], np.float64)


def _drawn(seen: Segments) -> Bytes:
    """What the network tells as a picture, (h, w), uint8; where walls don't show in comb, as in what fills cells, with
    walls of its own.
    """
    comb = seen.comb > _SURE
    bare = comb & without_walls(seen.wall, _ROOM)
    filled = opened(bare.astype(np.uint8), _SPECK_PX) > 0
    wall = np.where(filled, _lattice(comb.shape), seen.wall) if filled.any() else seen.wall
    return (np.where(comb, _WALL * wall, np.float32(0.0)) + _DARK).astype(np.uint8)


def _lattice(shape: tuple[int, ...]) -> Float32s:
    """Walls of a regular comb, 0 or 1, (h, w): three waves, whose sum is least along them."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float32) * np.float32(4.0 * math.pi / math.sqrt(3.0) / PITCH_PX)
    waves = sum(np.cos(x * math.cos(turn) + y * math.sin(turn)) for turn in (0.0, math.pi / 3.0, 2.0 * math.pi / 3.0))
    return np.asarray(waves < _ALONG_WALLS, np.float32)
