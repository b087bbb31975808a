"""How sure a calibration is: a 95 % bound in millimetres for every place in the picture and every height."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.errors import CalibrationError
from contour.geometry.arrays import Float64s
from contour.image.opencv_boards import inside_ring


@dataclass(frozen=True, eq=False)
class PositionUncertainty:
    """A map over the picture at several heights: the distance from the truth that 95 % of such maps keep below.

    `map_mm` has shape (heights, rows, columns), its corners are the picture's corner pixels; `heights_mm` rise.
    `figures_mm` holds one figure a height, for the part of the picture where the calibration's points lay:
    `covered_px`, a ring of pixels, shape (N, 2); None where nobody said, and then nothing is refused for it.
    """

    image_width: int
    image_height: int
    heights_mm: Float64s
    figures_mm: Float64s
    map_mm: Float64s
    covered_px: Float64s | None = None

    def __post_init__(self) -> None:
        for name in ("heights_mm", "figures_mm", "map_mm"):
            values = np.array(getattr(self, name), dtype=np.float64)
            if not np.isfinite(values).all():
                raise CalibrationError(f"uncertainty: {name} is not finite throughout. Calibrate again.")
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        shape, heights = self.map_mm.shape, self.heights_mm
        if heights.ndim != 1 or not len(heights) or (np.diff(heights) <= 0).any():
            raise CalibrationError(f"uncertainty: heights_mm is {heights.tolist()}, expected rising numbers.")
        if self.figures_mm.shape != heights.shape or len(shape) != 3 or len(heights) != shape[0] or min(shape[1:]) < 2:
            raise CalibrationError(
                f"uncertainty: {self.figures_mm.size} figures and a map of shape {shape} for {len(heights)} heights, "
                "expected one figure a height, and a map of at least 2 x 2 places for each. Calibrate again."
            )
        self._check_covered()
        if min(self.map_mm.min(), self.figures_mm.min()) < 0:
            raise CalibrationError("uncertainty: a figure is negative, expected 0 mm or more. Calibrate again.")

    def _check_covered(self) -> None:
        if self.covered_px is None:
            return
        ring = np.array(self.covered_px, dtype=np.float64)
        if ring.ndim != 2 or ring.shape[1:] != (2,) or len(ring) < 3 or not np.isfinite(ring).all():
            raise CalibrationError(
                f"uncertainty: covered_px has shape {ring.shape}, expected three or more finite points. Calibrate "
                "again."
            )
        ring.flags.writeable = False
        object.__setattr__(self, "covered_px", ring)

    def uncovered(self, points_px: Float64s) -> Float64s:
        """The pixels that lie outside the covered part, shape (M, 2): none where it is not stated."""
        if self.covered_px is None:
            return np.empty((0, 2))
        return np.asarray(points_px[~inside_ring(self.covered_px, points_px)])

    @classmethod
    def everywhere(cls, image_width: int, image_height: int, bound_mm: float) -> PositionUncertainty:
        """The same bound at every place and height."""
        flat = np.full((1, 2, 2), bound_mm)
        return cls(image_width, image_height, np.zeros(1), np.array([bound_mm]), flat)

    def at(self, points_px: Float64s, height_mm: float) -> Float64s:
        """The 95 % bound at each pixel on the plane z = `height_mm`, shape (N,), mm; linear between the map's places.

        Pixels beside the picture get its border's value; beyond the map's heights the last two go on in a line.
        """
        rows, columns = self.map_mm.shape[1:]
        last = np.array([columns - 1, rows - 1])
        size = np.array([max(self.image_width - 1, 1), max(self.image_height - 1, 1)])
        place = np.clip(np.asarray(points_px, dtype=np.float64) / size, 0.0, 1.0) * last
        first = np.minimum(place.astype(np.int64), last - 1)
        across, down = (place - first).T
        x, y = first.T
        plane = self._plane(height_mm)
        above = plane[y, x] * (1 - across) + plane[y, x + 1] * across
        below = plane[y + 1, x] * (1 - across) + plane[y + 1, x + 1] * across
        return np.asarray(above * (1 - down) + below * down)

    def figure_mm(self, height_mm: float) -> float:
        """The one figure for the plane z = `height_mm`, within the part of the picture the calibration covers."""
        low, share = self._between(height_mm)
        if len(self.heights_mm) == 1:
            return float(self.figures_mm[0])
        return max(float(self.figures_mm[low] * (1 - share) + self.figures_mm[low + 1] * share), 0.0)

    def _plane(self, height_mm: float) -> Float64s:
        low, share = self._between(height_mm)
        if len(self.heights_mm) == 1:
            return np.asarray(self.map_mm[0])
        return np.asarray(np.maximum(self.map_mm[low] * (1 - share) + self.map_mm[low + 1] * share, 0.0))

    def _between(self, height_mm: float) -> tuple[int, float]:
        """The height's lower neighbour, and its share of the way to the upper one."""
        heights = self.heights_mm
        if len(heights) == 1:
            return 0, 0.0
        low = int(np.clip(np.searchsorted(heights, height_mm) - 1, 0, len(heights) - 2))
        return low, float((height_mm - heights[low]) / (heights[low + 1] - heights[low]))
