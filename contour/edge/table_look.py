"""What is table, what is comb, and what is neither: flat things that lie on the block, on the table, or on both.

Light on a table changes slowly: lamps, shadows and vignetting have soft borders. Whatever lies on it has a sharp one.
So the table is what can be reached from most of it without crossing a sharp border, and every other flat part that is
as light as the table around it. Comb is nowhere flat: no point of it is farther than half a cell from a wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.edge.ring_places import runs_of
from contour.edge.table_light import table_light
from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, median, quantile
from contour.geometry.ring_lengths import RingLengths
from contour.image import channels
from contour.image.opencv import deep, opened, pieces_and_boxes, pieces_of, within
from contour.image.pixel_grid import drawn, fill, samples_of, whole_averaged
from contour.image.pixel_sampling import sample_at
from contour.walls.wall_evidence import BlockEvidence, RingEvidence

# Comb of finer cells than that shows at full size only: else here and there it looks flat.
_SAMPLES_PER_PITCH, _FINEST_PX, _FINE_PITCH_PX = 5.5, 2, 7.5
# Of the gradient's usual size on the picture's flat parts; and in eighths of a grey level a sample.
_SHARP, _LEAST_SHARP = 3.5, 10.0
# A border that is nowhere narrower than so many samples is soft.
_SOFT, _SOFT_SHARE = 7, 0.35
# Of the gradient's usual size in comb: no border may be so much sharper than walls that comb itself looks flat.
_OF_WALLS = 0.7
# Shorter borders are specks, scratches and dust: no border of a thing that could hide an edge.
_SPECK_PITCHES = 1.0
# Cells have no room for a disc of this radius; and a border with gaps smaller than its diameter still holds.
_CELL_ROOM, _GAP = 0.62, 0.2
# Within this of a thing a shadow is that thing's own, and no more to be trusted.
_CAST_PITCHES = 2.5
# Shadows with sharp borders are no wider than blocks are high: beside the block they have no room for such a disc.
_WIDEST_SHADE = 3.5
_RIM = 1.5
_THIN = 1.5
_NOWHERE_PX = 1e6
_BESIDE_PITCHES = 0.6
# Of the gradient's usual mean over a cell of comb.
_QUIET, _SMOOTH, _GOOD_SHARE = 0.45, 0.3, 0.3
_MOST = 0.5
# In shade comb changes by so much less as it is darker, and by so many times what the table does.
# Along dark things the means of comb beside them reach in, but not so far.
_SHADED, _BUSIER_THAN_TABLE, _DARKEST, _SHADED_ROOM = 0.6, 2.5, 2.0, 0.6
# What fills a hole ends where it is half as light. Pitches into it: its rim, and its middle (or so much of the
# deepest); how light that rim is, and how light where the block plainly shades it. Blown out light shows no shade.
_HOLE_RIM, _HOLE_MIDDLE, _RIM_LIGHT, _SHADED_RIM, _BLOWN_OUT = (0.2, 0.5), (1.0, 0.6), 0.93, 0.85, 250.0
# Shadows, sides of the block and its mirror image make a band beside it that has no room for a disc of this radius, or
# for few here and there; where walls are lost in a cell or two, the cells are flat.
_BAND, _LONG_PITCHES = 0.55, 2.0
# Where walls meet they are wider by half as much again than they are.
_STROKE = 2.0
# How far beyond an edge what lies against it is looked for, pitches.
_JUST_BEYOND = (0.6, 1.0, 1.5)


@dataclass(frozen=True, eq=False)
class TableLook:
    """Maps on a grid of `step` pixels a sample, (h, w): `table`, and `foreign`, flat and not the table."""

    table: Bools
    foreign: Bools
    things: Bools
    """What is foreign, mirror images of the block's walls all around it included."""
    step: float
    pitch_px: float
    lighter: Bools
    """Where the picture is lighter than the table."""
    shade: Bools
    """Where it is darker in all channels, as a shadow makes a table, and beside the block no wider than one is."""
    away: Float32s
    """Distance of each sample from what is foreign, pixels."""
    light: Bytes
    """The picture itself, the mean of its channels."""
    loose: Bools | None = None
    """Pieces of comb beside the block, told from it, and what lies within half a cell of their walls."""
    plain: bool = True
    """Whether what lies beside the block is judged: not where the table mirrors it, or has borders of its own."""

    def without(self, parts: Bools) -> TableLook:
        """The same without some of what is foreign, (h, w)."""
        foreign = self.foreign & ~parts
        return replace(self, foreign=foreign, things=self.things & ~parts, away=_away(foreign, self.step))

    def reduced(self, times: int) -> TableLook:
        """The same of a picture that this one's shows so many times as large."""
        return replace(self, step=self.step / times, pitch_px=self.pitch_px / times, away=self.away / np.float32(times))

    def foreign_at(self, points: Float64s) -> Float64s:
        """Distance of points (N, 2), pixels, from the nearest foreign thing, shape (N,), pixels."""
        grid = samples_of(points, self.step)
        return sample_at(self.away, grid[:, 0], grid[:, 1])

    def room_at(self, points: Float64s) -> Float64s:
        """How far points (N, 2), pixels, lie within things, from what is none, shape (N,), pixels."""
        grid = samples_of(points, self.step)
        room = cv2.distanceTransform(self.things.astype(np.uint8), cv2.DIST_L2, 3).astype(np.float32)
        return sample_at(room, grid[:, 0], grid[:, 1]) * self.step

    def table_at(self, points: Float64s) -> Bools:
        """Which points (N, 2), pixels, lie on the table, shape (N,)."""
        return self._at(self.table, points)

    def lighter_at(self, points: Float64s) -> Bools:
        """Which points (N, 2), pixels, are lighter than the table, shape (N,)."""
        return self._at(self.lighter, points)

    def loose_at(self, points: Float64s) -> Bools:
        """At which points (N, 2), pixels, a piece of comb lies that was told from the block, shape (N,)."""
        return np.zeros(len(points), np.bool_) if self.loose is None else self._at(self.loose, points)

    def _at(self, part: Bools, points: Float64s) -> Bools:
        grid = samples_of(points, self.step)
        return sample_at(part.astype(np.uint8) * np.uint8(255), grid[:, 0], grid[:, 1]) > 127.0

    def in_shade(self, points: Float64s) -> Bools:
        """Which points (N, 2), pixels, at foreign things are at nothing but what may be a shadow, shape (N,)."""
        grid = samples_of(points, self.step)
        return sample_at(_away(self.lit, self.step), grid[:, 0], grid[:, 1]) > _CAST_PITCHES * self.pitch_px

    @cached_property
    def lit(self) -> Bools:
        """Where something foreign is no shadow."""
        return _opened(self.things & ~self.shade, _THIN)

    @cached_property
    def solid(self) -> Bools:
        """Where everything is lighter than the table, and neither flat nor walls around dark cells: grain of what fills
        cells.
        """
        return np.asarray(_eroded(self.lighter.view(np.uint8)) & ~self.table & ~self.things)

    def solid_at(self, points: Float64s) -> Bools:
        """Which points (N, 2), pixels, lie in such grain, shape (N,)."""
        return self._at(self.solid, points)

    @cached_property
    def hiding(self) -> Bytes:
        """The map of what is foreign and no shadow, with its own borders, uint8, 1 where it hides what lies beneath."""
        return np.asarray(cv2.dilate(self.lit.astype(np.uint8), np.ones((3, 3), np.uint8)), np.uint8)

    def lit_along(self, ring: RingEvidence) -> float:
        """Along how much of a ring something foreign that is no shadow lies just beyond its witnesses, pixels."""
        beyond = [ring.points + out * self.pitch_px * ring.normal for out in _JUST_BEYOND]
        lies = np.any([self._at(self.lit, points) for points in beyond], axis=0)
        length = RingLengths.of(ring.coarse).length
        if lies.all():
            return length
        ends = (ring.position[run[[0, -1]]] for run in runs_of(lies))
        return max((float((last - first) % length) for first, last in ends), default=0.0)

    def fills(self, hole: RingEvidence) -> bool:
        """Whether a hole is none: most of it is foreign, lighter than the table ever is in a block's shade, and nearly
        as light along its rim as amidst it. A block shades the table along a hole's rim, also where a lamp lights it.
        """
        rim = self._rim_light(hole)
        return rim is not None and rim > _RIM_LIGHT

    def without_lit_floors(self, holes: Sequence[RingEvidence]) -> TableLook:
        """The same without what is foreign in holes that show the table under a lamp: it lies wholly within the hole,
        and the block shades it along the rim.
        """
        floors = np.zeros_like(self.foreign)
        for hole in holes:
            rim = self._rim_light(hole)
            if rim is not None and 0.0 < rim < _SHADED_RIM:
                floors |= drawn([hole.coarse], floors.shape, self.step) > 0
        if not floors.any():
            return self
        count, pieces = pieces_of(self.foreign, 8)
        beyond = np.bincount(pieces[~floors], minlength=count) > 0
        return self.without(floors & ~beyond.take(pieces))

    def _rim_light(self, hole: RingEvidence) -> float | None:
        """How light the rim of what is lit in a hole is, of its middle; 0 where that is blown out, infinite without
        room for one. None where not most of the hole is foreign and lighter than the table.
        """
        inside = _eroded(drawn([hole.coarse], self.foreign.shape, self.step))
        filled = self.foreign & self.lighter & inside
        if np.count_nonzero(filled) <= _MOST * np.count_nonzero(inside):
            return None
        body = (inside & (self.light > 0.5 * median(self.light[filled]))).astype(np.uint8)
        away = cv2.distanceTransform(opened(body, 3), cv2.DIST_L2, 3)
        deep = np.asarray(away, np.float64) * (self.step / self.pitch_px)
        rim = (deep > _HOLE_RIM[0]) & (deep < _HOLE_RIM[1])
        middle = deep > max(_HOLE_MIDDLE[0], _HOLE_MIDDLE[1] * float(deep.max()))
        if not (rim.any() and middle.any()):
            return np.inf
        amidst = median(self.light[middle])
        return 0.0 if amidst >= _BLOWN_OUT else median(self.light[rim]) / amidst


def beside(look: TableLook) -> float:
    """Within how many pixels of something foreign a wall may end because it goes on beneath."""
    return _BESIDE_PITCHES * look.pitch_px + look.step


def table_look(picture: Bytes, seen: BlockEvidence, *, plain: bool = False, mirrored: bool = False) -> TableLook:
    """What is table and what is neither table nor comb in a picture, grey (H, W) or BGR (H, W, 3), uint8.

    `plain`: the table is known to be a plain one, from a look at the block before anything of it was left out;
    `mirrored`: to be one that shows the block once more.
    """
    pitch_px = seen.pitch_px
    step = max(_FINEST_PX if pitch_px > _FINE_PITCH_PX else 1, int(pitch_px / _SAMPLES_PER_PITCH))
    small = whole_averaged(picture, step)
    samples = pitch_px / step
    block = _drawn(seen.rings, small.shape, step)
    slope = _slope(small)
    whole = _drawn(seen.rings[:1], small.shape, step)
    border = _borders(small, slope, (block, whole), samples)
    inside = _eroded(block)
    reach = _CELL_ROOM * samples - _RIM, _GAP * samples
    roomy = deep(1 - border, reach[0])
    room = (roomy & inside) | (deep(1 - border, reach[1]) & ~inside)
    _, parts = pieces_of(room, 4)
    area = np.bincount(parts[block == 0], minlength=int(parts.max()) + 1)
    area[:1] = 0
    light = table_light(small, parts, area, samples)
    table_part = light.parts
    table = _grown(table_part, inside, reach)
    # Small flat parts outside lie between walls that stick out, and between specks.
    flat = _grown(_wide((parts > 0) & ~table_part, roomy > 0), inside, reach)
    busy = _busy(slope, block, samples)
    quiet = (busy < _QUIET) & ~table
    loose = None if seen.loose is None else _loose(_walls(seen, picture.shape), (whole == 0) & light.alike, samples)
    told = table_part if loose is None else table_part | (loose & ~quiet)  # what parts it from the block may hide some
    mean = channels.mean(small)
    other = (flat | quiet) & ~told
    foreign = _opened(other, _CELL_ROOM * samples)
    if foreign.any():
        still = quantile(busy[table_part], 0.9) if table_part.any() else 0.0
        shaded = shaded_comb(busy, _over_a_cell(mean, samples), block, still)
        foreign = _opened(other & ~_opened(other & shaded, _SHADED_ROOM * samples), _CELL_ROOM * samples)
    foreign = _long(foreign, _LONG_PITCHES * samples)
    beside_block = _long(_opened((block == 0) & ~(table | told), _BAND * samples + 0.5), _LONG_PITCHES * samples)
    every = foreign | beside_block
    shade = light.shade
    shade &= ~_opened(every & shade & (block == 0), _WIDEST_SHADE * samples)
    maps = light.lighter, shade, _away(every, step), mean, loose
    look = TableLook(table, every, every, step, pitch_px, *maps).without_lit_floors(seen.rings[1:])
    if mirrored:
        within = foreign & inside
        return replace(look, foreign=within, away=_away(within, step), plain=False)
    if plain:
        return look
    exterior = seen.rings[0].points
    if np.count_nonzero(look.foreign_at(exterior) < beside(look)) > _MOST * len(exterior):
        # All around the block: the table mirrors it, or is no plain one. Neither is smooth.
        within = (foreign & inside) | _mostly(beside_block, busy < _SMOOTH)
        look = replace(look, foreign=within, away=_away(within, step), plain=False)
    return look


def _walls(seen: BlockEvidence, shape: tuple[int, ...]) -> Bytes:
    """The walls that are told from the block in a picture of that shape, (h, w), without pieces most of which is wider:
    print on labels.
    """
    walls = np.asarray(seen.loose)
    strokes = _opened(walls > 0, _STROKE * 0.5 * seen.wall_px * len(walls) / shape[0])
    return walls * ~_mostly(walls > 0, strokes, _MOST) if strokes.any() else walls


def _loose(walls: Bytes, alike: Bools, samples: float) -> Bools | None:
    """Pieces of comb beside the block, their cells filled: these hide none of it. None without any.

    `alike`: where light beside the block is the table's. That shows through cells: what has walls painted on it, or
    grain that looks like some, is another thing.
    """
    small = cv2.resize(walls, alike.shape[::-1], interpolation=cv2.INTER_AREA)
    size = 2 * round(0.5 * samples) + 1
    filled = cv2.dilate(small, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))
    loose = _mostly(filled > 0, alike)
    return loose if loose.any() else None


def _mostly(part: Bools, kind: Bools, share: float = _GOOD_SHARE) -> Bools:
    """The pieces of a part of which more than that share is of that kind."""
    count, pieces = pieces_of(part, 8)
    size = np.maximum(np.bincount(pieces.ravel(), minlength=count), 1)
    kept = np.bincount(pieces[kind], minlength=count) > share * size
    kept[0] = False
    return kept.take(pieces)


def _away(foreign: Bools, step: float) -> Float32s:
    if not foreign.any():
        return np.full(foreign.shape, _NOWHERE_PX, np.float32)
    return np.asarray(cv2.distanceTransform((~foreign).astype(np.uint8), cv2.DIST_L2, 3) * step, np.float32)


def _drawn(rings: Sequence[RingEvidence], shape: tuple[int, ...], step: int) -> Bytes:
    """1 inside of coarse rings, exterior first, and not in their holes, (h, w)."""
    block = np.zeros(shape[:2], np.uint8)
    for ring in rings:
        fill(block, ring.coarse, step, 0 if ring.is_hole else 1)
    return block


def _eroded(part: Bytes) -> Bools:
    return np.asarray(cv2.erode(part, np.ones((3, 3), np.uint8)) > 0)


def _slope(small: Bytes) -> NDArray[np.int16]:
    """Size of the gradient in eighths of a grey level a sample, the largest of all channels, shape (h, w)."""
    soft = cv2.GaussianBlur(small, (5, 5), 0)
    size = np.abs(cv2.Sobel(soft, cv2.CV_16S, 1, 0)) + np.abs(cv2.Sobel(soft, cv2.CV_16S, 0, 1))
    return np.asarray(channels.largest(size), np.int16)


def _busy(slope: NDArray[np.int16], block: Bytes, samples: float) -> Float32s:
    """How much light changes over a cell, of what it usually does in comb."""
    comb = slope[::2, ::2][block[::2, ::2] > 0]
    if not len(comb):
        return np.ones(slope.shape, np.float32)
    busy = _over_a_cell(np.minimum(slope.astype(np.float32), quantile(comb, 0.9)), samples)
    usual = median(busy[::2, ::2][block[::2, ::2] > 0])
    return np.asarray(busy / max(usual, 1e-3), np.float32)


def _over_a_cell(part: NDArray[np.generic], samples: float) -> Float32s:
    """Means over squares as wide as a cell."""
    size = 2 * round(0.5 * samples) + 1
    return np.asarray(cv2.blur(part.astype(np.float32), (size, size)), np.float32)


def shaded_comb(busy: Float32s, light: NDArray[np.generic], block: Bytes, still: float) -> Bools:
    """Where, within `block`, not 0 there, a shadow makes comb look quiet, (h, w): of its `light`, grey levels, it
    changes as much as comb does elsewhere, and by more than the table does, `still`. `busy`: by how much light changes.
    """
    within = block > 0
    if not within.any():
        return within
    of_light = busy / np.maximum(light.astype(np.float32), _DARKEST)
    usual = median(of_light[::2, ::2][within[::2, ::2]])
    return np.asarray(within & (of_light > _SHADED * usual) & (busy > _BUSIER_THAN_TABLE * still), np.bool_)


def _opened(part: Bools, radius: float) -> Bools:
    """The part without what is too narrow for a disc of this radius."""
    core = deep(part, radius) if part.any() else np.zeros(part.shape, np.uint8)
    if not core.any():
        return core > 0
    return np.asarray(part & (within(core, radius + 1) > 0), np.bool_)


def _borders(small: Bytes, slope: NDArray[np.int16], block: tuple[Bytes, Bytes], samples: float) -> Bytes:
    """1 where light changes sharply, along lines longer than specks; `block` without its holes, and with them."""
    material, whole = block
    far, walls = (slope[::2, ::2][material[::2, ::2] == part] for part in (0, 1))
    usual = median(far) if len(far) else 0.0
    level = max(_SHARP * usual, _LEAST_SHARP)
    if len(walls):
        level = min(level, _OF_WALLS * median(walls))
    # Glare and half shadows have borders as steep, but wide ones.
    beside = slope * (material == 0)
    wide = cv2.morphologyEx(beside, cv2.MORPH_OPEN, np.ones((_SOFT, _SOFT), np.uint8))
    light = channels.largest(small)
    table = light[::2, ::2][material[::2, ::2] == 0]
    lit = light > median(table) if len(table) else np.zeros(light.shape, np.bool_)
    # Dark things on a table have soft sides, too.
    soft = (whole > material) | (lit & (wide > _SOFT_SHARE * level)) | (wide > level)
    return _long(slope - wide * soft > level, _SPECK_PITCHES * samples).astype(np.uint8)


def _long(part: Bools, least: float) -> Bools:
    """The pieces of a part that are longer than that, samples."""
    if not part.any():
        return part
    pieces, stats = pieces_and_boxes(part.astype(np.uint8), 8)
    long = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) > least
    long[0] = False
    return long.take(pieces)


def _wide(flat: Bools, roomy: Bools) -> Bools:
    """The parts of `flat` that have such room somewhere."""
    count, parts = pieces_of(flat, 4)
    wide = np.zeros(count, np.bool_)
    wide[parts[roomy & flat]] = True
    wide[0] = False
    return wide.take(parts)


def _grown(part: Bools, inside: Bools, reach: tuple[float, float]) -> Bools:
    """A part that was seen through gaps of a border, so wide inside of the block and beside it, up to that border."""
    within_block, beside_it = (within(part, one + _RIM) > 0 for one in reach)
    return (within_block & inside) | (beside_it & ~inside)
