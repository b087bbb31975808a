"""Runs of a labelling as segments, refitted, and the next round's proposals made from them and their neighbours."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contour.geometry.arrays import Bools, Float64s, Indices, rolled
from contour.outline.labelling import PRICE_ARC, PRICE_LINE
from contour.outline.lines_and_arcs import Models, distance, feet, refine, through_pairs, through_triples
from contour.outline.proposals import Proposals, gather, gentle, window_fits
from contour.outline.witnesses import Witnesses, weights, window_cost

_MOST_PLACES = 160
# Witnesses by which a stretch inside of the outline is shifted, to share the rest with what lies beside it.
_SHARED = (2, 4)
_STEPS = 4


@dataclass(frozen=True, eq=False)
class Segments:
    """Pieces of the outline in travel order, one model each: first witness and number of witnesses (cyclic), shape
    (S,)."""

    models: Models
    bend: Bools
    first: Indices
    length: Indices

    def __len__(self) -> int:
        return len(self.first)

    def members(self, k: int, count: int) -> Indices:
        """The witnesses of segment k, in order, of `count` around the ring."""
        return np.asarray((self.first[k] + np.arange(self.length[k])) % count, np.intp)

    def owner(self, count: int) -> Indices:
        """Segment of each of the `count` witnesses, shape (N,)."""
        owner = np.repeat(np.arange(len(self)), self.length)
        return rolled(owner, int(self.first[0]))[:count]


def runs(label: Indices, proposals: Proposals) -> Segments:
    """The runs of a labelling, (N,), as segments."""
    first = np.flatnonzero(label != rolled(label, 1))
    if not len(first):
        first = np.zeros(1, dtype=np.intp)
    length = np.diff(first, append=first[0] + len(label))
    chosen = label[first]
    return Segments(proposals.models.take(chosen), proposals.bend[chosen], first, length)


def stretch(count: int, first: Indices, length: Indices) -> tuple[Indices, Float64s]:
    """Witness indices of each stretch, shape (K, m), and how many witnesses each entry stands for (0: padding)."""
    places = min(int(length.max()), _MOST_PLACES)
    rank = np.arange(places)[None, :]
    step = np.maximum(length[:, None] / places, 1.0)
    offset = np.floor((rank + 0.5) * step).astype(np.intp)
    multiplicity = np.where(offset < length[:, None], step, 0.0)
    return (first[:, None] + np.minimum(offset, length[:, None] - 1)) % count, multiplicity


def refitted(witnesses: Witnesses, segments: Segments) -> Segments:
    """The segments, their models fitted robustly to their own witnesses."""
    index, multiplicity = stretch(len(witnesses), segments.first, segments.length)
    return replace(segments, models=fitted(witnesses, segments.models, segments.bend, index, multiplicity))


def fitted(witnesses: Witnesses, models: Models, bend: Bools, index: Indices, multiplicity: Float64s) -> Models:
    """Models fitted robustly to the stretches of witnesses at `index`, as `stretch` tells them."""
    points = witnesses.points[index]
    for _ in range(_STEPS):
        signed = distance(models.take((slice(None), None)), points)
        models = refine(models, points, weights(witnesses, signed, index) * multiplicity, bend)
    return models


def around(witnesses: Witnesses, segments: Segments) -> Proposals:
    """Proposals near the present segments: each alone, with its next, with its next two; each as a line and as an
    arc."""
    count, total = len(witnesses), len(segments)
    span = np.arange(1, min(3, total) + 1)[:, None]
    last = (np.arange(total) + span - 1) % total
    length = (segments.first[last] - segments.first) % count + segments.length[last]
    length = np.minimum(np.where(span == 1, segments.length, length), count).repeat(2, axis=0).ravel()
    first = np.tile(segments.first, 2 * len(span))
    free = np.tile(np.repeat([False, True], total), len(span))
    index, multiplicity = stretch(count, first, length)
    models = fitted(witnesses, _starts(witnesses, segments, last), free, index, multiplicity)
    # Over calling all of them outliers.
    saved = (witnesses.cap_inside[index] - window_cost(witnesses, models, index)) * multiplicity
    gain = np.where(gentle(witnesses, models), saved.sum(axis=1) - np.where(free, PRICE_ARC, PRICE_LINE), -1.0)
    present = (np.arange(len(free)) < 2 * total) & (free == np.tile(segments.bend, 2 * len(span)))
    gain = np.where(present, np.maximum(gain, 0.0) + 1e4, gain)
    parts = [Proposals(models, free, first, length, gain)]
    if total > 1 and count > 9:
        # What hides between two segments: a short edge or a rounding that no window of the first round fell upon.
        size = np.repeat([5, 9, 5, 9], total)
        begins = (np.tile(segments.first, 4) - size // 2) % count
        parts.append(window_fits(witnesses, begins, size, np.repeat([False, True], 2 * total), 9))
    begins, size = _unexplained(witnesses, segments)
    if len(begins):
        twice = np.repeat([False, True], len(begins))
        parts.append(window_fits(witnesses, np.tile(begins, 2), np.tile(size, 2), twice, 16))
    merged = gather(parts)
    return merged.take(merged.gain > 0.0)


def _unexplained(witnesses: Witnesses, segments: Segments) -> tuple[Indices, Indices]:
    """Stretches of four and more witnesses in a row, single ones apart, that lie off their segments: first and length.

    Each comes as it is, and longer by one at either end. Those inside come shifted, too: what an arc cuts off of an
    edge lies half on that arc. Those outside may be dust.
    """
    count = len(witnesses)
    signed = distance(segments.models.take(segments.owner(count)), witnesses.points)
    off = np.abs(signed) > 3.0 * np.where(signed > 0.0, witnesses.outer, witnesses.inner)
    off |= rolled(off, 1) & rolled(off, -1)
    first = np.flatnonzero(off & ~rolled(off, 1))
    length = (np.flatnonzero(off & ~rolled(off, -1)) - first) % count + 1 if len(first) else first
    if len(first) and off[0] and off[-1]:
        last = np.flatnonzero(off & ~rolled(off, -1))
        length = (rolled(last, -1) - first) % count + 1
    long = (length >= 4) & (length + 2 < count)
    first, length = first[long], length[long]
    begins, sizes = [first, first - 1], [length, length + 2]
    inside = signed[(first + length // 2) % count] < 0.0
    for shift in _SHARED:
        begins += [(first + shift)[inside], (first - 2 * shift)[inside]]
        sizes += 2 * [(length + shift)[inside]]
    return np.concatenate(begins) % count, np.minimum(np.concatenate(sizes), count)


def _starts(witnesses: Witnesses, segments: Segments, last: Indices) -> Models:
    """First guesses of the models of unions that begin with each segment and end with the `last`, (P, S): of a line and
    of an arc through feet on them, (P, 2, S), flat.
    """
    begin = np.broadcast_to(np.arange(len(segments)), last.shape)
    following = (begin + 1) % len(segments)
    which = np.stack([begin, last, begin, begin, following, begin, last])
    share = np.array([0.1, 0.9, 0.08, 0.5, 0.5, 0.95, 0.92])[:, None, None]
    place = segments.first[which] + np.floor(share * segments.length[which]).astype(np.intp)
    place = np.minimum(place, segments.first[which] + segments.length[which] - 1) % len(witnesses)
    foot, _ = feet(segments.models.take(which), witnesses.points[place])
    alone, present = begin == last, segments.models.take(begin)
    inner = np.where(alone, foot[3], np.where(last == following, foot[5], foot[4]))
    line = _choose(alone & ~segments.bend, present, through_pairs(foot[0], foot[1]))
    arc = _choose(alone & segments.bend, present, through_triples(foot[2], inner, foot[6]))
    both = _choose(np.array([[True], [False]]), line.take((slice(None), None)), arc.take((slice(None), None)))
    return Models(both.origin.ravel(), both.tangent.ravel(), both.curvature.ravel())


def _choose(mask: Bools, yes: Models, no: Models) -> Models:
    return Models(
        np.where(mask, yes.origin, no.origin),
        np.where(mask, yes.tangent, no.tangent),
        np.where(mask, yes.curvature, no.curvature),
    )
