"""Whether a gauge was seen in enough places and directions, and which are missing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from contour.calibration.calibration import Calibration
from contour.geometry.arrays import Float64s
from contour.geometry.rings import densified
from contour.length_test.seen_gauge import CLASSES, SeenGauge

COLUMNS, ROWS = ("left", "middle", "right"), ("top", "middle", "bottom")
FEWEST_PLACES = 5
FEWEST_A_DIRECTION = 3
"""As VDI/VDE 2634-1 has several lengths along each of its lines: one alone says nothing of where it was off."""

_OUTLINE_STEPS = 8


@dataclass(frozen=True)
class Missing:
    """What is still to be seen: so many places, parts of the picture (column, row), lengths by direction."""

    places: int
    zones: tuple[tuple[str, str], ...]
    directions: tuple[tuple[str, int], ...]

    @property
    def nothing(self) -> bool:
        """True where the test is complete."""
        return not (self.places or self.zones or self.directions)


def missing(gauges: Sequence[SeenGauge], calibration: Calibration, height_mm: float, places: int) -> Missing:
    """What these lack of `places` places, all nine parts of the field, and each direction three times."""
    seen = {zone for gauge in gauges for zone in _zones(gauge, calibration, height_mm)}
    counts = Counter(length.direction for gauge in gauges for length in gauge.lengths)
    zones = tuple((column, row) for row in ROWS for column in COLUMNS if (column, row) not in seen)
    directions = tuple(
        (name, FEWEST_A_DIRECTION - counts[name]) for name in CLASSES if counts[name] < FEWEST_A_DIRECTION
    )
    return Missing(max(places - len(gauges), 0), zones, directions)


def field_px(calibration: Calibration) -> Float64s:
    """The part of the picture that may be measured in: low and high corner, shape (2, 2), pixels."""
    sure = calibration.uncertainty
    if sure is not None and sure.covered_px is not None:
        return np.array([sure.covered_px.min(axis=0), sure.covered_px.max(axis=0)])
    return np.array([[0.0, 0.0], [calibration.image_width - 1.0, calibration.image_height - 1.0]])


def _zones(gauge: SeenGauge, calibration: Calibration, height_mm: float) -> set[tuple[str, str]]:
    """The parts of the field, a third of its width and height each, that the gauge's outline or lengths reach."""
    size = float(np.ptp(gauge.outline_mm, axis=0).max())
    ends = [length.ends_mm for length in gauge.lengths]
    points = np.concatenate([densified(gauge.outline_mm, size / _OUTLINE_STEPS), *ends])
    low, high = field_px(calibration)
    share = (calibration.to_pixels(points, height_mm) - low) / (high - low)
    cells = np.clip(share * 3, 0, 2).astype(int)
    return {(COLUMNS[column], ROWS[row]) for column, row in cells.tolist()}
