"""Stretches along a contour, told along the polygon that was made of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from contour.edge.stretches import Stretch
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour

_SLIVER_PX = 1.0
"""Shorter stretches are nothing that a picture shows: seen ones join a neighbour, hidden ones are drawn out to it."""

_MOST_SAMPLES = 512
"""Places along one hidden stretch that are looked for on the polygon."""

_WORSE = {"seen": 0, "bridged": 1, "covered": 2}


def carried(stretches: Sequence[Stretch], traced: Contour, polygon: Contour) -> tuple[Stretch, ...]:
    """The stretches of `traced`'s rings along those of `polygon`, both in pixels: again without gaps, ring by ring.

    The polygon has the same rings in the same order and direction, with other vertices, moved by little or a margin.
    Whatever is nearest to a hidden place is hidden: no seen stretch gains by what a polygon leaves out.
    """
    told: list[Stretch] = []
    for number, (one, other) in enumerate(zip(traced.rings, polygon.rings, strict=True)):
        own = [stretch for stretch in stretches if stretch.ring == number]
        told += _on_ring(own, RingLengths.of(one), RingLengths.of(other))
    return tuple(told)


def _on_ring(own: list[Stretch], traced: RingLengths, polygon: RingLengths) -> list[Stretch]:
    around = polygon.length
    hidden = [(_span(stretch, traced, polygon), stretch) for stretch in own if stretch.state != "seen"]
    begun = polygon.feet(traced.at(np.array([stretch.from_px for stretch in own])))
    ends = [end % around for (low, long), _ in hidden for end in (low, low + long)]
    cuts = np.array(sorted({0.0, around, *begun, *ends}))
    middles = (cuts[:-1] + cuts[1:]) / 2
    nearest = np.searchsorted([stretch.to_px for stretch in own], traced.feet(polygon.at(middles)))
    pieces = []
    for low, high, index in zip(cuts[:-1].tolist(), cuts[1:].tolist(), nearest.tolist(), strict=True):
        here = [own[min(index, len(own) - 1)]]
        here += [stretch for (start, long), stretch in hidden if ((low + high) / 2 - start) % around < long]
        worst = max(here, key=lambda stretch: (_WORSE[stretch.state], stretch.bound_px))
        pieces.append(replace(worst, from_px=low, to_px=high))
    return _joined(_without_slivers(pieces))


def _span(stretch: Stretch, traced: RingLengths, polygon: RingLengths) -> tuple[float, float]:
    """Where on the polygon's ring all that is nearest to the stretch begins, and how long it is, pixels."""
    long = stretch.length_px
    count = int(np.clip(np.ceil(long) + 1, 2, _MOST_SAMPLES))
    feet = polygon.feet(traced.at(np.linspace(stretch.from_px, stretch.to_px, count)))
    steps = np.diff(feet)
    # From foot to foot the shorter way around: what lies between two hidden places is hidden, however they jump.
    way = np.concatenate([[0.0], np.cumsum(steps - polygon.length * np.round(steps / polygon.length))])
    widened = max(float(np.ptp(way)), _SLIVER_PX)
    return float(feet[0] + (way.min() + way.max() - widened) / 2), min(widened, polygon.length)


def _without_slivers(pieces: list[Stretch]) -> list[Stretch]:
    """The pieces of a ring, each sliver joined to the worse of its neighbours where that is no better than itself."""
    kept: list[Stretch] = []
    waiting = pieces[::-1]
    while waiting:
        piece = waiting.pop()
        beside = [*kept[-1:], *waiting[-1:]]
        worse = max(beside, key=lambda other: _WORSE[other.state], default=None)
        short = piece.length_px < _SLIVER_PX
        if worse is None or not short or _WORSE[worse.state] < _WORSE[piece.state]:
            kept.append(piece)
        elif kept and worse is kept[-1]:
            kept[-1] = _one(worse, piece)
        else:
            waiting[-1] = _one(worse, piece)
    return kept


def _joined(pieces: list[Stretch]) -> list[Stretch]:
    """Neighbours that say the same as one."""
    kept = pieces[:1]
    for piece in pieces[1:]:
        if piece == replace(kept[-1], from_px=piece.from_px, to_px=piece.to_px):
            kept[-1] = _one(kept[-1], piece)
        else:
            kept.append(piece)
    return kept


def _one(worse: Stretch, other: Stretch) -> Stretch:
    """Two neighbours as one stretch, which is what the worse of them is."""
    return replace(
        worse,
        from_px=min(worse.from_px, other.from_px),
        to_px=max(worse.to_px, other.to_px),
        bound_px=max(worse.bound_px, other.bound_px),
        straight=worse.straight and other.straight,
    )
