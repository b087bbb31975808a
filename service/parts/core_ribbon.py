"""The core's ribbon in one block: read from the picture, told, and drawn over it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from contour.calibration.calibration import Calibration
from contour.errors import CalibrationError
from contour.geometry.arrays import Bytes, Float64s
from contour.geometry.rings import Contour
from contour.ribbon.ribbon import CorePicture, Ribbon, read_ribbon
from contour.walls.lightness import wall_light

Line = tuple[tuple[float, float], tuple[float, float]]

_LINE_SHARE = 0.3
_CAMERA_PX = 1000.0
"""Distance of a camera of which only the scale is known, in pixels of its picture: a usual lens. It looks down."""


@dataclass(frozen=True)
class CoreRibbon:
    """What the picture tells of the ribbon's direction in the machine frame, and a line along it in the picture."""

    told: Ribbon
    line_px: Line | None = None

    def fields(self) -> dict[str, Any]:
        """As `combtrace fit --json`, journal and documents tell it."""
        told = self.told
        kept = [None if value is None else round(value, 3) for value in (told.angle_deg, told.bound_deg)]
        return {"angle_deg": kept[0], "bound_deg": kept[1], "told_by": told.told_by, "why": told.why or None}

    def kept(self) -> dict[str, Any]:
        """All of it as JSON's types, for `of_kept`."""
        return {**asdict(self.told), "line_px": self.line_px}

    @classmethod
    def of_kept(cls, kept: dict[str, Any]) -> CoreRibbon:
        """What was kept."""
        line = kept["line_px"]
        told = Ribbon(kept["angle_deg"], kept["bound_deg"], kept["told_by"], kept["why"])
        return cls(told, None if line is None else _line(line))

    @property
    def words(self) -> str:
        """In a few words."""
        told = self.told
        if told.angle_deg is None:
            return "ribbon not told"
        return f"ribbon at {told.angle_deg:.1f} degrees within {told.bound_deg:.1f}, by {told.told_by}"


def core_ribbon(
    picture: Bytes, block: Contour, pitch_px: float, *, bright: bool, calibration: Calibration, height_mm: float
) -> CoreRibbon:
    """The ribbon of the core whose outline in the picture is `block`, whose walls are bright, or dark, and whose top
    lies at `height_mm`.
    """
    light = wall_light(picture)

    def to_mm(pixels: Float64s) -> Float64s:
        return calibration.to_machine(calibration.to_work(pixels, height_mm))

    def lean_px(pixels: Float64s) -> Float64s:
        lean = calibration.to_pixels(to_mm(pixels), height_mm - 1.0) - pixels
        return lean if lean.any() else (pixels - (np.array(light.shape[::-1]) - 1.0) / 2.0) / _CAMERA_PX

    try:
        told = read_ribbon(CorePicture(light, block, pitch_px, bright, to_mm, lean_px))
        if told.angle_deg is None:
            return CoreRibbon(told)
        return CoreRibbon(told, _drawn(told.angle_deg, to_mm(block.exterior), calibration, height_mm))
    except CalibrationError as error:
        return CoreRibbon(Ribbon(why=f"the calibration does not hold there: {error}"))


def _drawn(angle_deg: float, block: Float64s, calibration: Calibration, height_mm: float) -> Line:
    """A line along the ribbon through the middle of the block's box, (x, y) of its ends, pixels."""
    low, high = block.min(axis=0), block.max(axis=0)
    way = np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))]) * _LINE_SHARE * (high - low).min()
    return _line(calibration.to_pixels(0.5 * (low + high) + np.stack([-way, way]), height_mm).round(2).tolist())


def _line(ends: Any) -> Line:
    (x, y), (u, v) = ends
    return (x, y), (u, v)
