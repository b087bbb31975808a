"""Border cells that a broken wall opens to the table, told from cells cut open and from bays between cells."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Indices
from contour.geometry.rings import signed_area
from contour.image.opencv import deep, pieces_and_middles, pieces_of
from contour.walls.wall_ends import ring_tips, thin

# Gaps of a broken wall, in pitches. The mouth of a bay between whole cells is hardly wider.
_BROKEN_PITCHES = 0.62
# The most that a broken wall opens, in squares of the pitch.
_LARGEST_CELL = 1.5
# So many of them side by side were cut open.
_FEWEST_CUT, _ROW_PITCHES = 3, 3.0
# How near to its mouth a broken wall ends.
_AT_MOUTH_PITCHES = 0.25
# Corners of 90 degrees are as thin for 0.41 radii; what is left of a wall with a gap of half a pitch for 0.63.
_THIN_RADII = 0.5


def leaking_cells(material: Bytes, pitch_px: float, wall_px: float) -> Bytes:
    """Cells that only a broken or faint wall opens to the table, up to the line across the gap.

    Where walls are grown by half a gap, such cells lie apart from the table; what is nearer to a cell's rest than to
    the table's is the cell. Three side by side were cut open, and where no wall ends at the gap it is the mouth
    of a bay between whole cells.
    """
    # Around the material lies the table: farther off there is no cell, and none nearer to it.
    left, top, wide, high = cv2.boundingRect(material)
    margin = round(pitch_px)
    about = (slice(max(top - margin, 0), top + high + margin), slice(max(left - margin, 0), left + wide + margin))
    leaking = np.zeros_like(material)
    leaking[about] = _leaking(material[about], pitch_px, wall_px)
    return leaking


def _leaking(material: Bytes, pitch_px: float, wall_px: float) -> Bytes:
    """The same, where table lies all around the material."""
    none = np.zeros_like(material)
    seeds = deep(1 - material, 0.5 * _BROKEN_PITCHES * pitch_px, 5)
    # As the labels below hang together: a cell that touches the table's seeds by a corner would make all of it a cell.
    labels, stats, middles = pieces_and_middles(seeds, 8)
    _, inner = pieces_of(1 - material, 4)
    outside = np.flatnonzero((inner == inner[0, 0]) & (seeds > 0))
    leaking = np.bincount(labels.ravel().take(outside), minlength=len(stats)) > 0
    leaking &= stats[:, cv2.CC_STAT_AREA] < _LARGEST_CELL * pitch_px * pitch_px
    leaking[0] = False
    found = np.flatnonzero(leaking)
    apart = np.hypot(*(middles[found, None] - middles[found]).T)
    found = found[(apart < _ROW_PITCHES * pitch_px).sum(axis=1) < _FEWEST_CUT]
    if not len(found):
        return none
    _, nearest = cv2.distanceTransformWithLabels(1 - seeds, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_CCOMP)
    nearest = np.where(material > 0, 0, nearest)
    ends = _wall_ends(material, pitch_px, wall_px)
    for number in found:
        left, top, wide, high, _ = stats[number].tolist()
        seed = np.s_[top : top + high, left : left + wide]
        cell = (nearest == nearest[seed][labels[seed] == number][0]).astype(np.uint8)
        if _wall_ends_at(material, cell, ends, pitch_px):
            none |= cell
    return none


def _wall_ends(material: Bytes, pitch_px: float, wall_px: float) -> Indices:
    """Pixels (x, y) in which walls end along the longest border of material, (N, 2); corners of whole cells beside a
    bay are no ends.
    """
    rings, _ = cv2.findContours(material, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    longest = max(rings, key=len)
    ring = longest[:, 0].astype(np.float64)
    ends = ring_tips(ring if signed_area(ring) < 0 else ring[::-1].copy(), pitch_px, wall_px)
    whole = np.asarray(cv2.drawContours(np.zeros_like(material), [longest], 0, 1, cv2.FILLED), np.uint8)
    return np.rint(ends[thin(whole, ends, wall_px, _THIN_RADII)]).astype(np.intp)


def _wall_ends_at(material: Bytes, cell: Bytes, ends: Indices, pitch_px: float) -> bool:
    """Whether one of the `ends` of walls lies at the mouth of an open cell."""
    left, top, wide, high = cv2.boundingRect(cell)
    margin = int(_AT_MOUTH_PITCHES * pitch_px) + 3
    left, top, right, bottom = max(left - margin, 0), max(top - margin, 0), left + wide + margin, top + high + margin
    part = np.s_[top:bottom, left:right]
    mouth = np.asarray(cv2.dilate(cell[part], np.ones((3, 3), np.uint8)), np.uint8) & (1 - cell[part])
    away = cv2.distanceTransform(1 - (mouth & (1 - material[part])), cv2.DIST_L2, 5)
    near = ends - (left, top)
    near = near[((near >= 0) & (near < away.shape[::-1])).all(axis=1)]
    return bool((away[near[:, 1], near[:, 0]] < _AT_MOUTH_PITCHES * pitch_px).any())
