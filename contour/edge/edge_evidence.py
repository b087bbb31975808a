"""What each stretch of a fitted ring rests on: on ends seen, or on a line carried across what hides them, if it does:
what lies outside alone hides nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.edge.ring_places import places_along, runs_of, turns_deg
from contour.edge.stretches import Hider, State, Stretch
from contour.edge.table_look import TableLook
from contour.edge.visible_edge import VisibleRing
from contour.geometry.arrays import Float64s, Indices, distinct
from contour.geometry.rectifier import Rectifier
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring, signed_area
from contour.geometry.signed_distance import nearest
from contour.outline.uncertainty import RingBounds

_SPACING_PITCHES = 0.25
# A bridge joins two sides: walls seen over so much of each, and between them no more of a bend than this.
_FLANK_PITCHES, _FLANK_WITNESSES = 6.0, 3
_STRAIGHT_PITCHES, _STRAIGHT_PX = 0.02, 0.7
_SMOOTH_DEG = 12.0
# So far inside of an edge, pitches, no more than that share of places may lie in a thing that hides none of it, and on
# what looks like table: cells show it.
_DEPTHS, _IN_THING, _ON_TABLE = (0.5, 0.9, 1.3), (0.15, 0.0, 0.0), (1.0, 0.3, 0.3)
# And it is no longer than that, pitches, less on a curve, nor than what is seen beside it of the same edge, at so many
# places.
_LONGEST, _SEEN_BESIDE, _ON_CURVES = 6.0, 6, 3.0
_SHORTEST_PITCHES = 1.0
# So many ends of walls at a thing lie so near to a shorter one that is hidden: it takes a corner off.
_FEW, _AT_THING_PITCHES = 2, 0.5
# What an edge may bend unseen, of the length bridged.
_BEND = 0.02
_LESS_SURE, _FOOT_PITCHES = 1.2, 1.5


def ring_evidence(
    number: int, ring: Ring, visible: VisibleRing, look: TableLook, rectifier: Rectifier | None, bounds: RingBounds
) -> tuple[Stretch, ...]:
    """The stretches of `ring`, pixels, in its own order; `number` is its place in the contour.

    What is seen, but less sure than the outline as a whole by more than `_LESS_SURE`, is a stretch of its own.
    """
    pitch_px = look.pitch_px
    places = places_along(ring, _SPACING_PITCHES * pitch_px, rectifier)
    sure = bounds.at(places.points)
    hidden = visible.hidden(places.points, look) if len(visible.distrusted) else np.zeros(len(sure), np.bool_)
    fills = visible.evidence.points[visible.filled & visible.fitted.inlier]
    filled = ~hidden & (nearest(places.points, fills) < 2 * _SPACING_PITCHES * pitch_px)
    known = places.points[hidden | filled]
    # Walls that end inside beside a thing end at it: there its own bound counts.
    unsure = (sure > _LESS_SURE * bounds.whole_px) & (nearest(places.points, known) > _FOOT_PITCHES * pitch_px)
    label = np.where(unsure, -2, np.where(filled, -1, 0))
    # Shorter ones are gaps between ends, as there are everywhere, but where walls end at a thing.
    runs = [
        run
        for run in runs_of(hidden)
        if len(run) > _SHORTEST_PITCHES / _SPACING_PITCHES
        or np.count_nonzero(nearest(visible.distrusted, places.points[run]) < _AT_THING_PITCHES * pitch_px) >= _FEW
    ]
    hides: list[_HiddenRun] = []
    if runs:
        # Fitted rings have the material on their left, which is where these point from.
        out = np.sign(signed_area(ring) * signed_area(visible.fitted.ring))
        inward = -out * RingLengths.of(ring).normals(places.at, pitch_px)
        told = [_hidden_run(run, places.points, inward, visible.on_line, look) for run in runs]
        hides = [one for one in told if one.state != "seen"]
    for index, one in enumerate(hides):
        label[one.places] = index + 1
    starts = distinct(np.concatenate([[0], np.flatnonzero(label != np.roll(label, 1))]))
    stretches = []
    for first, last in zip(starts, [*starts[1:], len(label)], strict=True):
        begin, end = float(places.at[first]), float(places.at[last]) if last < len(label) else places.whole
        kind = int(label[first])
        if kind > 0:
            one = hides[kind - 1]
            bound_px = bounds.whole_px + _BEND * one.length
            stretches.append(Stretch(number, begin, end, one.state, "object", bound_px, one.straight))
        else:
            by: Hider | None = "compound" if kind == -1 else None
            own_px = bounds.whole_px if kind != -2 else float(sure[first:last].max())
            stretches.append(Stretch(number, begin, end, "seen", by, own_px))
    return tuple(stretches)


@dataclass(frozen=True, eq=False)
class _HiddenRun:
    """A run of places on a ring, by their indices: whether it is bridged or covered, or `seen` where what lies there
    lies beside the block alone; whether along a line, and its length, pixels.
    """

    places: Indices
    state: State
    straight: bool
    length: float


def _hidden_run(run: Indices, place: Float64s, inward: Float64s, on_line: Float64s, look: TableLook) -> _HiddenRun:
    """What a run of the places (N, 2), pixels, that seem hidden rests on. inward: unit normals into the material at all
    places, (N, 2); on_line: the witnesses that lie on the ring, (M, 2).

    A thing hides an edge only where it lies on both sides of it. Where comb is seen right up to a line that the sides
    of a run agree on, it lies beside the block, or is a groove or a print of the table.
    """
    path = place[run]
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    if len(run) == len(place):
        return _HiddenRun(run, "covered", straight=False, length=length)
    sides = _flank(place, run[0], -1), _flank(place, run[-1], 1)
    support = [_support(side, on_line, look.pitch_px) for side in sides]
    state, straight = _bridged(path, sides, look.pitch_px) if min(support) >= _FLANK_WITNESSES else ("covered", False)
    beside = len(run) < sum(map(len, sides)) and sum(support) >= _SEEN_BESIDE and length < _LONGEST * look.pitch_px
    short = state == "bridged" and length < _ON_CURVES * look.pitch_px
    goes_on = beside and (short or _goes_on(run, place, on_line, sides, support, look.pitch_px))
    if goes_on and _comb_inside(path, inward[run], look):
        state = "seen"
    return _HiddenRun(run, state, straight, length)


def _bridged(path: Float64s, sides: tuple[Float64s, Float64s], pitch_px: float) -> tuple[State, bool]:
    """Whether a path (N, 2) goes on in its sides, and whether along a line."""
    before, after = sides
    path = np.concatenate([before[:4][::-1], path, after[:4]])
    if _is_straight(path, pitch_px):
        return "bridged", True
    smooth = np.abs(turns_deg(path[::2])).max(initial=0.0) < _SMOOTH_DEG
    return ("bridged" if smooth else "covered"), False


def _comb_inside(path: Float64s, inward: Float64s, look: TableLook) -> bool:
    """Whether comb lies all along the inside of a path (N, 2)."""
    for depth, in_thing, on_table in zip(_DEPTHS, _IN_THING, _ON_TABLE, strict=True):
        inside = path + depth * look.pitch_px * inward
        if np.mean(look.foreign_at(inside) <= 0.0) > in_thing or np.mean(look.table_at(inside)) > on_table:
            return False
    return True


def _goes_on(
    run: Indices,
    place: Float64s,
    on_line: Float64s,
    sides: tuple[Float64s, Float64s],
    support: list[int],
    pitch_px: float,
) -> bool:
    """Whether a run goes on straight in what is seen beside it, and where that is little, up to a corner, the next edge
    is seen.
    """
    for end, way, side, own in zip((run[0], run[-1]), (-1, 1), sides, support, strict=True):
        next_edge = _flank(place, end + way * (len(side) - 1), way)
        if own < _FLANK_WITNESSES and _support(next_edge, on_line, pitch_px) < _FLANK_WITNESSES:
            return False
    before, after = sides  # without the last two places, which may lie past a corner
    return _is_straight(np.concatenate([before[:-2][::-1], place[run], after[:-2]]), pitch_px)


def _is_straight(path: Float64s, pitch_px: float) -> bool:
    """Whether a path (N, 2) hardly leaves its chord."""
    chord = path[-1] - path[0]
    chord = chord / max(float(np.hypot(*chord)), 1e-9)
    off = np.abs((path - path[0]) @ np.array([-chord[1], chord[0]]))
    return float(off.max()) < max(_STRAIGHT_PX, _STRAIGHT_PITCHES * pitch_px)


def _support(side: Float64s, on_line: Float64s, pitch_px: float) -> int:
    """At how many places (N, 2) of a side a witness lies."""
    return int(np.count_nonzero(nearest(on_line, side) < _SPACING_PITCHES * pitch_px))


def _flank(place: Float64s, end: int, way: int) -> Float64s:
    """The outline before (-1) or behind (1) the end of a run, (N, 2), up to the next corner: an edge beyond it says
    nothing of where this one lies.
    """
    count = max(3, round(_FLANK_PITCHES / _SPACING_PITCHES))
    path = place[(end + way * np.arange(1, count + 1)) % len(place)]
    corners = np.flatnonzero(np.abs(turns_deg(path)) > _SMOOTH_DEG)
    return path[: corners[0] + 2] if len(corners) else path
