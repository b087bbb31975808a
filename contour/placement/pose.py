"""Where a part lies: a turn and a shift of its drawing, and which turns it may take."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour

MOST_STEPS = 360
"""Turns that are tried one by one: more would take longer than all of them together."""

_FREE_STEP = math.radians(1.0)
_FULL_TURN = 2 * math.pi
_SLACK = 1e-9


@dataclass(frozen=True)
class Pose:
    """The drawing turned by `angle` (radians, counter-clockwise) about its origin, then moved by (x, y), mm."""

    x: float
    y: float
    angle: float

    @property
    def angle_deg(self) -> float:
        """The angle in degrees, above -180 and up to 180."""
        turned = math.degrees(math.remainder(self.angle, _FULL_TURN))
        return 180.0 if turned <= -180.0 else turned

    def moved(self, points: Float64s) -> Float64s:
        """Points (N, 2) of the drawing where they come to lie."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]) + (self.x, self.y))

    def undone(self, points: Float64s) -> Float64s:
        """Points (N, 2) where they would lie in the drawing: `moved` the other way."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        return np.asarray((points - (self.x, self.y)) @ np.array([[cosine, -sine], [sine, cosine]]))

    def placed(self, part: Contour) -> Contour:
        """All rings of the part where they come to lie."""
        return Contour(self.moved(part.exterior), tuple(self.moved(hole) for hole in part.holes))


@dataclass(frozen=True)
class Turns:
    """The turns that a part may take: intervals (low, high), radians; one of no length is a single angle.

    The whole circle is one interval without ends.
    """

    intervals: tuple[tuple[float, float], ...]

    @classmethod
    def free(cls) -> Turns:
        """Any turn."""
        return cls(((-math.inf, math.inf),))

    @classmethod
    def steps(cls, count: int) -> Turns:
        """`count` equal steps of the circle, the first as drawn; 1 = as drawn alone. Raises ParameterError."""
        if not 1 <= count <= MOST_STEPS:
            raise ParameterError(f"rotation steps: {count}, expected 1 to {MOST_STEPS}")
        return cls(tuple((angle, angle) for angle in (_FULL_TURN * k / count for k in range(count))))

    def along(self, direction_deg: float, tolerance_deg: float) -> Turns:
        """Those that leave the drawing's x axis within the tolerance of a direction, either way round.

        A core's ribbon has no sense: 30 degrees and 210 are one direction. Raises ParameterError where none is left.
        """
        if tolerance_deg >= 90.0:
            return self
        half = math.radians(tolerance_deg)
        windows = [
            (middle - half, middle + half) for middle in (math.radians(direction_deg + turn) for turn in (0.0, 180.0))
        ]
        if self.intervals == Turns.free().intervals:
            return Turns(tuple(windows))
        kept = tuple(
            (angle, angle)
            for angle, _ in self.intervals
            if any(abs(math.remainder(angle - (low + high) / 2, _FULL_TURN)) <= half + _SLACK for low, high in windows)
        )
        if not kept:
            raise ParameterError(
                f"rotation: none of its {len(self.intervals)} angles leaves the part within {tolerance_deg:g} degrees "
                f"of the ribbon's {direction_deg:g}. Allow free rotation, more steps, or a wider tolerance"
            )
        return Turns(kept)

    def samples(self) -> list[tuple[float, tuple[float, float]]]:
        """Angles to begin from, each with its interval: all single ones, and every degree of an interval."""
        found = []
        for low, high in self.intervals:
            if math.isinf(low):
                angles = np.arange(0.0, _FULL_TURN - _SLACK, _FREE_STEP).tolist()
            else:
                angles = np.linspace(low, high, 1 + math.ceil((high - low) / _FREE_STEP)).tolist()
            found += [(angle, (low, high)) for angle in angles]
        return found

    @property
    def cyclic(self) -> bool:
        """True where the samples run round the whole circle, the last beside the first."""
        return math.isinf(self.intervals[0][0])

    def neighbours(self) -> list[bool]:
        """Of each sample but the last, whether the next one lies on the same interval."""
        return [one[1] == other[1] for one, other in pairwise(self.samples())]
