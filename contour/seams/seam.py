"""A seam through a block: a line along which its walls end. There two blocks lie against each other.

Each has cells of its own, and both were cut, so few walls lead from one to the other: along their common edge cells run
into each other. Where the blocks do not touch, what is free of walls makes one opening from outline to outline; where
they do, many short ones in a row, or none: then the order of cells alone tells them apart. Walls that are lost in one
block leave openings, too, but faint ones lead across, and its cells go on in the same order beyond. Adhesive in a
splice, compound or ink leave some in which light is not as in comb. Where all that is alike, floors of cells may step.
"""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes
from contour.geometry.rings import Ring
from contour.image.opencv import grey
from contour.image.pixel_grid import averaged, pixels_of, samples_of
from contour.seams.both_sides import cell_order, comb_along
from contour.seams.cell_sizes import parted_by_size
from contour.seams.floors import floors_differ, parted_by_floors
from contour.seams.inner_corners import hanging
from contour.seams.openings import Openings, openings
from contour.seams.parting import (
    LONG,
    Parted,
    beside,
    parted,
    parted_by_order,
    parted_by_row,
    parted_strip,
    runs_along,
)
from contour.walls.pieces import Piece
from contour.walls.see_block import SeenWalls
from contour.walls.wall_evidence import BlockEvidence

# Pixels a sample, if walls are two samples wide and more. Where an opening is long and yet parts nothing, pixels are
# looked at: in these walls that end beside each other touch less often.
_STEP = 2
# How much of a line runs along openings that part two blocks whose cells lie in one order: of those that lie alike by
# chance, and of halves that were left where they were cut, all of it; of single blocks with such openings 0.88.
_ALL_ALONG = 0.95
# A row of openings that runs so much along a line, with irregular cells on both sides: no single block of 420 has one.
_SURE_ROW = 0.85
# And where cells are in no order, but one opening is as long as in no single block, pitches, noise across it says
# nothing.
_OF_NO_BLOCK = 10.0
# Of a block: of 360 with compound or a splice, three have floors in two kinds of light, and fill 0.11 of it at most;
# another block against it that is no more is told by its cells or by what lies between.
_NO_PATCH = 0.25
# What hangs on a block between two inner corners has so many square pitches well within its outline at the least.
_LEAST_HANGING = 6.0


def parted_by_seam(walls: SeenWalls, seen: BlockEvidence, exterior: Ring) -> Piece | None:
    """The smaller of two parts of a block that a seam parts, by its exterior; None without a seam; all pixels."""
    if seen.mask is None:
        return None
    coarse = _STEP if seen.wall_px >= 2 * _STEP * walls.scale else 1
    for step in sorted({coarse, 1}, reverse=True):
        free = openings(walls, seen, seen.mask, step)
        light = _light(walls, seen, free)
        found = _other_block(walls, seen, free, light) or _other_part(walls, seen, free, light, exterior)
        if found is not None:
            return _smaller(free, found.part, walls.scale)
        if free.long.max(initial=0.0) < LONG:
            return None
    return None


def _other_block(walls: SeenWalls, seen: BlockEvidence, free: Openings, light: Bytes) -> Parted | None:
    """The part that is another block, by its openings."""
    strip = parted_strip(free)
    if strip is not None and parted_strip(_with_faint(walls, seen, free.step)) is not None:
        # Ink hides walls along a line, too; but cells go on in the same order beyond.
        order = cell_order(free, strip)
        if order.other or not order.known:
            return strip
    found = parted(free)
    if found is not None and comb_along(light, free, found) and _two(walls, seen, free, found, light):
        return found
    others = (one for one in _of_other_cells(free) if comb_along(light, free, one))
    return next(others, None) or _of_other_floors(_lit(walls, free, light), free)


def _of_other_floors(light: Bytes, free: Openings) -> Parted | None:
    """The part whose floors are in another light, where it is comb, or more of the block than compound fills."""
    found = parted_by_floors(light, free)
    if found is None or comb_along(light, free, found):
        return found
    share = float(np.mean(found.part[free.depth > 0.0]))
    return found if min(share, 1.0 - share) > _NO_PATCH else None


def _other_part(walls: SeenWalls, seen: BlockEvidence, free: Openings, light: Bytes, exterior: Ring) -> Parted | None:
    """What hangs on the block between two inner corners, where its cells lie in another order."""
    for one in hanging(exterior, seen.pitch_px):
        ends = (samples_of(one.part[[0, -1]], walls.scale) - free.first) / (free.step * free.pitch)
        found = beside(free, 0.0, ends[0], ends[1], _LEAST_HANGING)
        if found is not None and cell_order(free, found).other and comb_along(light, free, found):
            return found
    return None


def _of_other_cells(free: Openings) -> Iterator[Parted]:
    """Parts in which cells lie in another order than beyond, along a row of openings or by the order alone, or are of
    another size.
    """
    row = parted_by_row(free)
    if row is not None:
        order = cell_order(free, row)
        if order.other or (row.along > _SURE_ROW and order.some_other):
            yield row
    yield from (one for one in parted_by_order(free) if cell_order(free, one).surely_other)
    larger = parted_by_size(free)
    if larger is not None:
        yield larger


def _two(walls: SeenWalls, seen: BlockEvidence, free: Openings, found: Parted, light: Bytes) -> bool:
    """Whether cells lie in another order on both sides of a line along long openings, or else their floors differ, or
    no faint walls lead across. One block that was cut in two lies in one order: there openings must run all along.
    """
    order = cell_order(free, found)
    if order.some_other or (order.same and found.along < _ALL_ALONG):
        return order.some_other
    if not order.same:
        if found.along >= _ALL_ALONG and float(free.long.max()) > _OF_NO_BLOCK:
            return True
        if floors_differ(_lit(walls, free, light), free, found):
            return True
    return runs_along(_with_faint(walls, seen, free.step), found)


def _with_faint(walls: SeenWalls, seen: BlockEvidence, step: int) -> Openings:
    """The block's openings between walls at half the threshold."""
    assert seen.mask is not None
    faint = np.asarray(cv2.bitwise_or(seen.mask, walls.mask.faint()), np.uint8)
    return openings(walls, seen, faint, step)


def _light(walls: SeenWalls, seen: BlockEvidence, free: Openings) -> Bytes:
    """The light that walls were seen in on the openings' grid, (h, w), bright where walls are."""
    light = _on_grid(walls.small, free)
    return light if seen.polarity == "bright" else np.asarray(cv2.bitwise_not(light), np.uint8)


def _lit(walls: SeenWalls, free: Openings, light: Bytes) -> Bytes:
    """The light that floors of cells show in: `light`, but on a known table, from which they do not differ, how that is
    lit.
    """
    if walls.relief is None:
        return light
    return _on_grid(averaged(grey(walls.relief.lit), walls.scale, cv2.BORDER_REPLICATE), free)


def _on_grid(small: Bytes, free: Openings) -> Bytes:
    """Means on the openings' grid, (h, w)."""
    (left, top), (high, wide) = free.first, free.numbers.shape
    part = small[top : top + high * free.step, left : left + wide * free.step]
    return averaged(part, free.step, cv2.BORDER_REPLICATE)


def _smaller(free: Openings, part: Bools, scale: int) -> Piece:
    """The part, or the rest of the block where that is smaller, pixels."""
    block = free.depth > 0.0
    one = min(block & part, block & ~part, key=np.count_nonzero).astype(np.uint8)
    rings, _ = cv2.findContours(one, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    ring = np.asarray(max(rings, key=cv2.contourArea), np.float64).reshape(-1, 2)
    outline = pixels_of(pixels_of(ring, free.step) + free.first, scale)
    (left, top), (right, bottom) = (np.rint(corner).astype(int).tolist() for corner in (outline.min(0), outline.max(0)))
    whole = free.step * scale
    width = 2.0 * float(cv2.distanceTransform(one, cv2.DIST_L2, 5).max()) * whole
    return Piece(float(np.count_nonzero(one)) * whole**2, (left, top, right, bottom), outline, width)
