"""How well an outline agrees with the true one: distances along both, and the share of area that they have in common.

Places run along all rings, exterior and holes, at equal spacing, so every stretch of outline counts by its length. Of
both ways, found to true and true to found, the worse is told: an outline that leaves out a hole is near the truth
wherever it is, but the truth is not near it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Float64s
from contour.geometry.rectifier import Rectifier
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, Ring, densified
from contour.geometry.segments import BoxTree, distances_to_tree, near_pairs

SPACING_PX = 0.5
LEAST_PLACES = 8


@dataclass(frozen=True, eq=False)
class Agreement:
    """Distances in pixels from places along the found outline to the true one, (N,), and back, (M,); area in common.

    iou: intersection over union, 0 to 1.
    """

    to_truth_px: Float64s
    to_found_px: Float64s
    iou: float

    @property
    def mean_px(self) -> float:
        """The mean distance, of the worse way."""
        return self._worse(np.mean)

    @property
    def p95_px(self) -> float:
        """The 95th percentile, of the worse way."""
        return self._worse(lambda distances: np.percentile(distances, 95))

    @property
    def hausdorff_px(self) -> float:
        """The largest distance, low by at most a quarter of a pixel."""
        return self._worse(np.max)

    def holds(self, bound_px: float) -> bool:
        """True where 95 % of the true outline lies within the bound of the found one."""
        return float(np.percentile(self.to_found_px, 95)) <= bound_px

    def _worse(self, figure: Callable[[Float64s], np.floating]) -> float:
        return max(float(figure(self.to_truth_px)), float(figure(self.to_found_px)))


def agreement(found: Contour, truth: Contour, spacing_px: float = SPACING_PX) -> Agreement:
    """Compare two contours in pixels, whose edges are straight there (see `rectified_edges`)."""
    ours, theirs = places_along(found, spacing_px), places_along(truth, spacing_px)
    return Agreement(distances_to(ours, truth), distances_to(theirs, found), intersection_over_union(found, truth))


def places_along(contour: Contour, spacing: float) -> Float64s:
    """Points along all rings at equal spacing (at most `spacing`), shape (N, 2)."""
    return np.concatenate([_along(RingLengths.of(ring), spacing) for ring in contour.rings])


def _along(ring: RingLengths, spacing: float) -> Float64s:
    count = max(LEAST_PLACES, int(np.ceil(ring.length / spacing)))
    return ring.at(np.asarray((np.arange(count) + 0.5) * (ring.length / count)))


def distances_to(points: Float64s, contour: Contour) -> Float64s:
    """Distance of each point to the nearest place on any ring, shape (N,)."""
    return distances_to_tree(points, BoxTree.of_segments(*_edges(contour)))


def rectified_edges(contour: Contour, rectifier: Rectifier, step: float = 4.0) -> Contour:
    """The contour whose edges are straight in rectified coordinates, densified there, in raw pixels."""
    return Contour.of(rectifier.unrectify(densified(rectifier.rectify(ring), step)) for ring in contour.rings)


def intersection_over_union(one: Contour, other: Contour) -> float:
    """The area that both cover over that which any covers, exact; 0 where none covers any.

    Inside is by the even-odd rule over all rings of a contour. Between the heights at which edges end or cross, the
    lengths covered on a horizontal line change linearly, so those on the middle line give the area of the strip.
    """
    (start, end), count = _edges(one), len(np.concatenate(one.rings))
    more_start, more_end = _edges(other)
    start, end = np.concatenate([start, more_start]), np.concatenate([end, more_end])
    heights = np.unique(np.concatenate([start[:, 1], _crossings_y(start, end)]))
    middles = (heights[:-1] + heights[1:]) / 2
    low, high = np.minimum(start[:, 1], end[:, 1]), np.maximum(start[:, 1], end[:, 1])
    first, strips = np.searchsorted(middles, low), np.searchsorted(middles, high) - np.searchsorted(middles, low)
    edge = np.repeat(np.arange(len(start)), strips)
    strip = np.arange(len(edge)) - np.repeat(np.cumsum(strips) - strips - first, strips)
    share = (middles[strip] - start[edge, 1]) / (end[edge, 1] - start[edge, 1])
    x = start[edge, 0] + share * (end[edge, 0] - start[edge, 0])
    order = np.lexsort((x, strip))
    strip, x, edge = strip[order], x[order], edge[order]
    # Each ring crosses each middle line an even number of times, so counts may run on from strip to strip.
    in_one, in_other = np.cumsum(edge < count) % 2 == 1, np.cumsum(edge >= count) % 2 == 1
    area = np.diff(x, append=0.0) * np.diff(heights)[strip]
    union = float(area[in_one | in_other].sum())
    return float(area[in_one & in_other].sum()) / union if union > 0 else 0.0


def _edges(contour: Contour) -> tuple[Ring, Ring]:
    """Where the edges of all rings begin and end, shape (N, 2) both."""
    return np.concatenate(contour.rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in contour.rings])


def _crossings_y(start: Float64s, end: Float64s) -> Float64s:
    """The heights at which any two of the edges cross."""
    found = [np.zeros(0)]
    along = end - start
    for i, j in near_pairs(BoxTree.of_segments(start, end)):
        apart = start[j] - start[i]
        turn = along[i, 0] * along[j, 1] - along[i, 1] * along[j, 0]
        open_ = np.flatnonzero(turn)
        a, b, apart, turn = along[i[open_]], along[j[open_]], apart[open_], turn[open_]
        s = (apart[:, 0] * b[:, 1] - apart[:, 1] * b[:, 0]) / turn
        t = (apart[:, 0] * a[:, 1] - apart[:, 1] * a[:, 0]) / turn
        crosses = (s > 0) & (s < 1) & (t > 0) & (t < 1)
        found.append((start[i[open_], 1] + s * a[:, 1])[crosses])
    return np.concatenate(found)
