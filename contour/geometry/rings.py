"""Rings and contours: plane polygons as float64 arrays.

Signs are those of axes x right, y up: counter-clockwise is positive. In pixels, whose y runs down, the ring that a
person sees as counter-clockwise is the negative one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Float64s, rolled
from contour.geometry.segments import BoxTree, contains, distances_to_ring, first_meeting, self_meetings
from contour.geometry.simplification import simplify_indices

__all__ = [
    "Box",
    "Contour",
    "Ring",
    "area",
    "bounding_box",
    "contour_defect",
    "densified",
    "farthest",
    "hausdorff",
    "is_simple",
    "largest_loop",
    "oriented",
    "oriented_contour",
    "perimeter",
    "ring_defect",
    "signed_area",
    "simplify_indices",
]

Ring = Float64s
"""Vertices of a closed polygon, shape (N, 2), N >= 3, first vertex not repeated."""


@dataclass(frozen=True)
class Contour:
    """A block's outline: one exterior ring and the rings of its holes, in one unit (pixels or millimetres)."""

    exterior: Ring
    holes: tuple[Ring, ...] = ()

    @classmethod
    def of(cls, rings: Iterable[Ring]) -> Contour:
        """The contour of rings, exterior first, as `rings` has them."""
        exterior, *holes = rings
        return cls(exterior, tuple(holes))

    @property
    def rings(self) -> tuple[Ring, ...]:
        """All rings, exterior first."""
        return (self.exterior, *self.holes)

    @property
    def point_count(self) -> int:
        """Vertices of all rings together."""
        return sum(len(ring) for ring in self.rings)


@dataclass(frozen=True)
class Box:
    """An axis-parallel bounding box in the unit of its ring."""

    min_x: float
    min_y: float
    max_x: float
    max_y: float

    @property
    def width(self) -> float:
        return self.max_x - self.min_x

    @property
    def height(self) -> float:
        return self.max_y - self.min_y


def signed_area(ring: Ring) -> float:
    """Area by the shoelace formula, in the ring's unit squared: positive for counter-clockwise (y up)."""
    # Taken about the first vertex: far from the origin the products would cancel and cost digits.
    x, y = (ring - ring[0]).T
    return float(0.5 * (x * rolled(y, -1) - y * rolled(x, -1)).sum())


def oriented(ring: Ring, counter_clockwise: bool) -> Ring:
    """The ring in the wanted direction (y up), its first vertex kept; a copy only where it has to be turned."""
    if (signed_area(ring) > 0) == counter_clockwise:
        return ring
    return np.concatenate([ring[:1], ring[:0:-1]])


def oriented_contour(contour: Contour, counter_clockwise: bool) -> Contour:
    """The contour with its exterior in the wanted direction (y up) and its holes in the other."""
    holes = tuple(oriented(hole, not counter_clockwise) for hole in contour.holes)
    return Contour(oriented(contour.exterior, counter_clockwise), holes)


def area(contour: Contour) -> float:
    """Area of the exterior with the holes taken off, never negative, in the contour's unit squared."""
    holes = sum(abs(signed_area(hole)) for hole in contour.holes)
    return max(abs(signed_area(contour.exterior)) - holes, 0.0)


def largest_loop(ring: Ring) -> Ring:
    """The loop of largest area among those that a ring falls into at vertices it passes more than once.

    OpenCV's contours run out and back along filaments of one pixel, and twice through pixels that join two regions by
    a corner; these are the only ways in which they meet themselves, so the loop is simple.
    """
    ordered = ring[np.lexsort(ring.T)]
    if (ordered[1:] != ordered[:-1]).any(axis=1).all():
        return ring
    stack: list[tuple[float, float]] = []
    place: dict[tuple[float, float], int] = {}
    loops: list[list[tuple[float, float]]] = []
    for x, y in ring.tolist():
        at = place.get((x, y))
        if at is not None:
            loops.append(stack[at:])
            for passed in stack[at:]:
                del place[passed]
            del stack[at:]
        place[(x, y)] = len(stack)
        stack.append((x, y))
    rings = [np.array(loop) for loop in (*loops, stack) if len(loop) > 2]
    return max(rings, key=lambda loop: abs(signed_area(loop)), default=ring)


def perimeter(ring: Ring) -> float:
    """Length of the closed ring."""
    steps = rolled(ring, -1) - ring
    return float(np.hypot(steps[:, 0], steps[:, 1]).sum())


def bounding_box(ring: Ring) -> Box:
    """The ring's axis-parallel bounding box."""
    (min_x, min_y), (max_x, max_y) = ring.min(axis=0), ring.max(axis=0)
    return Box(float(min_x), float(min_y), float(max_x), float(max_y))


def is_simple(ring: Ring) -> bool:
    """True if the closed ring neither crosses nor touches itself; exact, for 3 vertices and more.

    A vertex given twice, a spike that folds back on itself and a ring without area are not simple.
    """
    return ring_defect(ring) is None


def ring_defect(ring: Ring) -> str | None:
    """Why a ring is not simple, with the place of the first meeting found; None where it is simple."""
    if len(ring) < 3:
        return f"has {len(ring)} vertices, needs 3"
    if not np.isfinite(ring).all():
        return "has a vertex that is not finite"
    for pairs in self_meetings(BoxTree.of_ring(ring)):
        first, second = (int(index) for index in pairs[0])
        x, y = ring[second]
        return f"meets itself: edges {first} and {second}, near ({x:.1f}, {y:.1f})"
    return None


def contour_defect(contour: Contour) -> str | None:
    """What makes the contour unfit to be cut, as one sentence; None where nothing does.

    Wanted: a simple exterior, simple holes inside it, no two rings touching, no hole within a hole.
    """
    names = ["exterior", *(f"hole {k + 1}" for k in range(len(contour.holes)))]
    for name, ring in zip(names, contour.rings, strict=True):
        defect = ring_defect(ring)
        if defect:
            return f"the {name} {defect}"
    trees = [BoxTree.of_ring(ring) for ring in contour.rings]
    for k, tree in enumerate(trees):
        for m in range(k + 1, len(trees)):
            meeting = first_meeting(tree, trees[m])
            if meeting:
                x, y = tree.start[meeting[0]]
                return f"the {names[k]} and {names[m]} meet near ({x:.1f}, {y:.1f})"
    return _nesting_defect(contour, names)


def _nesting_defect(contour: Contour, names: list[str]) -> str | None:
    """As `contour_defect`, for rings that are known not to meet: then one vertex of a ring tells for the whole."""
    for k, hole in enumerate(contour.holes):
        if not contains(contour.exterior, hole[:1])[0]:
            return f"the {names[k + 1]} lies outside the exterior"
        for m, other in enumerate(contour.holes):
            if m != k and contains(other, hole[:1])[0]:
                return f"the {names[k + 1]} lies inside the {names[m + 1]}"
    return None


def densified(ring: Ring, spacing: float) -> Ring:
    """The ring with points added along its edges so that neighbours are at most `spacing` apart; vertices stay."""
    ends = rolled(ring, -1)
    steps = ends - ring
    counts = np.maximum(np.ceil(np.hypot(steps[:, 0], steps[:, 1]) / spacing), 1).astype(np.intp)
    edge = np.repeat(np.arange(len(ring)), counts)
    within = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.asarray(ring[edge] + steps[edge] * (within / counts[edge])[:, None])


def hausdorff(a: Ring, b: Ring, spacing: float) -> float:
    """Two-sided Hausdorff distance between two closed curves, low by at most `spacing` / 2 (points are that dense)."""
    return farthest(Contour(a), Contour(b), spacing)[0]


def farthest(a: Contour, b: Contour, spacing: float) -> tuple[float, Float64s]:
    """As `hausdorff`, of all rings together, and the point (2,) of either that lies so far from the other."""
    found = []
    for one, other in ((a, b), (b, a)):
        points = np.concatenate([densified(ring, spacing) for ring in one.rings])
        near = np.min([distances_to_ring(points, ring) for ring in other.rings], axis=0)
        found.append((float(near.max()), points[near.argmax()]))
    return max(found, key=lambda place: place[0])
