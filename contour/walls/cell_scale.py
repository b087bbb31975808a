"""The scale of a block read from the picture itself: cell pitch, wall width, and whether walls are bright or dark."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np

from contour.errors import NoCellsFound
from contour.geometry.arrays import Bools, Bytes, Float64s, Indices, Int32s, median, quantile, quantiles
from contour.image.opencv import inverted, opened, pieces_and_areas, pieces_and_middles
from contour.image.side_by_side import side_by_side
from contour.walls.comb_likeness import (
    MOSTLY_SQUARES,
    ROUND_SQUARES,
    Comb,
    apart,
    filled_shares,
    lattice_order,
    surely_comb,
)
from contour.walls.wall_mask import FINE_PITCH, Smooth, wall_mask

_TILE_PX = 512
_TILES = 4
_LARGE_PX = 24_000_000
# First guesses of the pitch; the mask's windows forgive a factor of two either way.
_GUESSES = (24.0, 70.0, 8.0)
# Tried where these show no cells, as noise has patches as small; and the least cells counted then, and else, px².
_FINEST_GUESS = 4.5
_FINEST_CELL, _LEAST_CELL = 5, 9
_GOOD_SCORE = 0.2
_LEAST_SCORE = 0.14
_LEAST_CELLS = 6
# Two readings of one pitch differ by less than this share of it.
_SAME_PITCH = 0.1
# A sheet with holes far apart is a table, not a plate of cells.
_WIDEST_WALL = 0.65
# Walls wider than 0.45 pitch count for less and less.
_WIDE_WALL = 0.2


@dataclass(frozen=True)
class CellScale:
    """Pitch and wall width in pixels, polarity, number of enclosed cells, the area share of those of usual size,
    the part of the tile they fill, the wall contrast in grey levels, the share of the
    walls that hang together, and the grey levels of walls and of cells' floors.

    form: tells the share of the cells with neighbours all around, of those with a triangle's, the shares of its convex
    hull and of the circle around it that a cell fills, and the share that stays apart; of most readings nobody asks."""

    pitch_px: float
    wall_px: float
    bright: bool
    count: int
    regularity: float
    filled: float
    contrast: float
    connected: float
    level: float
    floor: float
    form: Callable[[], tuple[float, float, float, float, float, float]]

    @property
    def score(self) -> float:
        """Larger for a better comb: many cells, of one size, over most of the tile, with walls no wider than they."""
        # The light gaps of a comb of dark cells look like cells too, but leave less room between them.
        thin = min(1.0, (_WIDEST_WALL - self.wall_px / self.pitch_px) / _WIDE_WALL)
        return self.regularity * self.filled * self.connected * thin * min(1.0, self.count / 12)

    @property
    def merged(self) -> bool:
        """Whether these may be finer cells that run into each other."""
        return self.pitch_px < FINE_PITCH and not self.comb.cellular

    @cached_property
    def comb(self) -> Comb:
        """What tells a comb from other things that have patches side by side."""
        regular = self.regularity * self.filled
        order, triangles, squares, solid, circled, parted = self.form()
        return Comb(
            self.pitch_px,
            self.wall_px,
            self.bright,
            self.count,
            self.score,
            regular,
            order=order,
            solid=solid,
            circled=circled,
            triangular=triangles > 0.5 * order,
            square=squares > MOSTLY_SQUARES and circled > ROUND_SQUARES,
            apart=parted,
        )


def probe(light: Bytes, polarity: str) -> CellScale:
    """Cells in the most textured parts of the picture; polarity "auto", "bright" or "dark". Raises NoBlockFound.

    The busiest tile at full size is asked first, then the whole picture at a quarter of its size, where large cells are
    many, then further tiles. The first good answer is taken, else the best.
    """
    senses = [bright for bright in (True, False) if polarity != ("dark" if bright else "bright")]
    best: CellScale | None = None
    for part, shrink in _parts(light):
        found = _part_cells(part, senses, _GUESSES if shrink == 1 else _GUESSES[:2])
        if found is None:
            continue
        found = replace(found, pitch_px=found.pitch_px * shrink, wall_px=found.wall_px * shrink)
        if best is None or found.score > best.score:
            best = found
        if best.score > _GOOD_SCORE:
            break
    if best is None or not _is_comb(best) or best.merged:
        finest = [_part_cells(tile, senses, (_FINEST_GUESS,), _FINEST_CELL) for tile in _busiest_tiles(light)[:1]]
        best = max([one for one in (best, *finest) if one is not None], key=lambda one: one.score, default=None)
    if best is None or not _is_comb(best):
        seen = " and ".join(_shown(light, bright=bright) for bright in senses)
        raise NoCellsFound(
            f"no block found: the most textured part of the picture shows {seen}, "
            "expected a dozen or more of one size. Check that a block lies in view, the light, and the polarity"
        )
    return best


def _is_comb(cells: CellScale) -> bool:
    # Several small blocks in view fill little of a tile, and do not hang together.
    return cells.score >= _LEAST_SCORE or surely_comb(cells.comb)


def _shown(light: Bytes, *, bright: bool) -> str:
    """What the most textured part shows where walls are bright, or dark, in words."""
    tiles = _busiest_tiles(light)
    found = _part_cells(tiles[0], [bright], _GUESSES) if tiles else None
    cells = f"{found.count} enclosed cells of mixed size or far apart" if found else "no enclosed cells"
    return f"{cells} between {'bright' if bright else 'dark'} walls"


def _parts(light: Bytes) -> Iterator[tuple[Bytes, int]]:
    tiles = _busiest_tiles(light)
    yield from ((tile, 1) for tile in tiles[:1])
    if min(light.shape) >= 4 * 64:
        quarter = cv2.resize(light, (light.shape[1] // 4, light.shape[0] // 4), interpolation=cv2.INTER_AREA)
        yield np.asarray(quarter, np.uint8), 4
    yield from ((tile, 1) for tile in tiles[1:])


def _busiest_tiles(light: Bytes) -> list[Bytes]:
    """Tiles of up to 512 px with the most local contrast, busiest first, apart from each other."""
    block = 32
    hop = 4 if light.size < _LARGE_PX else 8
    sample = light[::hop, ::hop].astype(np.float32)
    shape = (max(1, light.shape[1] // block), max(1, light.shape[0] // block))
    both = cv2.merge([sample, sample * sample])
    mean, square = cv2.split(cv2.resize(both, shape, interpolation=cv2.INTER_AREA))
    # The root of the deviation, or one glaring object outweighs a whole dim block.
    activity = np.sqrt(np.sqrt(np.maximum(square - mean * mean, 0.0)))
    half = _TILE_PX // block // 2
    smooth = cv2.blur(activity, (2 * half + 1, 2 * half + 1), borderType=cv2.BORDER_CONSTANT)
    tiles = []
    for _ in range(_TILES):
        row, column = np.unravel_index(int(np.argmax(smooth)), smooth.shape)
        if smooth[row, column] <= 0:
            break
        top = int(np.clip(int(row) * block - _TILE_PX // 2, 0, max(0, light.shape[0] - _TILE_PX)))
        left = int(np.clip(int(column) * block - _TILE_PX // 2, 0, max(0, light.shape[1] - _TILE_PX)))
        tiles.append(light[top : top + _TILE_PX, left : left + _TILE_PX])
        smooth[max(0, row - half) : row + half + 1, max(0, column - half) : column + half + 1] = 0
    return tiles


def _part_cells(
    part: Bytes, senses: list[bool], guesses: tuple[float, ...], least: int = _LEAST_CELL
) -> CellScale | None:
    """The best reading of a part over first guesses of the pitch and senses of contrast, read once more with its own
    pitch.
    """
    best: CellScale | None = None
    for guess in guesses:
        for cells in _in_senses(part, guess, senses, least):
            if cells is not None and (best is None or cells.score > best.score):
                best = cells
        # Good enough in one sense and guess, while the other sense was heard too.
        if best is not None and best.score > _GOOD_SCORE:
            break
    if best is None:
        return None
    again = cells_of(part, best.pitch_px, bright=best.bright, least=least)
    if again is None or again.score >= best.score:
        return again or best
    # Faint fine cells are seen better through a wide window. And of webs as wide as holes their rims alone may be left.
    same = abs(again.pitch_px - best.pitch_px) < _SAME_PITCH * best.pitch_px
    return best if same or (again.comb.scattered and not best.comb.scattered) else again


def _in_senses(part: Bytes, guess: float, senses: list[bool], least: int) -> Sequence[CellScale | None]:
    if len(senses) == 1:
        return [cells_of(part, guess, bright=senses[0], least=least)]
    smooth = Smooth.of(part, guess)
    return side_by_side(
        lambda: cells_of(part, guess, bright=True, least=least, smooth=smooth),
        lambda: cells_of(part, guess, bright=False, least=least, smooth=smooth),
    )


def cells_of(
    light: Bytes, pitch_px: float, *, bright: bool, least: int = _LEAST_CELL, smooth: Smooth | None = None
) -> CellScale | None:
    """Cells of `least` pixels enclosed by the wall mask of `light` made for `pitch_px`; None where fewer than six."""
    seen = wall_mask(light, pitch_px, bright=bright, smooth=smooth)
    mask = seen.mask
    labels, stats, centroids = pieces_and_middles(inverted(mask), 4)
    areas, places, numbers = _enclosed(stats[1:], centroids[1:], mask.shape, least)
    if len(areas) < _LEAST_CELLS:
        return None
    # Half of the enclosed *area* lies in cells smaller than this, so that specks do not count; then merged cells are
    # told from single ones by a plain median.
    ascending = np.sort(areas)
    by_area = ascending[np.searchsorted(np.cumsum(ascending), 0.5 * ascending.sum())]
    typical = median(areas[areas > by_area / 3])
    regular = (areas > typical / 2) & (areas < 2 * typical)
    usual = areas[regular]
    if len(usual) < _LEAST_CELLS:
        return None
    inner = float(np.sqrt(2 / np.sqrt(3) * median(usual)))
    walls = _without_sheets(mask, max(3, round(0.7 * inner)))
    wall = wall_width(walls)
    size = inner + wall
    if wall > _WIDEST_WALL * size:
        return None
    # Area a regular comb of this pitch would fill with as many cells.
    # Cells of a comb lie side by side, specks of a table all over it: the part of their place that they fill.
    spread = np.diff(quantiles(places[regular], (0.05, 0.95)), axis=0)[0] / 0.9 + size
    filled = len(usual) * size * size * np.sqrt(3) / 2 / float(np.prod(spread))
    _, pieces = pieces_and_areas(mask, 8)
    connected = float(pieces.max() / max(1, pieces.sum()))
    return CellScale(
        size,
        wall,
        bright,
        len(usual),
        float(usual.sum() / areas.sum()),
        float(min(1.0, filled)),
        seen.contrast,
        connected,
        median(_some(light, walls > 0)),
        # The darker part of what is free, for a lighter table may lie in it too (of the lighter part for dark walls).
        quantile(_some(light, mask == 0), 0.3 if bright else 0.7),
        lambda: (
            *lattice_order(places[regular], size),
            *filled_shares(labels, numbers[regular], stats),
            apart(labels, numbers[regular], wall),
        ),
    )


def _some(light: Bytes, where: Bools) -> Bytes:
    """Every seventh pixel of those."""
    return light.ravel().take(np.flatnonzero(where)[::7])


def _without_sheets(mask: Bytes, side: int) -> Bytes:
    """The mask without what squares of `side` pixels fit into, unless that is most of it.

    A table as bright as the walls is no wall: what is wider than most of a cell does not count for their width.
    """
    sheet = opened(mask, side)
    walls = np.asarray(cv2.subtract(mask, cv2.dilate(sheet, np.ones((3, 3), np.uint8))), np.uint8)
    return walls if np.count_nonzero(walls) > 0.3 * np.count_nonzero(mask) else mask


def _enclosed(
    stats: Int32s, centroids: Float64s, shape: tuple[int, ...], least: int
) -> tuple[Float64s, Float64s, Indices]:
    """Areas (N,), centroids (N, 2) and labels (N,) of the pieces of `least` pixels that lie within the part and are no
    slivers.
    """
    left, top, wide, high, area = (stats[:, column] for column in range(5))
    within = (left > 0) & (top > 0) & (left + wide < shape[1]) & (top + high < shape[0])
    compact = (area > 0.3 * wide * high) & (np.maximum(wide, high) < 4 * np.minimum(wide, high)) & (area >= least)
    chosen = np.flatnonzero(within & compact)
    return area[chosen].astype(np.float64), centroids[chosen], chosen + 1


def wall_width(mask: Bytes) -> float:
    """Mean wall width of a mask, pixels: area over half its boundary length (Cauchy-Crofton: π/4 of its crossings)."""
    crossings = np.count_nonzero(mask[1:] != mask[:-1]) + np.count_nonzero(mask[:, 1:] != mask[:, :-1])
    return float(2 * np.count_nonzero(mask) / max(1.0, np.pi / 4 * crossings))
