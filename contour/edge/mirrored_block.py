"""A block on a polished table, without the walls that the table mirrors beyond its edge.

Mirrored walls are fainter than the block's, yet not fainter than its faintest. So those that rise high give a first
outline; where that is the axis of a mirror image, or one lies nearby, all that is beyond the axis is the image, and all
within it the block; elsewhere it is tried again with walls of another height.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import cv2
import numpy as np

from contour.edge.reflection import Reflection, axis_beside, reflection
from contour.edge.table_look import TableLook, table_look
from contour.edge.visible_edge import visible_rings
from contour.errors import NoBlockFound
from contour.geometry.arrays import Bytes
from contour.geometry.rectifier import Rectifier
from contour.geometry.rings import Contour, Ring
from contour.image.pixel_grid import samples_of
from contour.walls.pieces import Piece, pieces_beside
from contour.walls.see_block import SeenWalls, see_block, strong_walls
from contour.walls.wall_evidence import BlockEvidence

# Of the height of walls in the wider region; a mirror image has up to half of that, of bright walls more.
_RISES, _TURNS = (0.7, 0.85, 0.5, 1.0), 2
# On plain tables less of an outline is an axis. Of 30 outlines that came to be one all along the best of those through
# walls of the first height was so along 0.66 of it at least, and of those of other tables mostly less than half.
_FEW, _HALF = 0.05, 0.5
# Within 42 mirrored blocks no disc of more than 0.58 pitches holds no such wall, across holes one of 0.88 up.
_MOST_ROOM = 0.7
# Walls are what they were seen to be so near to a place of the outline without an axis, each so many of them.
_UNKNOWN_PITCHES, _EVERY = 0.8, 4

Looked = tuple[BlockEvidence, TableLook]
"""What is seen of a block, and of what lies on it."""


@dataclass(frozen=True, eq=False)
class _Found:
    """An outline, where it is the axis of a mirror image, whether it is that all along and comb fills it, and the walls
    it was laid through, None where all were.
    """

    contour: Contour
    shown: Reflection
    whole: bool
    seen: SeenWalls | None = None


def mirrored_block(
    picture: Bytes, walls: SeenWalls, first: Contour | None, rectifier: Rectifier | None
) -> Iterator[Looked]:
    """What is seen of a block within the axis of its mirror image, in a picture, grey (H, W) or BGR (H, W, 3), uint8:
    by all of its walls, by those through which the axis was laid, and by lighter ones. Nothing where no outline is an
    axis all along.

    `first`: the outline that was found with the mirrored walls, None without any.
    """
    axis = _axis(picture, walls, first, rectifier)
    if axis is None:
        return
    others = _beside(walls, axis.contour)
    # Gaps between places that are shown are short: the axis goes on there.
    shown = replace(axis.shown, shown=tuple(np.ones_like(one) for one in axis.shown.shown))
    own = () if axis.seen is None else (axis.seen,)
    lighter = (strong_walls(walls, rise) for rise in sorted(_RISES)[:2])
    for some in chain((_within(one, one, shown) for one in chain((walls, *own), lighter)), own):
        try:
            seen, look = _looked(picture, some)
        except NoBlockFound:
            continue
        yield replace(seen, others=others), look


def _axis(picture: Bytes, walls: SeenWalls, first: Contour | None, rectifier: Rectifier | None) -> _Found | None:
    """The outline that is the axis of a mirror image all along; None without one."""
    best = None if first is None else _judged(walls, first)
    for rise in _RISES:
        if best is not None and best.whole:
            break
        strong = strong_walls(walls, rise)
        known = best is not None and best.shown.share >= _FEW
        best = _better(best, _found(picture, walls, strong, rectifier, least=0.0 if known else _FEW))
        if best is None or best.shown.share < _FEW:
            return None
        for _ in range(_TURNS):
            if best.whole:
                break
            axis = axis_beside(walls.light, best.contour, walls.cells.pitch_px)
            turned = _better(best, _found(picture, walls, _within(walls, strong, axis), rectifier))
            if turned is None or turned is best:  # and so it would be again
                break
            best = turned
        if best.shown.share < _HALF:
            return None
    return best if best is not None and best.whole else None


def is_mirrored(walls: SeenWalls, contour: Contour) -> bool:
    """Whether the table mirrors the block all along a contour, and comb fills it."""
    return _judged(walls, contour).whole


def _judged(walls: SeenWalls, contour: Contour, seen: SeenWalls | None = None) -> _Found:
    shown = reflection(walls.light, contour, walls.cells.pitch_px)
    return _Found(contour, shown, shown.whole and _room_within(walls, contour) < _MOST_ROOM, seen)


def _beside(walls: SeenWalls, contour: Contour) -> tuple[Piece, ...]:
    """Pieces of comb beside a contour, with walls as light as a block's own: mirrored ones make none."""
    strong, scale = strong_walls(walls, _RISES[0]).mask.mask, walls.scale
    return pieces_beside(strong, samples_of(contour.exterior, scale), walls.cells.pitch_px / scale, scale)


def _room_within(walls: SeenWalls, contour: Contour) -> float:
    """The radius of the largest disc within a contour that holds no wall as light as a block's own, cell pitches:
    mirrored ones fill holes, and look like cells there.
    """
    free = cv2.subtract(_drawn(contour.rings, walls), strong_walls(walls, _RISES[0]).mask.mask)
    return float(cv2.distanceTransform(free, cv2.DIST_L2, 5).max()) * walls.scale / walls.cells.pitch_px


def _better(one: _Found | None, other: _Found | None) -> _Found | None:
    """The one of two that is whole, or the axis of a mirror image along more of it, in doubt the first."""
    if one is None or other is None:
        return one or other
    return max(one, other, key=lambda found: (found.whole, found.shown.share))


def _found(
    picture: Bytes, walls: SeenWalls, seen: SeenWalls, rectifier: Rectifier | None, *, least: float = 0.0
) -> _Found | None:
    """The outline of those walls that are `seen`, whatever they say against it; None without one, or where axes lie
    within half a pitch of the coarse outline along less of it than `least`: along no more of a line through wall ends.
    """
    try:
        looked, look = _looked(picture, seen)
        if least and axis_beside(walls.light, _coarse(looked), walls.cells.pitch_px).share < least:
            return None
        rings = visible_rings(picture, looked, look, rectifier)
    except NoBlockFound:
        return None
    return _judged(walls, Contour.of(one.fitted.ring[::-1].copy() for one in rings), seen)


def _coarse(seen: BlockEvidence) -> Contour:
    return Contour.of(ring.coarse[::-1].copy() for ring in seen.rings)


def _looked(picture: Bytes, walls: SeenWalls) -> Looked:
    seen = see_block(walls)
    return seen, table_look(picture, seen, mirrored=True)


def _within(walls: SeenWalls, strong: SeenWalls, axis: Reflection) -> SeenWalls:
    """The walls within an axis; those that are `strong`, on both sides, where there is none."""
    mask, reach = walls.mask.mask, round(_UNKNOWN_PITCHES * walls.cells.pitch_px / walls.scale)
    known = np.full_like(mask, 255)
    for ring, shown in zip(axis.places, axis.shown, strict=True):
        for x, y in np.rint(samples_of(ring[~shown][::_EVERY], walls.scale)).astype(int).tolist():
            cv2.circle(known, (x, y), reach, 0, cv2.FILLED)
    told = np.where(known > 0, mask & _drawn(axis.places, walls), strong.mask.mask)
    return replace(walls, mask=replace(walls.mask, mask=told, faint=lambda: told))


def _drawn(rings: Sequence[Ring], walls: SeenWalls) -> Bytes:
    """255 within rings, pixels, and not in their holes, on the grid of the walls' mask."""
    inside = np.zeros_like(walls.mask.mask)
    vertices = [np.rint(16 * samples_of(ring, walls.scale)).astype(np.int32) for ring in rings]
    return np.asarray(cv2.fillPoly(inside, vertices, 255, cv2.LINE_8, 4), np.uint8)
