"""A cutting polygon against limits: accepted, or every reason why not, with the measured value and the limit."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from contour.error_budget import ErrorBudget
from contour.geometry import Contour, Ring, contour_defect
from contour.polygon import Polygon
from contour.segments import BoxTree, contains, first_meeting


class Refusal(IntEnum):
    """Why a contour is refused; names and codes are the protocol's reject reasons."""

    NO_BLOCK_FOUND = 110
    TOUCHES_BORDER = 111
    AREA_OUT_OF_LIMITS = 112
    METHODS_DISAGREE = 113
    UNCERTAINTY_TOO_LARGE = 114
    OUTSIDE_WORK_AREA = 115
    SEVERAL_BLOCKS = 116
    TOO_MANY_POINTS = 130
    SELF_INTERSECTING = 131

    @property
    def reason(self) -> str:
        """The protocol's name, such as "no_block_found"."""
        return self.name.lower()


@dataclass(frozen=True)
class Limits:
    """What a contour must keep to. Limits in millimetres do not apply without a calibration.

    `work_area_mm` is a polygon in the machine frame, None = not checked; `max_uncertainty_mm` None = not checked.
    """

    min_area_mm2: float = 0.0
    max_area_mm2: float = float("inf")
    max_vertices: int = 4000
    border_px: float = 2.0
    work_area_mm: Ring | None = None
    max_uncertainty_mm: float | None = None


@dataclass(frozen=True)
class Finding:
    """One reason to refuse, and a sentence with what was seen, what is expected and what to do."""

    refusal: Refusal
    text: str


def judge(
    polygon: Polygon, frame_size: tuple[int, int], limits: Limits, *, budget: ErrorBudget | None = None
) -> tuple[Finding, ...]:
    """Every reason to refuse the polygon, lowest code first; empty = accepted.

    `frame_size` is (width, height) in pixels. Where there is a limit to the uncertainty in millimetres, a `budget` of
    None (nobody knows it) is refused as one too large.
    """
    findings = [
        _touches_border(polygon.pixels.exterior, frame_size, limits.border_px),
        _area(polygon.area_mm2, limits),
        _uncertainty(polygon, budget, limits.max_uncertainty_mm),
        _work_area(polygon.millimetres, limits.work_area_mm),
        _points(polygon.pixels, limits.max_vertices),
        _shape(polygon),
    ]
    return tuple(sorted((finding for finding in findings if finding), key=lambda finding: finding.refusal))


def _touches_border(exterior: Ring, frame_size: tuple[int, int], border_px: float) -> Finding | None:
    # Pixel (0, 0) is a centre: the frame's edges lie half a pixel outside the first and last ones.
    low, high = exterior.min(axis=0) + 0.5, np.asarray(frame_size) - 0.5 - exterior.max(axis=0)
    sides = {"left": low[0], "top": low[1], "right": high[0], "bottom": high[1]}
    side = min(sides, key=lambda name: float(sides[name]))
    if sides[side] > border_px:
        return None
    return Finding(
        Refusal.TOUCHES_BORDER,
        f"The contour comes within {max(float(sides[side]), 0.0):.1f} px of the picture's {side} edge, at least "
        f"{border_px:g} px are needed. Move the block so that all of it is in view.",
    )


def _area(area_mm2: float | None, limits: Limits) -> Finding | None:
    if area_mm2 is None or limits.min_area_mm2 <= area_mm2 <= limits.max_area_mm2:
        return None
    return Finding(
        Refusal.AREA_OUT_OF_LIMITS,
        f"The contour's area is {area_mm2:.0f} mm², the recipe expects {limits.min_area_mm2:.0f} to "
        f"{limits.max_area_mm2:.0f} mm². Check that the block is the recipe's, and the lighting.",
    )


def _uncertainty(polygon: Polygon, budget: ErrorBudget | None, limit: float | None) -> Finding | None:
    if limit is None or polygon.millimetres is None:
        return None
    if budget is None:
        return Finding(
            Refusal.UNCERTAINTY_TOO_LARGE,
            f"How sure the contour is, is not known, {limit:g} mm are allowed. Use wall-tips with edge: cut, and a "
            "calibration that knows the scale at the block's height, or set max_uncertainty_mm to 0.",
        )
    if budget.total_mm <= limit:
        return None
    return Finding(
        Refusal.UNCERTAINTY_TOO_LARGE,
        f"The contour is sure within {budget.total_mm:.2f} mm only ({budget}), {limit:g} mm are allowed. "
        "Check the light and the sharpness; calibrate again if that part is the largest.",
    )


def _work_area(millimetres: Contour | None, work_area: Ring | None) -> Finding | None:
    if millimetres is None or work_area is None:
        return None
    exterior = millimetres.exterior
    outside = exterior[~contains(work_area, exterior)]
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
    )


def _points(pixels: Contour, max_vertices: int) -> Finding | None:
    if pixels.point_count <= max_vertices:
        return None
    return Finding(
        Refusal.TOO_MANY_POINTS,
        f"The contour has {pixels.point_count} vertices, the recipe allows {max_vertices}. "
        "Raise tolerance_mm or max_vertices.",
    )


def _shape(polygon: Polygon) -> Finding | None:
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
