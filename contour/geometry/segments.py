"""Which segments of two closed rings meet, and how far points are from a ring: box trees over the vertices' order.

A ring's consecutive segments lie near each other, so boxes over runs of 2, 4, 8 … of them bound tightly. Both
questions walk down these boxes level by level, whole levels at a time, and cost about N log N for outlines.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Bools, Float64s, Indices, rolled

_MOST_PAIRS = 1 << 18
"""Pairs handled at once: 256 Ki pairs of boxes are about 20 MB, whatever the ring."""

_POINTS_AT_ONCE = 1 << 14

_ORIENT_ERROR = 3.3306690738754716e-16
"""Forward error of the 2 x 2 determinant, relative to the sum of its terms' sizes (Shewchuk 1997, ccwerrboundA)."""

_SPLITTER = 134217729.0
"""2^27 + 1: splits a double into two halves of 26 bits (Dekker 1971)."""


@dataclass(frozen=True, eq=False)
class BoxTree:
    """Boxes over runs of consecutive segments; `levels[0]` holds one box a segment, each further level half as many."""

    start: Float64s
    end: Float64s
    levels: tuple[tuple[Float64s, Float64s], ...]

    @classmethod
    def of_ring(cls, ring: Float64s) -> BoxTree:
        """The tree over the ring's N segments; segment i runs from vertex i to vertex i + 1 (cyclic)."""
        start = np.ascontiguousarray(ring, dtype=np.float64)
        return cls.of_segments(start, rolled(start, -1))

    @classmethod
    def of_segments(cls, start: Float64s, end: Float64s) -> BoxTree:
        """The tree over N segments, the better the nearer neighbours lie to each other."""
        levels = [(np.minimum(start, end), np.maximum(start, end))]
        while len(levels[-1][0]) > 1:
            low, high = levels[-1]
            cuts = np.arange(0, len(low), 2)
            levels.append((np.minimum.reduceat(low, cuts), np.maximum.reduceat(high, cuts)))
        return cls(start, end, tuple(levels))

    def at(self, level: int) -> tuple[Float64s, Float64s]:
        """Low and high corners at a level; above the root the root again, so that trees of two heights go together."""
        return self.levels[min(level, len(self.levels) - 1)]


def _children(nodes: Indices, tree: BoxTree, level: int) -> tuple[Indices, Indices]:
    """First and last child (the same where there is one) at `level` - 1 of nodes at `level`."""
    if level >= len(tree.levels):
        return nodes, nodes
    first = 2 * nodes
    return first, np.minimum(first + 1, len(tree.levels[level - 1][0]) - 1)


def _boxes_meet(a: BoxTree, b: BoxTree, level: int, i: Indices, j: Indices) -> Bools:
    low_a, high_a = a.at(level)
    low_b, high_b = b.at(level)
    meets = (low_a[i] <= high_b[j]) & (low_b[j] <= high_a[i])
    return np.asarray(meets.all(axis=1))


def near_pairs(a: BoxTree, b: BoxTree | None = None) -> Iterator[tuple[Indices, Indices]]:
    """Chunks of index pairs (i of `a`, j of `b`) whose segments' boxes meet; without `b`, pairs i < j within `a`."""
    other = a if b is None else b
    root = np.zeros(1, np.intp)
    stack = [(max(len(a.levels), len(other.levels)) - 1, root, root)]
    while stack:
        level, i, j = stack.pop()
        if level == 0:
            if b is None:
                i, j = i[i < j], j[i < j]
            if len(i):
                yield i, j
            continue
        if len(i) > _MOST_PAIRS:
            half = len(i) // 2
            stack += [(level, i[half:], j[half:]), (level, i[:half], j[:half])]
            continue
        i0, i1 = _children(i, a, level)
        j0, j1 = _children(j, other, level)
        i, j = np.concatenate([i0, i0, i1, i1]), np.concatenate([j0, j1, j0, j1])
        fresh = np.repeat([True, False, False, False], len(i0))
        fresh[len(i0) : 2 * len(i0)] = j1 != j0
        fresh[2 * len(i0) : 3 * len(i0)] = i1 != i0
        fresh[3 * len(i0) :] = (i1 != i0) & (j1 != j0)
        if b is None:
            fresh &= i <= j
        i, j = i[fresh], j[fresh]
        keep = _boxes_meet(a, other, level - 1, i, j)
        stack.append((level - 1, i[keep], j[keep]))


def _product_is_exact(a: Float64s, b: Float64s, product: Float64s) -> Bools:
    """True where `product` = fl(a·b) lost nothing (Dekker's two-product)."""
    big = _SPLITTER * a
    a_high = big - (big - a)
    big = _SPLITTER * b
    b_high = big - (big - b)
    a_low, b_low = a - a_high, b - b_high
    tail = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    underflows = (np.abs(product) < 1e-280) & (a != 0) & (b != 0)
    return np.asarray((tail == 0) & ~underflows)


def _difference_is_exact(a: Float64s, b: Float64s, difference: Float64s) -> Bools:
    """True where `difference` = fl(a - b) lost nothing (Knuth's two-sum)."""
    virtual_b = a - difference
    return np.asarray(((a - (difference + virtual_b)) + (virtual_b - b)) == 0)


def _exact_turn(a: Float64s, b: Float64s, c: Float64s) -> int:
    ax, ay, bx, by, cx, cy = (Fraction(float(value)) for value in (*a, *b, *c))
    turn = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (turn > 0) - (turn < 0)


def turns(a: Float64s, b: Float64s, c: Float64s) -> NDArray[np.int8]:
    """Exact sign of the turn a → b → c, shape (N,): 1 to the left (axes x right, y up), 0 straight, -1 to the right."""
    bx, by, cx, cy = b[:, 0] - a[:, 0], b[:, 1] - a[:, 1], c[:, 0] - a[:, 0], c[:, 1] - a[:, 1]
    left, right = bx * cy, by * cx
    turn = left - right
    signs = np.sign(turn).astype(np.int8)
    open_ = np.flatnonzero(np.abs(turn) < _ORIENT_ERROR * (np.abs(left) + np.abs(right)) + np.finfo(float).tiny)
    if len(open_) == 0:
        return signs
    # A difference of two exact products has the right sign; so pixel coordinates never need the slow way.
    a, b, c = a[open_], b[open_], c[open_]
    bx, by, cx, cy, left, right = (values[open_] for values in (bx, by, cx, cy, left, right))
    exact = _product_is_exact(bx, cy, left) & _product_is_exact(by, cx, right)
    for end, axis, difference in ((b, 0, bx), (b, 1, by), (c, 0, cx), (c, 1, cy)):
        exact &= _difference_is_exact(end[:, axis], a[:, axis], difference)
    for k in np.flatnonzero(~exact):
        signs[open_[k]] = _exact_turn(a[k], b[k], c[k])
    return signs


def segments_meet(p0: Float64s, p1: Float64s, q0: Float64s, q1: Float64s) -> Bools:
    """True where the closed segments p0 p1 and q0 q1 share a point, shape (N,); exact, touching included.

    Expects that the segments' boxes meet (`near_pairs`): collinear segments with meeting boxes share a point.
    """
    sides_of_p = turns(p0, p1, q0) * turns(p0, p1, q1)
    sides_of_q = turns(q0, q1, p0) * turns(q0, q1, p1)
    return np.asarray((sides_of_p <= 0) & (sides_of_q <= 0))


def first_meeting(a: BoxTree, b: BoxTree) -> tuple[int, int] | None:
    """Indices of a segment of `a` and one of `b` that share a point, or None."""
    for i, j in near_pairs(a, b):
        meets = segments_meet(a.start[i], a.end[i], b.start[j], b.end[j])
        if meets.any():
            k = int(np.argmax(meets))
            return int(i[k]), int(j[k])
    return None


def self_meetings(tree: BoxTree) -> Iterator[Indices]:
    """Chunks of pairs, shape (M, 2), of a ring's segments that share a point they should not.

    Neighbours share their common vertex and no more: a spike that folds back on itself counts, and so does a
    vertex given twice (a segment of length 0 meets both its neighbours).
    """
    count = len(tree.start)
    for i, j in near_pairs(tree):
        follows = j == i + 1
        closes = (i == 0) & (j == count - 1)
        meets = np.zeros(len(i), np.bool_)
        far = ~(follows | closes)
        meets[far] = segments_meet(tree.start[i[far]], tree.end[i[far]], tree.start[j[far]], tree.end[j[far]])
        for near, first, second in ((follows, i, j), (closes & ~follows, j, i)):
            meets[near] = _folds_back(tree.start[first[near]], tree.start[second[near]], tree.end[second[near]])
        if meets.any():
            yield np.stack([i[meets], j[meets]], axis=1)


def _folds_back(a: Float64s, b: Float64s, c: Float64s) -> Bools:
    """True where the path a → b → c returns on itself; standing still counts as that."""
    onward = ((b - a) * (c - b)).sum(axis=1)
    return np.asarray((onward <= 0) & (turns(a, b, c) == 0))


def contains(ring: Float64s, points: Float64s) -> Bools:
    """True where a point lies inside the ring by the even-odd rule, shape (P,); a point on the ring is either."""
    start, end = ring, rolled(ring, -1)
    inside = np.zeros(len(points), np.bool_)
    for k, point in enumerate(points):
        crossing = np.flatnonzero((start[:, 1] > point[1]) != (end[:, 1] > point[1]))
        here = np.broadcast_to(point, (len(crossing), 2))
        side = turns(start[crossing], end[crossing], here)
        upward = end[crossing, 1] > start[crossing, 1]
        inside[k] = bool(np.count_nonzero((side > 0) == upward) % 2)
    return inside


def distances_to_segments(points: Float64s, start: Float64s, end: Float64s) -> Float64s:
    """Distance of each point to its own closed segment, shape (N,)."""
    along = end - start
    offset = points - start
    length2 = np.einsum("ij,ij->i", along, along)
    share = np.einsum("ij,ij->i", offset, along) / np.where(length2 > 0, length2, 1)
    rest = offset - along * np.clip(share, 0, 1)[:, None]
    return np.asarray(np.hypot(rest[:, 0], rest[:, 1]))


def distances_to_ring(points: Float64s, ring: Float64s) -> Float64s:
    """Distance of each point to the nearest point of the closed ring, shape (P,)."""
    return distances_to_tree(points, BoxTree.of_ring(ring))


def distances_to_tree(points: Float64s, tree: BoxTree) -> Float64s:
    """Distance of each point to the nearest of the tree's segments, shape (P,)."""
    parts = [_distances(points[k : k + _POINTS_AT_ONCE], tree) for k in range(0, len(points), _POINTS_AT_ONCE)]
    return np.concatenate(parts) if parts else np.zeros(0)


def _distances(points: Float64s, tree: BoxTree) -> Float64s:
    nearest = np.full(len(points), np.inf)
    point = np.arange(len(points), dtype=np.intp)
    node = np.zeros(len(points), np.intp)
    for level in range(len(tree.levels) - 1, 0, -1):
        first, last = _children(node, tree, level)
        two = last != first
        point, node = np.concatenate([point, point[two]]), np.concatenate([first, last[two]])
        low, high = tree.levels[level - 1]
        below, above = low[node] - points[point], points[point] - high[node]
        outside = np.maximum(np.maximum(below, above), 0)
        # Some segment point lies in the box, so the nearest is no farther than the box's farthest corner.
        farthest = np.maximum(np.abs(below), np.abs(above))
        np.minimum.at(nearest, point, np.hypot(farthest[:, 0], farthest[:, 1]) * (1 + 1e-12))
        keep = np.hypot(outside[:, 0], outside[:, 1]) <= nearest[point]
        point, node = point[keep], node[keep]
    exact = np.full(len(points), np.inf)
    np.minimum.at(exact, point, distances_to_segments(points[point], tree.start[node], tree.end[node]))
    return exact
