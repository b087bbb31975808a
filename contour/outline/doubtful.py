"""Where an outline is round though a corner explains what was seen as well, or hardly anything was seen of it."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Bools, Complexes, Float64s, Indices, rolled
from contour.outline.bevels import between
from contour.outline.chains import Chain
from contour.outline.corners import Joints
from contour.outline.corners import ends as outermost
from contour.outline.labelling import PRICE_ARC, PRICE_LINE
from contour.outline.lines_and_arcs import Models, distance, feet, through_triples
from contour.outline.roundings import LEAST_TURN, MOST_TURN
from contour.outline.runs import Segments, fitted
from contour.outline.witnesses import Witnesses, cost, window_cost

# An arc told from the corner that it passes by fewer witnesses than that, ends of walls counted twice, so deep in it,
# pitches, and of a radius that no other arc has, may as well be that corner; it matters where the two are so far apart.
_TELL, _DEEP_IN, _ALIKE, _APART = 4, 0.1, 0.15, 0.5
# Two lines explain the witnesses of an arc or a curve as well where they cost no more than so many nats above it; it
# matters where they meet so far from any of these witnesses, pitches. A line's least number of witnesses.
_AS_WELL, _FAR, _OF_A_LINE = 8.0, 0.4, 2
# Motion moves ends of neighbouring walls alike: of 215 right outlines the least is 17 nats for a line for an arc (told
# while it was asked how far it misses that arc's ends); of two that were off by 0.8 and 1.2 cells it was 15 and 9.
_HARDLY_BENT = 16.0
# Shares of the way along an arc at which a line is asked how far off it leads.
_ALONG = np.linspace(0.0, 1.0, 9)
# Where an arc meets a line in a corner, its outermost ends may be that line's if they lie so near to it, pitches.
_AT_JOINT = 0.2
# Where two arcs meet so far from what was seen of either, pitches, and so deep in the material, one arc through so many
# witnesses of both may run there; and where nothing was seen for longer, a corner so far aside is a guess. Of 150 right
# outlines none has either.
_NOTCH_LONG, _NOTCH_DEEP, _NOTCH_AS_WELL, _OF_EITHER = 1.5, 0.3, 12.0, 3
_UNSEEN_LONG, _ASIDE = 3.0, 0.5
# A corner between lines in which so many clean ends lie so far inside of both, pitches, may as well be a bevel: of
# 196 right outlines one has such a corner, off by a third of a cell, and one that was off by 0.9.
_IN_CORNER, _DEEP_IN_CORNER = 2, 0.35
# So may one across which a clean end that deep and two more witnesses lie in one line, so long and so far off it,
# pitches: the ends along a bevel of two cells, of which one was drawn off as a corner. Of 260 right outlines none has.
_ACROSS_LONG, _IN_LINE = 1.0, 0.03
# So may one of which so many square pitches are unseen between the last ends on both: a bevel of three cells was drawn
# halfway. Of 255 right outlines none has such a corner, of 139 cut lattices one.
_UNSEEN = 2.6
# And where another corner is cut or round, of so many: one that is cut by a cell, or as round, was drawn whole. A cut
# is no longer than that, between edges that turn by no more.
_UNSEEN_LIKEWISE, _CUT_LONG, _CUT_TURN = 0.75, 7.0, np.radians(125.0)
# And where no wall ends within so many pitches of it, of so many where another is cut or round, and where none is. Of
# 15 such outlines that were wrong this tells eight, of 357 right ones none.
_BARE, _UNSEEN_BARE_LIKEWISE, _UNSEEN_BARE = 0.65, 0.38, 1.2
# So is a line across a corner no longer than that, by so few witnesses, if less than a cell would be lost in it: of 135
# blocks none has one, and one whose last walls are inked has.
_BEVEL_LONG, _LOST = 2.0, 1.0
# Another arc that lies so near to one that goes on over so much, radians, all around a hole or a disc, pitches, may as
# well be a part of it along which walls are inked: of 260 right outlines none has one.
_ROUND, _ASTRAY = np.radians(200.0), (0.25, 1.0)
# So is the floor of a notch, no longer than that, between edges that turn in by so much from one to the other, from
# which its witnesses lie so far, root mean square, pitches: a line, an arc, and one that turns by so much itself. Along
# round floors they lie within 0.03, and 0.1 to 0.27 where an arc was drawn through corners. So is an arc between two
# corners of so much, one beside which a line or an arc steps aside by so much, or that so few witnesses lead to, one
# that is no longer than that and not round, and one that nothing was seen of: there a line steps aside to the next.
# Light between walls does not tell of these: the place that is told lies so far out of the floor.
_FLOOR_LONG, _FLOOR_TURN, _ROUND_FLOOR_TURN = 7.5, np.radians(135.0), np.radians(100.0)
_FLOOR_OFF, _BENT_FLOOR_OFF, _ROUND_FLOOR_OFF = 0.25, 0.12, 0.06
_CORNER, _STEP_LONG, _LEAD, _SHORT_FLOOR, _OUT_OF_FLOOR = np.radians(30.0), 1.0, 3, 5.0, 1.25
# An outlier has no say in where a line lies.
_LEAST_WEIGHT = 1e-9


def untold(
    witnesses: Witnesses, segments: Segments, found: Joints, inlier: Bools, residual: Float64s, chains: list[Chain]
) -> Complexes:
    """Middles of arcs, free curves and short lines that may as well be corners, and corners that may as well be none,
    shape (K,), in the fitting plane.

    Roundings of one block mostly have one radius: two that are alike tell each other.
    """
    bend, curvature = np.flatnonzero(segments.bend), segments.models.curvature
    alike = np.zeros((len(segments), len(segments)), dtype=bool)
    alike[np.ix_(bend, bend)] = np.abs(curvature[bend] / curvature[bend, None] - 1.0) < _ALIKE
    arcs = np.setdiff1d(bend, [k for chain in chains for k in chain.segments])
    lone = arcs[np.count_nonzero(alike[np.ix_(arcs, arcs)], axis=1) == 1]
    curves: list[tuple[Indices, float, Models | None]] = [
        (segments.members(k, len(witnesses)), PRICE_ARC, segments.models.take(np.array([k]))) for k in lone.tolist()
    ]
    for chain in chains:
        others = np.setdiff1d(bend, chain.segments)
        if not chain.curve.closed and not alike[np.ix_(np.array(chain.segments), others)].any():
            curves.append((chain.witnesses, chain.price, None))
    places = [
        witnesses.points[index].mean()
        for index, price, arc in curves
        if _may_be_a_corner(witnesses, index, residual[index], price, arc)
    ]
    places += _hardly_seen(witnesses, segments, lone, found, inlier)
    places += _vague_floors(witnesses, segments, found, inlier, residual, chains)
    places += _bent_lines(witnesses, segments, lone, found, residual)
    places += _maybe_bevelled(witnesses, segments, found, inlier)
    places += _unseen_corners(witnesses, segments, found, inlier, residual, chains)
    places += _astray(witnesses, segments, found)
    return np.array(places + _lone_bevels(witnesses, segments, found, inlier), np.complex128)


def _may_be_a_corner(
    witnesses: Witnesses, index: Indices, residual: Float64s, price: float, arc: Models | None
) -> bool:
    """Whether two lines explain the witnesses at `index`, in order, as well as the curve of so many nats that they
    have these distances from, and meet far from it: from these witnesses, and from the `arc` if it is one.
    """
    count = len(index)
    first = np.arange(_OF_A_LINE, count - _OF_A_LINE + 1)
    if not len(first):
        return False
    middle = witnesses.points[index].mean()
    points = witnesses.points[index] - middle
    lying = _lying(witnesses, index, residual)
    weight = _weights(witnesses, index, lying)
    before = _lines(points, weight).take(first - 1)
    after = _lines(points[::-1], weight[::-1]).take(count - first - 1)
    after = Models(after.origin, -after.tangent, after.curvature)
    signed = np.where(
        np.arange(count) < first[:, None],
        distance(before.take((slice(None), None)), points),
        distance(after.take((slice(None), None)), points),
    )
    nats = cost(witnesses, signed, index).sum(axis=1)
    best = int(nats.argmin())
    if nats[best] + 2.0 * PRICE_LINE > cost(witnesses, residual, index).sum() + price + _AS_WELL:
        return False
    way, other = before.tangent[best], after.tangent[best]
    turn = np.angle(other * way.conjugate())
    if not LEAST_TURN < abs(turn) < MOST_TURN:
        return False
    on_it = points[lying]
    along = ((after.origin[best] - before.origin[best]) * other.conjugate()).imag / (way * other.conjugate()).imag
    corner = before.origin[best] + along * way
    far = np.abs(corner - on_it).min(initial=np.inf)
    if arc is not None:
        far = min(far, float(np.abs(distance(arc, middle + corner)[0])))
    return bool(far > _FAR * witnesses.pitch_px)


def _vague_floors(
    witnesses: Witnesses,
    segments: Segments,
    found: Joints,
    inlier: Bools,
    residual: Float64s,
    chains: list[Chain],
) -> list[np.complex128]:
    """Places before floors of notches that may as well run otherwise, and middles of those not seen."""
    begin, end = rolled(found.begin, 1), found.end
    (_, sets_out), (_, comes_in) = feet(segments.models, begin), feet(segments.models, end)
    # By how much the outline turns in at the joint behind each segment, and along each.
    joint = np.angle(comes_in * rolled(sets_out, -1).conj())
    chord = end - begin
    long = np.abs(chord) / witnesses.pitch_px
    own = -2.0 * np.arcsin(np.clip(0.5 * np.abs(chord) * segments.models.curvature, -1.0, 1.0))
    if (own + joint).sum() > 0.0:
        return []  # all of a hole turns in
    aside = np.abs(found.end - found.begin) > _STEP_LONG * witnesses.pitch_px
    unseen = aside & (np.abs(joint) > _FLOOR_TURN)
    places: list[np.complex128] = (0.5 * (found.end + found.begin))[unseen].tolist()
    round_ = own > _ROUND_FLOOR_TURN
    floor = (round_ | (own + joint + rolled(joint, 1) > _FLOOR_TURN)) & (long < _FLOOR_LONG)
    floor[[k for chain in chains for k in chain.segments]] = False
    of_each = [segments.members(k, len(witnesses)) for k in range(len(segments))]
    few = ~segments.bend & np.array([np.count_nonzero(inlier[index]) < _LEAD for index in of_each])
    doubted = rolled(few, 1) | rolled(few, -1) | aside | rolled(aside, 1)
    doubted |= ~round_ & (long < _SHORT_FLOOR)
    doubted |= segments.bend & (np.minimum(joint, rolled(joint, 1)) > _CORNER)
    for k in np.flatnonzero(floor).tolist():
        off = np.minimum(np.abs(residual[of_each[k]]) / witnesses.pitch_px, 1.0)
        most = _ROUND_FLOOR_OFF if round_[k] else _BENT_FLOOR_OFF if segments.bend[k] else _FLOOR_OFF
        if np.sqrt((off**2).mean()) > most or doubted[k]:
            out = -1j * chord[k] / max(abs(chord[k]), 1e-9)
            places.append(0.5 * (begin[k] + end[k]) + _OUT_OF_FLOOR * witnesses.pitch_px * out)
    return places


def _bent_lines(
    witnesses: Witnesses, segments: Segments, arcs: Indices, found: Joints, residual: Float64s
) -> list[np.complex128]:
    """Middles of those arcs whose witnesses a line explains as well, which meets what is beside them elsewhere."""
    places = []
    for k in arcs.tolist() if len(segments) > 1 else ():
        index, (ends, tangent) = segments.members(k, len(witnesses)), _at_ends(segments, found, k)
        arc = feet(segments.models.take(np.full(len(_ALONG), k)), ends[0] + _ALONG * (ends[1] - ends[0]))[0]
        beside = np.array([k - 1, (k + 1) % len(segments)])
        edges = segments.models.take(beside[:, None])
        off = np.abs(distance(edges, witnesses.points[index]))
        turn = np.abs(np.angle(segments.models.tangent[beside] * tangent.conjugate()))
        corner = (turn > LEAST_TURN) & ~segments.bend[beside]
        theirs = (off < _AT_JOINT * witnesses.pitch_px) & corner[:, None]
        first, last = (int(np.argmin(np.append(one, False))) for one in (theirs[0], theirs[1, ::-1]))
        for start, stop in {(a, len(index) - b) for a in (0, first) for b in (0, last)}:
            own = index[start:stop]
            if len(own) > _OF_A_LINE and _may_be_a_line(witnesses, own, residual[own], arc, edges):
                places.append(ends.mean())
                break
    return places


def _may_be_a_line(witnesses: Witnesses, index: Indices, residual: Float64s, arc: Complexes, edges: Models) -> bool:
    """Whether a line explains the witnesses at `index` nearly as well as an arc that they have these distances from,
    and leads far from it between the edges beside it: that arc's places are given, and these edges, shape (2, 1).
    """
    points = witnesses.points[index]
    most = cost(witnesses, residual, index).sum() + PRICE_ARC + _HARDLY_BENT
    for weight in (_weights(witnesses, index, _lying(witnesses, index, residual)), np.ones(len(index))):
        line = _lines(points, weight).take([-1])
        nats = cost(witnesses, distance(line.take((slice(None), None)), points), index).sum() + PRICE_LINE
        aside = np.abs(distance(line.take((slice(None), None)), arc))
        apart = np.minimum(aside, np.abs(distance(edges, arc))).min(axis=0).max()
        if nats < most and apart > _APART * witnesses.pitch_px:
            return True
    return False


def _maybe_bevelled(witnesses: Witnesses, segments: Segments, found: Joints, inlier: Bools) -> list[np.complex128]:
    """Corners between lines that clean ends lie in which neither explains, or of which hardly anything was seen."""
    places = []
    first, last = outermost(witnesses, segments, inlier)
    lines = ~segments.bend & ~rolled(segments.bend, -1)
    likewise = _cuts_a_corner(witnesses, segments, found)
    most, most_bare = (_UNSEEN_LIKEWISE, _UNSEEN_BARE_LIKEWISE) if likewise else (_UNSEEN, _UNSEEN_BARE)
    for k in np.flatnonzero(lines).tolist() if len(segments) > 2 else ():
        after = (k + 1) % len(segments)
        index = between(segments, inlier, k, after)
        index = index[witnesses.clean[index]]
        both = segments.models.take(np.array([[k], [after]]))
        inside = -distance(both, witnesses.points[index]).max(axis=0) / witnesses.pitch_px
        corner = np.complex128(0.5 * (found.end[k] + found.begin[k]))
        sides = np.array([last[k], first[after]]) - corner
        unseen = 0.5 * abs((sides[0] * sides[1].conjugate()).imag) / witnesses.pitch_px**2
        away = np.abs(witnesses.points - corner).min() / witnesses.pitch_px
        # A cut from one last end to the other leads no farther from a blunt corner.
        lost = 2.0 * unseen * witnesses.pitch_px / max(abs(sides[0] - sides[1]), 1e-9)
        bare = away > _BARE and lost > _ASIDE
        row = np.concatenate([last[[k]], witnesses.points[index], first[[after]]])
        across = _in_one_line(row, witnesses.pitch_px, np.pad(inside > _DEEP_IN_CORNER, 1))
        if unseen > (most_bare if bare else most) or across or np.count_nonzero(inside > _DEEP_IN_CORNER) >= _IN_CORNER:
            places.append(corner)
    return places


def _cuts_a_corner(witnesses: Witnesses, segments: Segments, found: Joints) -> bool:
    """Whether any segment is short enough to cut off a corner, or round it, between what is beside it."""
    short = np.abs(found.end - rolled(found.begin, 1)) < _CUT_LONG * witnesses.pitch_px
    tangent = segments.models.tangent
    turn = np.abs(np.angle(rolled(tangent, -1) * rolled(tangent, 1).conj()))
    return bool((short & (turn > LEAST_TURN) & (turn < _CUT_TURN)).any())


def _in_one_line(points: Complexes, pitch_px: float, deep: Bools) -> bool:
    """Whether three of the points (N,), in their order, one of them `deep`, (N,), lie in one line."""
    for first, last in zip(*np.triu_indices(len(points), 2), strict=True):
        way = points[last] - points[first]
        if abs(way) > _ACROSS_LONG * pitch_px:
            off = np.abs(((points[first : last + 1] - points[first]) * way.conjugate()).imag) / abs(way)
            on = off < _IN_LINE * pitch_px
            if np.count_nonzero(on) > _OF_A_LINE and deep[first : last + 1][on].any():
                return True
    return False


def _astray(witnesses: Witnesses, segments: Segments, found: Joints) -> list[np.complex128]:
    """Middles of arcs that leave one which goes on all around, by less than a cell."""
    begin, places = rolled(found.begin, 1), []
    for k in np.flatnonzero(segments.bend).tolist():
        curvature = segments.models.curvature[k]
        _, tangent = _at_ends(segments, found, k)
        turn = np.angle(tangent[1] * tangent[0].conjugate()) * np.sign(curvature) % (2.0 * np.pi)
        others = np.setdiff1d(np.flatnonzero(segments.bend), [k])
        if turn < _ROUND or not len(others):
            continue
        joints = np.concatenate([found.end[others], begin[others]])
        off = np.abs(distance(segments.models.take(np.full(len(joints), k)), joints)).max() / witnesses.pitch_px
        if _ASTRAY[0] < off < _ASTRAY[1]:
            places.append(joints.mean())
    return places


def _at_ends(segments: Segments, found: Joints, k: int) -> tuple[Complexes, Complexes]:
    """Where a segment begins and ends, and its unit tangents there, (2,) each."""
    ends = np.array([found.begin[k - 1], found.end[k]])
    return ends, feet(segments.models.take(np.array([k, k])), ends)[1]


def _unseen_corners(
    witnesses: Witnesses, segments: Segments, found: Joints, inlier: Bools, residual: Float64s, chains: list[Chain]
) -> list[np.complex128]:
    """Where two arcs meet in no curve, and too little was seen for it to be told that they do."""
    joined = {k for chain in chains for k in chain.segments[:-1]}
    if len(segments) < 2 or any(chain.curve.closed for chain in chains):
        return []
    places = []
    for k in np.flatnonzero(segments.bend & rolled(segments.bend, -1)).tolist():
        if k in joined:
            continue
        before, after = (segments.members(one, len(witnesses)) for one in (k, (k + 1) % len(segments)))
        last, first = np.flatnonzero(inlier[before])[-_OF_EITHER:], np.flatnonzero(inlier[after])[:_OF_EITHER]
        if min(len(last), len(first)) < _OF_A_LINE:
            continue
        ends = witnesses.points[[before[last[0]], before[last[-1]], after[first[0]], after[first[-1]]]]
        corner, chord = 0.5 * (found.end[k] + found.begin[k]), ends[2] - ends[1]
        long = abs(chord) / witnesses.pitch_px
        deep = ((corner - ends[1]) * chord.conjugate()).imag / max(abs(chord), 1e-9) / witnesses.pitch_px
        index = np.concatenate([before[last[0] :], after[: first[-1] + 1]])
        notch = long > _NOTCH_LONG and deep > _NOTCH_DEEP
        guess = long > _UNSEEN_LONG and abs(deep) > _ASIDE
        if guess or (notch and _may_be_one_arc(witnesses, index, residual[index], ends, corner)):
            places.append(np.complex128(corner))
    return places


def _may_be_one_arc(
    witnesses: Witnesses, index: Indices, residual: Float64s, ends: Complexes, corner: np.complex128
) -> bool:
    """Whether one arc explains the witnesses at `index` nearly as well as two that they have these distances from, and
    passes the corner of these far off. ends: the outermost witnesses of either that lie on it, (4,).
    """
    triples = ends[np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])].T
    each = np.tile(index, (4, 1))
    arcs = fitted(witnesses, through_triples(*triples), np.ones(4, np.bool_), each, np.ones(each.shape))
    as_well = window_cost(witnesses, arcs, each).sum(axis=1) < cost(witnesses, residual, index).sum() + _NOTCH_AS_WELL
    apart = np.abs(distance(arcs, np.full(4, corner))) > _NOTCH_DEEP * witnesses.pitch_px
    return bool((as_well & apart).any())


def _lying(witnesses: Witnesses, index: Indices, residual: Float64s) -> Bools:
    """Which witnesses at `index` lie on what they have these distances from."""
    return np.asarray(np.abs(residual) < 3.0 * witnesses.outer[index])


def _weights(witnesses: Witnesses, index: Indices, lying: Bools) -> Float64s:
    """What each of the witnesses at `index` says of where a line runs."""
    return np.where(lying, witnesses.outer[index] ** -2.0, _LEAST_WEIGHT)


def _lines(points: Complexes, weight: Float64s) -> Models:
    """The lines through the first point, the first two, three and so on, shape (N,), by weighted least squares across
    them.
    """
    total, first, second = (np.cumsum(weight * points**power) for power in (0, 1, 2))
    middle = first / total
    tangent = np.exp(0.5j * np.angle(second - first * middle))
    forward = ((points - points[0]) * tangent.conj()).real
    return Models(middle, np.where(forward < 0.0, -tangent, tangent), np.zeros(len(points)))


def _hardly_seen(
    witnesses: Witnesses, segments: Segments, arcs: Indices, found: Joints, inlier: Bools
) -> list[np.complex128]:
    """Middles of those arcs that too few witnesses tell from the corners that they may be.

    A radius r passes the corner of a turn t at r / cos(t / 2) - r.
    """
    owner = segments.owner(len(witnesses))
    places = []
    for k in arcs:
        ends, tangent = _at_ends(segments, found, k)
        turn = float(np.abs(np.angle(tangent[0].conjugate() * tangent[1])))
        passed = (1.0 / np.cos(0.5 * min(turn, MOST_TURN)) - 1.0) / abs(segments.models.curvature[k])
        if turn > MOST_TURN or passed < _APART * witnesses.pitch_px:
            continue
        own = inlier & (owner == k)
        away = np.abs(((witnesses.points[own, None] - ends) * tangent.conj()).imag).min(axis=1)
        deep = away > _DEEP_IN * witnesses.pitch_px
        if np.count_nonzero(deep) + np.count_nonzero(deep & witnesses.clean[own]) < _TELL:
            places.append(ends.mean())
    return places


def _lone_bevels(witnesses: Witnesses, segments: Segments, found: Joints, inlier: Bools) -> list[np.complex128]:
    """Middles of those lines that two witnesses alone put across a corner, where the cell in it may as well be lost, or
    its walls may be too dark to show.
    """
    begin, owner = rolled(found.begin, 1), segments.owner(len(witnesses))
    count = np.bincount(owner[inlier], minlength=len(segments))
    long = np.abs(found.end - begin)
    places = []
    for k in np.flatnonzero(~segments.bend & (count <= _OF_A_LINE) & (long < _BEVEL_LONG * witnesses.pitch_px)):
        beside = np.array([k - 1, (k + 1) % len(segments)])
        before, after = segments.models.take(beside).tangent
        turn = np.angle(after * before.conjugate())
        if segments.bend[beside].any() or not LEAST_TURN < abs(turn) < MOST_TURN:
            continue
        origin = segments.models.take(beside).origin
        ahead = ((origin[1] - origin[0]) * after.conjugate()).imag / (before * after.conjugate()).imag
        way = (found.end[k] - begin[k]) / max(long[k], 1e-9)
        passed = abs(((origin[0] + ahead * before - begin[k]) * way.conjugate()).imag) / witnesses.pitch_px
        if _APART < passed < _LOST:
            places.append(0.5 * (begin[k] + found.end[k]))
    return places
