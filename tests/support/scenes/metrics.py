"""How far a traced contour lies from the true one, as `contour.geometry.agreement` says, and to which side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from contour.geometry import agreement as geometry
from contour.geometry.agreement import SPACING_PX, places_along, rectified_edges
from contour.geometry.rectifier import Rectifier
from contour.geometry.rings import Contour


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
    figures = geometry.agreement(dense, truth, spacing_px)
    outside = 1.0 - 2.0 * _covered(truth, dense, spacing_px)
    inside = 2.0 * _covered(dense, truth, spacing_px) - 1.0
    return Agreement(
        mean_px=figures.mean_px,
        p95_px=figures.p95_px,
        hausdorff_px=figures.hausdorff_px,
        bias_px=0.5 * (float((figures.to_truth_px * outside).mean()) + float((figures.to_found_px * inside).mean())),
        iou=figures.iou,
        vertices=found.point_count,
    )


def _covered(area: Contour, outline: Contour, spacing_px: float) -> np.ndarray:
    """1.0 for each place along the outline that lies in the area, else 0.0."""
    polygon = shapely.Polygon(area.exterior, [hole for hole in area.holes if len(hole) >= 3])
    whole = polygon if polygon.is_valid else shapely.make_valid(polygon)
    places = places_along(outline, spacing_px)
    return shapely.contains_xy(whole, places[:, 0], places[:, 1]).astype(float)
