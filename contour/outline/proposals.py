"""Proposed lines and arcs: robust fits to windows of neighbouring witnesses, from four of them up to the whole ring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Complexes, Indices
from contour.outline.lines_and_arcs import (
    Models,
    distance,
    distance_from_lines,
    join,
    refine,
    through_pairs,
    through_triples,
)
from contour.outline.witnesses import Witnesses, cost, weights, window_cost

# Pairs and triples of sample places (shares of the window) that a fit starts from; far ones fix direction best.
_PAIRS = np.array(
    [
        (0.0, 1.0),
        (0.13, 0.87),
        (0.27, 1.0),
        (0.0, 0.6),
        (0.4, 1.0),
        (0.07, 0.8),
        (0.2, 0.67),
        (0.33, 0.93),
        (0.0, 0.47),
        (0.53, 1.0),
    ]
)
_TRIPLES = np.array(
    [
        (0.0, 0.47, 1.0),
        (0.13, 0.6, 1.0),
        (0.0, 0.4, 0.87),
        (0.13, 0.53, 0.87),
        (0.27, 0.67, 1.0),
        (0.0, 0.33, 0.73),
        (0.07, 0.53, 0.93),
        (0.2, 0.6, 0.93),
        (0.07, 0.4, 0.8),
        (0.2, 0.47, 0.8),
    ]
)
# Sharper bends than these (radius in pitches) show in no more than two or three witnesses: corners, dents and debris.
_LEAST_RADIUS_CONVEX = 1.25
_LEAST_RADIUS_CONCAVE = 1.05
_REDUNDANT = 2.0
# Rings of so few witnesses, holes mostly, are looked at from every place.
FEW = 64
_SAME, _ROUNDING = 0.1, 1e-9


@dataclass(frozen=True, eq=False)
class Proposals:
    """Models with the stretch of witnesses they may explain: first index and length (cyclic), and their gain in
    nats."""

    models: Models
    bend: Bools
    first: Indices
    length: Indices
    gain: np.ndarray[tuple[int], np.dtype[np.float64]]

    def __len__(self) -> int:
        return len(self.first)

    def take(self, keep: Indices | Bools) -> Proposals:
        """The proposals at `keep`."""
        return Proposals(self.models.take(keep), self.bend[keep], self.first[keep], self.length[keep], self.gain[keep])


def gather(parts: list[Proposals]) -> Proposals:
    """All proposals of `parts`."""
    return Proposals(
        join([part.models for part in parts]),
        np.concatenate([part.bend for part in parts]),
        np.concatenate([part.first for part in parts]),
        np.concatenate([part.length for part in parts]),
        np.concatenate([part.gain for part in parts]),
    )


def samples(count: int, first: Indices, length: Indices, places: int) -> Indices:
    """`places` witness indices spread over each stretch, shape (K, places), cyclic; short stretches repeat some."""
    share = np.linspace(0.0, 1.0, places)
    offset = np.rint(share[None, :] * np.maximum(length[:, None] - 1, 0)).astype(np.intp)
    return (first[:, None] + offset) % count


def propose(witnesses: Witnesses) -> Proposals:
    """Lines and arcs on windows of 4, 8, 16, ... witnesses and on the whole ring, without those a longer window
    explains."""
    count = len(witnesses)
    if count <= FEW:
        return _propose_everywhere(witnesses)
    sizes = [size for size in (4, 6, *(8 * 2**k for k in range(11))) if size < count] + [count]
    levels = [
        level
        for group in ([z for z in sizes if z <= 8], [z for z in sizes if z > 8])
        for level in _levels(witnesses, group)
    ]
    kept: list[Proposals] = []
    longer: list[Proposals] = []
    for level in reversed(levels):
        for fits in level:
            worth = fits.take(fits.gain > 0.0)
            kept.append(worth.take(~_explained(witnesses, worth, longer)) if len(worth) and longer else worth)
        longer = level
    return gather(kept)


def _propose_everywhere(witnesses: Witnesses) -> Proposals:
    """Lines and arcs on windows of 2, 3, 4, 6, ... witnesses from every one on, each different one once.

    A ring of few witnesses has edges of two or three of them.
    """
    count = len(witnesses)
    sizes = [size for size in (2, 3, 4, 6, 8, 12, 16, 24, 32) if size < count] + [count]
    parts = []
    for group in ([z for z in sizes if z <= 8], [z for z in sizes if z > 8]):
        parts += [fits for level in _levels(witnesses, group) for fits in level]
    fits = gather(parts)
    fits = fits.take(fits.gain > 0.0)
    return fits.take(_different(witnesses, fits))


def _different(witnesses: Witnesses, fits: Proposals) -> Indices:
    """Indices of proposals, best first, without those that save about the same as a better one at every witness."""
    signed = distance(fits.models.take((slice(None), None)), witnesses.points[None, :])
    saved = np.maximum(witnesses.cap_inside - cost(witnesses, signed), 0.0)
    total = saved.sum(axis=1)
    # By what they save in all: what two save differs by no less than that does, so that only near ones are compared.
    rising = np.argsort(total)
    saved, total, gain = saved[rising], total[rising], fits.gain[rising]
    begin = np.searchsorted(total, total / (1.0 + _SAME) - _ROUNDING).tolist()
    end = np.searchsorted(total, total / (1.0 - _SAME) + _ROUNDING, side="right").tolist()
    left, most = np.ones(len(fits), np.bool_), _SAME * total
    kept: list[int] = []
    for best in np.lexsort((rising, -gain)).tolist():
        if left[best]:
            kept.append(best)
            near = slice(begin[best], end[best])
            apart = saved[near] - saved[best]
            left[near] &= np.abs(apart, out=apart).sum(axis=1) > most[near]
    return rising[kept]


def _levels(witnesses: Witnesses, sizes: list[int]) -> list[list[Proposals]]:
    """Window fits of each size, lines and (from six witnesses on, five of few) arcs, all fitted in one batch."""
    if not sizes:
        return []
    count = len(witnesses)
    least_bend = 5 if count <= FEW else 6
    plan = [
        (np.arange(0, count, _stride(size, count), dtype=np.intp), size, bend)
        for size in sizes
        for bend in ((False, True) if size >= least_bend else (False,))
    ]
    first = np.concatenate([begins for begins, _, _ in plan])
    length = np.concatenate([np.full(len(begins), size) for begins, size, _ in plan])
    bends = np.concatenate([np.full(len(begins), bend) for begins, _, bend in plan])
    fits = window_fits(witnesses, first, length, bends, 8 if sizes[-1] <= 8 else 16)
    levels: dict[int, list[Proposals]] = {}
    begin = 0
    for begins, size, _ in plan:
        levels.setdefault(size, []).append(fits.take(np.arange(begin, begin + len(begins))))
        begin += len(begins)
    return list(levels.values())


def _stride(size: int, count: int) -> int:
    if count <= FEW:
        return 1 if size < count else count
    return max(1, size // 4 if size != 6 else 2) if size < count else count


def window_fits(witnesses: Witnesses, first: Indices, length: Indices, bend: Bools, places: int) -> Proposals:
    """A robust line or arc for each window that begins at `first`: the best of a few through its points, refined
    twice."""
    index = samples(len(witnesses), first, length, places)
    points = witnesses.points[index]
    return _refined(witnesses, _best_starts(witnesses, points, index, bend), bend, (first, length), index)


def _refined(
    witnesses: Witnesses, starts: Models, bend: Bools, window: tuple[Indices, Indices], index: Indices
) -> Proposals:
    points, (first, length) = witnesses.points[index], window
    for _ in range(2):
        starts = refine(
            starts, points, weights(witnesses, distance(starts.take((slice(None), None)), points), index), bend
        )
    signed = distance(starts.take((slice(None), None)), points)
    saved = witnesses.cap_inside[index] - cost(witnesses, signed, index)
    along = (starts.tangent[:, None] * witnesses.normal[index].conj()).imag.mean(axis=1)
    sound = (along > np.where(bend, 0.2, 0.5)) & gentle(witnesses, starts)
    return Proposals(
        starts, bend, first, length, np.where(sound, saved.sum(axis=1) * (length / index.shape[1]) - 8.0, -1.0)
    )


def renewed(witnesses: Witnesses, fits: Proposals) -> Proposals:
    """The proposals fitted to their windows once more, by the noise that is known by now."""
    index = samples(len(witnesses), fits.first, fits.length, 16)
    again = _refined(witnesses, fits.models, fits.bend, (fits.first, fits.length), index)
    return again.take(again.gain > 0.0)


def gentle(witnesses: Witnesses, models: Models) -> Bools:
    """True where a model bends no more sharply than witnesses a pitch apart can show."""
    turn = models.curvature * witnesses.pitch_px
    mild: Bools = (turn < 1.0 / _LEAST_RADIUS_CONVEX) & (turn > -1.0 / _LEAST_RADIUS_CONCAVE)
    return mild


def _best_starts(witnesses: Witnesses, points: Complexes, index: Indices, bend: Bools) -> Models:
    """Of the lines through pairs (circles through triples where `bend`) of each row's points, the cheapest."""
    found = []
    rows = [np.flatnonzero(~bend), np.flatnonzero(bend)]
    for row, shares in zip(rows, (_PAIRS, _TRIPLES), strict=True):
        own = points[row]
        spots = np.rint(shares * (points.shape[1] - 1)).astype(np.intp)
        picked = own[:, spots]
        through, off = (through_triples, distance) if shares is _TRIPLES else (through_pairs, distance_from_lines)
        starts = through(*np.moveaxis(picked, 2, 0))
        signed = off(starts.take((..., None)), own[:, None, :])
        best = cost(witnesses, signed, index[row][:, None, :]).sum(axis=2).argmin(axis=1)
        found.append(starts.take((np.arange(len(row)), best)))
    order = np.argsort(np.concatenate(rows), kind="stable")
    return join(found).take(order)


def _explained(witnesses: Witnesses, fits: Proposals, longer: list[Proposals]) -> Bools:
    """True where one of the longer windows about the same place explains a window's own witnesses as well."""
    count = len(witnesses)
    index = samples(count, fits.first, fits.length, min(int(fits.length[0]), 8))
    scale = float(fits.length[0]) / index.shape[1]
    own = window_cost(witnesses, fits.models, index).sum(axis=1)
    explained = np.zeros(len(fits), np.bool_)
    for other in longer:
        left = np.flatnonzero(~explained)
        stride = int(other.first[1] - other.first[0]) if len(other) > 1 else count
        middle = fits.first[left] + fits.length[left] // 2 - other.length[0] // 2
        near = (np.rint(middle / stride).astype(np.intp)[:, None] + np.array([-1, 0, 1])) % len(other)
        there = index[left][:, None, :]
        theirs = cost(witnesses, distance(other.models.take(near).take((..., None)), witnesses.points[there]), there)
        least = np.where(other.gain[near] > 0.0, theirs.sum(axis=2), np.inf).min(axis=1)
        explained[left] = (least - own[left]) * scale < _REDUNDANT
    return explained
