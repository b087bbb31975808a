"""From the traced contour to the cutting polygon: few vertices, the same ones in pixels and in millimetres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from contour.calibration.calibration import Calibration, scales
from contour.errors import MarginImpossible, ParameterError
from contour.geometry.arrays import Float64s, Indices
from contour.geometry.offset import offset_contour
from contour.geometry.rings import Contour, area, contour_defect, oriented_contour
from contour.geometry.segments import distances_to_ring
from contour.geometry.simplification import simplify_indices
from contour.polygon.start_vertex import Start, begun_at, first_vertices
from contour.polygon.vertex_budget import within_budget

PIXEL_TOLERANCE = 0.25
"""What simplification may shift where there is no calibration, px: below what any method here claims to resolve."""

_HALVINGS = 4
"""Times the tolerance is halved when rings that were apart would meet; after that the rings stay as traced."""

_START_TIE_MM = 1.0
_START_TIE_PX = 4.0
"""Vertices that are as good to begin at within this: more than two pictures of one block differ by."""


@dataclass(frozen=True)
class Finish:
    """What a recipe makes of the contour besides leaving vertices out.

    margin_mm: how far every edge moves into the material (negative: out of it). max_vertices: where there are more, the
    contour may give up `budget_mm` of material to have no more; 0 = it may not. start: the vertex that each ring begins
    at, None = as traced.
    """

    margin_mm: float = 0.0
    max_vertices: int | None = None
    budget_mm: float = 0.0
    start: Start | None = None


PLAIN = Finish()


@dataclass(frozen=True)
class Polygon:
    """The polygon that would be sent: exterior counter-clockwise, holes clockwise as seen in the work frame.

    `pixels` and `millimetres` hold the same vertices in the same order; pixels run y down, so their exterior has a
    negative shoelace area. Millimetres are in the machine frame. `mm_per_px` is the largest scale on the exterior: an
    uncertainty in pixels times it is one in millimetres. All three millimetre fields are None without a calibration.
    `shift_px` is the largest distance of a traced vertex from the polygon: what leaving vertices out has cost, the
    margin left aside. `given_up_px` bounds what the vertex budget has cost, always material. `defect` says why there is
    no such polygon, one sentence; then this is the one without margin.
    """

    pixels: Contour
    millimetres: Contour | None
    area_px2: float
    area_mm2: float | None
    mm_per_px: float | None
    shift_px: float = 0.0
    given_up_px: float = 0.0
    defect: str | None = None

    def bound_px(self, traced_px: float) -> float:
        """The 95 % bound on where the polygon's edges lie, where those traced have `traced_px`, pixels.

        What leaving vertices out shifts adds to what tracing may be off by: of neither sign, known to neither. What the
        vertex budget gave up is of one sign, and adds in full.
        """
        return float(np.hypot(traced_px, self.shift_px)) + self.given_up_px


def cutting_polygon(
    contour_px: Contour,
    calibration: Calibration | None,
    *,
    height_mm: float,
    tolerance_mm: float,
    finish: Finish = PLAIN,
    on_stage: Callable[[str], None] = lambda _name: None,
) -> Polygon:
    """The contour as few vertices within the tolerance of it (two-sided Hausdorff; 0.25 px without a calibration).

    `height_mm` is the height of the traced plane above the table. `on_stage` is called with "convert" and "simplify"
    when each has ended. Raises CalibrationError where the contour cannot be converted, ParameterError for a bad
    tolerance, or a margin or start point in millimetres without a calibration. A contour that cannot be cut
    (self-intersecting, …) is handed on as it is: `judge` names what is wrong.
    """
    contour_px = oriented_contour(contour_px, counter_clockwise=False)
    if calibration is None:
        on_stage("convert")
        polygon = _in_pixels(contour_px, finish)
    else:
        traced_mm = convert(contour_px, calibration, height_mm)
        plane = _Plane(calibration, height_mm, float(scales(calibration, contour_px.exterior, height_mm).max()))
        on_stage("convert")
        polygon = _in_millimetres(contour_px, traced_mm, plane, tolerance_mm, finish)
    on_stage("simplify")
    return polygon


def _in_pixels(contour_px: Contour, finish: Finish) -> Polygon:
    if finish.margin_mm or isinstance(finish.start, tuple):
        raise ParameterError("A margin and a start point are millimetres, and need a calibration. Name one.")
    pixels = _subset(contour_px, _kept_vertices(contour_px, PIXEL_TOLERANCE))
    if finish.start is not None:
        y_up = Contour(_mirrored(pixels.exterior), tuple(_mirrored(hole) for hole in pixels.holes))
        pixels = begun_at(pixels, first_vertices(y_up, finish.start, _START_TIE_PX))
    return Polygon(pixels, None, area(pixels), None, None, _shift(contour_px, pixels))


@dataclass(frozen=True)
class _Plane:
    """The traced plane's height above the table, and its coarsest scale along the contour."""

    calibration: Calibration
    height_mm: float
    mm_per_px: float


def _in_millimetres(
    contour_px: Contour, traced_mm: Contour, plane: _Plane, tolerance_mm: float, finish: Finish
) -> Polygon:
    kept = _kept_vertices(traced_mm, tolerance_mm)
    pixels, millimetres = _subset(contour_px, kept), _subset(traced_mm, kept)
    given_up_mm, defect = 0.0, None
    before = millimetres
    if finish.max_vertices is not None and finish.budget_mm and millimetres.point_count > finish.max_vertices:
        before, given_up_mm = _budgeted(traced_mm, millimetres, finish.max_vertices, finish.budget_mm)
    try:
        moved = _with_margin(before, finish.margin_mm)
    except MarginImpossible as error:
        moved, defect = before, f"{error}. Correct margin_mm, or use a recipe for a block of this size"
    shift_px = 0.0 if given_up_mm else _shift(traced_mm, millimetres) / plane.mm_per_px
    if moved is not millimetres:
        millimetres = moved
        rings = [plane.calibration.to_pixels(ring, plane.height_mm) for ring in moved.rings]
        pixels = Contour(rings[0], tuple(rings[1:]))
    if finish.start is not None:
        first = first_vertices(millimetres, finish.start, _START_TIE_MM)
        pixels, millimetres = begun_at(pixels, first), begun_at(millimetres, first)
    given_up_px = given_up_mm / plane.mm_per_px
    return Polygon(pixels, millimetres, area(pixels), area(millimetres), plane.mm_per_px, shift_px, given_up_px, defect)


def _budgeted(traced_mm: Contour, simplified_mm: Contour, most: int, budget_mm: float) -> tuple[Contour, float]:
    """The contour within the traced one that keeps the budget, and what it gave up; else the simplified one, and 0."""
    if contour_defect(traced_mm) is not None:
        return simplified_mm, 0.0
    smaller = within_budget(traced_mm, most, budget_mm)
    return (smaller.contour, smaller.shift) if smaller.fits else (simplified_mm, 0.0)


def _with_margin(contour_mm: Contour, margin_mm: float) -> Contour:
    if margin_mm == 0 or contour_defect(contour_mm) is not None:  # `judge` names the defect
        return contour_mm
    return offset_contour(contour_mm, margin_mm)


def _mirrored(ring: Float64s) -> Float64s:
    return ring * [1.0, -1.0]


def convert(contour_px: Contour, calibration: Calibration, height_mm: float) -> Contour:
    """The contour in the machine frame, millimetres, vertex by vertex; CalibrationError as `to_work`."""
    rings = [calibration.to_machine(calibration.to_work(ring, height_mm)) for ring in contour_px.rings]
    return Contour(rings[0], tuple(rings[1:]))


def _kept_vertices(contour: Contour, tolerance: float) -> list[Indices]:
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


def _subset(contour: Contour, kept: list[Indices]) -> Contour:
    rings = [ring[indices] for ring, indices in zip(contour.rings, kept, strict=True)]
    return Contour(rings[0], tuple(rings[1:]))
