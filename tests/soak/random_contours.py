"""Contours that nobody has seen: another one at each measurement, so that none can pass for its neighbour."""

from __future__ import annotations

import math
import random
from pathlib import Path

import numpy as np

from contour.geometry.rings import Contour, area
from contour.placement.place import Placement
from contour.placement.pose import Pose
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.parts.fit import PartFit
from service.parts.part import Part


class RandomContours(Measurer):
    """A measurer that looks at no picture: another contour each time, with or without a hole.

    parts: in most of them lies a part, as different as they are.
    """

    def __init__(self, chance: random.Random, most_vertices: int, *, parts: bool = False) -> None:
        super().__init__(None)
        self._chance = chance
        self._most = most_vertices
        self._parts = parts

    def measure(self, *_: object, **__: object) -> Measurement:
        exterior = self._ring(self._chance.randint(3, self._most), 50, 100)
        holes = (self._ring(self._chance.randint(3, 6), 5, 15)[::-1],) if self._chance.random() < 0.3 else ()
        contour = Contour(exterior, holes)
        part = self._part() if self._parts and self._chance.random() < 0.8 else None
        return Measurement("find-contours", pixels=contour, millimetres=contour, area_mm2=area(contour), part=part)

    def _part(self) -> PartFit:
        """A part somewhere, with or without a hole; the pose in whole µm and thousandths of a degree."""
        hole = (self._ring(3, 2, 4)[::-1],) if self._chance.random() < 0.5 else ()
        placed = Contour(self._ring(self._chance.randint(3, self._most), 20, 40), hole)
        x, y, angle = (round(self._chance.uniform(-300, 170), 3) for _ in range(3))
        placement = Placement(Pose(x, y, math.radians(angle)), 3.0, ((0.0, 0.0), (3.0, 0.0)))
        return PartFit(Part(Path("part.dxf"), placed, "mm"), placement, placed, 2.0, 0.5)

    def _ring(self, vertices: int, least_mm: float, most_mm: float) -> np.ndarray:
        """A star-shaped ring about the origin, counter-clockwise, in whole micrometres."""
        turns = [number + self._chance.uniform(-0.3, 0.3) for number in range(vertices)]
        angles = np.array(turns) * 2 * np.pi / vertices
        radii = np.array([self._chance.uniform(least_mm, most_mm) for _ in range(vertices)])
        return np.round(np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1), 3)
