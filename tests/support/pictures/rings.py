"""Rings for tests: star-shaped, traced from random pixels, and dense; all simple unless a test says otherwise."""

from __future__ import annotations

import cv2
import numpy as np
import shapely
from hypothesis import assume
from hypothesis import strategies as st
from numpy.typing import NDArray

from contour.geometry.rings import Contour, Ring, contour_defect, densified, largest_loop

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
"""Counter-clockwise for y up, area 100."""


def star(radii: list[float], turn: float = 0.0) -> Ring:
    """Star-shaped about the origin, so simple for radii above 0; counter-clockwise."""
    angles = turn + np.arange(len(radii)) * (2 * np.pi / len(radii))
    return np.column_stack([np.cos(angles), np.sin(angles)]) * np.array(radii)[:, None]


def pixel_outline(mask: NDArray[np.uint8]) -> Ring | None:
    """The outline of the largest white region through pixel centres, every pixel a vertex; None if it has no area."""
    found, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    ring = max(found, key=cv2.contourArea, default=None)
    if ring is None or cv2.contourArea(ring) == 0:
        return None
    return largest_loop(ring.reshape(-1, 2).astype(np.float64))


def random_blob(seed: int, size: int = 48) -> Ring:
    """A ragged pixel outline: smoothed noise above its middle, always the same for a seed."""
    rng = np.random.default_rng(seed)
    field = cv2.GaussianBlur(rng.normal(size=(size, size)), (0, 0), rng.uniform(1.0, 5.0))
    ring = pixel_outline((field > np.median(field)).astype(np.uint8) * 255)
    assert ring is not None
    return ring


stars = st.builds(
    star,
    st.lists(st.floats(1.0, 100.0), min_size=5, max_size=60),
    st.floats(0.0, 6.28),
)
blobs = st.builds(random_blob, st.integers(0, 10_000))
dense_stars = stars.map(lambda ring: densified(ring, 3.0))
simple_rings = st.one_of(stars, blobs, dense_stars)


@st.composite
def contours(draw: st.DrawFn) -> Contour:
    ring = draw(simple_rings)
    holes: tuple[np.ndarray, ...] = ()
    if draw(st.booleans()):
        solid = shapely.Polygon(ring)
        middle = solid.representative_point()
        room = solid.exterior.distance(middle)
        radii = draw(st.lists(st.floats(0.2, 0.9), min_size=4, max_size=12))
        holes = (star([radius * room for radius in radii])[::-1] + np.array([middle.x, middle.y]),)
    contour = Contour(ring, holes)
    assume(contour_defect(contour) is None)
    return contour


def alike(ring: Ring, other: Ring, distance: float) -> bool:
    """Whether no point of either curve is farther than that from the other, by a part in a thousand."""
    curves = [shapely.LinearRing(ring), shapely.LinearRing(other)]
    near = [curve.buffer(distance * 1.001 + 1e-6, quad_segs=32) for curve in curves]  # its arcs lie 3e-4 inside
    return bool(near[0].covers(curves[1]) and near[1].covers(curves[0]))


def solid(contour: Contour) -> shapely.Polygon:
    return shapely.Polygon(contour.exterior, contour.holes)
