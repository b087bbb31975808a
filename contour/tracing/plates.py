"""Perforated sheets: more material than walls, with holes all over that show the table."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float64s, median
from contour.geometry.rings import Ring
from contour.image.opencv import closed_by_disc
from contour.tracing.closed_cells import MaterialEdge, closed_along
from contour.tracing.cut_lines import straight_cuts
from contour.tracing.trace import Edge
from contour.walls.comb_likeness import Comb

# Webs of a sheet are wider than most walls; its holes are orderly, and round: a circle fills 0.79 of the box around it,
# a hexagon 0.75 to 0.87, a square of a chessboard all of it.
_LEAST_WEB, _LEAST_ORDER, _LEAST_SOLID = 0.2, 0.4, 0.93
# Squares that hang together by their corners fill less than half of theirs.
_LEAST_BOXED, _MOST_BOXED = 0.7, 0.89
# Webs of fine cells are not told from walls, which look wider than they are.
_FINE_PITCH_PX, _WIDER_PX = 15.0, 1.5
# Of what the sheet differs from the table by, what its holes do: they are in shadow. Ink differs from most tables.
_LIKE_TABLE = 0.45
# A disc of so many pitches' radius does not get into a hole that was cut open by less than most of it.
# It does not get into an inner corner, either, over 0.04 squares of the pitch.
_BAY_PITCHES, _LEAST_BAY, _LARGE_BAY = 0.45, 0.06, 0.12
# Edges of webs run along the cut itself, so near and so straight.
_WEB_PX, _ALONG = 3.0, 0.98
# An opened hole is less than a pitch wide.
_OPEN_PITCHES = 1.0


def like_plate(comb: Comb | None) -> bool:
    """Whether patches may be the holes of a perforated sheet; whether they show the table, its outline tells."""
    return (
        comb is not None
        and comb.pitch_px > _FINE_PITCH_PX
        and comb.wall_px - _WIDER_PX > _LEAST_WEB * comb.pitch_px
        and comb.order > _LEAST_ORDER
        and comb.solid > _LEAST_SOLID
    )


def plate_edge(material: MaterialEdge, pitch_px: float) -> tuple[MaterialEdge | None, Edge] | None:
    """The outline of a perforated sheet, along a straight cut where that opened its holes, and how its border runs: no
    outline, where more than one cut opened them, as webs end all around then.

    None where it is no sheet: its holes are not round or do not show the table.
    """
    boxed, shade = _holes(material, pitch_px)
    if not _LEAST_BOXED < boxed < _MOST_BOXED or shade > _LIKE_TABLE:
        return None
    corners, normals = _bays(material.apart.region, _LEAST_BAY, pitch_px)
    if not len(corners):
        return material, "cells"
    cuts = straight_cuts(material, corners, normals, pitch_px, open_px=_OPEN_PITCHES * pitch_px)
    if len(cuts) != 1:
        return None, "cut"
    closed = closed_along(material, _along_webs(material.contour.rings, cuts[0])[None], pitch_px)
    return (None, "cut") if len(_bays(closed.apart.region, _LARGE_BAY, pitch_px)[0]) else (closed, "mixed")


def _holes(material: MaterialEdge, pitch_px: float) -> tuple[float, float]:
    """Median share of the smallest box around them that holes fill; and what they differ from the table by, over what
    the sheet does.
    """
    apart = material.apart
    holes = ((apart.region > 0) & (apart.difference <= apart.level)).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(holes, connectivity=4)
    large = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] > 0.1 * pitch_px * pitch_px)[1:]
    if not len(large):
        return 1.0, 1.0
    boxed, shades = [], []
    for number in large[np.linspace(0, len(large) - 1, min(len(large), 64)).astype(int)]:
        left, top, wide, high, area = stats[number].tolist()
        one = labels[top : top + high, left : left + wide] == number
        outline, _ = cv2.findContours(one.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        _, size, _ = cv2.minAreaRect(outline[0])
        boxed.append(area / ((size[0] + 1) * (size[1] + 1)))
        shades.append(np.quantile(apart.difference[top : top + high, left : left + wide][one], 0.3))
    sheet = median(2.0 * apart.level[(apart.region > 0) & (holes == 0)].astype(np.float64))
    return median(np.array(boxed)), median(np.array(shades)) / max(sheet, 1.0)


def _along_webs(rings: tuple[Ring, ...], cut: Float64s) -> Float64s:
    """A cut, (2, 2), moved and turned onto the edges near it that run along it."""
    start = np.concatenate(rings)
    step = np.concatenate([np.roll(ring, -1, axis=0) for ring in rings]) - start
    length = np.hypot(step[:, 0], step[:, 1])
    along = (cut[1] - cut[0]) / np.hypot(*(cut[1] - cut[0]))
    across = np.array([-along[1], along[0]])
    middle = start + 0.5 * step - cut[0]
    place, off = middle @ along, middle @ across
    webs = (np.abs(step @ along) > _ALONG * length) & (np.abs(off) < _WEB_PX)
    webs &= (place > 0) & (place < np.hypot(*(cut[1] - cut[0])))
    if np.count_nonzero(webs) < 2:
        return cut
    slope, offset = np.polyfit(place[webs], off[webs], 1, w=np.sqrt(length[webs]))
    return cut + np.outer(slope * ((cut - cut[0]) @ along) + offset, across)


def _bays(region: Bytes, least: float, pitch_px: float) -> tuple[Float64s, Float64s]:
    """Corners of the mouths of holes that are open to the table, of `least` squares of the pitch and more, (2 N, 2),
    pixels, and unit vectors out of them.
    """
    radius = _BAY_PITCHES * pitch_px
    pad = int(radius) + 2
    wide = np.pad(region, pad)
    closed = closed_by_disc(wide, radius)
    bays = ((closed > 0) & (wide == 0)).astype(np.uint8)
    outside = ((closed == 0) & (wide == 0)).astype(np.uint8)
    by_outside = cv2.dilate(outside, np.ones((3, 3), np.uint8))
    _, labels, stats, middles = cv2.connectedComponentsWithStats(bays, connectivity=4)
    corners, normals = [], []
    for number in np.flatnonzero(stats[:, cv2.CC_STAT_AREA] > least * pitch_px * pitch_px)[1:]:
        left, top, across, high, _ = stats[number].tolist()
        part = np.s_[top : top + high, left : left + across]
        rows, columns = np.nonzero((labels[part] == number) & (by_outside[part] > 0))
        if len(rows) < 2:
            continue
        mouth = np.stack([columns + left, rows + top], axis=1).astype(np.float64)
        axis = np.linalg.svd(mouth - mouth.mean(axis=0))[2][0]
        place = (mouth - mouth.mean(axis=0)) @ axis
        out = mouth.mean(axis=0) - middles[number]
        corners += [mouth[np.argmin(place)] - pad, mouth[np.argmax(place)] - pad]
        normals += [out / max(float(np.hypot(*out)), 1e-9)] * 2
    return np.array(corners).reshape(-1, 2), np.array(normals).reshape(-1, 2)
