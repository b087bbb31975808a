"""Contours that nobody has seen: another one at each measurement, so that none can pass for its neighbour."""

from __future__ import annotations

import random

import numpy as np

from contour.geometry.rings import Contour, area
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement


class RandomContours(Measurer):
    """A measurer that looks at no picture: another contour each time, with or without a hole."""

    def __init__(self, chance: random.Random, most_vertices: int) -> None:
        super().__init__(None)
        self._chance = chance
        self._most = most_vertices

    def measure(self, *_: object, **__: object) -> Measurement:
        exterior = self._ring(self._chance.randint(3, self._most), 50, 100)
        holes = (self._ring(self._chance.randint(3, 6), 5, 15)[::-1],) if self._chance.random() < 0.3 else ()
        contour = Contour(exterior, holes)
        return Measurement("find-contours", pixels=contour, millimetres=contour, area_mm2=area(contour))

    def _ring(self, vertices: int, least_mm: float, most_mm: float) -> np.ndarray:
        """A star-shaped ring about the origin, counter-clockwise, in whole micrometres."""
        turns = [number + self._chance.uniform(-0.3, 0.3) for number in range(vertices)]
        angles = np.array(turns) * 2 * np.pi / vertices
        radii = np.array([self._chance.uniform(least_mm, most_mm) for _ in range(vertices)])
        return np.round(np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1), 3)
