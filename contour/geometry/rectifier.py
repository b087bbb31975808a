"""Raw pixels to a plane without lens distortion and back: what fitting needs to know of a calibration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Rectifier(Protocol):
    """Maps raw pixels to a plane without lens distortion, in units of about a pixel, and back.

    Both verbs take and return shape (N, 2), float64.
    """

    def rectify(self, points_px: NDArray[np.float64]) -> NDArray[np.float64]: ...

    def unrectify(self, points: NDArray[np.float64]) -> NDArray[np.float64]: ...


@dataclass(frozen=True)
class CroppedRectifier:
    """A rectifier for the pixels of a part of the picture, whose first one is `first` (x, y) of the whole."""

    whole: Rectifier
    first: NDArray[np.float64]

    def rectify(self, points_px: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.whole.rectify(points_px + self.first)

    def unrectify(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.whole.unrectify(points) - self.first
