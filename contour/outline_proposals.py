"""Proposed lines and arcs: robust fits to windows of neighbouring witnesses, from four of them up to the whole ring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.outline_models import Index, Models, distance, join, refine, through_pairs, through_triples
from contour.outline_witnesses import Witnesses, cost, weights, window_cost

_SAMPLES = 16
# Pairs and triples of sample places (fractions of the window) that a fit starts from; far ones fix direction best.
_PAIRS = np.array([(0, 1), (0.07, 0.93), (0.13, 0.8), (0.2, 1), (0, 0.47), (0.53, 1), (0.27, 0.73), (0.33, 0.93), (0.07, 0.6), (0.4, 0.87)])
_TRIPLES = np.array(
    [(0, 0.47, 1), (0.07, 0.53, 0.93), (0.13, 0.6, 1), (0, 0.4, 0.8), (0.2, 0.6, 0.93), (0.07, 0.4, 0.73), (0.13, 0.47, 0.87), (0.27, 0.67, 1)]
)
_REDUNDANT = 2.0


@dataclass(frozen=True)
class Proposals:
    """Models with the stretch of witnesses they may explain: first index and length (cyclic), and their gain in nats."""

    models: Models
    bend: np.ndarray[tuple[int], np.dtype[np.bool_]]
    first: Index
    length: Index
    gain: np.ndarray[tuple[int], np.dtype[np.float64]]

    def __len__(self) -> int:
        return len(self.first)

    def take(self, keep: Index | np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Proposals:
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


def samples(count: int, first: Index, length: Index, places: int = _SAMPLES) -> Index:
    """Up to `places` witness indices spread over each stretch, shape (K, places), cyclic."""
    share = np.linspace(0.0, 1.0, places)
    offset = np.rint(share[None, :] * np.maximum(length[:, None] - 1, 0)).astype(np.intp)
    return (first[:, None] + offset) % count


def propose(witnesses: Witnesses) -> Proposals:
    """Lines and arcs on windows of 4, 8, 16, ... witnesses and on the whole ring, without those a longer window explains."""
    count = len(witnesses)
    sizes = [size for size in (4, 6, *(8 * 2**k for k in range(11))) if size < count] + [count]
    kept: list[Proposals] = []
    longer: list[Proposals] = []
    for size in reversed(sizes):
        level = [_window_fits(witnesses, size, bend) for bend in ((False, True) if size >= 6 else (False,))]
        for fits in level:
            worth = fits.gain > 0.0
            for other in longer:
                worth &= ~_explained(witnesses, fits, other)
            kept.append(fits.take(worth))
        longer = level
    return gather(kept)


def _window_fits(witnesses: Witnesses, size: int, bend: bool) -> Proposals:
    count = len(witnesses)
    stride = max(1, size // 4) if size < count else count
    return window_fits(witnesses, np.arange(0, count, stride, dtype=np.intp), size, bend)


def window_fits(witnesses: Witnesses, first: Index, size: int, bend: bool) -> Proposals:
    """A robust line or arc for each window of `size` witnesses that begins at `first`: the best of a few, refined twice."""
    count = len(witnesses)
    length = np.full(len(first), size, dtype=np.intp)
    places = min(size, _SAMPLES)
    index = samples(count, first, length, places)
    points = witnesses.points[index]
    spots = np.rint((_TRIPLES if bend else _PAIRS) * (places - 1)).astype(np.intp)
    picked = points[:, spots]
    if bend:
        starts = through_triples(picked[..., 0], picked[..., 1], picked[..., 2])
    else:
        starts = through_pairs(picked[..., 0], picked[..., 1])
    signed = distance(starts.take((..., None)), points[:, None, :])
    best = cost(witnesses, signed, index[:, None, :]).sum(axis=2).argmin(axis=1)
    models = starts.take((np.arange(len(first)), best))
    free = np.full(len(first), bend)
    for _ in range(2):
        row_weights = weights(witnesses, distance(models.take((slice(None), None)), points), index)
        models = refine(models, points, row_weights, free)
    signed = distance(models.take((slice(None), None)), points)
    saved = witnesses.cap_inside[index] - cost(witnesses, signed, index)
    along = (models.tangent[:, None] * witnesses.normal[index].conj()).imag.mean(axis=1)
    gain = np.where(along > 0.5 if not bend else along > 0.2, saved.sum(axis=1) * (size / places) - 8.0, -1.0)
    return Proposals(models, free, first, length, gain)


def _explained(witnesses: Witnesses, fits: Proposals, longer: Proposals) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """True where one of the longer windows about the same place explains a window's own witnesses as well."""
    if not len(fits) or not len(longer):
        return np.zeros(len(fits), dtype=bool)
    count = len(witnesses)
    index = samples(count, fits.first, fits.length, min(int(fits.length[0]), 8))
    points = witnesses.points[index]
    scale = float(fits.length[0]) / index.shape[1]
    own = window_cost(witnesses, fits.models, index).sum(axis=1)
    stride = int(longer.first[1] - longer.first[0]) if len(longer) > 1 else count
    middle = fits.first + fits.length // 2 - longer.length[0] // 2
    near = np.rint(middle / stride).astype(np.intp)[:, None] + np.array([-1, 0, 1])
    near = near % len(longer)
    signed = distance(longer.models.take(near).take((..., None)), points[:, None, :])
    theirs = cost(witnesses, signed, index[:, None, :]).sum(axis=2)
    theirs = np.where(longer.gain[near] > 0.0, theirs, np.inf).min(axis=1)
    explained: np.ndarray[tuple[int], np.dtype[np.bool_]] = (theirs - own) * scale < _REDUNDANT
    return explained
