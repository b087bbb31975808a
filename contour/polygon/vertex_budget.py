"""A contour with at most so many vertices that lies within the traced one: only material is given up, none is claimed.

`shrinking_steps` proposes it; here it is proven, by other means: exactly that it never leaves the traced contour, and
by samples how far it lies from it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour, Ring, contour_defect, oriented_contour
from contour.geometry.segments import BoxTree, contains, distances_to_ring, near_pairs, turns
from contour.polygon.shrinking_steps import reduced

_SAMPLES = 16
"""The proof may find up to this part of the bound more than there is; steps keep clear of it."""

_ON = 1e-12
"""Of the contour's size: a point as near as that lies on a ring, where "inside" is rounding."""


@dataclass(frozen=True)
class Budgeted:
    """The smaller contour, how far it lies from the traced one (two-sided Hausdorff, an upper bound), and if it fits.

    Where it does not fit the budget, no further step keeps the bound.
    """

    contour: Contour
    shift: float
    fits: bool


def within_budget(contour: Contour, max_vertices: int, bound: float) -> Budgeted:
    """The contour, or one within it of at most `max_vertices` vertices, none of its points farther than `bound` away.

    `contour` must be fit to be cut, `bound` above 0 in its unit: ParameterError. The result has the same rings in the
    same order, exterior counter-clockwise, holes clockwise (y up).
    """
    if not (np.isfinite(bound) and bound > 0):
        raise ParameterError(f"bound is {bound}: expected a number above 0, in the contour's unit.")
    contour = oriented_contour(contour, counter_clockwise=True)
    if contour.point_count <= max_vertices:
        return Budgeted(contour, 0.0, True)
    defect = contour_defect(contour)
    if defect:
        raise ParameterError(f"The contour has no inside to stay in: {defect}.")
    smaller = reduced(contour, max_vertices, bound * (1 - 1 / _SAMPLES))
    shift = proven_shift(contour, smaller, bound)
    fits = smaller.point_count <= max_vertices and shift <= bound and lies_within(contour, smaller)
    return Budgeted(smaller, shift, fits)


def lies_within(outer: Contour, inner: Contour) -> bool:
    """True if no ring of `inner` crosses one of `outer` (touching is none), and `inner` is inside, holes left out."""
    size = float(np.ptp(outer.exterior, axis=0).max())
    for own in inner.rings:
        tree = BoxTree.of_ring(own)
        for other in outer.rings:
            around = BoxTree.of_ring(other)
            for i, j in near_pairs(tree, around):
                a, b, c, d = tree.start[i], tree.end[i], around.start[j], around.end[j]
                if ((turns(a, b, c) * turns(a, b, d) < 0) & (turns(c, d, a) * turns(c, d, b) < 0)).any():
                    return False
        # A middle may lie on the outer ring, where "inside" is undecided: there its distance tells.
        middles = (own + np.roll(own, -1, axis=0)) / 2
        points = np.concatenate([own, middles])
        inside = contains(outer.exterior, points)
        for hole in outer.holes:
            inside &= ~contains(hole, points)
        if (_nearest(points[~inside], outer) > _ON * size).any():
            return False
    for hole in outer.holes:
        covered = contains(inner.exterior, hole)
        for own in inner.holes:
            covered &= ~contains(own, hole)
        if (_nearest(hole[covered], inner) > _ON * size).any():
            return False
    return True


def proven_shift(traced: Contour, smaller: Contour, bound: float) -> float:
    """An upper bound on the two-sided Hausdorff distance of two contours, ring by ring, high by at most bound/16."""
    seen = 0.0
    for one, other in zip(traced.rings, smaller.rings, strict=True):
        for here, there in ((one, other), (other, one)):
            seen = _farthest(here, there, seen, bound / _SAMPLES)
    return seen + bound / _SAMPLES


def _farthest(here: Ring, there: Ring, seen: float, slack: float) -> float:
    """The largest distance found of points of the ring `here` from `there`, or `seen`; none is larger by `slack`.

    Along a piece of length l the distance is at most (l + that of its two ends) / 2; pieces are halved until that is
    near enough to the largest distance seen.
    """
    start, end = _unlike(here, there)
    at_start, at_end = distances_to_ring(start, there), distances_to_ring(end, there)
    seen = max(seen, float(at_start.max(initial=0.0)))
    while True:
        most = (np.hypot(*(end - start).T) + at_start + at_end) / 2
        open_ = most > seen + slack
        if not open_.any():
            return seen
        start, end, at_start, at_end = start[open_], end[open_], at_start[open_], at_end[open_]
        middle = (start + end) / 2
        at_middle = distances_to_ring(middle, there)
        seen = max(seen, float(at_middle.max()))
        start, end = np.concatenate([start, middle]), np.concatenate([middle, end])
        at_start, at_end = np.concatenate([at_start, at_middle]), np.concatenate([at_middle, at_end])


def _unlike(here: Ring, there: Ring) -> tuple[Float64s, Float64s]:
    """Starts and ends of the edges of `here` that are no edges of `there`."""
    edges = [np.concatenate([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in (here, there)]
    known = {edge.tobytes() for edge in edges[1]}
    new = edges[0][[edge.tobytes() not in known for edge in edges[0]]]
    return new[:, :2], new[:, 2:]


def _nearest(points: Float64s, contour: Contour) -> Float64s:
    return np.asarray(np.min([distances_to_ring(points, ring) for ring in contour.rings], axis=0))
