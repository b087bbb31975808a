"""Contours that need no file: each tries another part of a controller's program."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contour.geometry.rings import Contour, Ring
from service.commissioning.given_contours import GivenContour


def _ring(*points: tuple[float, float]) -> Ring:
    return np.array(points, dtype=np.float64)


def _rectangle() -> Contour:
    return Contour(_ring((0, 0), (100, 0), (100, 50), (0, 50)))


def _corner() -> Contour:
    return Contour(_ring((0, 0), (100, 0), (100, 40), (40, 40), (40, 80), (0, 80)))


def _holes() -> Contour:
    square = _ring((10, 10), (10, 30), (30, 30), (30, 10))
    triangle = _ring((50, 10), (60, 40), (90, 10))
    return Contour(_rectangle().exterior, (square, triangle))


def _circle() -> Contour:
    return Contour(_around(np.full(400, 100.0)))


def _gear() -> Contour:
    return Contour(_around(np.where(np.arange(1500) // 15 % 2, 190.0, 200.0)))


def _crossing() -> Contour:
    return Contour(_ring((0, 0), (100, 0), (100, 50), (20, 50), (30, 60), (20, 60), (30, 50), (0, 50)))


def _around(radii_mm: Ring) -> Ring:
    """Vertices at equal angles, the lowest and leftmost at 0."""
    angle = np.arange(len(radii_mm)) * 2 * np.pi / len(radii_mm)
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * radii_mm[:, None]
    return np.asarray(np.round(ring - ring.min(axis=0), 3))


SHAPES: dict[str, tuple[str, Callable[[], Contour]]] = {
    "rectangle": ("100 x 50 mm, that of the protocol's worked example", _rectangle),
    "corner": ("an L of 6 vertices", _corner),
    "holes": ("the rectangle with two holes", _holes),
    "circle": ("400 vertices, on one page of the default layout", _circle),
    "gear": ("1500 vertices, on several pages of the default layout", _gear),
    "crossing": ("crosses itself: refused with 131, nothing is sent", _crossing),
}
"""What each is, and how it is made: lower left corner of its box at (0, 0)."""


def shape(name: str, at_mm: tuple[float, float] = (0.0, 0.0)) -> GivenContour:
    """The shape of that name, the lower left corner of its box at `at_mm`."""
    contour = SHAPES[name][1]()
    moved = tuple(ring + np.array(at_mm) for ring in contour.rings)
    return GivenContour(name, Contour(moved[0], moved[1:]), uncertainty_mm=0.2)
