"""A contour moved by a margin: inwards the exterior shrinks and the holes grow, by parallel edges with mitred corners.

Each ring has the material on its left, so both are one step: the edges move to their left. Where a corner opens, the
moved edges are prolonged until they meet (mitre); a corner sharper than 60 degrees is cut off square at the margin
instead, or its tip would run away. What closes up in the course of it is taken out by winding numbers.
"""

from __future__ import annotations

import numpy as np

from contour.errors import MarginImpossible, ParameterError
from contour.geometry.rings import Contour, Ring, contour_defect, oriented_contour, signed_area
from contour.geometry.segments import contains, distances_to_ring
from contour.geometry.winding_border import positive_border

_MITRE_LIMIT = 2.0
"""Longest mitre, in margins."""

_STRAIGHT = 1e-9
"""Sine below which two edges go on straight."""

_SLACK = 8.0
"""Steps of the grid by which a corner may come nearer than the margin."""


def offset_contour(contour: Contour, margin: float) -> Contour:
    """The contour with every edge moved by `margin` into the material (out of it where negative), in its unit.

    Exterior counter-clockwise, holes clockwise (y up), in the order of the contour's own. No point of the result is
    nearer to the contour than the margin, and it has as many rings: raises MarginImpossible where one vanishes, splits
    or runs into another, or where the result cannot be proven right, ParameterError where the contour itself is
    unfit or the margin no number.
    """
    if not np.isfinite(margin):
        raise ParameterError(f"margin is {margin}: expected a number, in the contour's unit.")
    defect = contour_defect(contour)
    if defect:
        raise ParameterError(f"The contour has no inside to move into: {defect}.")
    contour = oriented_contour(contour, counter_clockwise=True)
    if margin == 0:
        return contour
    rings, step = positive_border([_moved(ring, margin) for ring in contour.rings])
    moved = _matched(contour, rings, margin)
    _check(contour, moved, margin, _SLACK * step)
    return moved


def _moved(ring: Ring, margin: float) -> Ring:
    """The ring's edges moved to their left, joined corner by corner; crosses itself where corners close."""
    along = np.roll(ring, -1, axis=0) - ring
    along /= np.hypot(along[:, 0], along[:, 1])[:, None]
    before = np.roll(along, 1, axis=0)
    left, left_before = along[:, ::-1] * [-1, 1], before[:, ::-1] * [-1, 1]
    turn = before[:, 0] * along[:, 1] - before[:, 1] * along[:, 0]
    straight = (np.abs(turn) < _STRAIGHT) & ((before * along).sum(axis=1) > 0)
    closes = (turn * margin > 0) & ~straight
    normal_sum = left + left_before
    half = np.hypot(normal_sum[:, 0], normal_sum[:, 1]) / 2  # cosine of half the turn
    mitred = ~closes & (half >= 1 / _MITRE_LIMIT)
    # Tangent of a quarter of the turn, by the half-angle formula.
    reach = abs(margin) * np.sqrt(np.maximum(1 - half, 0.0) / (1 + half))
    points = np.empty((len(ring), 3, 2))
    points[:, 0] = ring + left_before * margin + np.where(closes, 0.0, reach)[:, None] * before
    # The vertex itself on the way makes the loop of a corner that closes wind the other way round (Clipper does so).
    points[:, 1] = ring + normal_sum * np.where(mitred, margin / (2 * np.maximum(half, 0.1) ** 2), 0.0)[:, None]
    points[:, 2] = ring + left * margin - np.where(closes, 0.0, reach)[:, None] * along
    used = np.stack([~mitred, closes | mitred, ~mitred], axis=1)
    return np.asarray(points[used])


def _matched(contour: Contour, rings: tuple[Ring, ...], margin: float) -> Contour:
    """The rings as a contour, each hole in the place of the one it came from."""
    exteriors = [ring for ring in rings if signed_area(ring) > 0]
    holes = [ring for ring in rings if signed_area(ring) <= 0]
    what = f"moved by {margin:g} into the material" if margin > 0 else f"moved by {-margin:g} out of the material"
    if len(exteriors) != 1:
        seen = f"falls into {len(exteriors)} pieces" if exteriors else "vanishes"
        raise MarginImpossible(f"{what}, the exterior {seen}")
    ordered: list[Ring] = []
    for number, hole in enumerate(contour.holes, 1):
        own = [ring for ring in holes if _came_from(ring, hole, margin)]
        if len(own) != 1:
            seen = "falls into pieces" if own else "vanishes or runs into another ring"
            raise MarginImpossible(f"{what}, hole {number} {seen}")
        ordered.append(own[0])
    if len(holes) != len(contour.holes) or len({id(ring) for ring in ordered}) != len(holes):
        raise MarginImpossible(f"{what}, {len(contour.holes)} holes become {len(holes)}")
    return Contour(exteriors[0], tuple(ordered))


def _came_from(ring: Ring, hole: Ring, margin: float) -> bool:
    """A hole that has grown holds the one it was; one that has shrunk lies in it."""
    return bool(contains(ring, hole[:1])[0] if margin > 0 else contains(hole, ring[:1])[0])


def _check(contour: Contour, moved: Contour, margin: float, slack: float) -> None:
    """Raise MarginImpossible unless the result is fit to be cut and nowhere nearer to the contour than the margin."""
    defect = contour_defect(moved)
    if defect:
        raise MarginImpossible(f"moved by {margin:g}, {defect}")
    # Rings that do not meet are nearest at a vertex of one of them.
    nearest = min(
        min(float(distances_to_ring(own, other).min()), float(distances_to_ring(other, own).min()))
        for own in moved.rings
        for other in contour.rings
    )
    inner, outer = (moved, contour) if margin > 0 else (contour, moved)
    if nearest < abs(margin) - slack or not contains(outer.exterior, inner.exterior[:1])[0]:
        raise MarginImpossible(f"moved by {margin:g}, it comes within {nearest:g} of where it was")
