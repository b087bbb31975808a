"""Contours as shapely's polygons, and back. Imported only where shapely is there."""

from __future__ import annotations

import numpy as np
import shapely

from contour.geometry.rings import Contour, oriented_contour


def polygon_of(contour: Contour) -> shapely.Polygon:
    """The contour as shapely has it."""
    return shapely.Polygon(contour.exterior, list(contour.holes))


def contour_of(polygon: shapely.Polygon) -> Contour:
    """The polygon as a contour, its exterior counter-clockwise, holes clockwise."""
    rings = [np.asarray(ring.coords, np.float64)[:-1, :2] for ring in (polygon.exterior, *polygon.interiors)]
    return oriented_contour(Contour(rings[0], tuple(rings[1:])), counter_clockwise=True)


def point_within(contour: Contour) -> tuple[float, float]:
    """A place in the material, well inside of most shapes."""
    place = polygon_of(contour).representative_point()
    return round(float(place.x), 2), round(float(place.y), 2)
