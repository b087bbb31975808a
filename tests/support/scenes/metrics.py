"""How far a traced contour lies from the true one: distances along both outlines, signed bias, overlap.

Samples run along all rings, exterior and holes, at equal spacing, so every stretch of outline counts by its length.
Each distance is taken both ways (found to true, true to found) and the worse way is told: a contour that leaves out a
hole is near the truth wherever it is, but the truth is not near it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from contour.geometry.rectifier import Rectifier
from contour.geometry.rings import Contour, Ring
from contour.synthetic import densified

SPACING_PX = 0.5


@dataclass(frozen=True)
class Agreement:
    """Distances in pixels between a found and a true contour; `bias_px` > 0: the found one lies outside."""

    mean_px: float
    p95_px: float
    hausdorff_px: float
    bias_px: float
    iou: float
    vertices: int


def agreement(
    found: Contour, truth: Contour, *, rectifier: Rectifier | None = None, spacing_px: float = SPACING_PX
) -> Agreement:
    """Compare two contours in pixels.

    Where the method fitted straight edges in rectified coordinates, `rectifier` densifies them there first: in pixels
    they are curves. The truth must be dense already (see `contour.synthetic.truth_px`).
    """
    dense = found if rectifier is None else rectified_edges(found, rectifier)
    ours, theirs = samples(dense, spacing_px), samples(truth, spacing_px)
    to_truth, to_found = distances(ours, truth), distances(theirs, dense)
    found_area, true_area = region(dense), region(truth)
    outside = np.where(shapely.contains_xy(true_area, ours[:, 0], ours[:, 1]), -1.0, 1.0)
    covered = np.where(shapely.contains_xy(found_area, theirs[:, 0], theirs[:, 1]), 1.0, -1.0)
    union = shapely.area(shapely.union(found_area, true_area))
    return Agreement(
        mean_px=max(float(to_truth.mean()), float(to_found.mean())),
        p95_px=max(float(np.percentile(to_truth, 95)), float(np.percentile(to_found, 95))),
        hausdorff_px=max(float(to_truth.max()), float(to_found.max())),
        bias_px=0.5 * (float((to_truth * outside).mean()) + float((to_found * covered).mean())),
        iou=float(shapely.area(shapely.intersection(found_area, true_area)) / union) if union > 0.0 else 0.0,
        vertices=found.point_count,
    )


def samples(contour: Contour, spacing: float) -> NDArray[np.float64]:
    """Points along all rings at equal spacing (at most `spacing`), shape (N, 2)."""
    return np.concatenate([_along(ring, spacing) for ring in contour.rings])


def _along(ring: Ring, spacing: float) -> NDArray[np.float64]:
    closed = np.concatenate((ring, ring[:1]))
    reached = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))))
    count = max(8, int(np.ceil(reached[-1] / spacing)))
    at = (np.arange(count) + 0.5) * (reached[-1] / count)
    return np.column_stack((np.interp(at, reached, closed[:, 0]), np.interp(at, reached, closed[:, 1])))


def distances(points: NDArray[np.float64], contour: Contour) -> NDArray[np.float64]:
    """Distance of each point to the nearest place on any ring, shape (N,)."""
    ends = [np.stack((ring, np.roll(ring, -1, axis=0)), axis=1) for ring in contour.rings]
    edges = np.asarray(shapely.linestrings(np.concatenate(ends)), dtype=object)
    tree = shapely.STRtree(edges)
    pairs, found = tree.query_nearest(shapely.points(points), return_distance=True, all_matches=False)
    result = np.empty(len(points))
    result[pairs[0]] = found
    return result


def region(contour: Contour) -> shapely.Geometry:
    """The area inside the exterior and outside the holes; a ring that crosses itself is mended."""
    polygon = shapely.Polygon(contour.exterior, [hole for hole in contour.holes if len(hole) >= 3])
    return polygon if polygon.is_valid else shapely.make_valid(polygon)


def rectified_edges(contour: Contour, rectifier: Rectifier, step: float = 4.0) -> Contour:
    """The contour whose edges are straight in rectified coordinates, densified there, in raw pixels."""
    exterior, *holes = (rectifier.unrectify(densified(rectifier.rectify(ring), step)) for ring in contour.rings)
    return Contour(exterior, tuple(holes))
