"""What one picture shows of a gauge: its lengths as the cell measures them, and how straight its lines come out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Float64s

CLASSES = ("x", "rising", "y", "falling")
"""Directions in the machine frame: along x, up to the right, along y, down to the right, each within 22.5 degrees."""

_SAME_SHARE, _SAME_DEG = 0.05, 10.0
"""A gauge laid again without moving it lies within a part of its size; nearer it is no new place."""


@dataclass(frozen=True, eq=False)
class SeenLength:
    """A length between two ends, shape (2, 2), machine frame, mm.

    `per_height` is what it would be longer by, in mm, were the plane 1 mm higher than it was taken to be.
    """

    name: str
    measured_mm: float
    ends_mm: Float64s
    per_height: float

    @property
    def direction_deg(self) -> float:
        """Against the machine's x axis, counter-clockwise, 0 to 180."""
        x, y = self.ends_mm[1] - self.ends_mm[0]
        return float(np.degrees(np.arctan2(y, x)) % 180.0)

    @property
    def direction(self) -> str:
        """The one of CLASSES that it runs along."""
        return CLASSES[int((self.direction_deg + 22.5) // 45.0) % 4]


@dataclass(frozen=True)
class SeenLine:
    """A line of the gauge that is straight: how far its points scatter across it, least to most, mm."""

    name: str
    form_mm: float


@dataclass(frozen=True, eq=False)
class SeenGauge:
    """All that one picture shows of it. `outline_mm`: ring around it, (N, 2), machine frame; `turn_deg` its turn.

    `heights_mm`: how high its plane lies at its corners, (4,), by its perspective; None where that is not seen.
    """

    lengths: tuple[SeenLength, ...]
    lines: tuple[SeenLine, ...]
    outline_mm: Float64s
    turn_deg: float
    heights_mm: Float64s | None = None

    @property
    def middle_mm(self) -> Float64s:
        """The middle of its outline, shape (2,)."""
        return np.asarray(self.outline_mm.mean(axis=0))

    def same_place(self, other: SeenGauge) -> bool:
        """True where it lies as in the other picture; a gauge turned by half a turn lies anew."""
        size = float(np.linalg.norm(np.ptp(self.outline_mm, axis=0)))
        moved = float(np.linalg.norm(self.middle_mm - other.middle_mm))
        turned = abs((self.turn_deg - other.turn_deg + 180.0) % 360.0 - 180.0)
        return moved < _SAME_SHARE * size and turned < _SAME_DEG


def straightness_mm(points_mm: Float64s, share: float = 1.0) -> float:
    """Least range that holds this share of the points' distances from their line of least squares, (N, 2) in, mm."""
    rest = points_mm - points_mm.mean(axis=0)
    _, _, axes = np.linalg.svd(rest, full_matrices=False)
    away = np.sort(rest @ axes[1])
    held = int(np.ceil(share * len(away)))
    return float((away[held - 1 :] - away[: len(away) - held + 1]).min())
