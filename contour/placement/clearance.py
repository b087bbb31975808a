"""How far a placed part keeps from the block's edge, exactly: distances between vertices of one and edges of the other.

Of two polygons whose edges do not cross, the smallest distance is found at a vertex of one of them. Outside is told by
a sign: a part's vertex that lies out of the block, and a block's vertex that lies in the part's material.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Float64s, Indices
from contour.geometry.rings import Contour, oriented_contour
from contour.geometry.segments import BoxTree, first_meeting
from contour.placement.pose import Pose

_AT_ONCE = 1 << 18
_TOUCHING = 1e-9


@dataclass(frozen=True)
class Outline:
    """Edges of all rings of a shape that have its material on their left: where they begin and end, (N, 2) both.

    Where they begin are the shape's vertices.
    """

    start: Float64s
    end: Float64s

    @classmethod
    def of(cls, contour: Contour) -> Outline:
        """All rings of the contour, whichever way they ran."""
        rings = oriented_contour(contour, counter_clockwise=True).rings
        return cls(np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings]))

    def moved(self, pose: Pose) -> Outline:
        """The outline where the pose lays it."""
        return Outline(pose.moved(self.start), pose.moved(self.end))


@dataclass(frozen=True)
class Contacts:
    """Places where part and block are near: `of_part` and `of_block` (K, 2), mm; their distance, negative where one is
    where it must not be, (K,); the unit direction in which the part's place must move to gain distance (K, 2); and
    `vertex`, the part's (numbered from 0) or the block's (numbered on behind them) that is one of the two, (K,).
    """

    of_part: Float64s
    of_block: Float64s
    distance: Float64s
    away: Float64s
    vertex: Indices

    @property
    def least(self) -> float:
        """The smallest distance; infinite where there is no contact."""
        return float(self.distance.min(initial=np.inf))

    def take(self, index: Indices | Bools) -> Contacts:
        """The contacts at `index`."""
        return Contacts(
            self.of_part[index], self.of_block[index], self.distance[index], self.away[index], self.vertex[index]
        )


def contacts(part: Outline, block: Outline, reach: float, among: Indices | None = None) -> Contacts:
    """Contacts of the placed part and the block that are no farther than the nearest and `reach` more.

    among: only of these vertices, numbered as in `Contacts.vertex`; None = of all.
    """
    own = np.arange(len(part.start)) if among is None else among[among < len(part.start)]
    other = np.arange(len(block.start)) if among is None else among[among >= len(part.start)] - len(part.start)
    found = _contacts(part.start[own], block, reach, inside=True)
    back = _contacts(block.start[other], part, reach, inside=False)
    joined = Contacts(
        np.concatenate([found.point, back.foot]),
        np.concatenate([found.foot, back.point]),
        np.concatenate([found.distance, back.distance]),
        np.concatenate([found.away, -back.away]),
        np.concatenate([own[found.index], other[back.index] + len(part.start)]),
    )
    return joined.take(joined.distance <= joined.least + reach)


def crosses(part: Contour, block: Contour) -> bool:
    """True where an edge of the part meets one of the block; exact."""
    trees = [BoxTree.of_ring(ring) for ring in block.rings]
    return any(first_meeting(BoxTree.of_ring(own), other) is not None for own in part.rings for other in trees)


@dataclass(frozen=True)
class _Near:
    """Points near edges, by their index; their feet there, signed distances, and where they gain distance."""

    point: Float64s
    foot: Float64s
    distance: Float64s
    away: Float64s
    index: Indices


def _contacts(points: Float64s, shape: Outline, reach: float, *, inside: bool) -> _Near:
    """Points near the shape's edges; inside: they belong within its material, else out of it."""
    count = max(_AT_ONCE // len(shape.start), 1)
    parts = [_near(points, shape, slice(k, k + count), reach, inside) for k in range(0, len(points), count)]
    if not parts:
        return _Near(np.empty((0, 2)), np.empty((0, 2)), np.empty(0), np.empty((0, 2)), np.empty(0, np.intp))
    names = ("point", "foot", "distance", "away", "index")
    return _Near(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _near(points: Float64s, shape: Outline, which: slice, reach: float, inside: bool) -> _Near:
    own, along = points[which], shape.end - shape.start
    square = np.maximum((along**2).sum(axis=1), 1e-18)
    # By coordinates: sums over an axis of two are many times slower.
    x, y = np.subtract.outer(own[:, 0], shape.start[:, 0]), np.subtract.outer(own[:, 1], shape.start[:, 1])
    share = np.clip((x * along[:, 0] + y * along[:, 1]) / square, 0.0, 1.0)
    distance = np.hypot(x - share * along[:, 0], y - share * along[:, 1])
    nearest = distance.min(axis=1)
    sign = np.where(_within(x, y, along) == inside, 1.0, -1.0)
    # What is where it must not be has one way out, the shortest; what is not keeps clear of every edge.
    limit = np.where(sign > 0, max(float((nearest * sign).min()), 0.0) + reach, nearest)
    row, column = np.nonzero(distance <= limit[:, None])
    point, way = own[row], along[column]
    foot = shape.start[column] + share[row, column][:, None] * way
    length, side = distance[row, column], sign[row]
    # On an edge, away is to its left, where the material lies, or to its right.
    left = np.column_stack([-way[:, 1], way[:, 0]]) * (1.0 if inside else -1.0) / np.sqrt(square[column])[:, None]
    off = (point - foot) / np.maximum(length, _TOUCHING)[:, None] * side[:, None]
    return _Near(point, foot, length * side, np.where((length > _TOUCHING)[:, None], off, left), row + which.start)


def _within(x: Float64s, y: Float64s, along: Float64s) -> Bools:
    """Which points lie in the material, by the even-odd rule along the ray to the right; x, y: from each edge's begin.

    In floating point: what it decides on is checked exactly where it matters, by `crosses`.
    """
    spans = (y >= 0) != (y >= along[:, 1])
    slope = along[:, 0] / np.where(along[:, 1] == 0, 1.0, along[:, 1])
    return np.asarray(np.count_nonzero(spans & (y * slope > x), axis=1) % 2 == 1)
