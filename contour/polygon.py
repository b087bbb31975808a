"""From the traced contour to the cutting polygon: few vertices, the same ones in pixels and in millimetres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contour.calibration import Calibration, scales
from contour.errors import ParameterError
from contour.geometry import Contour, area, contour_defect, oriented_contour, simplify_indices
from contour.segments import distances_to_ring

PIXEL_TOLERANCE = 0.25
"""What simplification may shift where there is no calibration, px: below what any method here claims to resolve."""

_HALVINGS = 4
"""Times the tolerance is halved when rings that were apart would meet; after that the rings stay as traced."""


@dataclass(frozen=True)
class Polygon:
    """The polygon that would be sent: exterior counter-clockwise, holes clockwise as seen in the work frame.

    `pixels` and `millimetres` hold the same vertices in the same order; pixels run y down, so their exterior has a
    negative shoelace area. Millimetres are in the machine frame. `mm_per_px` is the largest scale on the exterior: an
    uncertainty in pixels times it is one in millimetres. All three millimetre fields are None without a calibration.
    `shift_px` is the largest distance of a traced vertex from the polygon: what leaving vertices out has cost.
    """

    pixels: Contour
    millimetres: Contour | None
    area_px2: float
    area_mm2: float | None
    mm_per_px: float | None
    shift_px: float = 0.0


def cutting_polygon(
    contour_px: Contour,
    calibration: Calibration | None,
    *,
    height_mm: float,
    tolerance_mm: float,
    on_stage: Callable[[str], None] = lambda _name: None,
) -> Polygon:
    """The contour as few vertices within `tolerance_mm` of it (two-sided Hausdorff; 0.25 px without a calibration).

    `height_mm` is the height of the traced plane above the table. `on_stage` is called with "convert" and "simplify"
    when each has ended. Raises CalibrationError where the contour cannot be converted, ParameterError for a bad
    tolerance. A contour that cannot be cut (self-intersecting, …) is handed on as it is: `judge` names what is wrong.
    """
    contour_px = oriented_contour(contour_px, counter_clockwise=False)
    if calibration is None:
        on_stage("convert")
        pixels = _subset(contour_px, _kept_vertices(contour_px, PIXEL_TOLERANCE))
        shift_px = _shift(contour_px, pixels)
        on_stage("simplify")
        return Polygon(pixels, None, area(pixels), None, None, shift_px)
    traced_mm = convert(contour_px, calibration, height_mm)
    mm_per_px = float(scales(calibration, contour_px.exterior, height_mm).max())
    on_stage("convert")
    kept = _kept_vertices(traced_mm, tolerance_mm)
    pixels, millimetres = _subset(contour_px, kept), _subset(traced_mm, kept)
    shift_px = _shift(traced_mm, millimetres) / mm_per_px
    on_stage("simplify")
    return Polygon(pixels, millimetres, area(pixels), area(millimetres), mm_per_px, shift_px)


def convert(contour_px: Contour, calibration: Calibration, height_mm: float) -> Contour:
    """The contour in the machine frame, millimetres, vertex by vertex; CalibrationError as `to_work`."""
    rings = [calibration.to_machine(calibration.to_work(ring, height_mm)) for ring in contour_px.rings]
    return Contour(rings[0], tuple(rings[1:]))


def _kept_vertices(contour: Contour, tolerance: float) -> list[NDArray[np.intp]]:
    """Indices of the vertices to keep, ring by ring; rings that were apart stay apart."""
    if not (np.isfinite(tolerance) and tolerance >= 0):
        raise ParameterError(f"tolerance is {tolerance}: expected a number of 0 or more, in the contour's unit.")
    for halving in range(_HALVINGS + 1):
        kept = [simplify_indices(ring, tolerance / 2**halving) for ring in contour.rings]
        if not contour.holes or contour_defect(_subset(contour, kept)) is None or contour_defect(contour) is not None:
            return kept
    return [np.arange(len(ring)) for ring in contour.rings]


def _shift(traced: Contour, kept: Contour) -> float:
    """Largest distance of a traced vertex from the ring made of those kept."""
    pairs = [(one, few) for one, few in zip(traced.rings, kept.rings, strict=True) if len(few) < len(one)]
    return max((float(distances_to_ring(one, few).max()) for one, few in pairs), default=0.0)


def _subset(contour: Contour, kept: list[NDArray[np.intp]]) -> Contour:
    rings = [ring[indices] for ring, indices in zip(contour.rings, kept, strict=True)]
    return Contour(rings[0], tuple(rings[1:]))
