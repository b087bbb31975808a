"""Whether a block's border was cut through its cells or closes them: where it was cut, walls end."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np

from contour.errors import EdgeContradicted
from contour.geometry.arrays import Bools, Bytes, Float64s, rolled
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, Ring, densified
from contour.geometry.segments import BoxTree, distances_to_ring, distances_to_tree
from contour.geometry.signed_distance import nearest
from contour.image.opencv import fewer_vertices
from contour.image.pixel_sampling import light_beside
from contour.material.closed_cells import MaterialEdge
from contour.tracing.trace import Edge
from contour.walls.cell_scale import CellScale
from contour.walls.wall_ends import ring_tips, thin
from contour.walls.wall_evidence import BlockEvidence, RingEvidence, WitnessKind

# Along a cut edge a wall ends every pitch or so, on an edge that follows a row of cells none for a while.
_FAR_PITCHES = 4.0
# Of 130 rendered cut blocks the most is 0.60; of lattices that were closed and then cut along one line the least 0.66.
_MOST_WITHOUT_ENDS = 0.63
# Two sides of a block that run along rows of cells have no ends either, but lie apart.
_LONGEST_WITHOUT_ENDS = 0.55
# Walls that stand out of an outline around material, for each pitch of its convex hull: closed borders have 0.14 at
# most, cut ones 0.25, unless the floor of their cells is told from the table; then the outline is right all the same.
_MOST_TIPS = 0.2
# Glints look like ends of walls, and teeth of closed triangles stand out like them: what is both, is one.
_SAME_PITCHES = 0.4
# Of triangles only thin ones are ends: of 28 closed lattices none has such an end, of 28 cut along one line 26. So are
# those of other fine cells, whose pixels make ends of corners.
_THIN_RADII = 1.15
_THIN_FINE_RADII = 0.7
FINE_PITCH_PX = 12.0
"""Cells below this are fine: their corners may pass for ends of walls."""
# Corners of fine closed cells pass for ends all around: their teeth lie 0.15 pitches inside of lines through these and
# more, in the mean. Material whose cells' floors differ from the table runs along a cut, 0.1 pitches off at most.
_ALONG_PITCHES = 0.12
# Walls line a border that closes its cells: at so many places of it, within a wall's width, light is nearer to theirs
# than to floors'. On tables as light as they a right border has 0.92, and cells that were cut open, whose floors alone
# differ from the table, 0.75 at most.
_LINED, _STEPS_INTO_WALL, _NORMAL_PITCHES = 0.85, 6, 0.2
# Between corners that turn by more than this an outline around closed triangles follows whole walls, straight within so
# much of one; blunt tips of teeth are shorter. Of 120 closed borders none has so many parts between these lengths.
_TURN_DEG, _STRAIGHT, _CUT_WALL, _FEWEST_CUT = 40.0, 0.12, (0.32, 0.6), 3
# Of a triangle over the pitch of a hexagon as large.
_TRIANGLE_SIDE = math.sqrt(2.0)


def may_be_closed(seen: BlockEvidence) -> bool:
    """Whether so few walls end along the border that it may close its cells, or triangles make it hard to tell;
    `edge_kind` tells.
    """
    if _triangular(seen):
        return True
    gaps = _gaps(seen, seen.rings[0].position[seen.rings[0].kind <= WitnessKind.BLUNT])
    return float(gaps[gaps > _FAR_PITCHES * seen.pitch_px].sum()) > _MOST_WITHOUT_ENDS * float(gaps.sum())


def edge_kind(material: MaterialEdge, seen: BlockEvidence, cuts: Sequence[Float64s] = ()) -> Edge:
    """What a border with few ends is, by those that the edge of material shows as well, and by `cuts` that it shows,
    (N, 2, 2) each, pixels: cut, where they lie on several sides of the block, mixed, where they lie on one, cells,
    where there are none.
    """
    sure = [ring.position[sure_ends(material, ring, seen)] for ring in seen.rings]
    if cuts:
        exterior, lines = seen.rings[0], np.concatenate(cuts)
        off = distances_to_tree(exterior.points, BoxTree.of_segments(lines[:, 0], lines[:, 1]))
        sure[0] = np.append(sure[0], exterior.position[off < _SAME_PITCHES * seen.pitch_px])
    if not any(len(ends) for ends in sure):
        return "cells"
    gaps = _gaps(seen, sure[0])
    return "mixed" if gaps.max() > _LONGEST_WITHOUT_ENDS * gaps.sum() else "cut"


def sure_ends(material: MaterialEdge, ring: RingEvidence, seen: BlockEvidence) -> Bools:
    """Which witnesses of a ring are ends of walls at the edge of material, too, shape (N,)."""
    tips = border_tips(material, seen)
    if _triangular(seen) or seen.pitch_px < FINE_PITCH_PX:
        radii = _THIN_RADII if _triangular(seen) else _THIN_FINE_RADII
        tips = tips[thin(material.apart.region, tips, seen.wall_px, radii)]
    if not len(tips):
        return np.zeros(len(ring.points), np.bool_)
    return (ring.kind <= WitnessKind.BLUNT) & (nearest(ring.points, tips) < _SAME_PITCHES * seen.pitch_px)


def border_tips(material: MaterialEdge, seen: BlockEvidence) -> Float64s:
    """The ends of walls that stand out of material, pixels, (N, 2)."""
    return np.concatenate([ring_tips(ring, seen.pitch_px, seen.wall_px) for ring in material.border])


def side_px(seen: BlockEvidence) -> float:
    """How far apart walls meet a line mostly, pixels: a pitch, or the side of a triangle."""
    return seen.pitch_px * (_TRIANGLE_SIDE if _triangular(seen) else 1.0)


def tooth_px(seen: BlockEvidence) -> float:
    """How deep the teeth of closed cells are: of triangles as deep as these are high, pixels; 0 of other cells."""
    return math.sqrt(0.75) * side_px(seen) if _triangular(seen) else 0.0


def teeth_cut(exterior: Ring, seen: BlockEvidence) -> bool:
    """Whether an outline around closed triangles, pixels, has parts between corners that are no whole walls: it was cut
    there.
    """
    if not _triangular(seen):
        return False
    side = side_px(seen)
    corners = fewer_vertices(exterior, _STRAIGHT * side)
    parts = rolled(corners, -1) - corners
    ways = parts[:, 0] + 1j * parts[:, 1]
    turns = np.abs(np.angle(ways / rolled(ways, 1), deg=True)) > _TURN_DEG
    least, most = _CUT_WALL
    cut = turns & rolled(turns, -1) & (np.abs(ways) > least * side) & (np.abs(ways) < most * side)
    return bool(np.count_nonzero(cut) >= _FEWEST_CUT)


def _triangular(seen: BlockEvidence) -> bool:
    return seen.comb is not None and seen.comb.triangular


def lined_by_walls(border: Ring, light: Bytes, cells: CellScale) -> bool:
    """Whether walls line a border around material, pixels, negative shoelace, in `light` (H, W). Only where the table
    is as light as walls may it run along floors of cells. None do that are the darker ones of light walls, or the other
    way round: compound beside cells looks so.
    """
    if (cells.level > cells.floor) != cells.bright:
        return False
    lengths = RingLengths.of(border)
    at = np.arange(0.0, lengths.length, 1.0)
    place, inwards = lengths.at(at), lengths.normals(at, _NORMAL_PITCHES * cells.pitch_px)

    def as_walls(side: Float64s) -> float:
        within = np.linspace(0.5 * cells.wall_px, cells.wall_px + 1.0, _STEPS_INTO_WALL)
        share = (light_beside(light, place, side, within) - cells.floor) / (cells.level - cells.floor)
        return float(np.mean(share.max(axis=0) > 0.5))

    return as_walls(-inwards) < 0.5 or as_walls(inwards) > _LINED


def check_promise(promise: str, kind: Edge, *, traced: bool) -> None:
    """Raise EdgeContradicted where a border is not of the kind that was promised, and where it is of both kinds and was
    not `traced`.
    """
    if kind == "mixed" and not (traced and promise == "auto"):
        raise EdgeContradicted(
            "the border closes its cells along most of its length, but walls end along a part of it: it was cut there. "
            "Such a border is traced by edge: auto, where it was cut along straight lines from corner to corner: cut "
            "the block straight or all around, or give edge: cells if nothing was cut",
            kind,
        )
    if promise == "cut" and kind == "cells":
        raise EdgeContradicted(
            "the recipe says edge: cut, but no walls end along the border: it closes its cells. Use edge: auto or "
            "edge: cells",
            kind,
        )


def check_fine(material: MaterialEdge, seen: BlockEvidence, outline: Contour) -> None:
    """Raise EdgeContradicted where the edge of material around fine cells neither has ends on several sides nor runs
    along the `outline` through those that were seen, pixels.
    """
    if edge_kind(material, seen) == "cut":
        return
    off = distances_to_ring(densified(outline.exterior, 1.0), material.contour.exterior)
    if off.mean() > _ALONG_PITCHES * seen.pitch_px:
        raise EdgeContradicted(
            "walls seem to end all along the border, but the edge of the material shows few ends: cells of "
            f"{seen.pitch_px:.0f} px are too small to tell a cut border from a closed one here. Give edge: cut or "
            "edge: cells, or more pixels a cell",
            "cut",
        )


def check_closed(exterior: Ring, pitch_px: float, wall_px: float) -> None:
    """Raise EdgeContradicted where walls end at an outline around material, pixels, negative shoelace."""
    around = cv2.arcLength(cv2.convexHull(exterior.astype(np.float32)), True)
    tips = len(ring_tips(exterior, pitch_px, wall_px)) * pitch_px / around
    if tips > _MOST_TIPS:
        raise EdgeContradicted(
            f"the recipe says edge: cells, but {tips:.1f} walls end at the border for each cell along it, "
            f"{_MOST_TIPS:g} are allowed: cells are cut open. Use edge: auto or edge: cut",
            "cut",
        )


def _gaps(seen: BlockEvidence, ends: Float64s) -> Float64s:
    """Lengths of the exterior from one end to the next, pixels; all of it where there is none."""
    length = RingLengths.of(seen.rings[0].coarse).length
    if not len(ends):
        return np.array([length])
    ends = np.sort(ends)
    return np.diff(np.append(ends, ends[0] + length))
