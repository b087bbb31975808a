"""The border of what closed curves wind around, as rings; crossings are found and decided on a grid of integers.

The curves may cross themselves and one another anyhow. Their edges are cut at every crossing, each cut point rounded
to the grid, again and again until no two pieces cross (snap rounding, Hobby 1999, by repetition). Then each piece's
winding numbers on both sides are counted, and those with a positive number on one side only are the border (winding
numbers for offsets: Chen & McMains 2005).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Bools, Float64s, Int64s
from contour.geometry.segments import BoxTree, near_pairs
from contour.geometry.simplification import simplify_indices

_BITS = 28
"""Of a coordinate on the grid: differences have 29, their products 58, so that int64 decides every turn exactly. Of
1 m that is 4 nm."""

_MOST_ROUNDS = 30
"""Rounding a crossing may make a new one; two or three rounds are usual."""

_GRID_STEPS = 2.0
"""What cleaning may move: a crossing lies within one step of both its edges."""

_ROWS = 256


def positive_border(curves: Sequence[Float64s]) -> tuple[tuple[Float64s, ...], float]:
    """Rings around all points with a positive winding number, that region on their left, and the grid's step.

    Curves have shape (N, 2) and are closed. Rings are within two steps of the exact ones; two that touch at a point may
    come as one that touches itself. Raises ParameterError where the cutting does not come to an end.
    """
    low = np.min([curve.min(axis=0) for curve in curves], axis=0)
    extent = float(np.max([(curve - low).max() for curve in curves]))
    step = 2.0 ** (np.ceil(np.log2(max(extent, 1e-300))) - _BITS)
    on_grid = [np.rint((curve - low) / step).astype(np.int64) for curve in curves]
    start = np.concatenate(on_grid)
    end = np.concatenate([np.roll(curve, -1, axis=0) for curve in on_grid])
    rings = _loops(*_border(*_cut_apart(start, end)))
    return tuple(ring[simplify_indices(ring, _GRID_STEPS)] * step + low for ring in rings), step


def _cut_apart(start: Int64s, end: Int64s) -> tuple[Int64s, Int64s]:
    """The same edges in pieces that share end points at most."""
    for _ in range(_MOST_ROUNDS):
        moves = (start != end).any(axis=1)
        start, end = start[moves], end[moves]
        owner, points = _cuts(start, end)
        if len(owner) == 0:
            return start, end
        start, end = _pieces(start, end, owner, points)
    raise ParameterError(f"The curves' crossings are not told apart in {_MOST_ROUNDS} rounds. Use fewer vertices.")


def _turns(a: Int64s, b: Int64s, c: Int64s) -> Int64s:
    """Sign of the turn a -> b -> c, exact: 1 to the left, 0 straight, -1 to the right."""
    one, two = b - a, c - a
    return np.asarray(np.sign(one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]))


def _cuts(start: Int64s, end: Int64s) -> tuple[Int64s, Int64s]:
    """Edges to cut, and where: at crossings, and at the end points of others that lie on them."""
    tree = BoxTree.of_segments(start.astype(np.float64), end.astype(np.float64))
    owners: list[Int64s] = []
    points: list[Int64s] = []
    for i, j in near_pairs(tree):
        a, b, c, d = start[i], end[i], start[j], end[j]
        sides = _turns(a, b, c), _turns(a, b, d), _turns(c, d, a), _turns(c, d, b)
        for edge, point, side in ((i, c, sides[0]), (i, d, sides[1]), (j, a, sides[2]), (j, b, sides[3])):
            here = (side == 0) & _within(point, start[edge], end[edge])
            owners.append(edge[here])
            points.append(point[here])
        cross = np.flatnonzero((sides[0] * sides[1] < 0) & (sides[2] * sides[3] < 0))
        if len(cross):
            at = np.array([_crossing(a[k], b[k], c[k], d[k]) for k in cross], dtype=np.int64)
            for edge in (i[cross], j[cross]):
                inner = (at != start[edge]).any(axis=1) & (at != end[edge]).any(axis=1)
                owners.append(edge[inner])
                points.append(at[inner])
    if not owners:
        return np.zeros(0, np.int64), np.zeros((0, 2), np.int64)
    return np.concatenate(owners), np.concatenate(points)


def _within(point: Int64s, start: Int64s, end: Int64s) -> Bools:
    """True where a point on an edge's line lies between its ends, ends left out."""
    inside = (point >= np.minimum(start, end)) & (point <= np.maximum(start, end))
    ends = (point == start).all(axis=1) | (point == end).all(axis=1)
    return np.asarray(inside.all(axis=1) & ~ends)


def _crossing(a: Int64s, b: Int64s, c: Int64s, d: Int64s) -> tuple[int, int]:
    """The grid point nearest to where two edges cross; in Python's integers, which do not overflow."""
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = a.tolist(), b.tolist(), c.tolist(), d.tolist()
    below = (bx - ax) * (dy - cy) - (by - ay) * (dx - cx)
    above = (cx - ax) * (dy - cy) - (cy - ay) * (dx - cx)
    if below < 0:
        below, above = -below, -above
    x, y = (2 * above * (bx - ax) + below) // (2 * below), (2 * above * (by - ay) + below) // (2 * below)
    return ax + x, ay + y


def _pieces(start: Int64s, end: Int64s, owner: Int64s, points: Int64s) -> tuple[Int64s, Int64s]:
    """The edges with theirs cut at the points, in the order of the edges."""
    edge = np.concatenate([np.arange(len(start)), owner])
    along = ((points - start[owner]) * (end[owner] - start[owner])).sum(axis=1)
    along = np.concatenate([np.full(len(start), np.iinfo(np.int64).min), along])
    order = np.lexsort((along, edge))
    edge = edge[order]
    begin = np.concatenate([start, points])[order]
    until = np.roll(begin, -1, axis=0)
    last = np.append(edge[1:] != edge[:-1], True)
    until[last] = end[edge[last]]
    return begin, until


def _border(start: Int64s, end: Int64s) -> tuple[Int64s, Int64s]:
    """Pieces with a positive winding number on one side only, directed so that it is on their left."""
    back = (start[:, 0] > end[:, 0]) | ((start[:, 0] == end[:, 0]) & (start[:, 1] > end[:, 1]))
    low, high = np.where(back[:, None], end, start), np.where(back[:, None], start, end)
    pieces, which = np.unique(np.concatenate([low, high], axis=1), axis=0, return_inverse=True)
    times = np.bincount(which.reshape(-1), weights=np.where(back, -1, 1)).astype(np.int64)
    pieces, times = pieces[times != 0], times[times != 0]
    low, high = pieces[:, :2], pieces[:, 2:]
    left = _winding_left(low, high, times)
    right = left - times
    forward, backward = (left > 0) & (right <= 0), (left <= 0) & (right > 0)
    return np.concatenate([low[forward], high[backward]]), np.concatenate([high[forward], low[backward]])


def _winding_left(low: Int64s, high: Int64s, times: Int64s) -> Int64s:
    """Winding number just left of each piece, by a ray from its middle along x; `times` it runs from low to high."""
    middle = low + high  # twice the middle; the ends count twice below
    rises = high[:, 1] > low[:, 1]
    bottom, top = 2 * np.minimum(low[:, 1], high[:, 1]), 2 * np.maximum(low[:, 1], high[:, 1])
    below, above = np.where(rises[:, None], low, high) * 2, np.where(rises[:, None], high, low) * 2
    count = np.where(rises, times, -times)
    winding = np.zeros(len(low), np.int64)
    order = np.argsort(middle[:, 1], kind="stable")
    for k in range(0, len(order), _ROWS):
        rows = order[k : k + _ROWS]
        near = np.flatnonzero((top > middle[rows[0], 1]) & (bottom <= middle[rows[-1], 1]))
        y = middle[rows, 1][:, None]
        spans = (bottom[near] <= y) & (y < top[near])
        beyond = _turns(below[near][None], above[near][None], middle[rows][:, None]) > 0
        winding[rows] = ((spans & beyond) * count[near]).sum(axis=1)
    return np.asarray(winding + np.where(rises, times, 0))


def _loops(start: Int64s, end: Int64s) -> list[Float64s]:
    """The directed pieces as closed rings; as many end in each point as begin there."""
    after: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for (x, y), (to_x, to_y) in zip(start.tolist(), end.tolist(), strict=True):
        after.setdefault((x, y), []).append((to_x, to_y))
    rings = []
    while after:
        first = point = next(iter(after))
        ring = []
        while True:
            ring.append(point)
            onward = after[point].pop()
            if not after[point]:
                del after[point]
            point = onward
            if point == first:
                break
        rings.append(np.array(ring, dtype=np.float64))
    return rings
