"""What speaks against a polygon: its area, holes, place, uncertainty, number of vertices, and shape."""

from __future__ import annotations

import numpy as np

from contour.acceptance.error_budget import ErrorBudget
from contour.acceptance.findings import Finding, Limits, Refusal, around, closed, runs_where
from contour.calibration.position_uncertainty import PositionUncertainty
from contour.geometry.rings import Contour, Ring, contour_defect
from contour.geometry.segments import BoxTree, contains, first_meeting
from contour.polygon.polygon import Polygon

# How large a circle shows a vertex.
_SHOWN_PX = 12.0


def area_out_of_limits(area_mm2: float | None, limits: Limits) -> Finding | None:
    """An area beyond the recipe's limits; none without a calibration."""
    if area_mm2 is None or limits.min_area_mm2 <= area_mm2 <= limits.max_area_mm2:
        return None
    return Finding(
        Refusal.AREA_OUT_OF_LIMITS,
        f"The contour's area is {area_mm2:.0f} mm², the recipe expects {limits.min_area_mm2:.0f} to "
        f"{limits.max_area_mm2:.0f} mm². Check that the block is the recipe's, and the lighting.",
    )


def too_many_holes(contour: Contour, most: int, unit: str = "px") -> Finding | None:
    """More holes than the recipe's block may have: what is too much may be a thing that lies on it."""
    if len(contour.holes) <= most:
        return None
    x, y = contour.holes[0].mean(axis=0)
    return Finding(
        Refusal.AREA_OUT_OF_LIMITS,
        f"The contour's holes are more than the recipe allows, {len(contour.holes)} in place of {most}: one lies "
        f"around ({x:.0f}, {y:.0f}) {unit}. Check that nothing lies on the block, and that the block is the recipe's.",
        tuple(closed(hole) for hole in contour.holes) if unit == "px" else (),
    )


def too_unsure(millimetres: Contour | None, budget: ErrorBudget | None, limit: float | None) -> Finding | None:
    """A position less sure than `limit` millimetres, or not known to be so."""
    if limit is None or millimetres is None:
        return None
    if budget is None:
        return Finding(
            Refusal.UNCERTAINTY_TOO_LARGE,
            f"How sure the contour is, is not known, {limit:g} mm are allowed. Use wall-tips, and a "
            "calibration that knows the scale at the block's height, or set max_uncertainty_mm to 0.",
        )
    if budget.total_mm <= limit:
        return None
    return Finding(
        Refusal.UNCERTAINTY_TOO_LARGE,
        f"The contour is sure within {budget.total_mm:.2f} mm only ({budget}), {limit:g} mm are allowed. "
        "Check the light and the sharpness; calibrate again if that part is the largest.",
    )


def outside_work_area(
    millimetres: Contour | None, work_area: Ring | None, pixels: Contour | None = None
) -> Finding | None:
    """A contour that leaves the work area, in the machine frame; `pixels`, where it has any, show where."""
    if millimetres is None or work_area is None:
        return None
    exterior = millimetres.exterior
    leaves = ~contains(work_area, exterior)
    outside = exterior[leaves]
    if len(outside):
        place = f"vertex ({outside[0, 0]:.1f}, {outside[0, 1]:.1f}) mm and {len(outside) - 1} more lie outside"
    else:
        # All vertices inside are not enough for a work area that is not convex.
        meeting = first_meeting(BoxTree.of_ring(exterior), BoxTree.of_ring(work_area))
        if meeting is None:
            return None
        x, y = exterior[meeting[0]]
        place = f"the edge from ({x:.1f}, {y:.1f}) mm crosses or touches its border"
    return Finding(
        Refusal.OUTSIDE_WORK_AREA,
        f"The contour leaves the work area: {place}. Move the block, or check work_area_mm and the alignment.",
        () if pixels is None else runs_where(pixels.exterior, leaves),
    )


def outside_calibration(pixels: Contour, sure: PositionUncertainty | None) -> Finding | None:
    """A contour that leaves the part of the picture that the calibration covers."""
    outside = np.empty((0, 2)) if sure is None else sure.uncovered(pixels.exterior)
    if not len(outside):
        return None
    x, y = outside[0]
    return Finding(
        Refusal.OUTSIDE_WORK_AREA,
        f"The contour leaves the part of the picture that the calibration covers: vertex ({x:.0f}, {y:.0f}) px and "
        f"{len(outside) - 1} more lie outside. Move the block towards the picture's middle, or calibrate again with "
        "views that reach there.",
        tuple(around(x, y, _SHOWN_PX) for x, y in outside.tolist()),
    )


def too_many_points(contour: Contour, max_vertices: int) -> Finding | None:
    """More vertices than allowed, all rings together."""
    if contour.point_count <= max_vertices:
        return None
    return Finding(
        Refusal.TOO_MANY_POINTS,
        f"The contour has {contour.point_count} vertices, the recipe allows {max_vertices}. "
        "Raise tolerance_mm or max_vertices, or let it give up more material by budget_mm.",
    )


def not_cuttable(polygon: Polygon) -> Finding | None:
    """Rings that meet themselves or one another, in pixels or in millimetres."""
    if polygon.defect is not None:
        return Finding(Refusal.SELF_INTERSECTING, f"The contour cannot be cut: {polygon.defect}.")
    shapes: list[tuple[str, Contour]] = [("", polygon.pixels)]
    if polygon.millimetres is not None:
        shapes.append((" in millimetres", polygon.millimetres))
    for unit, contour in shapes:
        defect = contour_defect(contour)
        if defect:
            return Finding(
                Refusal.SELF_INTERSECTING,
                f"The contour cannot be cut{unit}: {defect}. Look at the overlay; check edge, method, light and focus.",
            )
    return None
