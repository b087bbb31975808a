"""The last word of wall-tips: an outline against the wall ends it was laid through, and the walls that are seen."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from contour.edge.visible_edge import VisibleRing
from contour.errors import NoBlockFound
from contour.geometry.arrays import Bools, Bytes, Float64s, Indices, median, quantile, rolled
from contour.geometry.rectifier import Rectifier, rectified
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring
from contour.geometry.signed_distance import depth_inside, nearest
from contour.material.corner_walls import corner_walls
from contour.material.floor_edge import floor_edge
from contour.outline.fit import FittedRing
from contour.relief.reach import Reach
from contour.relief.relief import Relief
from contour.walls.wall_evidence import BlockEvidence, RingEvidence, WitnessKind

_FAR_OFF_PITCHES = 0.5
# Edges that are all but parallel meet anywhere: a corner so far from all that was seen of the block is none of it.
_AWAY_PITCHES = 10.0
# Of 137 right rings 0.71 of the witnesses lie on the one with fewest; of a square hole that was drawn round 0.5.
_LEAST_ON_RING = 0.58
# Of what witnesses 82 cut holes 0.38 at least are ends of walls, of sheets with wide webs 0.26; along dark compound
# with whole cells around 0.06, and thrice two of eight. One more is asked for: a corner of cells may look like an end.
_LEAST_ENDS_OF_HOLE, _BY_CHANCE = 0.2, 1
# Of 370 right holes two have so much of their edge more than a cell from all that was seen, of 51 wrong ones ten.
_MOST_OF_HOLE_UNSEEN = 0.2
# Cells are lost, and leave ends inside; but nothing puts two ends side by side outside of a block: one may be a chip.
# A clean end outside is a chip, or a streak that a wall's side makes, only where the outline meets the ends beside it.
_FAR_OUTSIDE_PITCHES, _CLEAN_OUTSIDE_PITCHES = 1.0 / 3.0, 1.0 / 6.0
_IN_A_ROW, _IN_A_ROW_OUTSIDE = 4, 2
# Beside a corner a single one may be all that shows that it lies elsewhere; along an edge dust makes such.
_OUTSIDE_CORNER_PITCHES, _AT_CORNER_PITCHES = 0.3, 1.5
# Of 290 right outlines none lies so far from all that it was laid through where the coarse edge is so deep inside (0.57
# pitches at most), but at corners of which cells are missing.
_DEEP_PITCHES, _FAR_PITCHES, _NEAR_PITCHES = 0.6, 1.0, 0.25
# Over comb light changes within so many pitches each way, or that share of the coarse edge's depth, by more than so
# many times what it does at most places so far beside the block: by 4.7 and more in shade or glare, over table by 2.0.
_CELL_PITCHES, _OF_DEPTH, _BUSIER, _BESIDE_PITCHES, _MOSTLY = 0.4, 0.3, 3.0, 1.5, 0.8
_CORNER, _TURN_PITCHES = np.radians(35.0), 0.5
# What stands out of a known table as walls do, and as far along, is one: of 288 outlines one leaves such outside, off
# by 0.58 of a cell. Beside right ones lie streaks, 0.7 as high as walls at most, and specks, 0.4 pitches long.
# More than a cell's side is one also where it is fainter: a curve was cut off by 0.7 of a cell so.
_OUTSIDE_PITCHES, _FAR_OUT_PITCHES = 0.2, 0.3
_LONG_AND_LIKE_WALLS = ((0.5, 0.75), (0.9, 0.4))
# Of 160 right cut lattices and 180 blocks on the shop floor no edge between two corners passes ends so far inside and
# has as few of its own, which lie no nearer to the edges beside it; but chords of curves do.
_PASSED_PITCHES, _LONG_PITCHES, _SHARED_PITCHES, _SHARED_SPREADS = 0.25, 1.5, 0.06, 3.0
# Where walls lie farthest out, light changes by 0.28 of what it does at their ends at least (60 right outlines, in deep
# shadow, else 0.69) over three of them in a row; along glare that was taken for walls by 0.15.
_FLAT, _FLAT_IN_A_ROW, _PATCH_PITCHES, _BLUR_PX, _BLUR_REACHES_PX = 0.2, 4, 0.06, 1.0, 3
# Neighbours on a wall's boundary are an eighth of a pitch apart, its two sides a wall's width.
_ONE_WALL_PITCHES = 0.3


def check_against_evidence(
    evidence: RingEvidence, ring: Ring, inlier: Bools, pitch_px: float, rectifier: Rectifier | None
) -> None:
    """Raise NoBlockFound where the ring passes four wall ends in a row by more than half a cell on one side, or leaves
    two in a row outside by more than a third, or a clean one by more than a sixth beside another one that it passes, or
    one of those that it was laid through: `inlier`, shape (N,); where these are hardly more than the others; and where
    its edges meet far from the block.

    A ring that was fitted in the rectified plane is straight between its vertices there, and is looked at there: in the
    picture a lens bends a long edge by more than a small cell.
    """
    away = np.maximum(evidence.coarse.min(axis=0) - ring, ring - evidence.coarse.max(axis=0)).max(axis=1)
    if away.max() > _AWAY_PITCHES * pitch_px:
        x, y = ring[away.argmax()]
        raise NoBlockFound(
            f"no block found: two edges of the outline that fits most wall ends meet at ({x:.0f}, {y:.0f}) px, far "
            "from the block. Check that nothing lies against the block, and that its edge is in focus"
        )
    if inlier.mean() < _LEAST_ON_RING:
        (x, y), on_it = ring.mean(axis=0), np.count_nonzero(inlier)
        raise NoBlockFound(
            f"no block found: of {len(inlier)} ends of walls around ({x:.0f}, {y:.0f}) px only {on_it} lie on the "
            "outline that fits most of them. Check that nothing lies against the block, and that its edge is in focus"
        )
    ends, clean = evidence.kind != WitnessKind.OUTERMOST, evidence.kind == WitnessKind.CLEAN
    into_ring = depth_inside(ring, evidence.points, rectifier)
    depth = -into_ring if evidence.is_hole else into_ring
    # Ends inside are passed rightly where outermost walls between them are met: foam has such inside.
    inside, outside = depth / pitch_px, -depth[ends] / pitch_px
    missed, own = ends & ~inlier, ends & inlier
    passed = np.roll(missed, 1) | np.roll(missed, -1)
    for off, points, most, how_far in (
        (inside > _FAR_OFF_PITCHES, evidence.points, _IN_A_ROW, "half a cell"),
        (outside > _FAR_OFF_PITCHES, evidence.points[ends], _IN_A_ROW, "half a cell"),
        (outside > _FAR_OUTSIDE_PITCHES, evidence.points[ends], _IN_A_ROW_OUTSIDE, "a third of a cell"),
        (clean & passed & (inside < -_CLEAN_OUTSIDE_PITCHES), evidence.points, 1, "a sixth of a cell"),
        # An edge whose own ends lie beyond its corner was cut off there, or drawn past it.
        (own & (inside > _FAR_OFF_PITCHES), evidence.points, 1, "half a cell"),
        (own & (inside < -_FAR_OUTSIDE_PITCHES), evidence.points, 1, "a third of a cell"),
    ):
        if not off.any():
            continue
        in_a_row = _ends_of_rows(off, most)
        if in_a_row.any():
            x, y = points[np.argmax(in_a_row)]
            raise NoBlockFound(
                f"no block found: the outline that fits most wall ends passes those near ({x:.0f}, {y:.0f}) px by more "
                f"than {how_far}. Check that nothing lies against the block, and that its edge is in focus"
            )


def ends_outside_corners(
    evidence: RingEvidence, ring: Ring, inlier: Bools, pitch_px: float, rectifier: Rectifier | None
) -> Float64s:
    """Ends of walls that the ring leaves outside beside one of its corners, (K, 2), pixels; `inlier`, (N,), are those
    that it was laid through.
    """
    missed = evidence.points[~inlier & (evidence.kind < WitnessKind.OUTERMOST)]
    if not len(missed):
        return missed
    into_ring = (-1.0 if evidence.is_hole else 1.0) * depth_inside(ring, missed, rectifier)
    left = missed[into_ring < -_OUTSIDE_CORNER_PITCHES * pitch_px]
    if not len(left):
        return left
    flat = rectified(ring, rectifier)
    away = nearest(rectified(left, rectifier), flat[_at_corners(RingLengths.of(flat), pitch_px)])
    return left[away < _AT_CORNER_PITCHES * pitch_px]


def untold_corners(one: VisibleRing, light: Bytes, seen: BlockEvidence, *, exterior: bool) -> Float64s:
    """Where nothing that is seen tells whether a ring is round or a corner, walls or floors, (K, 2), pixels."""
    ring = one.fitted
    floors = floor_edge(light, ring.ring, seen.pitch_px, bright=seen.polarity == "bright")
    told = floors.tells(ring.untold, seen.pitch_px)
    places = [floors.passed(one.on_line, seen.pitch_px)]
    if exterior and seen.mask is not None:
        scale = round(light.shape[0] / seen.mask.shape[0])
        walls = corner_walls(seen.mask, scale, ring.ring, ring.untold, seen.pitch_px)
        told |= walls.tells(ring.untold, seen.pitch_px)
        places.append(walls.corners[walls.bare])
    return np.concatenate([ring.untold[~told], *places])


def _at_corners(lengths: RingLengths, pitch_px: float) -> Bools:
    """Which vertices of a ring are corners, shape (N,)."""
    return np.asarray(np.abs(lengths.turns(lengths.starts, _TURN_PITCHES * pitch_px)) > _CORNER)


def check_unseen(
    evidence: RingEvidence, ring: Ring, inlier: Bools, light: Bytes, pitch_px: float, rectifier: Rectifier | None
) -> None:
    """Raise NoBlockFound where the ring leads over the table: far from all that it was laid through, from other
    material, and from its corners, with the coarse edge deep inside, and light between them as even as beside the
    block: in shade or glare the coarse edge leaves out cells.

    For rings of which nothing is hidden.
    """
    in_picture = ring
    ring, coarse = rectified(ring, rectifier), rectified(evidence.coarse, rectifier)
    inside = (-1.0 if evidence.is_hole else 1.0) * depth_inside(ring, coarse)
    deep = np.flatnonzero(inside > _DEEP_PITCHES * pitch_px)
    if not len(deep):
        return
    lengths = RingLengths.of(ring)
    feet = lengths.feet(coarse[deep])
    points = rectified(evidence.points[inlier], rectifier)
    material = rectified(np.concatenate([evidence.walls.points, evidence.beside]), rectifier)
    near = material[np.abs(depth_inside(ring, material)) < _NEAR_PITCHES * pitch_px] if len(material) else material
    corners = lengths.starts[_at_corners(lengths, pitch_px)]
    known = np.concatenate([lengths.feet(np.concatenate([points, near])), corners])
    away = np.abs(feet[:, None] - known)
    away = np.minimum(away, lengths.length - away).min(axis=1, initial=lengths.length)
    over = deep[away > _FAR_PITCHES * pitch_px]
    if len(over):
        drawn = RingLengths.of(in_picture)
        between = 0.5 * (evidence.coarse[over] + drawn.at(drawn.feet(evidence.coarse[over])))
        beside = evidence.points[inlier] + _BESIDE_PITCHES * pitch_px * evidence.normal[inlier]
        # Where nothing but the table can lie between both.
        half = max(1, round(min(_CELL_PITCHES * pitch_px, _OF_DEPTH * float(inside[over].min()))))
        table = quantile(_changes(light, beside, half), _MOSTLY)
        over = over[_changes(light, between, half) <= _BUSIER * table]
    if len(over):
        x, y = evidence.coarse[over[inside[over].argmax()]]
        raise NoBlockFound(
            f"no block found: the outline that fits most wall ends leads over the table near ({x:.0f}, {y:.0f}) px, "
            "far from any of them. Check that nothing lies against the block, and that its edge is in focus"
        )


def check_own_ends(evidence: RingEvidence, fitted: FittedRing, pitch_px: float, rectifier: Rectifier | None) -> None:
    """Raise NoBlockFound where a straight edge passes as many ends inside as it has of its own: a line from the last
    end of one edge to that of another goes through a third by chance. So it is where a fifth of a hole has none.

    For rings of which nothing is hidden.
    """
    if evidence.is_hole and fitted.unseen_share > _MOST_OF_HOLE_UNSEEN:
        (x, y), seen = fitted.ring.mean(axis=0), 1.0 - fitted.unseen_share
        raise NoBlockFound(
            f"no block found: wall ends witness {100 * seen:.0f} % of the hole around ({x:.0f}, {y:.0f}) px, expected "
            f"at least {100 * (1.0 - _MOST_OF_HOLE_UNSEEN):.0f} %. Check the light, and that nothing lies in the hole"
        )
    ring, points = rectified(fitted.ring, rectifier), rectified(evidence.points, rectifier)
    lengths = RingLengths.of(ring)
    edge, _ = lengths.places(lengths.feet(points))
    ends = evidence.kind != WitnessKind.OUTERMOST
    missed = ends & ~fitted.inlier & (fitted.residual < -_PASSED_PITCHES * pitch_px)
    shared_px = max(_SHARED_PITCHES * pitch_px, _SHARED_SPREADS * fitted.spread_px)
    heading = lengths.edges[:, 0] + 1j * lengths.edges[:, 1]
    corner = np.abs(np.angle(heading * rolled(heading, 1).conjugate())) > _CORNER
    straight = corner & rolled(corner, -1) & (np.abs(heading) > _LONG_PITCHES * pitch_px)
    for one in np.unique(edge[missed & straight[edge]]).tolist():
        own = points[fitted.inlier & (edge == one)]
        for beside in (one - 1, one + 1):
            there = lengths.at(lengths.along_edge(np.full(len(own), beside % len(ring)), own))
            own = own[np.hypot(*(own - there).T) > shared_px]
        passed = np.flatnonzero(missed & (edge == one))
        if len(own) <= len(passed):
            x, y = evidence.points[passed[fitted.residual[passed].argmin()]]
            raise NoBlockFound(
                f"no block found: the outline passes wall ends near ({x:.0f}, {y:.0f}) px inside, along an edge with "
                f"{len(own)} of its own. Check that nothing lies against the block, and that its edge is in focus"
            )


def check_on_walls(evidence: RingEvidence, inlier: Bools, light: Bytes, pitch_px: float) -> None:
    """Raise NoBlockFound where hardly any wall ends along a hole, or a ring was laid through four places in a row at
    which none does, nor light, (H, W), changes as it does at walls: along glare.

    For rings of which nothing is hidden.
    """
    count = np.count_nonzero(evidence.kind != WitnessKind.OUTERMOST)
    if evidence.is_hole and count < _LEAST_ENDS_OF_HOLE * len(evidence.points) + _BY_CHANCE:
        (x, y), places = evidence.points.mean(axis=0), len(evidence.points)
        raise NoBlockFound(
            f"no block found: of {places} places along the hole around ({x:.0f}, {y:.0f}) px walls end at {count}, "
            "as if it was not cut: something that looks like the table may fill cells. Check the light, and that "
            "nothing lies on the block"
        )
    on_it = np.flatnonzero(inlier)
    ends = evidence.kind[on_it] != WitnessKind.OUTERMOST
    if len(on_it) < _FLAT_IN_A_ROW or not ends.any():
        return
    span = _changes(light, evidence.points[on_it], max(1, round(_PATCH_PITCHES * pitch_px)) + 1)
    in_a_row = _ends_of_rows(~ends & (span < _FLAT * median(span[ends])), _FLAT_IN_A_ROW)
    if in_a_row.any():
        x, y = evidence.points[on_it[np.argmax(in_a_row)]]
        raise NoBlockFound(
            f"no block found: near ({x:.0f}, {y:.0f}) px the outline follows light that changes too softly for walls. "
            "Move the lamp or the block so that no glare lies at its edge"
        )


def _changes(light: Bytes, points: Float64s, half: int) -> Float64s:
    """By how much light, lightly blurred, changes within so many pixels of points, (N, 2), both ways, shape (N,)."""
    reach = np.arange(-half - _BLUR_REACHES_PX, half + _BLUR_REACHES_PX + 1)
    columns, rows = (
        np.clip(place[:, None] + reach, 0, size - 1)
        for place, size in zip(np.rint(points).astype(np.intp).T, light.shape[::-1], strict=True)
    )
    # Patches below one another: only what is looked at is blurred, and nothing of one reaches the next.
    patches = light[rows[:, :, None], columns[:, None, :]]
    smooth = cv2.GaussianBlur(patches.reshape(-1, len(reach)), (2 * _BLUR_REACHES_PX + 1,) * 2, _BLUR_PX)
    inner = slice(_BLUR_REACHES_PX, -_BLUR_REACHES_PX)
    return np.asarray(np.ptp(smooth.reshape(patches.shape)[:, inner, inner], axis=(1, 2)), np.float64)


def _ends_of_rows(flags: Bools, count: int) -> Bools:
    """Where so many flags in a row around a ring end, shape (N,)."""
    return np.asarray(np.all([np.roll(flags, shift) for shift in range(count)], axis=0))


def check_against_relief(
    evidence: RingEvidence, ring: Ring, relief: Relief, pitch_px: float, rectifier: Rectifier | None
) -> None:
    """Raise NoBlockFound where a ring leaves a wall outside that stands out of a known table."""
    walls = evidence.walls.points
    if not len(walls):
        return
    outside = (1.0 if evidence.is_hole else -1.0) * depth_inside(ring, walls, rectifier) / pitch_px
    left = np.flatnonzero(outside > _OUTSIDE_PITCHES)
    if outside.max() < _FAR_OUT_PITCHES:
        return
    height = relief.height_at(walls)
    usual = median(height[outside < _OUTSIDE_PITCHES])
    for wall in _pieces(walls[left], _ONE_WALL_PITCHES * pitch_px):
        one = left[wall]
        long = max(float(np.hypot(*(walls[one] - point).T).max()) for point in walls[one])
        high = median(height[one]) / max(usual, 1e-9)
        like_walls = any(long > least * pitch_px and high > part for least, part in _LONG_AND_LIKE_WALLS)
        if outside[one].max() > _FAR_OUT_PITCHES and like_walls:
            x, y = walls[one].mean(axis=0)
            raise NoBlockFound(
                f"no block found: the outline that fits most wall ends leaves a wall outside near ({x:.0f}, {y:.0f}) "
                "px. Check that nothing lies against the block, and that its edge is in focus"
            )


def check_reached(reaches: Sequence[Reach], least_px: float) -> None:
    """Raise NoBlockFound where an outline leads over a known table, reached by no wall over so many pixels or more.

    For rings of which nothing is hidden.
    """
    for one in reaches:
        for first, last in one.gaps(least_px):
            if one.plain_between(first, last):
                x, y = one.lengths.at(np.array([0.5 * (first + last)]))[0]
                where = f"({x:.0f}, {y:.0f}) px"
                raise NoBlockFound(
                    f"no block found: the outline that fits most wall ends leads over the table near {where}, "
                    "where no wall reaches it. Check that nothing lies against the block, and that its edge is in focus"
                )


def _pieces(points: Float64s, reach_px: float) -> list[Indices]:
    """The indices of points (N, 2) that hang together, none farther than that from the next of its piece."""
    pieces, left = [], np.ones(len(points), np.bool_)
    while left.any():
        piece = np.zeros(len(points), np.bool_)
        grown = np.arange(len(points)) == np.argmax(left)
        while grown.any():
            piece |= grown
            grown = left & ~piece & (nearest(points, points[grown]) < reach_px)
        left &= ~piece
        pieces.append(np.flatnonzero(piece))
    return pieces
