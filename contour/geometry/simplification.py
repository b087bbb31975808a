"""A ring's fewest vertices within a tolerance, chosen among its own.

Every stretch of the ring that is left out stays within the tolerance of the *segment* that replaces it, ends
included. Then the distance holds both ways: the stretch runs from one end of the segment to the other, so while it
stays near, its foot point passes over all of the segment. That is the two-sided Hausdorff bound.

Two steps: Douglas-Peucker (1973) by levels, all stretches at once; then, among the vertices it keeps at a finer
tolerance, the fewest by a shortest path over the allowed shortcuts (Imai & Iri 1988), which are found by cones
(Chan & Chin 1996). Of several solutions with as few vertices the one that shifts least area is taken.
"""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Bools, Float64s, Indices, distinct
from contour.geometry.segments import BoxTree, distances_to_segments, self_meetings

_FINER = (0.0, 0.35, 0.6, 0.8)
"""Shares of the tolerance at which Douglas-Peucker offers candidates; the first that offers few enough is used. At 0
these are all vertices that bend, and the result has at most one vertex more than the fewest possible."""

_MOST_CANDIDATES = 1200
_MOST_WORK = 1_000_000
"""Bounds on the search, about 0.3 s: candidates, and candidates times the vertices that a shortcut passes over."""

_FIRST_REACH = 32

_MOST_CELLS = 1 << 19
"""Cells of one batch of cones: starts x reach."""


def simplify_indices(ring: Float64s, tolerance: float) -> Indices:
    """Indices of the vertices to keep, ascending, at least 3: the ring through them lies within `tolerance` both ways.

    `tolerance` is in the ring's unit. A simple ring stays simple. The choice does not depend on where the ring starts,
    except between equally good solutions. Rings of 3 vertices, and a tolerance of 0, keep all vertices that bend.
    """
    count = len(ring)
    if count <= 3:
        return np.arange(count, dtype=np.intp)
    anchor, opposite = _far_apart(ring)
    path = np.concatenate([ring[anchor:], ring[: anchor + 1]])
    forced = np.zeros(count + 1, np.bool_)
    forced[[0, (opposite - anchor) % count, count]] = True
    plain = _at_least_three(path, _douglas_peucker(path, forced, tolerance), tolerance)
    fewest = _fewest(path, plain, tolerance)
    chosen = _untangled(path, fewest, tolerance)
    if len(chosen) > len(fewest):
        # Douglas-Peucker's choice lies closer to the ring and may need fewer vertices put back.
        chosen = min(chosen, _untangled(path, np.flatnonzero(plain)[:-1], tolerance), key=len)
    return np.sort((chosen + anchor) % count)


def _far_apart(ring: Float64s) -> tuple[int, int]:
    """Indices of two vertices far apart, found by geometry alone; corners of the hull, so likely to be kept anyway."""
    first = np.lexsort((ring[:, 1], ring[:, 0]))[0]
    offset = ring - ring[first]
    one = int(np.argmax(np.einsum("ij,ij->i", offset, offset)))
    offset = ring - ring[one]
    return one, int(np.argmax(np.einsum("ij,ij->i", offset, offset)))


def _douglas_peucker(path: Float64s, forced: Bools, tolerance: float) -> Bools:
    """Mask of the vertices kept on an open path, `forced` among them (both ends are): all levels, each at once."""
    kept = forced.copy()
    bounds = np.flatnonzero(forced)
    begin, end = bounds[:-1], bounds[1:]
    while True:
        long = end - begin > 1
        begin, end = begin[long], end[long]
        if len(begin) == 0:
            return kept
        farthest, distance = _farthest(path, begin, end)
        split = distance > tolerance
        begin, end, farthest = begin[split], end[split], farthest[split]
        kept[farthest] = True
        begin, end = np.concatenate([begin, farthest]), np.concatenate([farthest, end])


def _farthest(path: Float64s, begin: Indices, end: Indices) -> tuple[Indices, Float64s]:
    """The vertex strictly between begin and end that is farthest from their segment, and how far, for each stretch."""
    counts = end - begin - 1
    first = np.cumsum(counts) - counts
    owner = np.repeat(np.arange(len(begin)), counts)
    index = np.arange(len(owner)) - first[owner] + begin[owner] + 1
    distance = distances_to_segments(path[index], path[begin[owner]], path[end[owner]])
    largest = np.maximum.reduceat(distance, first)
    hits = np.flatnonzero(distance == largest[owner])
    once = np.flatnonzero(np.diff(owner[hits], prepend=-1))
    return index[hits[once]], largest


def _at_least_three(path: Float64s, kept: Bools, tolerance: float) -> Bools:
    """The mask with a third vertex where all lies within the tolerance of one segment: the one farthest from it."""
    if np.count_nonzero(kept) > 3:
        return kept
    bounds = np.flatnonzero(kept)
    long = np.flatnonzero(np.diff(bounds) > 1)
    farthest, distance = _farthest(path, bounds[long], bounds[long + 1])
    forced = kept.copy()
    forced[farthest[np.argmax(distance)]] = True
    return _douglas_peucker(path, forced, tolerance)


def _fewest(path: Float64s, kept: Bools, tolerance: float) -> Indices:
    """Indices (without the path's end, which is its start) of as few vertices as the candidates allow."""
    plain = np.flatnonzero(kept)[:-1]
    if len(plain) <= 3 or tolerance <= 0:
        return plain
    passed_over = len(path) / len(plain)
    for share in _FINER:
        candidates = np.flatnonzero(_douglas_peucker(path, kept, share * tolerance))
        if len(candidates) <= min(_MOST_CANDIDATES, _MOST_WORK / passed_over):
            break
    else:
        return plain
    best = _shortest(path, candidates, tolerance)
    # The path's start is kept by force; started in the middle of the first solution, it may turn out needless.
    middle = best[len(best) // 2]
    turned = np.concatenate([path[middle:-1], path[: middle + 1]])
    candidates = np.append(np.sort((candidates[:-1] - middle) % (len(path) - 1)), len(path) - 1)
    again = (_shortest(turned, candidates, tolerance) + middle) % (len(path) - 1)
    solutions = [np.sort(solution) for solution in (again, best, plain) if len(solution) >= 3]
    return min(solutions, key=len)


def _shortest(path: Float64s, candidates: Indices, tolerance: float) -> Indices:
    """Fewest of the candidates (path indices, both ends among them) joined by allowed shortcuts; the end left out."""
    forward = _cones(path, candidates, tolerance)
    backward = _cones(path[::-1], (len(path) - 1) - candidates[::-1], tolerance)
    allowed = forward & backward[::-1, ::-1].T
    # Neighbours among the candidates are joined by Douglas-Peucker's own bound; rounding must not cut the path.
    allowed[np.arange(len(candidates) - 1), np.arange(1, len(candidates))] = True
    shifted = _area_shift(path, candidates)
    price = np.where(allowed, shifted / (shifted[allowed].sum() + 1.0), np.inf)
    cost = np.full(len(candidates), np.inf)
    before = np.zeros(len(candidates), np.intp)
    cost[0] = 0
    for k in range(len(candidates) - 1):
        through = cost[k] + 1 + price[k]
        before[through < cost] = k
        np.minimum(cost, through, out=cost)
    chosen = [len(candidates) - 1]
    while chosen[-1]:
        chosen.append(int(before[chosen[-1]]))
    return candidates[chosen[:0:-1]]


def _area_shift(path: Float64s, candidates: Indices) -> Float64s:
    """Area between the path and the shortcut from candidate i to j, shape (C, C), by sums of cross products."""
    centred = path - path.mean(axis=0)
    x, y = centred.T
    swept = np.concatenate([[0.0], np.cumsum(x[:-1] * y[1:] - x[1:] * y[:-1])])[candidates]
    x, y = x[candidates], y[candidates]
    chord = x[:, None] * y[None, :] - x[None, :] * y[:, None]
    return np.asarray(np.abs(swept[None, :] - swept[:, None] - chord) / 2)


def _cones(path: Float64s, starts: Indices, tolerance: float) -> Bools:
    """allowed[i, j]: the ray from starts[i] through starts[j] passes all path vertices between within `tolerance`."""
    allowed = np.zeros((len(starts), len(starts)), np.bool_)
    waiting = np.arange(len(starts) - 1)
    reach = _FIRST_REACH
    while len(waiting):
        unfinished = []
        batch = max(_MOST_CELLS // reach, 1)
        for k in range(0, len(waiting), batch):
            rows = waiting[k : k + batch]
            unfinished.append(rows[_cone_batch(path, starts, rows, reach, tolerance, allowed)])
        waiting = np.concatenate(unfinished)
        reach *= 4
    return allowed


def _cone_batch(path: Float64s, starts: Indices, rows: Indices, reach: int, tolerance: float, allowed: Bools) -> Bools:
    """Fill `allowed` for some starts, looking `reach` vertices ahead; True for starts whose cone is still open then.

    A vertex farther than the tolerance allows directions within asin(tolerance / distance) of its own; what has been
    allowed by all vertices so far is one interval, measured from the first such vertex's direction.
    """
    last = len(path) - 1
    index = np.minimum(starts[rows, None] + np.arange(1, reach + 1), last)
    offset = path[index] - path[starts[rows], None]
    distance = np.hypot(offset[..., 0], offset[..., 1])
    angle = np.arctan2(offset[..., 1], offset[..., 0])
    bounds = distance > tolerance
    first = np.argmax(bounds, axis=1)
    angle -= angle[np.arange(len(rows)), first][:, None]
    angle = (angle + np.pi) % (2 * np.pi) - np.pi
    half = np.full_like(distance, np.inf)
    np.divide(tolerance, distance, out=half, where=bounds)
    np.arcsin(half, out=half, where=bounds)
    low = np.maximum.accumulate(angle - half, axis=1)
    high = np.minimum.accumulate(angle + half, axis=1)
    fits = np.ones_like(bounds)
    fits[:, 1:] = (low[:, :-1] <= angle[:, 1:]) & (angle[:, 1:] <= high[:, :-1])
    ahead = np.searchsorted(starts, index)
    is_start = starts[np.minimum(ahead, len(starts) - 1)] == index
    row, column = np.nonzero(fits & is_start)
    allowed[rows[row], ahead[row, column]] = True
    return np.asarray((low[:, -1] <= high[:, -1]) & (starts[rows] + reach < last))


def _untangled(path: Float64s, kept: Indices, tolerance: float) -> Indices:
    """The choice with vertices put back until its ring is simple, as far as the path itself is."""
    last = len(path) - 1
    while True:
        meetings = list(self_meetings(BoxTree.of_ring(path[kept])))
        if not meetings:
            return kept
        ends = np.append(kept[1:], kept[0] + last)
        tangled = distinct(np.concatenate(meetings))
        begin, end = kept[tangled], ends[tangled]
        long = end - begin > 1
        if not long.any():
            return kept
        closed = np.concatenate([path[:-1], path])
        farthest, _ = _farthest(closed, begin[long], end[long])
        start = int(kept[0])
        forced = np.zeros(last + 1, np.bool_)
        forced[[0, last]] = True
        forced[(np.concatenate([kept, farthest]) - start) % last] = True
        again = _douglas_peucker(closed[start : start + last + 1], forced, tolerance)
        kept = np.sort((np.flatnonzero(again)[:-1] + start) % last)
