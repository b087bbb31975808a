"""Perforated sheets: more material than walls, with holes all over that show the table."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bools, Float64s, median, medians, quantile
from contour.geometry.rings import Contour, Ring, densified, signed_area
from contour.geometry.segments import distances_to_ring
from contour.geometry.signed_distance import depth_inside
from contour.image.opencv import closed_by_disc, median_where, pieces_and_middles
from contour.material.closed_cells import MaterialEdge, closed_along
from contour.tracing.cut_lines import straight_cuts
from contour.tracing.touched_edges import touched_cuts
from contour.tracing.trace import Edge
from contour.walls.comb_likeness import FINE_PITCH_PX, WIDER_PX, WIDEST_FINE, Comb, circled

# Webs of a sheet are wider than most walls; its holes are orderly.
_LEAST_WEB, _LEAST_ORDER, _LEAST_SOLID = 0.2, 0.4, 0.93
# Those of large holes in a wide rim look narrower, and of a dozen holes few have neighbours all around: where holes are
# large enough to be seen round, that is asked.
_NARROW_WEB, _FEW_ORDER = 0.12, 0.2
# Of fewer neither their order nor their form tells anything: with webs as wide as holes some run into each other, and
# the sheet's own holes are asked.
_FEWEST_TOLD = 12
# And round: of the circle around it a hole of a dozen pixels and more fills 0.88 at least, a hexagon 0.86 at most. Of
# smaller ones that cannot be told; squares and drawn-out cells fill 0.72 at most, round ones 0.8 at least.
_ROUND, _MAYBE_ROUND, _FINE_HOLE_PX = 0.866, 0.76, 12.0
# Those among which the scale was read, as they are, may fill less by this; of combs there the most is 0.85.
_AS_SCALE_READS = 0.015
# Of what the sheet differs from the table by, what its holes do: they are in shadow. Ink differs from most tables.
_LIKE_TABLE = 0.45
# A disc of so many pitches' radius does not get into a hole that was cut open by less than most of it. It does not get
# into an inner corner, either, over 0.04 squares of the pitch. Where holes are large enough, what was one is an arc, of
# their radius within a quarter; of fine ones a single bay may be the rounded corner of a dent.
_BAY_PITCHES, _LEAST_BAY, _LEAST_FINE_BAY, _LARGE_BAY = 0.45, 0.02, 0.06, 0.12
_OF_ONE_BAY = 2
_ARC_RADII, _ARC_OFF, _ARC_OFF_PX, _MOUTH, _MOUTH_PX, _FEWEST_ARC = 0.25, 0.04, 0.2, 0.1, 2.0, 8
# Corners of webs are rounded: what stands out farthest of them within so many pitches lies on the cut.
_ROUND_PITCHES = 0.2
# Edges of webs run along the cut itself, so near and so straight.
_WEB_PX, _ALONG = 3.0, 0.98
# Edges as long as so many pitches are moved onto webs that lie so near, and run along so much of the edge, and over so
# much of it. Corners move by less than a pitch, and not where lines meet at a smaller sine.
_LONG_EDGE, _NEAR_WEBS, _OF_EDGE, _SPREAD_OF_EDGE, _MOVED, _PARALLEL = 2.0, 0.4, 0.15, 0.4, 1.0, 0.2
# Rims of opened holes lie farther in: what does by so many pixels is left out, step by step.
_STEPS_OUT, _WEB_OFF_PX = 8, 0.7
# An opened hole is less than a pitch wide.
_OPEN_PITCHES = 1.0
# Holes smaller than this share of the usual are specks, and fewer make no sheet. Of noise in the floor of cells, where
# little of it differs from the table as little, all are: a pixel fills any circle.
_SPECK, _FEWEST_HOLES, _LEAST_HOLE_PX = 1.0 / 3.0, 6, 4.0
# Right outlines of 33 cut sheets leave out 0.07 pitches of material at most, and edges that are touched by 0.16, wrong
# ones 0.54 or 0.4.
_LEFT_OUT, _BESIDE = 0.2, 0.25


def like_plate(comb: Comb | None) -> tuple[bool, bool]:
    """Whether patches may be the holes of a perforated sheet, and whether they may though too small to be seen round;
    whether they show the table, its outline tells.
    """
    if comb is None or comb.solid <= _LEAST_SOLID:
        return False, False
    if comb.count < _FEWEST_TOLD:
        return True, False
    # Webs of fine cells are not told from walls, which look wider than they are, unless no wall is as wide.
    web = (comb.wall_px - WIDER_PX) / comb.pitch_px
    wide = web > (_LEAST_WEB if comb.pitch_px > FINE_PITCH_PX else WIDEST_FINE) and comb.order > _LEAST_ORDER
    large = comb.pitch_px - comb.wall_px > _FINE_HOLE_PX
    if comb.circled < (_ROUND if large else _MAYBE_ROUND) - _AS_SCALE_READS:
        return False, wide
    return wide or (large and web > _NARROW_WEB and comb.order > _FEW_ORDER), wide


def plate_edge(material: MaterialEdge, *, wide: bool) -> tuple[MaterialEdge | None, Edge] | None:
    """The outline of a perforated sheet, along a straight cut where that opened its holes, and how its border runs: no
    outline, where more than one cut opened them, as webs end all around then.

    None where it is no sheet: its holes are not round or do not show the table. `wide`: its webs are wider than walls,
    so that holes too small to tell may be round.
    """
    holes = _holes(material)
    if holes is None or not holes.round(wide=wide) or holes.shade > _LIKE_TABLE:
        return None
    pitch_px = holes.pitch_px
    lines = _through_bays(material, holes)
    if lines is None:
        # Holes that were opened by less; a closed sheet has no openings.
        lines = touched_cuts(material, pitch_px, alike=True)
        if not lines:
            return material, "cells"
    if len(lines) > 1:
        return None, "cut"
    # Fine cells that may as well be a print's have teeth, which look open as well.
    elsewhere: tuple[None, Edge] | None = (None, "cut") if holes.circled > _ROUND else None
    if not lines:
        return elsewhere
    cuts = np.array([_along_webs(material.contour.rings, cut) for cut in lines[0]])
    closed = closed_along(material, cuts, pitch_px)
    return elsewhere if len(_bays(closed, holes, _LARGE_BAY)[0]) else (closed, "mixed")


def _through_bays(material: MaterialEdge, holes: _Holes) -> list[Float64s] | None:
    """Straight cuts through the mouths of holes that are wide open, as `straight_cuts`; None where none is."""
    pitch_px = holes.pitch_px
    corners, normals = _bays(material, holes, _LEAST_FINE_BAY if holes.fine else _LEAST_BAY)
    if len(corners) == _OF_ONE_BAY and holes.fine:
        corners, normals = _bays(material, holes, _LARGE_BAY)
    if not len(corners):
        return None
    corners = _outermost(material, corners, normals, _ROUND_PITCHES * pitch_px)
    lines = straight_cuts(material, corners, normals, pitch_px, open_px=_OPEN_PITCHES * pitch_px)
    if len(corners) == _OF_ONE_BAY:
        # Nothing else is cut open: it is one if a cut goes on beside it, or it is most of a hole.
        cut = _goes_on(lines[0], corners, pitch_px) if lines else len(_bays(material, holes, _LARGE_BAY)[0]) > 0
        return lines if cut else None
    return lines


def _goes_on(cuts: Float64s, mouth: Float64s, pitch_px: float) -> bool:
    """Whether cuts, (N, 2, 2), go on along the sheet beside the mouth of a bay, by its corners, (2, 2), pixels; through
    those of a dent's corner they do not.
    """
    longest = float(np.hypot(*(cuts[:, 1] - cuts[:, 0]).T).max())
    return longest > float(np.hypot(*(mouth[1] - mouth[0]))) + pitch_px


@dataclass(frozen=True)
class _Holes:
    """Holes of a sheet: their pitch and diameter, pixels, the share that they fill of the circle around them, and what
    they differ from the table by, over what the sheet does; medians.
    """

    pitch_px: float
    diameter_px: float
    circled: float
    shade: float

    def round(self, *, wide: bool) -> bool:
        """Whether they are round, or may be, as holes too small to tell between `wide` webs."""
        return self.circled > (_MAYBE_ROUND if wide and self.fine else _ROUND)

    @property
    def fine(self) -> bool:
        """Whether they are too small for their form to be told."""
        return self.diameter_px < _FINE_HOLE_PX


def _holes(material: MaterialEdge) -> _Holes | None:
    """The holes in a sheet; None where there are too few."""
    apart = material.apart
    holes = apart.openings
    labels, stats, middles = pieces_and_middles(holes, 4)
    area = stats[1:, cv2.CC_STAT_AREA].astype(np.float64)
    # Specks are many, but little of all that is free.
    ascending = np.sort(area)
    typical = ascending[np.searchsorted(np.cumsum(ascending), 0.5 * ascending.sum())] if len(area) else 0.0
    large = 1 + np.flatnonzero(area > _SPECK * typical)
    diameter_px = float(np.sqrt(4.0 / np.pi * typical))
    if len(large) < _FEWEST_HOLES or diameter_px < _LEAST_HOLE_PX:
        return None
    sampled = large[np.linspace(0, len(large) - 1, min(len(large), 64)).astype(int)]
    figures = []
    for number in sampled:
        left, top, wide, high, size = stats[number].tolist()
        one = labels[top : top + high, left : left + wide] == number
        outline, _ = cv2.findContours(one.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        shade = quantile(apart.difference[top : top + high, left : left + wide][one], 0.3)
        figures.append((circled(size, outline[0]), shade))
    sheet = 2.0 * median_where(apart.level, (apart.region > 0) & (holes == 0))
    away = np.hypot(*(middles[sampled, None] - middles[large]).T)
    pitch_px = median(np.sort(away, axis=0)[1])
    filled, shade = medians(np.array(figures), axis=0).tolist()
    return _Holes(pitch_px, diameter_px, filled, shade / max(sheet, 1.0))


def _outermost(material: MaterialEdge, corners: Float64s, normals: Float64s, radius: float) -> Float64s:
    """What of the material's border stands out farthest within a radius of corners, along normals, (N, 2), pixels."""
    border = np.concatenate(material.border)
    moved = corners.copy()
    for number, (corner, out) in enumerate(zip(corners, normals, strict=True)):
        near = border[np.hypot(*(border - corner).T) < radius]
        if len(near):
            moved[number] = near[np.argmax(near @ out)]
    return moved


def onto_webs(material: MaterialEdge, outline: Contour, pitch_px: float) -> Contour:
    """An outline, pixels, of a sheet that was cut on several sides, its straight edges moved onto the webs between
    holes, which show where the sheet ends, and its corners with them.
    """
    rings = [densified(ring, 1.0) for ring in material.contour.rings]
    border, ahead = np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) - ring for ring in rings])
    side = -float(np.sign(signed_area(outline.exterior)))
    return Contour.of(_on_webs(ring, border, ahead, pitch_px, side) for ring in outline.rings)


def _on_webs(ring: Ring, border: Float64s, ahead: Float64s, pitch_px: float, side: float) -> Ring:
    """A ring with its straight edges moved onto what of a border, (N, 2), runs along them, by steps `ahead`."""
    following = np.roll(ring, -1, axis=0)
    lines = [_web_line(*edge, border, ahead, pitch_px, side) for edge in zip(ring, following, strict=True)]
    moved = ring.copy()
    for number, (before, line) in enumerate(zip([lines[-1], *lines[:-1]], lines, strict=True)):
        if before is None and line is None:
            continue
        one = before or (ring[number - 1], ring[number] - ring[number - 1])
        other = line or (ring[number], following[number] - ring[number])
        corner = _meet(one, other)
        if corner is not None and np.hypot(*(corner - ring[number])) < _MOVED * pitch_px:
            moved[number] = corner
    return moved


def _web_line(
    start: Float64s, stop: Float64s, border: Float64s, ahead: Float64s, pitch_px: float, side: float
) -> tuple[Float64s, Float64s] | None:
    """A place and a direction of the line along webs beside an edge; None where too little of it runs along any."""
    long = float(np.hypot(*(stop - start)))
    if long < _LONG_EDGE * pitch_px:
        return None
    along = (stop - start) / long
    out = side * np.array([-along[1], along[0]])
    place, off = (border - start) @ along, (border - start) @ out
    webs = (np.abs(ahead @ along) > _ALONG * np.hypot(*ahead.T)) & (np.abs(off) < _NEAR_WEBS * pitch_px)
    webs &= (place > 0.0) & (place < long)
    slope = offset = 0.0
    for _ in range(_STEPS_OUT):
        if np.count_nonzero(webs) < _OF_EDGE * long or np.ptp(place[webs]) < _SPREAD_OF_EDGE * long:
            return None
        slope, offset = np.polyfit(place[webs], off[webs], 1)
        webs &= off - offset - slope * place > -_WEB_OFF_PX
    start, stop = start + offset * out, start + long * along + (offset + slope * long) * out
    return start, stop - start


def _meet(one: tuple[Float64s, Float64s], other: tuple[Float64s, Float64s]) -> Float64s | None:
    """Where two lines meet, each by a place and a direction; None where they are all but parallel."""
    (start, along), (place, ahead) = one, other
    cross = float(along[0] * ahead[1] - along[1] * ahead[0])
    if abs(cross) < _PARALLEL * np.hypot(*along) * np.hypot(*ahead):
        return None
    way = place - start
    return np.asarray(start + (way[0] * ahead[1] - way[1] * ahead[0]) / cross * along)


def check_sheet(material: MaterialEdge, outline: Contour, pitch_px: float) -> None:
    """Raise NoBlockFound where an outline, pixels, of a sheet that was cut on several sides leaves material out, or an
    edge that material touches at every hole: a sheet shows where it ends between these.
    """
    border = np.concatenate(material.border)
    cuts = touched_cuts(material, pitch_px, alike=True)
    edges = [densified(edge, pitch_px) for edge in np.concatenate(cuts)] if cuts else []
    left_out = [depth_inside(outline.exterior, border), *(-depth_inside(hole, border) for hole in outline.holes)]
    beside = distances_to_ring(np.concatenate(edges), outline.exterior) > _BESIDE * pitch_px if edges else np.empty(0)
    if min(depth.min() for depth in left_out) < -_LEFT_OUT * pitch_px or beside.any():
        raise NoBlockFound(
            "no block found: the outline that fits most ends of webs leaves the sheet's edge between them. Check that "
            "nothing lies against the sheet, and the light"
        )


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


def _bays(material: MaterialEdge, holes: _Holes, least: float) -> tuple[Float64s, Float64s]:
    """Corners of the mouths of `holes` that are open to the table, of `least` squares of the pitch and more, (2 N, 2),
    pixels, and unit vectors out of them.
    """
    pitch_px = holes.pitch_px
    radius = _BAY_PITCHES * pitch_px
    pad = int(radius) + 2
    wide = np.pad(material.apart.region, pad)
    closed = closed_by_disc(wide, radius)
    bays = ((closed > 0) & (wide == 0)).astype(np.uint8)
    outside = ((closed == 0) & (wide == 0)).astype(np.uint8)
    by_outside = cv2.dilate(outside, np.ones((3, 3), np.uint8))
    _, labels, stats, middles = cv2.connectedComponentsWithStats(bays, connectivity=4)
    border = densified(material.contour.exterior, 1.0)
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
        ends = np.array([mouth[np.argmin(place)], mouth[np.argmax(place)]]) - pad
        around = np.s_[top - 2 : top + high + 2, left - 2 : left + across + 2]
        beside = _along(border, labels[around] == number, (left - 2 - pad, top - 2 - pad))
        if holes.fine or _is_arc(beside, ends, 0.5 * holes.diameter_px):
            corners += [*ends]
            normals += [out / max(float(np.hypot(*out)), 1e-9)] * 2
    return np.array(corners).reshape(-1, 2), np.array(normals).reshape(-1, 2)


def _along(border: Float64s, bay: Bools, first: tuple[int, int]) -> Float64s:
    """The points of a border, (N, 2), that lie beside a bay; its mask, with two pixels around it, begins at `first`."""
    beside = cv2.dilate(bay.astype(np.uint8), np.ones((5, 5), np.uint8))
    column, row = (np.rint(border).astype(int) - first).T
    near = (row >= 0) & (row < beside.shape[0]) & (column >= 0) & (column < beside.shape[1])
    near[near] = beside[row[near], column[near]] > 0
    return np.asarray(border[near])


def _is_arc(border: Float64s, mouth: Float64s, radius: float) -> bool:
    """Whether a bay's border, (N, 2), pixels, is that of a hole of this radius between its mouth's corners, (2, 2)."""
    off = np.hypot(*(border[:, None] - mouth).transpose(2, 0, 1)).min(axis=1, initial=np.inf)
    inner = border[off > max(_MOUTH_PX, _MOUTH * radius)]
    if len(inner) < _FEWEST_ARC:
        return False
    from_middle = inner - inner.mean(axis=0)
    terms = np.column_stack((2.0 * from_middle, np.ones(len(inner))))
    x, y, rest = np.linalg.lstsq(terms, (from_middle**2).sum(axis=1))[0].tolist()
    apart = np.hypot(*(from_middle - (x, y)).T)
    around = float(np.sqrt(max(rest + x * x + y * y, 0.0)))
    return abs(around - radius) < _ARC_RADII * radius and bool(
        np.sqrt(np.mean((apart - around) ** 2)) < _ARC_OFF * radius + _ARC_OFF_PX
    )
