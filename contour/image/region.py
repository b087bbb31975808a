"""The part of a picture that is looked at; nothing is seen outside of it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Bytes, Float64s, medians
from contour.geometry.rings import Contour, Ring
from contour.geometry.segments import contains, distances_to_ring
from contour.image.pixel_grid import fill_finely, pixels_of

_LEAST_PX = 32


@dataclass(frozen=True, eq=False)
class Region:
    """A region of interest: its corners in pixels, shape (N, 2), float64."""

    ring: Ring

    @classmethod
    def of_box(cls, left: float, top: float, right: float, bottom: float) -> Region:
        """The region between two columns and two rows of pixels, both included."""
        return cls(np.array([[left, top], [right, top], [right, bottom], [left, bottom]], dtype=np.float64))

    def enlarged(self, times: int) -> Region:
        """The region in the picture shown so many times as large."""
        return Region(pixels_of(self.ring, times))

    def cut(self, picture: Bytes) -> tuple[Bytes, Float64s]:
        """The part of the picture within the region's box, and that part's first pixel (x, y).

        What lies in the box but outside the region has the colour that is usual along the region's border: there is
        nothing to see. Raises ParameterError where less than 32 x 32 px of the region lie in the picture.
        """
        height, width = picture.shape[:2]
        low = np.maximum(np.ceil(self.ring.min(axis=0)), 0).astype(int)
        high = np.minimum(np.floor(self.ring.max(axis=0)), [width - 1, height - 1]).astype(int)
        if (high - low + 1 < _LEAST_PX).any():
            (x0, y0), (x1, y1) = self.ring.min(axis=0), self.ring.max(axis=0)
            raise ParameterError(
                f"The region of interest, x {x0:.0f} to {x1:.0f} px, y {y0:.0f} to {y1:.0f} px, leaves less than "
                f"{_LEAST_PX} x {_LEAST_PX} px of a picture of {width} x {height} px. Correct roi_px or roi_mm."
            )
        part = picture[low[1] : high[1] + 1, low[0] : high[0] + 1]
        inside = np.zeros(part.shape[:2], np.uint8)
        fill_finely(inside, [self.ring - low], 1)
        if inside.all():
            return np.ascontiguousarray(part), low.astype(np.float64)
        rim = inside - cv2.erode(inside, np.ones((9, 9), np.uint8), borderValue=0)
        usual = medians(part[rim > 0], axis=0)
        filled = part.copy()
        filled[inside == 0] = np.rint(usual).astype(np.uint8)
        return filled, low.astype(np.float64)

    def margin(self, points: Ring) -> float:
        """How far inside the region the points (N, 2), pixels, all lie; negative where one is outside of it."""
        distance = distances_to_ring(points, self.ring)
        return float(np.where(contains(self.ring, points), distance, -distance).min())


def shifted(contour: Contour, by: Float64s) -> Contour:
    """The contour moved by (x, y) pixels."""
    return Contour(contour.exterior + by, tuple(hole + by for hole in contour.holes))
