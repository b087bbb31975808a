"""A cutting polygon against limits: accepted, or every reason why not, with the measured value and the limit."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from contour.acceptance.error_budget import ErrorBudget
from contour.acceptance.quality import QualityLimits, lost_in_noise, picture_faults, quality_faults
from contour.calibration.position_uncertainty import PositionUncertainty
from contour.geometry.rings import Contour, Ring, area, contour_defect
from contour.geometry.segments import BoxTree, contains, first_meeting
from contour.image.region import Region
from contour.image.taught_table import TableLimits, TableLook
from contour.polygon.polygon import Polygon
from contour.tracing.tracing import Trace
from contour.walls.comb_likeness import unlike_comb
from contour.walls.pieces import Piece

# Of what contour and busy region may be apart in one place, the share that they may be apart everywhere. Of 500
# traceable scenes none lies farther outside than 0.19 pitches; outlines a cell too fat lie 0.33 or more in 98 of 100.
_EVERYWHERE = 0.125
# Cell pitches. As much as contour and busy part of the picture may be apart.
_SURE_WITHIN_PITCHES = 2.0
# Of two blocks whose areas differ by less than this the larger one is a matter of chance.
_EQUAL_SHARE = 0.8


class Refusal(IntEnum):
    """Why a contour is refused; names and codes are the protocol's reject reasons."""

    IMAGE_QUALITY = 102
    SCENE_MOVED = 103
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

    `work_area_mm` is a polygon in the machine frame, `sure` states the part of the picture that the calibration covers;
    None = not checked, as are `max_uncertainty_mm` and `max_disagreement_pitches`.
    `pieces` one: no other block may be in view; largest: a smaller one may. `block_share` of the traced block's area
    makes another piece of comb a block, below that it is an offcut.
    """

    min_area_mm2: float = 0.0
    max_area_mm2: float = float("inf")
    max_vertices: int = 4000
    border_px: float = 2.0
    work_area_mm: Ring | None = None
    sure: PositionUncertainty | None = None
    max_uncertainty_mm: float | None = None
    max_disagreement_pitches: float | None = None
    pieces: Literal["one", "largest"] = "one"
    block_share: float = 0.04
    quality: QualityLimits = field(default_factory=QualityLimits)


@dataclass(frozen=True)
class Finding:
    """One reason to refuse, and a sentence with what was seen, what is expected and what to do."""

    refusal: Refusal
    text: str


def judge(
    polygon: Polygon,
    frame_size: tuple[int, int],
    limits: Limits,
    *,
    traced: Trace | None = None,
    region: Region | None = None,
    budget: ErrorBudget | None = None,
    picture: NDArray[np.uint8] | None = None,
) -> tuple[Finding, ...]:
    """Every reason to refuse the polygon, lowest code first; empty = accepted.

    `frame_size` is (width, height) in pixels, `region` what was looked at of it. `traced`, what the polygon was made
    of, adds what was seen besides. Where there is a limit to the uncertainty in millimetres, a `budget` of None (nobody
    knows it) is refused as one too large. Where cells turn out to be none, the `picture` is judged as a whole, too: by
    a pitch that is none nothing looks blurred.
    """
    # With a margin the polygon may well leave the picture; what was seen may not.
    outlines = [traced.contour.exterior] if traced else [polygon.pixels.exterior]
    nothing = [finding for finding in (_no_walls(traced, limits.quality), _no_comb(traced)) if finding]
    findings = [
        *_quality(traced, limits.quality),
        *_picture(picture if nothing else None),
        *nothing,
        _touches_region(outlines, region, limits.border_px),
        _touches_border(outlines, frame_size, limits.border_px),
        _goes_on(traced),
        _area(polygon.area_mm2, limits),
        _disagreement(traced, limits.max_disagreement_pitches),
        _vague(traced),
        _uncertainty(polygon.millimetres, budget, limits.max_uncertainty_mm),
        _work_area(polygon.millimetres, limits.work_area_mm),
        _uncovered(polygon.pixels, limits.sure),
        _several(traced, limits),
        _points(polygon.pixels, limits.max_vertices),
        _shape(polygon),
    ]
    found = sorted((finding for finding in findings if finding), key=lambda finding: finding.refusal)
    # Each reason once, in the words of the first that saw it.
    return tuple(finding for n, finding in enumerate(found) if finding.refusal not in {f.refusal for f in found[:n]})


def judge_millimetres(contour: Contour, limits: Limits, bound_mm: float | None) -> tuple[Finding, ...]:
    """As `judge`, for a contour that was given and not traced: what millimetres alone can speak against.

    `bound_mm` is the 95 % bound on its position, None = not known.
    """
    budget = None if bound_mm is None else ErrorBudget(bound_mm, 0.0, None)
    defect = contour_defect(contour)
    shape = None if defect is None else Finding(Refusal.SELF_INTERSECTING, f"The contour cannot be cut: {defect}.")
    findings = [
        _area(area(contour), limits),
        _uncertainty(contour, budget, limits.max_uncertainty_mm),
        _work_area(contour, limits.work_area_mm),
        _points(contour, limits.max_vertices),
        shape,
    ]
    return tuple(finding for finding in findings if finding)


def judge_without_block(picture: NDArray[np.uint8], text: str) -> tuple[Finding, ...]:
    """Why there is no contour, lowest code first: what is wrong with the picture as a whole, and `text`, which says
    what was looked for in vain.
    """
    return (*_picture(picture), Finding(Refusal.NO_BLOCK_FOUND, text))


def judge_table(look: TableLook, limits: TableLimits) -> tuple[Finding, ...]:
    """Why the picture cannot be trusted: light or camera are not as they were when the table was taught."""
    if look.shift_px is not None and look.shift_px > limits.max_shift_px:
        return (
            Finding(
                Refusal.SCENE_MOVED,
                f"The table's pattern has moved by {look.shift_px:.1f} px since it was taught, at most "
                f"{limits.max_shift_px:g} px is allowed. If camera or table were moved, calibrate and teach the table "
                "again.",
            ),
        )
    low, high = limits.gain
    if not low <= look.gain <= high:
        return (
            Finding(
                Refusal.IMAGE_QUALITY,
                f"The table's light is {100 * look.gain:.0f} % of what it was when it was taught, {100 * low:.0f} to "
                f"{100 * high:.0f} % is allowed. Check lamp and exposure, or teach the table again.",
            ),
        )
    if look.rim_share < limits.min_rim_share:
        return (
            Finding(
                Refusal.IMAGE_QUALITY,
                f"Of the picture's rim {100 * look.rim_share:.0f} % looks as the table was taught, at least "
                f"{100 * limits.min_rim_share:.0f} % is needed. Clear the table, check that light and camera are as "
                "they were, or teach the table again.",
            ),
        )
    return ()


def _quality(traced: Trace | None, limits: QualityLimits) -> list[Finding]:
    if traced is None or traced.quality is None:
        return []
    faults = quality_faults(traced.quality, limits)
    return [_bad_picture(". Besides, ".join(faults))] if faults else []


def _picture(picture: NDArray[np.uint8] | None) -> list[Finding]:
    return [] if picture is None else [_bad_picture(fault) for fault in picture_faults(picture)]


def _bad_picture(fault: str) -> Finding:
    return Finding(Refusal.IMAGE_QUALITY, f"The picture is not good enough: {fault}.")


def _no_walls(traced: Trace | None, limits: QualityLimits) -> Finding | None:
    if traced is None or traced.quality is None:
        return None
    why = lost_in_noise(traced.quality, limits)
    return Finding(Refusal.NO_BLOCK_FOUND, f"No block found: {why}.") if why else None


def _goes_on(traced: Trace | None) -> Finding | None:
    if traced is None or not traced.reaches_frame:
        return None
    return Finding(
        Refusal.TOUCHES_BORDER,
        "The block's walls go on to the last pixels of what was looked at: part of it may lie outside. Move the block "
        "so that all of it is in view.",
    )


def _no_comb(traced: Trace | None) -> Finding | None:
    if traced is None or traced.comb is None:
        return None
    why = unlike_comb(traced.comb)
    return Finding(Refusal.NO_BLOCK_FOUND, f"No block found: {why}.") if why else None


def _touches_border(outlines: list[Ring], frame_size: tuple[int, int], border_px: float) -> Finding | None:
    # Pixel (0, 0) is a centre: the frame's edges lie half a pixel outside the first and last ones. A ring reaches
    # farthest at a vertex; the polygon leaves some out, so the ring that it was made of counts too.
    lowest = np.min([outline.min(axis=0) for outline in outlines], axis=0)
    highest = np.max([outline.max(axis=0) for outline in outlines], axis=0)
    low, high = lowest + 0.5, np.asarray(frame_size) - 0.5 - highest
    sides = {"left": low[0], "top": low[1], "right": high[0], "bottom": high[1]}
    side = min(sides, key=lambda name: float(sides[name]))
    if sides[side] > border_px:
        return None
    return Finding(
        Refusal.TOUCHES_BORDER,
        f"The contour comes within {max(float(sides[side]), 0.0):.1f} px of the picture's {side} edge, at least "
        f"{border_px:g} px are needed. Move the block so that all of it is in view.",
    )


def _touches_region(outlines: list[Ring], region: Region | None, border_px: float) -> Finding | None:
    if region is None:
        return None
    # A block that goes on outside of the region is cut by its border, along the last pixels' centres.
    margin = min(region.margin(outline) for outline in outlines) + 0.5
    if margin > border_px:
        return None
    return Finding(
        Refusal.TOUCHES_BORDER,
        f"The contour comes within {max(margin, 0.0):.1f} px of the edge of the region of interest, at least "
        f"{border_px:g} px are needed. Move the block so that all of it lies in the region, or correct roi_px or "
        "roi_mm.",
    )


def other_blocks(traced: Trace, limits: Limits) -> list[Piece]:
    """The pieces beside the traced block for which it is refused, largest first."""
    share = max(limits.block_share, _EQUAL_SHARE) if limits.pieces == "largest" else limits.block_share
    return [piece for piece in traced.others if piece.area_px2 >= share * area(traced.contour)]


def _several(traced: Trace | None, limits: Limits) -> Finding | None:
    blocks = [] if traced is None else other_blocks(traced, limits)
    if traced is None or not blocks:
        return None
    own = area(traced.contour)
    left, top, right, bottom = blocks[0].box_px
    seen = (
        f"Beside the traced block of {own:.0f} px² lies another of {blocks[0].area_px2:.0f} px² "
        f"(x {left} to {right}, y {top} to {bottom} px)" + (f", and {len(blocks) - 1} more" if blocks[1:] else "")
    )
    if limits.pieces == "largest":
        return Finding(
            Refusal.SEVERAL_BLOCKS,
            f"{seen}. For pieces: largest others may reach {100 * _EQUAL_SHARE:.0f} % of it, else the largest is a "
            "guess. Take one of them away.",
        )
    return Finding(
        Refusal.SEVERAL_BLOCKS,
        f"{seen}. The recipe allows one, and offcuts up to {100 * limits.block_share:g} % of it. Leave one block on "
        "the table, or use a recipe with pieces: largest.",
    )


def _area(area_mm2: float | None, limits: Limits) -> Finding | None:
    if area_mm2 is None or limits.min_area_mm2 <= area_mm2 <= limits.max_area_mm2:
        return None
    return Finding(
        Refusal.AREA_OUT_OF_LIMITS,
        f"The contour's area is {area_mm2:.0f} mm², the recipe expects {limits.min_area_mm2:.0f} to "
        f"{limits.max_area_mm2:.0f} mm². Check that the block is the recipe's, and the lighting.",
    )


def _disagreement(traced: Trace | None, limit: float | None) -> Finding | None:
    if traced is None or traced.disagreement is None or limit is None:
        return None
    apart = traced.disagreement
    advice = "Look at the overlay; check light and table, and that nothing lies against the block."
    if apart.pitches > limit:
        what = "takes for block what looks like table" if apart.claimed else "leaves out what looks like block"
        x, y = apart.place_px
        return Finding(
            Refusal.METHODS_DISAGREE,
            f"The contour {what} near ({x:.0f}, {y:.0f}) px, by {apart.pitches:.1f} cells, {limit:g} are allowed. "
            f"{advice}",
        )
    if apart.outside_pitches > _EVERYWHERE * limit:
        return Finding(
            Refusal.METHODS_DISAGREE,
            f"Most of the contour lies outside of what looks like block, by {apart.outside_pitches:.2f} cells, "
            f"{_EVERYWHERE * limit:g} are allowed. {advice}",
        )
    return None


def _vague(traced: Trace | None) -> Finding | None:
    """Whatever the recipe allows: beyond some cells it is not known which of them belong to the block."""
    if traced is None or traced.uncertainty_px is None or not traced.pitch_px:
        return None
    cells = traced.uncertainty_px / traced.pitch_px
    if cells <= _SURE_WITHIN_PITCHES:
        return None
    return Finding(
        Refusal.UNCERTAINTY_TOO_LARGE,
        f"The contour is sure within {traced.uncertainty_px:.1f} px only, {cells:.1f} cells, {_SURE_WITHIN_PITCHES:g} "
        "are allowed: walls end far away from it. Look at the overlay; check light and table, and that no straight "
        "light lines or cables lie in view.",
    )


def _uncertainty(millimetres: Contour | None, budget: ErrorBudget | None, limit: float | None) -> Finding | None:
    if limit is None or millimetres is None:
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


def _uncovered(pixels: Contour, sure: PositionUncertainty | None) -> Finding | None:
    outside = np.empty((0, 2)) if sure is None else sure.uncovered(pixels.exterior)
    if not len(outside):
        return None
    x, y = outside[0]
    return Finding(
        Refusal.OUTSIDE_WORK_AREA,
        f"The contour leaves the part of the picture that the calibration covers: vertex ({x:.0f}, {y:.0f}) px and "
        f"{len(outside) - 1} more lie outside. Move the block towards the picture's middle, or calibrate again with "
        "views that reach there.",
    )


def _points(contour: Contour, max_vertices: int) -> Finding | None:
    if contour.point_count <= max_vertices:
        return None
    return Finding(
        Refusal.TOO_MANY_POINTS,
        f"The contour has {contour.point_count} vertices, the recipe allows {max_vertices}. "
        "Raise tolerance_mm or max_vertices, or let it give up more material by budget_mm.",
    )


def _shape(polygon: Polygon) -> Finding | None:
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
