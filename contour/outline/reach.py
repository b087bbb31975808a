"""How far each model of a ring goes on without a witness: what an outline of broken cells leaves unseen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Complexes, Float64s, Indices
from contour.outline.lines_and_arcs import Models, feet
from contour.outline.witnesses import Witnesses


@dataclass(frozen=True, eq=False)
class Reach:
    """From each state's foot along its model to the nearest witness that lies on it, back and ahead: shape (N, A),
    pixels, 0 where none does."""

    back: Float64s
    ahead: Float64s


def reach(witnesses: Witnesses, models: Models, foot: Complexes, *, last: Indices, following: Indices) -> Reach:
    """The reach of each state: its model, foot and supporting witnesses (see `supports`), shape (N, A) each."""
    return Reach(_away(witnesses, models, foot, last), _away(witnesses, models, foot, following))


def supports(lies: Bools, place: Indices, begin: Indices, end: Indices) -> tuple[Indices, Indices]:
    """The witness at or before each entry, and at or after it, that `lies` on the same model; -1 where none does.

    Entries of one model run from `begin` to `end`, one for each witness (at `place`) that it may explain.
    """
    here = np.arange(len(place))
    last = np.maximum.accumulate(np.where(lies, here, -1))
    following = np.minimum.accumulate(np.where(lies, here, len(place))[::-1])[::-1]
    back = np.where(last >= begin, place[np.maximum(last, 0)], -1)
    ahead = np.where(following < end, place[np.minimum(following, len(place) - 1)], -1)
    return back, ahead


def _away(witnesses: Witnesses, models: Models, foot: Complexes, support: Indices) -> Float64s:
    there, _ = feet(models, witnesses.points[support])
    return np.where(support >= 0, np.abs(there - foot), 0.0)
