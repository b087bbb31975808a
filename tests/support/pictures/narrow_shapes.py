"""Shapes with bumps and dents, as contours in pixels."""

from __future__ import annotations

import numpy as np
import shapely

from contour.geometry.rings import Contour

PITCH = 20.0
BLOCK = shapely.box(100, 100, 700, 500)


def contour(shape: shapely.Geometry, turn_deg: float = 0.0) -> Contour:
    """A polygon turned by so much, as contours in pixels run: exterior negative by the shoelace, holes positive."""
    turned = shapely.affinity.rotate(shape, turn_deg)
    oriented = shapely.geometry.polygon.orient(turned, -1.0)
    exterior, *holes = (np.array(ring.coords)[:-1] for ring in (oriented.exterior, *oriented.interiors))
    return Contour(exterior, tuple(holes))


def chip(width: float, depth: float) -> shapely.Geometry:
    """So many pitches wide and far out, at the middle of the block's lower edge (the larger y), with slanting sides."""
    w, d = 0.5 * width * PITCH, depth * PITCH
    return shapely.Polygon([(400 - w, 499), (400 + w, 499), (400 + 0.8 * w, 500 + d), (400 - 0.8 * w, 500 + d)])


def dent(width: float, depth: float) -> shapely.Geometry:
    return shapely.affinity.scale(chip(width, depth), yfact=-1, origin=(400, 500))
