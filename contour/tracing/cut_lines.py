"""Straight cuts through a border that closes its cells elsewhere, by ends of walls in a row: from the first thing that
touches their line to the last.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Float64s
from contour.geometry.rings import densified
from contour.geometry.segments import BoxTree, distances_to_ring, distances_to_tree
from contour.image.opencv import fewer_vertices
from contour.material.closed_cells import MaterialEdge, closed_along
from contour.tracing.edge_kind import FINE_PITCH_PX, border_tips, side_px, sure_ends, tooth_px
from contour.walls.wall_ends import thin
from contour.walls.wall_evidence import BlockEvidence

# Ends of walls and corners of cells lie within this of the line they were cut along, and nothing stands out of it.
_NEAR_PX, _NEAR_PITCHES = 1.2, 0.04
# Pixels of a wall's end, which blur rounds, lie inside of it.
_OUT_PX, _ROUND_PX = 1.0, 1.0
# Over an opened cell nothing touches the line for as long: over-expanded ones are 1.45 pitches wide.
OPEN_PITCHES = 2.0
# A line through two ends is always found; through three only along a cut.
_FEWEST_ENDS, _FEWEST_MORE = 2, 3
_LEAST_APART_PITCHES = 0.5
_FITS = 3
# Ends that are left lie at the corners, and the outline passes these. Blur moves ends of walls off the line by more
# than still touches it.
_LEFT_PX, _CORNER_PITCHES, _SHORT_PITCHES = 3.0, 0.4, 0.25
# Corners of closed squares are as thin for 0.25 at most (of 50 lattices; of 150 with other cells none shows any).
_STUB_RADII = 0.4


def with_cuts(material: MaterialEdge, seen: BlockEvidence, touched: list[Float64s]) -> MaterialEdge | None:
    """The outline around material along straight cuts where these opened its cells, those that are `touched` or else
    those that ends of walls lie on; None where ends lie on no such cut, or beyond its last corner, or where the outline
    leaves out a corner: a sliver of a wall.
    """
    ring = seen.rings[0]
    sure = sure_ends(material, ring, seen)
    lines = touched or straight_cuts(
        material, ring.points[sure], ring.normal[sure], seen.pitch_px, open_px=OPEN_PITCHES * side_px(seen)
    )
    if not lines:
        return None
    cuts = np.concatenate(lines)
    closed = closed_along(material, _to_walls(cuts, material, seen), seen.pitch_px)
    left = ring.points[sure_ends(closed, ring, seen)]
    off = distances_to_tree(left, BoxTree.of_segments(cuts[:, 0], cuts[:, 1])) if len(left) else np.empty(0)
    corners = distances_to_ring(cuts.reshape(-1, 2), closed.contour.exterior)
    return None if (off > _LEFT_PX).any() or (corners > _CORNER_PITCHES * seen.pitch_px).any() else closed


def _to_walls(cuts: Float64s, material: MaterialEdge, seen: BlockEvidence) -> Float64s:
    """Cuts, (N, 2, 2), and from the ends of walls that stop short of them, as blur moves ends, to them, (M, 2, 2)."""
    tips = border_tips(material, seen)
    short = []
    for start, end in cuts:
        step = end - start
        place = np.clip((tips - start) @ step / max(float(step @ step), 1e-9), 0.0, 1.0)
        foot = start + place[:, None] * step
        near = np.hypot(*(tips - foot).T) < _SHORT_PITCHES * seen.pitch_px
        short.append(np.stack([tips[near], foot[near]], axis=1))
    return np.concatenate([cuts, *short])


def stub_cuts(material: MaterialEdge, seen: BlockEvidence) -> list[Float64s]:
    """Straight cuts through what is left of two walls or more, as `straight_cuts`, where material shows it alone: a cut
    that opened one cell leaves two. None of triangles or fine cells, whose corners look like it.
    """
    tips = border_tips(material, seen)
    if tooth_px(seen) or seen.pitch_px < FINE_PITCH_PX or len(tips) < _FEWEST_ENDS:
        return []
    tips = tips[thin(material.apart.region, tips, seen.wall_px, _STUB_RADII)]
    outwards = tips - np.concatenate(material.border).mean(axis=0)
    return straight_cuts(material, tips, outwards, seen.pitch_px, open_px=OPEN_PITCHES * seen.pitch_px)


def straight_cuts(
    material: MaterialEdge, ends: Float64s, normals: Float64s, pitch_px: float, *, open_px: float
) -> list[Float64s]:
    """Straight cuts that `ends` of walls, (N, 2), pixels, lie on: for each line, most ends first, from corner to corner
    of the material, (K, 2, 2), more than one where it crosses a dent.

    normals: unit vectors outwards at each end, (N, 2). A line that material stands out of is no cut, and a cut ends
    where nothing touches it for `open_px` pixels.
    """
    border, corners, near = border_and_hull(material, pitch_px)
    lines: list[Float64s] = []
    while len(ends) >= (_FEWEST_MORE if lines else _FEWEST_ENDS):
        line = _line(ends, normals, near, _LEAST_APART_PITCHES * pitch_px)
        if line is None or line.on_it.sum() < (_FEWEST_MORE if lines else _FEWEST_ENDS):
            break
        line = _along_hull(corners, ends, line, near)
        cuts = from_corner_to_corner(border, ends, line, near, open_px)
        if not len(cuts):
            break
        lines.append(cuts)
        ends, normals = ends[~line.on_it], normals[~line.on_it]
    return lines


@dataclass(frozen=True, eq=False)
class Line:
    """A point of a line, the unit vectors along it and out of the material, (2,) each, and which ends lie on it."""

    middle: Float64s
    along: Float64s
    out: Float64s
    on_it: Bools


def _line(ends: Float64s, normals: Float64s, near: float, apart: float) -> Line | None:
    """The line that most ends lie on, of all through two that are `apart` pixels apart."""
    one, other = np.triu_indices(len(ends), 1)
    step = ends[other] - ends[one]
    far = np.hypot(step[:, 0], step[:, 1]) > apart
    if not far.any():
        return None
    one, step = one[far], step[far] / np.hypot(step[far, 0], step[far, 1])[:, None]
    across = np.stack([-step[:, 1], step[:, 0]], axis=1)
    off = ends @ across.T - (ends[one] * across).sum(axis=1)
    on_it = np.abs(off[:, np.argmax((np.abs(off) < near).sum(axis=0))]) < near
    for _ in range(_FITS):
        middle = ends[on_it].mean(axis=0)
        along = np.linalg.svd(ends[on_it] - middle)[2][0]
        out = np.array([-along[1], along[0]])
        again = np.abs((ends - middle) @ out) < near
        if np.count_nonzero(again) < _FEWEST_ENDS:
            break
        on_it = again
    outwards = 1.0 if out @ normals[on_it].sum(axis=0) > 0 else -1.0
    return Line(middle, along, outwards * out, on_it)


def border_and_hull(material: MaterialEdge, pitch_px: float) -> tuple[Float64s, Float64s, float]:
    """Material's border, half a pixel apart, (N, 2), corners of its convex hull, (M, 2), and how near to a line is on
    it, which corners stand out farther than; pixels.
    """
    near = _NEAR_PX + _NEAR_PITCHES * pitch_px
    border = np.concatenate([densified(ring, 0.5) for ring in material.border])
    return border, fewer_vertices(cv2.convexHull(border.astype(np.float32))[:, 0].astype(np.float64), near), near


def _along_hull(corners: Float64s, ends: Float64s, line: Line, near: float) -> Line:
    """The edge of a hull, by its corners, (M, 2), that a line's ends lie on, which knows more of it than a few ends at
    one of its own; the line where there is none.
    """
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = (end - start) / np.hypot(*(end - start))
        out = np.array([-along[1], along[0]])
        if (np.abs((ends[line.on_it] - start) @ out) < near).all():
            return Line(start, along, out * np.sign(out @ line.out), line.on_it)
    return line


def from_corner_to_corner(border: Float64s, ends: Float64s, line: Line, near: float, gap: float) -> Float64s:
    """Where the border, (M, 2), touches the line first and last without `gap` pixels between, (K, 2, 2); empty where
    one of its ends is not among that, or material stands out of the line there.

    Where nothing stands out of the line anywhere, all that touches it was cut along it; else what has ends.
    """
    place, off = (border - line.middle) @ line.along, (border - line.middle) @ line.out
    touching = np.sort(place[(off < near) & (off > -near - _ROUND_PX)])
    own = (ends[line.on_it] - line.middle) @ line.along
    beyond = place[off > near + _OUT_PX]
    cuts, left = [], np.ones(len(own), np.bool_)
    for run in np.split(touching, np.flatnonzero(np.diff(touching) > gap) + 1):
        its = (own > run[0] - gap) & (own < run[-1] + gap) if len(run) else left & False
        if not len(run) or (len(beyond) and not its.any()):
            continue
        if ((beyond > run[0]) & (beyond < run[-1])).any():
            return np.empty((0, 2, 2))
        left &= ~its
        cuts.append(line.middle + np.outer([run[0], run[-1]], line.along))
    return np.empty((0, 2, 2)) if left.any() else np.array(cuts).reshape(-1, 2, 2)
