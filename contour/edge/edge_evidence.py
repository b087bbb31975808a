"""What each stretch of a fitted ring rests on: on ends seen, or on a line carried across what hides them."""

from __future__ import annotations

import numpy as np

from contour.edge.hidden_runs import SPACING_PITCHES, hidden_run
from contour.edge.ring_places import places_along, runs_of
from contour.edge.stretches import Hider, Stretch
from contour.edge.table_look import TableLook
from contour.edge.visible_edge import VisibleRing
from contour.geometry.arrays import distinct
from contour.geometry.rectifier import Rectifier
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring, signed_area
from contour.geometry.signed_distance import nearest
from contour.outline.uncertainty import RingBounds

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
    places = places_along(ring, SPACING_PITCHES * pitch_px, rectifier)
    sure = bounds.at(places.points)
    hidden = visible.hidden(places.points, look) if len(visible.distrusted) else np.zeros(len(sure), np.bool_)
    fills = visible.evidence.points[visible.filled & visible.fitted.inlier]
    filled = ~hidden & (nearest(places.points, fills) < 2 * SPACING_PITCHES * pitch_px)
    known = places.points[hidden | filled]
    # Walls that end inside beside a thing end at it: there its own bound counts.
    unsure = (sure > _LESS_SURE * bounds.whole_px) & (nearest(places.points, known) > _FOOT_PITCHES * pitch_px)
    label = np.where(unsure, -2, np.where(filled, -1, 0))
    # Shorter ones are gaps between ends, as there are everywhere, but where walls end at a thing.
    runs = [
        run
        for run in runs_of(hidden)
        if len(run) > _SHORTEST_PITCHES / SPACING_PITCHES
        or np.count_nonzero(nearest(visible.distrusted, places.points[run]) < _AT_THING_PITCHES * pitch_px) >= _FEW
    ]
    # Fitted rings have the material on their left, which is where these point from.
    out = np.sign(signed_area(ring) * signed_area(visible.fitted.ring))
    inward = -out * RingLengths.of(ring).normals(places.at, pitch_px)
    told = [hidden_run(run, places.points, inward, visible.on_line, look) for run in runs]
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
