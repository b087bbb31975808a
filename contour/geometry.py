"""Rings and contours: plane polygons as float64 arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Ring = NDArray[np.float64]
"""Vertices of a closed polygon, shape (N, 2), N >= 3, first vertex not repeated."""


@dataclass(frozen=True)
class Contour:
    """A block's outline: one exterior ring and the rings of its holes, in one unit (pixels or millimetres)."""

    exterior: Ring
    holes: tuple[Ring, ...] = ()

    @property
    def rings(self) -> tuple[Ring, ...]:
        """All rings, exterior first."""
        return (self.exterior, *self.holes)

    @property
    def point_count(self) -> int:
        """Vertices of all rings together."""
        return sum(len(ring) for ring in self.rings)
