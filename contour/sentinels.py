"""Fixed marks beside the table: where the calibration saw them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contour.errors import CalibrationError

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mark:
    """An ArUco mark: its id, and the pixels of its corners as its dictionary orders them, shape (4, 2)."""

    id: int
    corners_px: Floats

    def __post_init__(self) -> None:
        corners = np.array(self.corners_px, dtype=np.float64)
        if corners.shape != (4, 2) or not np.isfinite(corners).all():
            raise CalibrationError(f"Mark {self.id} has corners of shape {corners.shape}, expected (4, 2), all finite.")
        corners.flags.writeable = False
        object.__setattr__(self, "corners_px", corners)

    @property
    def middle_px(self) -> Floats:
        """The mean of its corners, shape (2,)."""
        return np.asarray(self.corners_px.mean(axis=0))

    @property
    def size_px(self) -> float:
        """The mean length of its sides."""
        return float(np.linalg.norm(self.corners_px - np.roll(self.corners_px, 1, axis=0), axis=1).mean())


@dataclass(frozen=True)
class Sentinels:
    """The marks of one dictionary (DICT_5X5_250, …) that the calibration saw, each id once."""

    dictionary: str
    marks: tuple[Mark, ...]

    def __post_init__(self) -> None:
        ids = [mark.id for mark in self.marks]
        if not ids or len(set(ids)) != len(ids):
            raise CalibrationError(f"Sentinels {ids}: expected one or more marks, each id once.")
