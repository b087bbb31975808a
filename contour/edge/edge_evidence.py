"""What each stretch of a fitted ring rests on: on ends seen, or on a line carried across what hides them."""

from __future__ import annotations

import numpy as np

from contour.edge.ring_places import places_along, runs_of, turns_deg
from contour.edge.stretches import Hider, State, Stretch
from contour.edge.table_look import TableLook
from contour.edge.visible_edge import SPACING_PITCHES, VisibleRing
from contour.geometry.arrays import Float64s, Indices, distinct
from contour.geometry.rectifier import Rectifier
from contour.geometry.rings import Ring
from contour.geometry.signed_distance import nearest
from contour.outline.uncertainty import RingBounds

_SHORTEST_PITCHES = 1.0
# So many ends of walls at a thing lie so near to a shorter one that is hidden: it takes a corner off.
_FEW, _AT_THING_PITCHES = 2, 0.5
# A bridge joins two sides: walls seen over so much of each, and between them no more of a bend than this.
_FLANK_PITCHES, _FLANK_WITNESSES = 6.0, 3
_STRAIGHT_PITCHES, _STRAIGHT_PX = 0.02, 0.7
_SMOOTH_DEG = 12.0
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
    places = places_along(ring, SPACING_PITCHES * pitch_px, rectifier)
    sure = bounds.at(places.points)
    hidden = visible.hidden(places.points, look) if len(visible.distrusted) else np.zeros(len(sure), np.bool_)
    fills = visible.evidence.points[visible.filled & visible.fitted.inlier]
    filled = ~hidden & (nearest(places.points, fills) < 2 * SPACING_PITCHES * pitch_px)
    told = places.points[hidden | filled]
    # Walls that end inside beside a thing end at it: there its own bound counts.
    unsure = (sure > _LESS_SURE * bounds.whole_px) & (nearest(places.points, told) > _FOOT_PITCHES * pitch_px)
    label = np.where(unsure, -2, np.where(filled, -1, 0))
    # Shorter ones are gaps between ends, as there are everywhere, but where walls end at a thing.
    runs = [
        run
        for run in runs_of(hidden)
        if len(run) > _SHORTEST_PITCHES / SPACING_PITCHES
        or np.count_nonzero(nearest(visible.distrusted, places.points[run]) < _AT_THING_PITCHES * pitch_px) >= _FEW
    ]
    for index, run in enumerate(runs):
        label[run] = index + 1
    states = [_run_state(run, places.points, visible.on_line, pitch_px) for run in runs]
    starts = distinct(np.concatenate([[0], np.flatnonzero(label != np.roll(label, 1))]))
    stretches = []
    for first, last in zip(starts, [*starts[1:], len(label)], strict=True):
        begin, end = float(places.at[first]), float(places.at[last]) if last < len(label) else places.whole
        kind = int(label[first])
        if kind > 0:
            state, straight, length = states[kind - 1]
            bound_px = bounds.whole_px + _BEND * length
            stretches.append(Stretch(number, begin, end, state, "object", bound_px, straight))
        else:
            by: Hider | None = "compound" if kind == -1 else None
            own_px = bounds.whole_px if kind != -2 else float(sure[first:last].max())
            stretches.append(Stretch(number, begin, end, "seen", by, own_px))
    return tuple(stretches)


def _run_state(run: Indices, place: Float64s, on_line: Float64s, pitch_px: float) -> tuple[State, bool, float]:
    """Whether a hidden run is bridged or covered, whether along a line, and its length, pixels."""
    count = len(place)
    path = place[run]
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    if len(run) == count:
        return "covered", False, length
    before, after = _flank(place, run[0], -1), _flank(place, run[-1], 1)
    support = [np.count_nonzero(nearest(on_line, side) < SPACING_PITCHES * pitch_px) for side in (before, after)]
    if min(support) < _FLANK_WITNESSES:
        return "covered", False, length
    path = np.concatenate([before[:4][::-1], path, after[:4]])
    chord = path[-1] - path[0]
    chord = chord / max(float(np.hypot(*chord)), 1e-9)
    off = np.abs((path - path[0]) @ np.array([-chord[1], chord[0]]))
    if float(off.max()) < max(_STRAIGHT_PX, _STRAIGHT_PITCHES * pitch_px):
        return "bridged", True, length
    if np.abs(turns_deg(path[::2])).max(initial=0.0) < _SMOOTH_DEG:
        return "bridged", False, length
    return "covered", False, length


def _flank(place: Float64s, end: int, way: int) -> Float64s:
    """The outline before (-1) or behind (1) the end of a run, (N, 2), up to the next corner: an edge beyond it says
    nothing of where this one lies.
    """
    count = max(3, round(_FLANK_PITCHES / SPACING_PITCHES))
    path = place[(end + way * np.arange(1, count + 1)) % len(place)]
    corners = np.flatnonzero(np.abs(turns_deg(path)) > _SMOOTH_DEG)
    return path[: corners[0] + 2] if len(corners) else path
