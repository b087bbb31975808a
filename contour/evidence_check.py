"""The last word of wall-tips: an outline against the wall ends it was laid through."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contour.errors import NoBlockFound
from contour.geometry import Ring
from contour.ring_depth import depth_inside
from contour.tracing import Rectifier
from contour.wall_evidence import RingEvidence, WitnessKind

_FAR_OFF_PITCHES = 0.5
_IN_A_ROW = 4
# Along the edge: as many ends lie behind one another where cells are seen deep into a faint edge.
_ROW_PITCHES = 2.0


def check_against_evidence(evidence: RingEvidence, ring: Ring, pitch: float, rectifier: Rectifier | None) -> None:
    """Raise NoBlockFound where the ring passes four wall ends in a row, over two cells and more, by more than half a
    cell on one side.

    A ring that was fitted in the rectified plane is straight between its vertices there, and is looked at there: in the
    picture a lens bends a long edge by more than a small cell.
    """
    ends = evidence.kind != WitnessKind.OUTERMOST
    places = evidence.points
    if rectifier is not None:
        ring, places = rectifier.rectify(ring), rectifier.rectify(places)
    depth = depth_inside(ring, places)
    # Ends inside are passed rightly where outermost walls between them are met: foam has such inside.
    inside, outside = depth > _FAR_OFF_PITCHES * pitch, (depth < -_FAR_OFF_PITCHES * pitch)[ends]
    around = float(np.hypot(*(np.roll(evidence.coarse, -1, axis=0) - evidence.coarse).T).sum())
    every = np.ones(len(ends), dtype=bool)
    for off, which in ((inside, every), (outside, ends)):
        last = _row(off, evidence.position[which], around, _ROW_PITCHES * pitch)
        if last is not None:
            x, y = evidence.points[which][last]
            raise NoBlockFound(
                f"no block found: the outline that fits most wall ends passes those near ({x:.0f}, {y:.0f}) px by more "
                "than half a cell. Check that nothing lies against the block, and that its edge is in focus"
            )


def _row(off: NDArray[np.bool_], position: NDArray[np.float64], around: float, least: float) -> int | None:
    """The last of four and more in a row, `least` pixels and more apart at `position` on a ring `around` long."""
    count = len(off)
    starts = range(min(count, 1)) if off.all() else np.flatnonzero(off & ~np.roll(off, 1))
    for start in starts:
        ahead = off[(start + np.arange(count)) % count]
        stop = count - 1 if ahead.all() else int(ahead.argmin()) - 1
        last = int(start + stop) % count
        if stop + 1 >= _IN_A_ROW and (position[last] - position[start]) % around >= least:
            return last
    return None
