"""The outer boundary of the material itself, for blocks whose border cells are closed: all that differs from the
table.

Printed and moulded honeycomb, boards and foam slabs end in whole cells: their true edge is serrated, and no line
through wall ends describes it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import cv2
import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bools, Bytes, Float64s, Indices, median
from contour.geometry.rings import Contour, Ring, signed_area
from contour.image.opencv import fewer_vertices, opened, pieces_and_areas, pieces_and_boxes, pieces_of
from contour.image.pixel_sampling import sample_at
from contour.image.side_by_side import side_by_side
from contour.material.leaking_cells import leaking_cells
from contour.material.table_surface import OUTLIER, difference_from_table
from contour.walls.cell_scale import wall_width
from contour.walls.coarse_rings import cyclic_mean

# Chips and dust are small against a block; a block smaller than this share of the picture is a chip to this method.
_LEAST_SHARE = 0.004
# How far behind the boundary, and before it, its own half level is looked for.
_REACH_PX = 3.0
_OUT_PX = 2.0
# Gaps of a faint wall, in pitches, that do not open a cell.
_GAP_PITCHES = 0.3
_NEARBY_PITCHES = 0.8
# What the table passes into within two pixels by less than this share of the level is its shadow: edges are sharper.
_SOFT = 0.2
# The least cell that a faint wall closes, in squares of the pitch.
_LEAST_CELL = 0.5
# And the largest that a cut opens, over what large cells of the block enclose: of 88 lattices cut once opened ones have
# 0.99 of that at most. Where none encloses so much table, or few do, as where noise makes some of a floor that differs
# from it, over a square of the pitch: a cell has 0.87 with walls.
_LARGEST_CELL, _LARGE_CELLS, _LEAST_OPENING, _LEAST_OPEN, _LEAST_BAY = 1.2, 0.9, 0.2, 0.1, 0.1
# An opening as large as this is a hole, however narrow; broken walls join fewer cells.
_HOLE = 5.0
# So is one in which a disc of this radius fits; whatever pixels are, it fills so much of its radius squared at least.
_HOLE_PITCHES, _DISC_FILLS = 1.1, 1.5
_SIMPLE_PX = 0.25
# How near to a cut the outline runs along it: what is drawn is off by as much as pixels are, and walls end round.
_ON_CUT_PX, _PARTED_PX = 2.0, 2
_NO_CUTS = np.empty((0, 2, 2))
# Where cells differ from the table by so many grey levels, what differs by less than this share of that is a bay that a
# cut closed, no cell that it opened: of what the half of them differs by at least, as light falls into cells that were
# opened, and they may show the table as it is. Nearer to a wall its blur tells nothing, nor does what little is left
# of it then.
_FLOOR_LEVELS, _LIKE_FLOOR, _FROM_WALL_PX, _LEAST_FREE = 6.0, 0.35, 7, 0.1
# Of the width of the edge: half a level off moves the outline by so much. And of a wall's: the outermost one leans,
# shows its side, or stands on a foot: in photographs nobody can say which of that is the edge. Webs of a sheet do not.
_LEAST_BOUND_PX, _BOUND_OF_WIDTH, _BOUND_OF_WALL = 0.3, 0.4, 0.5
_WIDEST_WALL_PITCHES = 0.2


@dataclass(frozen=True, eq=False)
class Apart:
    """How far each pixel is from the table, (H, W), the level from which it is material, and what is, 1 or 0, cells
    filled; uint8 all. And how wide walls are, pixels, not webs.
    """

    difference: Bytes
    level: Bytes
    region: Bytes
    wall_px: float

    @cached_property
    def openings(self) -> Bytes:
        """Where the region shows the table, (H, W), 1 or 0: holes, and cells whose floor is as light as it."""
        return ((self.region > 0) & (self.difference <= self.level)).astype(np.uint8)


@dataclass(frozen=True)
class MaterialEdge:
    """The outline around material, pixels, and a 95 % bound of how far off it may be.

    border: the material's own outermost pixels with all that stands out of it, walls a pixel wide too, rings (N, 2).
    """

    contour: Contour
    bound_px: float
    border: tuple[Ring, ...]
    apart: Apart = field(compare=False, repr=False)


def material_edge(picture: Bytes, pitch_px: float, walls: Bytes) -> MaterialEdge:
    """Boundary of the largest region that differs from the table, in pixels, with holes wider than 2.2 pitches or as
    large as five cells.

    `walls` (H, W), 255 where the picture shows cell walls, adds those that differ less than most. Exterior with
    negative shoelace, holes positive. The table is a smooth surface in every channel, learnt from the picture's border
    inwards. Raises NoBlockFound.
    """
    difference, noise = difference_from_table(picture)
    level = _levels(difference, noise, pitch_px)
    apart = _without_soft_shadow(difference, level)
    faint = (walls > 0) & (difference > np.maximum(level // 2, np.uint8(min(255.0, OUTLIER * noise))))
    wall_px = wall_width(walls)
    surely, perhaps = side_by_side(
        lambda: _region(apart, pitch_px, wall_px), lambda: _region(apart | faint, pitch_px, wall_px)
    )
    region = _with_faint_cells(surely, perhaps, pitch_px)
    return _outlined(Apart(difference, level, region, min(wall_px, _WIDEST_WALL_PITCHES * pitch_px)))


def closed_along(material: MaterialEdge, cuts: Float64s, pitch_px: float) -> MaterialEdge:
    """The outline around material with the cells filled that straight cuts opened: it follows the cuts there, but not
    across bays that show the table.

    `cuts`: where each begins and ends, (N, 2, 2), pixels; what touches a line in one place alone is none.
    """
    cuts = cuts[np.hypot(*(cuts[:, 1] - cuts[:, 0]).T) >= 1.0]
    shut, parted = material.apart.region.copy(), material.apart.region.copy()
    for cut in cuts:
        start, end = (tuple(np.rint(place).astype(int).tolist()) for place in cut)
        cv2.line(shut, start, end, 1)
        cv2.line(parted, start, end, 1, 2 * _PARTED_PX + 1)
    region = _without_bays(_filled(shut, pitch_px), shut, parted, material.apart, pitch_px)
    return _outlined(replace(material.apart, region=region), cuts)


def outlined(material: MaterialEdge, region: Bytes) -> MaterialEdge:
    """The outline around a part of material, `region` (H, W), 1 where it is: the rest of it is none."""
    apart = material.apart
    difference = np.where(apart.region > region, np.uint8(0), apart.difference)
    return _outlined(replace(apart, difference=difference, region=region))


def _without_bays(closed: Bytes, shut: Bytes, parted: Bytes, apart: Apart, pitch_px: float) -> Bytes:
    """A region without what cuts added, `shut` by them, to that of material and is larger than a cell, or shows the
    table where cells do not. `parted`: shut by wide cuts, which walls reach that end short of them.
    """
    away = np.ones((_FROM_WALL_PX,) * 2, np.uint8)
    free = cv2.erode((apart.difference <= apart.level).astype(np.uint8), away) > 0
    cells = apart.difference[(apart.region > 0) & free]
    floor = median(cells.astype(np.float64)) if len(cells) else 0.0
    _, openings = pieces_and_areas(apart.openings, 4)
    whole = openings[1:][openings[1:] > _LEAST_OPENING * pitch_px * pitch_px]
    enough = whole.sum() > _LEAST_OPEN * np.count_nonzero(apart.region)
    cell = float(np.quantile(whole, _LARGE_CELLS)) if enough else pitch_px * pitch_px
    labels, area = pieces_and_areas(closed & (1 - shut), 4)
    parts, part_area = pieces_and_areas(closed & (1 - parted), 4)
    owner = np.zeros(len(part_area), np.intp)
    owner[parts] = labels
    bay = np.zeros(len(area), np.bool_)
    bay[owner[part_area > _LARGEST_CELL * cell]] = True
    bay[0] = False
    differ = np.full(len(area), np.nan)
    for number in 1 + np.flatnonzero(area[1:] > _LEAST_BAY * pitch_px * pitch_px) if floor >= _FLOOR_LEVELS else ():
        inner = apart.difference[(labels == number) & free]
        if len(inner) > _LEAST_FREE * area[number]:
            differ[number] = median(inner.astype(np.float64))
    usual = min(floor, median(np.append(differ[~np.isnan(differ)], floor)))
    if usual >= _FLOOR_LEVELS:
        bay |= differ <= _LIKE_FLOOR * usual
    # With the cut across its mouth.
    bays = cv2.dilate(bay.astype(np.uint8)[labels], np.ones((3, 3), np.uint8))
    return np.where(bays > 0, apart.region, closed)


def _outlined(apart: Apart, cuts: Float64s = _NO_CUTS) -> MaterialEdge:
    region, difference, level = apart.region, apart.difference, apart.level
    border, _ = cv2.findContours(region, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    # Threads a pixel wide would cross themselves once they are moved.
    body = opened(region, 3)
    chains, hierarchy = cv2.findContours(body, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    found = [
        (*_sub_pixel(difference, level, chain[:, 0, :].astype(np.float64), cuts), bool(node[3] >= 0))
        for chain, node in zip(chains, () if hierarchy is None else hierarchy[0], strict=True)
        if len(chain) >= 8
    ]
    outer = [one for one in found if not one[2]]
    if not outer:
        raise NoBlockFound(
            "no block found: all that differs from the table is threads a pixel or two wide. Check that a block lies "
            "in view, the light and the focus"
        )
    exterior, widths, _ = max(outer, key=lambda one: abs(signed_area(one[0])))
    holes = [(_turned(ring, 1.0), wide) for ring, wide, hole in found if hole]
    widths = np.concatenate([widths, *(wide for _, wide in holes)])
    contour = Contour(_turned(exterior, -1.0), tuple(ring for ring, _ in holes))
    soft_px = _LEAST_BOUND_PX + _BOUND_OF_WIDTH * float(np.quantile(widths, 0.95))
    bound_px = float(np.hypot(soft_px, _BOUND_OF_WALL * apart.wall_px))
    outermost = tuple(ring[:, 0].astype(np.float64) for ring in border if len(ring) >= 8)
    return MaterialEdge(contour, bound_px, outermost, apart)


def _with_faint_cells(surely: Bytes, perhaps: Bytes, pitch_px: float) -> Bytes:
    """A region with what fainter walls add to it, where they close cells: less than half of one is something beside."""
    labels, area = pieces_and_areas(perhaps & (1 - surely), 8)
    cells = area > _LEAST_CELL * pitch_px * pitch_px
    cells[0] = False
    return np.where(cells[labels], np.uint8(1), surely & perhaps)


def _level(difference: Bytes, spread: float) -> float:
    """The level that parts material from table best (Otsu). Raises NoBlockFound where nothing stands out."""
    split, _ = cv2.threshold(difference[::2, ::2].copy(), 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    if split < OUTLIER * spread:
        raise NoBlockFound(
            f"no block found: nothing stands out from the table by more than {split:.0f} grey levels, of which its own "
            f"texture makes {spread:.0f}. Check the light and that a block lies in view"
        )
    return float(split)


def _levels(difference: Bytes, spread: float, pitch_px: float) -> Bytes:
    """The level for each pixel, shape (H, W): half of what material nearby differs by, so that fainter things beside it
    stay out.
    """
    least = _level(difference, spread)
    side = 2 * round(_NEARBY_PITCHES * pitch_px) + 1
    # A grid is enough for what changes over a cell.
    hop = max(1, side // 8)
    small = cv2.resize(difference, None, fx=1 / hop, fy=1 / hop, interpolation=cv2.INTER_AREA)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * (side // hop // 2) + 1,) * 2)
    nearby = cv2.blur(cv2.dilate(small, disc), (5, 5))
    half = cv2.resize(nearby, difference.shape[::-1], interpolation=cv2.INTER_LINEAR) // 2
    return np.maximum(np.asarray(half, np.uint8), np.uint8(min(255.0, least)))


def _without_soft_shadow(difference: Bytes, level: Bytes) -> Bools:
    """What differs from the table by more than the level, but for what the table passes into softly: its shadow."""
    apart = difference > level
    disc = np.ones((3, 3), np.uint8)
    soft = cv2.LUT(level, np.maximum(_SOFT * np.arange(256), 1.0).astype(np.uint8))
    rough = cv2.morphologyEx(difference, cv2.MORPH_GRADIENT, disc) > soft
    count, labels = pieces_of(~rough, 4)
    of_table = np.bincount(labels.ravel().take(np.flatnonzero(~apart & ~rough)), minlength=count) > 0
    of_table[0] = False
    return np.asarray(apart & ~of_table.take(labels))


def _region(apart: Bools, pitch_px: float, wall_px: float) -> Bytes:
    """The largest piece with its cells filled; inner openings in which a disc of 1.1 pitches' radius fits stay open."""
    material = _closed(apart.astype(np.uint8), _GAP_PITCHES * pitch_px)
    labels, stats = pieces_and_boxes(material, 8)
    area = (stats[:, cv2.CC_STAT_WIDTH] * stats[:, cv2.CC_STAT_HEIGHT]).astype(np.float64)
    area[0] = 0
    if area.max() < _LEAST_SHARE * apart.size:
        raise NoBlockFound(
            "no block found: all that differs from the table is smaller than a block. Check that a block lies in view"
        )
    piece = (labels == int(np.argmax(area))).astype(np.uint8)
    # Of the piece alone: specks of a table lie as close as walls, and enclose as much.
    margin = round(pitch_px)
    around = cv2.copyMakeBorder(piece, margin, margin, margin, margin, cv2.BORDER_CONSTANT, value=0)
    piece |= leaking_cells(around, pitch_px, wall_px)[margin:-margin, margin:-margin]
    return _filled(piece, pitch_px)


def _filled(piece: Bytes, pitch_px: float) -> Bytes:
    """A piece with its cells filled, but for openings in which a disc of 1.1 pitches' radius fits, or as large as
    five cells.
    """
    free = 1 - np.asarray(cv2.copyMakeBorder(piece, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0), np.uint8)
    inner, area = pieces_and_areas(free, 4)
    open_ = area > _HOLE * pitch_px * pitch_px
    open_[inner[0, 0]] = True
    # Most of such discs fit into nothing smaller than what is large enough.
    if (~open_ & (area > _DISC_FILLS * (_HOLE_PITCHES * pitch_px) ** 2))[1:].any():
        room = cv2.distanceTransform(free, cv2.DIST_L2, 5)
        open_[inner[room > _HOLE_PITCHES * pitch_px]] = True
    open_[0] = False
    return np.asarray(1 - open_.view(np.uint8).take(inner)[1:-1, 1:-1], np.uint8)


def _closed(material: Bytes, gap: float) -> Bytes:
    size = 2 * int(gap / 2) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    wide = cv2.copyMakeBorder(material, size, size, size, size, cv2.BORDER_CONSTANT, value=0)
    return np.asarray(cv2.morphologyEx(wide, cv2.MORPH_CLOSE, disc)[size:-size, size:-size], np.uint8)


def _sub_pixel(difference: Bytes, levels: Bytes, chain: Float64s, cuts: Float64s) -> tuple[Ring, Float64s]:
    """The chain moved to half of the material's own difference behind it, along `cuts` onto them, simplified to a
    quarter of a pixel; and how wide the edge is at each point of the chain, pixels: what material differs by over the
    steepest fall.
    """
    smooth = cyclic_mean(chain, 2)
    normal = outwards(smooth, 1)
    along = np.arange(-_REACH_PX, _OUT_PX + 0.1, 0.25)
    places = smooth[:, None, :] + along[None, :, None] * normal[:, None, :]
    values = sample_at(difference, places[:, :, 0], places[:, :, 1])
    level = 0.5 * (values.max(axis=1, keepdims=True) + values[:, -2:].mean(axis=1, keepdims=True))
    falls = (values[:, :-1] >= level) & (values[:, 1:] < level)
    # The outermost one: behind it may lie cells.
    index = falls.shape[1] - 1 - np.argmax(falls[:, ::-1], axis=1)
    rows = np.arange(len(smooth))
    high, low = values[rows, index], values[rows, index + 1]
    part = (high - level[:, 0]) / np.maximum(high - low, 1e-6)
    shift = np.where(falls.any(axis=1), along[index] + 0.25 * part, 0.5)
    # Over an opened cell there is no edge to be seen.
    feet, cut = _on_cuts(smooth, cuts)
    seen = cut < 0
    moved = np.where(seen[:, None], smooth + shift[:, None] * normal, feet)
    if not seen.any():
        seen = ~seen
    steepest = (values[seen, :-4] - values[seen, 4:]).max(axis=1)
    behind = chain[seen].astype(np.intp)
    widths = 2.0 * levels[behind[:, 1], behind[:, 0]] / np.maximum(steepest, 1.0)
    # One run along a cut is straight from its first point to its last.
    moved = moved[seen | (cut != np.roll(cut, 1)) | (cut != np.roll(cut, -1))]
    return fewer_vertices(moved, _SIMPLE_PX), widths


def _on_cuts(points: Float64s, cuts: Float64s) -> tuple[Float64s, Indices]:
    """The points, those near a cut moved straight onto it, and the number of that, -1 away from all."""
    cut = np.full(len(points), -1, np.intp)
    for number, (start, end) in enumerate(cuts):
        length = float(np.hypot(*(end - start)))
        along = (end - start) / length
        place = (points - start) @ along
        foot = start + place[:, None] * along
        nearby = (np.hypot(*(points - foot).T) < _ON_CUT_PX) & (place > 0) & (place < length)
        points = np.where(nearby[:, None], foot, points)
        cut[nearby] = number
    return points, cut


def outwards(ring: Ring, reach: int) -> Float64s:
    """Unit vectors to the free side of a ring of findContours, by its neighbours `reach` points away, (N, 2)."""
    along = np.roll(ring, -reach, axis=0) - np.roll(ring, reach, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    return np.stack([-along[:, 1], along[:, 0]], axis=1)


def _turned(ring: Ring, sign: float) -> Ring:
    return ring if signed_area(ring) * sign > 0 else ring[::-1].copy()
