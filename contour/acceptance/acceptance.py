"""A cutting polygon against limits: accepted, or every reason why not, with the measured value and the limit."""

from __future__ import annotations

from dataclasses import dataclass

from contour.acceptance.block_findings import (
    disagrees,
    no_comb,
    no_walls,
    parted,
    reaches_frame,
    several_blocks,
    touches_border,
    touches_region,
    vague,
)
from contour.acceptance.edge_findings import border_goes_on, edge_covered, line_at_edge
from contour.acceptance.error_budget import ErrorBudget
from contour.acceptance.findings import Finding, Limits, Refusal
from contour.acceptance.picture_findings import alike_table, badly_seen, useless_picture
from contour.acceptance.polygon_findings import (
    area_out_of_limits,
    not_cuttable,
    outside_calibration,
    outside_work_area,
    too_many_holes,
    too_many_points,
    too_unsure,
)
from contour.acceptance.sent_evidence import ToMillimetres
from contour.acceptance.trace_check import CheckedTrace
from contour.geometry.arrays import Bytes
from contour.geometry.rings import Contour, area, contour_defect
from contour.image.region import Region
from contour.polygon.polygon import Polygon


@dataclass(frozen=True, eq=False)
class View:
    """What was looked at: `size` (width, height) of the picture in pixels, the region of it, and the picture itself."""

    size: tuple[int, int]
    region: Region | None = None
    picture: Bytes | None = None


def judge(
    polygon: Polygon,
    view: View,
    limits: Limits,
    *,
    traced: CheckedTrace | None = None,
    budget: ErrorBudget | None = None,
    to_mm: ToMillimetres | None = None,
) -> tuple[Finding, ...]:
    """Every reason to refuse the polygon, lowest code first; empty = accepted.

    `traced`, what the polygon was made of, adds what was seen besides. Where there is a limit to the uncertainty in
    millimetres, a `budget` of None (nobody knows it) is refused as one too large. `to_mm` is None without a
    calibration. Where cells turn out to be none, the view's picture is judged as a whole, too: by a pitch that is none
    nothing looks blurred.
    """
    trace = traced.trace if traced else None
    # With a margin the polygon may well leave the picture; what was seen may not.
    outlines = [trace.contour.exterior] if trace else [polygon.pixels.exterior]
    nothing = [finding for finding in (no_walls(traced, limits.quality), no_comb(traced)) if finding]
    judged = None if limits.max_disagreement_pitches is None else traced
    covered = edge_covered(trace, to_mm, limits) or border_goes_on(judged, to_mm) or line_at_edge(judged, to_mm)
    findings = [
        *badly_seen(traced, limits.quality),
        alike_table(traced),
        *useless_picture(view.picture if nothing else None),
        *nothing,
        touches_region(outlines, view.region, limits.border_px),
        touches_border(outlines, view.size, limits.border_px),
        reaches_frame(trace),
        area_out_of_limits(polygon.area_mm2, limits),
        too_many_holes(polygon.pixels, limits.max_holes),
        # Where something lies over the edge, that is why the picture says otherwise there, and where the edge is vague.
        *(() if covered else (disagrees(traced, limits.max_disagreement_pitches), vague(trace))),
        too_unsure(polygon.millimetres, budget, limits.max_uncertainty_mm),
        outside_work_area(polygon.millimetres, limits.work_area_mm, polygon.pixels),
        outside_calibration(polygon.pixels, limits.sure),
        several_blocks(trace, limits),
        parted(judged),
        covered,
        too_many_points(polygon.pixels, limits.max_vertices),
        not_cuttable(polygon),
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
        area_out_of_limits(area(contour), limits),
        too_many_holes(contour, limits.max_holes, "mm"),
        too_unsure(contour, budget, limits.max_uncertainty_mm),
        outside_work_area(contour, limits.work_area_mm),
        too_many_points(contour, limits.max_vertices),
        shape,
    ]
    return tuple(finding for finding in findings if finding)


def judge_without_block(picture: Bytes, text: str) -> tuple[Finding, ...]:
    """Why there is no contour, lowest code first: what is wrong with the picture as a whole, and `text`, which says
    what was looked for in vain.
    """
    return (*useless_picture(picture), Finding(Refusal.NO_BLOCK_FOUND, text))
