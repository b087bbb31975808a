"""The coarse block: where the comb lies to a fraction of a cell."""

from __future__ import annotations

import cv2
import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bytes, Float64s, Int32s
from contour.image.opencv import (
    closed_by_disc,
    deep,
    median_where,
    pieces_and_areas,
    pieces_and_boxes,
    pieces_of,
    within,
)
from contour.image.pixel_grid import averaged, coarse_step, pixels_of
from contour.walls.coarse_rings import PAD, CoarseBlock, padded, sides, walls_at_frame, with_rings
from contour.walls.faint_links import FadedWalls

# A disc of 0.72 pitch bridges an open cell (1.15 pitches across its corners) and a wall broken out of it.
CLOSING_PITCHES = 0.72
"""Radius of the disc that bridges an open cell at the border."""
# A gap in a ring of single cells around an opening, up to a cell wide, is a missing wall and no way out.
_LINK_PITCHES = 1.0
_FRAGMENT_PITCHES = 2.0
_SPECK_PITCHES = 0.4
_STRAND_PITCHES = 0.8
# All gaps around an opening together, its line being a sample or two wide.
_GAPS_PITCHES = 2.5
# Samples of another piece within two of the main one that make both of them one block.
_CONTACTS = 6
# An inner opening in which a disc of this radius fits is a hole, not a missing cell.
_HOLE_RADIUS_PITCHES = 1.1
# So far within a block no larger disc fits between walls in 90 of 93 right outlines, and none of 0.48; in the others
# ink, adhesive or a hand hides walls. Holes of a cell and a half leave room for it.
_OPENING_RADIUS_PITCHES, _WELL_WITHIN_PITCHES = 0.6, 1.2
_WALL_COVERAGE = 0.12
# Grey levels between table and walls, averaged with their cells, below which an opening's own level says nothing.
_LEAST_SHADE = 8.0
# A light table in a hole lies in the block's shade: of what table and walls differ by, it is lighter than walls by 0.13
# and more. Black cells are by 0.05 at most, but for one block (0.17) that is refused for its light. Of a hole that lies
# half in deep shade a quarter is lighter by 0.54, of black cells in blocks that are accepted by 0.10.
_LIGHTER_THAN_WALLS, _A_QUARTER_LIGHTER = 0.1, 0.3
# Cells make a block a pitch wide at the least; a horn with an angle of 25 degrees is thinner over 1.8 pitches, and
# strands of broken cells lie along the block.
_THIN_PITCHES = 0.8
_OUT_PITCHES = 2.3


Pieces = tuple[Int32s, Int32s]
"""The number of the piece of walls each sample lies in, (H, W), 0 in none, and OpenCV's statistics of each."""


def coarse_block(mask: Bytes, light: Bytes, pitch_px: float, small: Bytes | None = None) -> CoarseBlock:
    """The largest comb in a wall mask (H, W), uint8, of the picture `light`, with cells `pitch_px` pixels wide.

    `small`: the mask's `averaged` by samples of `coarse_step`, where it is known. Raises NoBlockFound.
    """
    step = coarse_step(pitch_px)
    small = averaged(mask, step) if small is None else small
    walls = (small > 255 * _WALL_COVERAGE).astype(np.uint8)
    walls = padded(walls, cv2.BORDER_CONSTANT)
    samples = pitch_px / step
    pieces = pieces_and_boxes(walls, 8)
    kept = _main_piece(pieces, samples)
    filled, kept = _linked(pieces, kept, closed_by_disc(kept, CLOSING_PITCHES * samples), samples)
    filled = without_threads(_largest(filled | kept), samples)
    kept &= filled
    filled = _fill_missing_cells(filled, kept, (light, step), _HOLE_RADIUS_PITCHES * samples)
    left = sides(filled, walls_at_frame(mask, kept, step), samples)
    if len(left) == 4:
        raise NoBlockFound(
            "no block found: a pattern of cells runs out of the picture on all four sides, as a table's does. "
            "Check that a block lies in view with table around it"
        )
    return with_rings(filled, kept, _strands(walls & (1 - kept), samples), step, samples, leaves=bool(left))


def small_openings(block: CoarseBlock, light: Bytes, pitch_px: float, scale: int) -> Float64s:
    """The middles x and y of openings between a block's walls that may be holes or missing cells, and radii of discs
    that fit there, pixels of a picture `scale` times as large as the mask and `light`, (K, 3); `pitch_px` in mask
    pixels. Cells whose walls have faded, but show in `light`, (H, W), uint8, are none.
    """
    away = np.asarray(cv2.distanceTransform(1 - block.walls, cv2.DIST_L2, 5), np.float64) * block.step
    # Told from the middles of samples, the outermost lie half a one within.
    well_within = block.depth > _WELL_WITHIN_PITCHES * pitch_px - 0.5 * block.step
    count, pieces = pieces_of((away > _OPENING_RADIUS_PITCHES * pitch_px) & well_within, 8)
    if count == 1:
        return np.empty((0, 3))
    found = []
    faded = FadedWalls.of(light, block.step, block.filled, pitch_px / block.step)
    for number in range(1, count):
        radius = np.where(pieces == number, away, 0.0)
        row, column = np.unravel_index(radius.argmax(), radius.shape)
        if radius[row, column] > _HOLE_RADIUS_PITCHES * pitch_px:
            continue
        if not faded.in_small(float(column), float(row), float(radius[row, column]) / block.step):
            x, y = pixels_of(np.array([column - PAD, row - PAD], np.float64), block.step * scale)
            found.append((x, y, radius[row, column] * scale))
    return np.array(found, np.float64).reshape(-1, 3)


def _main_piece(pieces: Pieces, samples: float) -> Bytes:
    """The walls of the largest piece of comb; `samples` is the pitch on the coarse grid. Raises NoBlockFound.

    Chips and neighbouring pieces may lie nearer than the closing reaches, but do not hang together with the block. Only
    where no piece holds most of the walls (a faint block seen in fragments) all fragments of several cells are taken.
    """
    labels, stats = pieces
    area = stats[:, cv2.CC_STAT_AREA].astype(np.float64)
    area[0] = 0
    size = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    size[0] = 0
    large = size > 3 * samples
    if not large.any():
        raise NoBlockFound(
            "no block found: the walls seen form no piece more than three cells wide. "
            "Check the light and that a block lies in view"
        )
    if area.max() <= 0.5 * area[large].sum():
        return large.astype(np.uint8).take(labels)
    main = labels == int(np.argmax(area))
    # Another large piece that all but hangs together with it at several walls is a part behind a faint row.
    near = cv2.dilate(main.view(np.uint8), np.ones((5, 5), np.uint8)) > 0
    touching = np.bincount(labels[near & (labels > 0) & ~main], minlength=len(area)) >= _CONTACTS
    kept = large & touching
    return np.asarray(main | kept.take(labels) if kept.any() else main, np.uint8)


def _linked(pieces: Pieces, kept: Bytes, filled: Bytes, samples: float) -> tuple[Bytes, Bytes]:
    """The filled block and its walls with a thin line across every gap of less than a cell that leads into an opening.

    Closing joins what lies side by side, but not the ends of a strand of walls between an opening and the table. Grown
    walls part such openings from the table; where their two sides meet again, the line runs. Loose walls of the strand
    are walls of the block then.
    """
    reach = 0.5 * _LINK_PITCHES * samples
    labels, stats = pieces
    size = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    small = (size > _SPECK_PITCHES * samples) & (size < _FRAGMENT_PITCHES * samples)
    small[0] = False
    strand = kept | small.take(labels).astype(np.uint8)
    count, parts = pieces_of(deep(1 - strand, reach, 5), 4)
    # Cells are such parts too; only wide ones can be holes.
    wide = np.zeros(count, np.bool_)
    wide[parts[deep(1 - strand, _HOLE_RADIUS_PITCHES * samples, 5) > 0]] = True
    wide[0] = False
    if np.count_nonzero(wide) < 2:
        return filled, kept
    narrow = (~wide).astype(np.uint8).take(parts)
    _, nearest = cv2.distanceTransformWithLabels(narrow, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_CCOMP)
    nearest = nearest.astype(np.uint16)
    low = cv2.erode(nearest, np.ones((3, 3), np.uint8))
    line = (low < nearest) & (within(strand, reach + 1, 5) > 0) & (filled == 0)
    if not line.any():
        return filled, kept
    # Dust on a table encloses openings too, but its strands are gaps for the most part.
    gaps = line & (cv2.dilate(strand, np.ones((3, 3), np.uint8)) == 0)
    both = np.concatenate([nearest[gaps], low[gaps]])
    length = np.bincount(both, minlength=int(nearest.max()) + 1)
    closed = length <= _GAPS_PITCHES * samples
    closed[nearest[0, 0]] = False
    line[line] = closed[low[line]] | closed[nearest[line]]
    across = labels[line & (cv2.dilate(filled, np.ones((3, 3), np.uint8)) == 0)]
    joined = (np.bincount(across, minlength=len(small)) > 0) & small
    return filled | line.view(np.uint8), kept | joined.take(labels).view(np.uint8)


def _largest(filled: Bytes) -> Bytes:
    labels, area = pieces_and_areas(filled, 8)
    return np.asarray(labels == int(np.argmax(area)), np.uint8) if len(area) > 2 else filled


def _fill_missing_cells(filled: Bytes, walls: Bytes, seen: tuple[Bytes, int], radius: float) -> Bytes:
    """The block with every inner opening filled in which no disc of `radius` fits, that is as dark as dark walls, or in
    which walls have faded.

    Looked into at a slant, black cells show nothing but wall: no mask of walls against cells, and no hole either.
    `seen`: the picture, and its pixels a sample.
    """
    count, labels = pieces_of(1 - filled, 4)
    opening = np.zeros(count, np.bool_)
    opening[labels[deep(1 - filled, radius, 5) > 0]] = True
    outside = labels[0, 0]
    opening[[0, outside]] = False
    if opening.any():
        shade = padded(averaged(*seen, cv2.BORDER_REPLICATE), cv2.BORDER_REPLICATE)
        table = median_where(shade, labels == outside)
        wall = median_where(shade, walls)
        for number in np.flatnonzero(opening):
            half, quarter = np.quantile(shade[labels == number], (0.5, 0.75)) - wall
            # Lighter than a light block's walls and cells together is the table in a hole, or a lamp's spot on it.
            lighter = half > _LIGHTER_THAN_WALLS * (table - wall) or quarter > _A_QUARTER_LIGHTER * (table - wall)
            opening[number] = table < wall or lighter or table - wall < _LEAST_SHADE
        faded = FadedWalls.of(*seen, filled, radius / _HOLE_RADIUS_PITCHES)
        for number in np.flatnonzero(opening):
            opening[number] = not faded.in_hole(labels == number)
    opening[outside] = True
    return (~opening).astype(np.uint8).take(labels)


def _strands(walls: Bytes, samples: float) -> Bytes:
    """Those of the walls that are as long as a cell's wall and more, no specks."""
    labels, stats = pieces_and_boxes(walls, 8)
    long = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) > _STRAND_PITCHES * samples
    long[0] = False
    return long.take(labels).view(np.uint8)


def without_threads(filled: Bytes, samples: float) -> Bytes:
    """The filled block on the coarse grid, 1 inside, without what is thinner than a cell, reaches more than two cells
    away from the block and ends on the table; `samples` is the pitch on that grid.

    Threads that lead from the block to the block again stay: they are the rim of an opening.
    """
    size = 2 * round(0.5 * _THIN_PITCHES * samples) + 1
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    wide = np.asarray(cv2.morphologyEx(filled, cv2.MORPH_OPEN, disc), np.uint8)
    labels, stats = pieces_and_boxes(filled & ~wide, 8)
    length = np.hypot(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    long = length > _OUT_PITCHES * samples
    long[0] = False
    if not long.any() or not wide.any():
        return filled
    away = cv2.distanceTransform(1 - wide, cv2.DIST_L2, 3)
    kept = filled.copy()
    for number in np.flatnonzero(long):
        thread = (labels == number).astype(np.uint8)
        root = cv2.bitwise_and(cv2.dilate(thread, np.ones((3, 3), np.uint8)), wide)
        roots, _ = cv2.connectedComponents(root, connectivity=8)
        if roots == 2 and float(away[thread > 0].max()) > _OUT_PITCHES * samples:
            kept[thread > 0] = 0
    return kept
