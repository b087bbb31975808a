"""A picture becomes the polygon that would be sent, with what speaks against sending it. No device is touched."""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from contour.acceptance.acceptance import View, judge, judge_without_block
from contour.acceptance.block_findings import judge_opinion
from contour.acceptance.error_budget import ErrorBudget, error_budget
from contour.acceptance.findings import Finding, Limits, Refusal, closed
from contour.acceptance.picture_findings import judge_table
from contour.acceptance.sent_evidence import ToMillimetres, sent_evidence
from contour.acceptance.trace_check import checked_trace
from contour.calibration.calibration import Calibration
from contour.edge.known_table import OverTable, over_known_table
from contour.errors import CalibrationError, EdgeContradicted, NoBlockFound, ParameterError
from contour.geometry.agreement import rectified_edges
from contour.geometry.arrays import Bools, Float64s
from contour.geometry.rectifier import Rectifier
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, Ring, densified
from contour.image.line_noise import without_line_noise
from contour.image.opencv import enlarged
from contour.image.picture_check import check_picture
from contour.image.region import Region, shifted
from contour.image.taught_table import TableLimits, TableLook, look_at
from contour.material.even_table import even_table
from contour.polygon.polygon import Finish, Polygon, cutting_polygon
from contour.relief.relief import Displacement
from contour.segmentation.comb_picture import comb_picture
from contour.segmentation.second_opinion import second_opinion
from contour.tracing.sliding_matrix import coarse_step, default_core_px
from contour.tracing.trace import Trace, TraceSettings
from service.measuring.looks.look import Look
from service.measuring.looks.outcome import agreed, best, fine, tried
from service.measuring.measurement import Measurement
from service.measuring.part_trial import PartTrial
from service.reasons import Reason, Rejection

if TYPE_CHECKING:
    from service.config.recipes import AnyRecipe
    from service.measuring.calibration_guard import CalibrationGuard
    from service.measuring.table_file import TableRecord

log = logging.getLogger("combtrace.measure")

_ROI_STEPS = 12
# Of the height of walls in the wider region: a table's grain and grooves rise less than most walls do.
_STRONG_WALLS = 0.6
# A network puts ends of walls so much farther in or out, all along: a share of a pitch that no scatter of them tells.
_NETWORK_PITCHES = 0.1
# Fine cells are looked at so many times as large, too.
_TWICE = 2


class _Stopwatch:
    """Times of stages, as they end one after another."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._last = clock()
        self.milliseconds: dict[str, float] = {}

    def lap(self, stage: str) -> None:
        """The stage that ran since the last lap has ended."""
        now = self._clock()
        self.milliseconds[stage] = self.milliseconds.get(stage, 0.0) + (now - self._last) * 1000
        self._last = now


class Measurer:
    """Traces pictures with recipes. Without a calibration it works in pixels; limits in mm do not apply."""

    def __init__(
        self,
        calibration: Calibration | None,
        *,
        guard: CalibrationGuard | None = None,
        work_area_mm: Ring | None = None,
        table: TableRecord | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._calibration = calibration
        self._guard = guard
        self._work_area_mm = work_area_mm
        self._table = table
        self._clock = clock
        self._doubted: set[int] = set()
        self.parts = PartTrial()

    @property
    def guard(self) -> CalibrationGuard | None:
        """The calibration with its limits."""
        return self._guard

    @property
    def work_area_mm(self) -> Ring | None:
        """The machine's work area."""
        return self._work_area_mm

    @property
    def table(self) -> TableRecord | None:
        """The taught table."""
        return self._table

    @property
    def calibration_digest(self) -> str | None:
        """The hash of the calibration file's content; None without one."""
        return None if self._guard is None else self._guard.record.digest

    @property
    def calibrated(self) -> bool:
        """True where pixels become millimetres."""
        return self._calibration is not None

    def measure(
        self, picture: NDArray[np.uint8], recipe: AnyRecipe, thickness_mm: float, camera: str = ""
    ) -> Measurement:
        """The measurement of one picture of a camera ("" = not told).

        Raises PictureError or ParameterError where the picture or the recipe is unusable.
        """
        watch = _Stopwatch(self._clock)
        result = Measurement(
            method=recipe.method,
            thickness_mm=None if self._calibration is None else thickness_mm,
            aligned=self._calibration is not None and self._calibration.aligned,
        )
        try:
            result = self._traced(picture, recipe, thickness_mm, result, watch, camera)
        except NoBlockFound as error:
            watch.lap("trace")
            result = replace(result, edge=error.edge, findings=rejections(judge_without_block(picture, str(error))))
        except EdgeContradicted as error:
            result = replace(result, edge=error.edge, findings=((Reason.EDGE_CONTRADICTED, str(error)),))
        except CalibrationError as error:
            result = replace(result, findings=((Reason.CALIBRATION_MISMATCH, str(error)),))
        if self._guard is not None:
            findings = (*result.findings, *self._guard.findings(picture, camera))
            result = replace(result, findings=tuple(sorted(findings, key=lambda finding: finding[0])))
            watch.lap("guard")
        if any(part.ribbon_from_picture for part in recipe.asked_parts):
            result = self.parts.with_ribbon(result, picture, self._calibration)
        if recipe.part is not None:
            result = self.parts.tried(result, recipe.part, self._calibration)
            watch.lap("part")
        if recipe.parts:
            result = self.parts.laid(result, recipe, self._calibration)
            watch.lap("part")
        doubt = step_doubt(recipe, result.pitch_px)
        if doubt and recipe.number not in self._doubted:
            self._doubted.add(recipe.number)
            log.warning("recipe %d: %s", recipe.number, doubt)
        total = sum(watch.milliseconds.values())
        return replace(result, timings_ms={**watch.milliseconds, "total": total})

    def _traced(
        self,
        picture: NDArray[np.uint8],
        recipe: AnyRecipe,
        thickness_mm: float,
        result: Measurement,
        watch: _Stopwatch,
        camera: str,
    ) -> Measurement:
        check_picture(picture)
        height, width = picture.shape[:2]
        calibration = self._calibration
        if calibration is not None:
            calibration.check_fits(width, height)
        picture = without_line_noise(picture)
        known = None if self._table is None else self._look_at_table(self._table, picture, camera)
        if known is not None:
            watch.lap("table")
            changes = judge_table(known, TableLimits())
            if changes:
                return replace(result, findings=rejections(changes))
        outlined = partial(
            self._outlined, whole=picture, recipe=recipe, thickness_mm=thickness_mm, result=result, watch=watch
        )
        looks = self._looks(picture, known, recipe, thickness_mm)
        first = tried(outlined, next(looks))
        if known is None and recipe.method == "wall-tips" and fine(picture, first, recipe):
            looks = self._looks(enlarged(picture, _TWICE), None, recipe, thickness_mm, times=_TWICE)
            found = agreed(first, best(tried(outlined, next(looks)), looks, outlined, watch.lap))
        else:
            found = best(first, looks, outlined, watch.lap)
        if isinstance(found, Exception):
            raise found
        return found

    def _looks(
        self,
        picture: NDArray[np.uint8],
        known: TableLook | None,
        recipe: AnyRecipe,
        thickness_mm: float,
        *,
        times: int = 1,
    ) -> Iterator[Look]:
        """What to look at, one after the other until nothing speaks against what is found: what differs from a table
        that is known, or need not be taught to be, the picture's walls, what a network tells, and walls that rise high.
        `times`: how many times as large as it was taken the picture is.
        """
        displacement = None if times > 1 else self._displacement(recipe, thickness_mm, picture.shape[:2])
        if known is None:
            yield Look(picture, times=times)
            even = None if displacement is None else even_table(picture)
            over = None if even is None else _over(picture, even, recipe, displacement)
            if over is not None and over.alike:
                relief = over.relief()
                yield Look(relief.apart, replace(relief, even=True))
        else:
            over = _over(picture, known, recipe, displacement)
            picture = known.picture
            plain_first = over is None or not over.alike
            if plain_first:
                yield Look(picture)
            if over is not None:
                relief = over.relief()
                yield Look(relief.apart, relief)
            if not plain_first:
                yield Look(picture)
        if recipe.method == "wall-tips":
            if recipe.network:
                draw = cache(partial(comb_picture, picture))
                yield Look(picture, draw=draw, times=times)
                yield Look(picture, draw=draw, times=times, by="border")
                yield Look(picture, draw=draw, times=times, by="networks")
            yield Look(picture, least_rise=_STRONG_WALLS, times=times)

    def _outlined(
        self,
        look: Look,
        *,
        whole: NDArray[np.uint8],
        recipe: AnyRecipe,
        thickness_mm: float,
        result: Measurement,
        watch: _Stopwatch,
    ) -> Measurement:
        """The measurement of what is looked at in the whole picture."""
        picture, source = look.drawn(watch.lap)
        height, width = whole.shape[:2]
        calibration = self._calibration
        rectifier = None if calibration is None else calibration.rectifier(thickness_mm)
        region = self._region(recipe, thickness_mm)
        settings = replace(trace_settings(recipe), least_rise=look.least_rise)
        checked = checked_trace(
            picture, settings, region, rectifier, look.relief, source, times=look.times, on_stage=watch.lap
        )
        look.check(checked.trace.contour)
        if look.network:
            checked = replace(checked, trace=checked.trace.less_sure(_NETWORK_PITCHES))
        traced = checked.trace
        result = replace(
            result,
            polarity=traced.polarity,
            pitch_px=traced.pitch_px,
            edge=traced.edge,
            network=look.network,
            pixels=traced.contour,
            quality=checked.quality,
        )
        polygon = self._polygon(traced.contour, recipe, thickness_mm, watch)
        sure_px = None if traced.uncertainty_px is None else polygon.bound_px(traced.uncertainty_px)
        budget = self._budget(polygon, recipe, thickness_mm, sure_px)
        to_mm = self._to_mm(thickness_mm)
        limits = self._limits(recipe)
        view = View((width, height), region, picture)
        findings = judge(polygon, view, limits, traced=checked, budget=budget, to_mm=to_mm)
        if not findings and recipe.network and limits.max_disagreement_pitches is not None:
            watch.lap("judge")
            findings = _second_opinion(whole, traced, region, rectifier, watch)
        evidence = sent_evidence(traced, polygon, budget, to_mm)
        watch.lap("judge")
        return replace(
            result,
            pixels=polygon.pixels,
            shown_px=self._shown(findings, thickness_mm),
            millimetres=polygon.millimetres,
            area_px2=polygon.area_px2,
            area_mm2=polygon.area_mm2,
            uncertainty_px=sure_px,
            uncertainty=budget,
            evidence=evidence,
            findings=rejections(findings),
        )

    def _shown(self, findings: tuple[Finding, ...], thickness_mm: float) -> tuple[Float64s, ...]:
        """Paths in the picture that show the findings, the work area's border with a contour that leaves it."""
        shown = [path for finding in findings for path in finding.shown_px]
        left = any(finding.refusal == Refusal.OUTSIDE_WORK_AREA for finding in findings)
        if left and self._work_area_mm is not None and self._calibration is not None:
            ring = self._work_area_mm
            border = densified(ring, float(np.ptp(ring, axis=0).max()) / _ROI_STEPS)
            with contextlib.suppress(CalibrationError):  # a border that the camera does not look at
                shown.append(closed(self._calibration.to_pixels(border, thickness_mm)))
        return tuple(shown)

    def _look_at_table(self, record: TableRecord, picture: NDArray[np.uint8], camera: str) -> TableLook:
        if camera and record.camera not in ("", camera):
            raise CalibrationError(
                f"The table was taught with camera {record.camera}, the picture is of {camera}. Use that "
                "camera, or teach the table again."
            )
        return look_at(picture, record.table)

    def _displacement(self, recipe: AnyRecipe, thickness_mm: float, shape: tuple[int, int]) -> Displacement | None:
        """How far lower edges of walls seem displaced in a picture of that shape, (H, W); None where nobody knows, and
        for methods that do not ask.
        """
        calibration = self._calibration
        if calibration is None or recipe.method != "wall-tips":
            return None
        if not (calibration.height_known(0.0) and calibration.height_known(thickness_mm)):
            return None
        height, width = shape
        columns, rows = np.meshgrid((0.0, 0.5 * width, width - 1.0), (0.0, 0.5 * height, height - 1.0))
        points = np.column_stack((columns.ravel(), rows.ravel()))
        with contextlib.suppress(CalibrationError):
            below = calibration.to_pixels(calibration.to_machine(calibration.to_work(points, thickness_mm)), 0.0)
            return Displacement.of(points, below)
        return None

    def _polygon(self, contour: Contour, recipe: AnyRecipe, thickness_mm: float, watch: _Stopwatch) -> Polygon:
        return cutting_polygon(
            contour,
            self._calibration,
            height_mm=thickness_mm,
            tolerance_mm=recipe.tolerance_mm,
            finish=Finish(recipe.margin_mm, recipe.max_vertices, recipe.budget_mm, recipe.first_vertex),
            on_stage=watch.lap,
        )

    def _region(self, recipe: AnyRecipe, thickness_mm: float) -> Region | None:
        if recipe.roi_px:
            return Region.of_box(*recipe.roi_px)
        if not recipe.roi_mm:
            return None
        if self._calibration is None:
            raise ParameterError("roi_mm needs a calibration. Name one, or give roi_px")
        left, bottom, right, top = recipe.roi_mm
        corners = np.array([[left, bottom], [right, bottom], [right, top], [left, top]])
        # Straight in millimetres is bent by the lens.
        ring = densified(corners, max(right - left, top - bottom) / _ROI_STEPS)
        return Region(self._calibration.to_pixels(ring, thickness_mm))

    def _budget(
        self, polygon: Polygon, recipe: AnyRecipe, thickness_mm: float, uncertainty_px: float | None
    ) -> ErrorBudget | None:
        if self._calibration is None or polygon.mm_per_px is None:
            return None
        return error_budget(
            polygon.pixels,
            self._calibration,
            height_mm=thickness_mm,
            thickness_tolerance_mm=recipe.thickness_tolerance_mm,
            uncertainty_px=uncertainty_px,
            mm_per_px=polygon.mm_per_px,
        )

    def _to_mm(self, thickness_mm: float) -> ToMillimetres | None:
        calibration = self._calibration
        if calibration is None:
            return None
        return lambda pixels: calibration.to_machine(calibration.to_work(pixels, thickness_mm))

    def _limits(self, recipe: AnyRecipe) -> Limits:
        return Limits(
            min_area_mm2=recipe.min_area_mm2,
            max_area_mm2=recipe.max_area_mm2,
            max_holes=recipe.max_holes,
            max_vertices=recipe.max_vertices,
            work_area_mm=self._work_area_mm,
            sure=None if self._calibration is None else self._calibration.uncertainty,
            pieces=recipe.pieces,
            max_bridged_mm=recipe.max_bridged_mm,
            bridge=recipe.bridge,
            max_uncertainty_mm=recipe.max_uncertainty_mm or None,
            max_disagreement_pitches=recipe.max_disagreement_pitches or None,
        )


def _over(
    picture: NDArray[np.uint8], look: TableLook, recipe: AnyRecipe, displacement: Displacement | None
) -> OverTable | None:
    """What the picture shows of a block on a known table; None on one that is far darker, and where nobody knows how
    far lower edges of walls seem displaced.
    """
    with contextlib.suppress(NoBlockFound, CalibrationError):
        return None if displacement is None else over_known_table(picture, look, recipe.polarity, displacement)
    return None


def _second_opinion(
    picture: NDArray[np.uint8],
    traced: Trace,
    region: Region | None,
    rectifier: Rectifier | None,
    watch: _Stopwatch,
) -> tuple[Finding, ...]:
    """What networks say against the outline: comb beyond it, things over it, no cells within it, a seam through it.

    Closed cells are none that they know, nor are triangles, squares, and sheets.
    """
    known = traced.edge == "cut" and (traced.comb is None or traced.comb.core)
    if not known or traced.pitch_px is None or traced.evidence is None:
        return ()
    outline = traced.contour if rectifier is None else rectified_edges(traced.contour, rectifier)
    part, first = (picture, np.zeros(2)) if region is None else region.cut(picture)
    told = [
        RingLengths.of(traced.contour.rings[one.ring]).path(one.from_px, one.to_px) - first
        for one in traced.evidence or ()
        if one.hidden_or_filled
    ]
    dark = traced.polarity == "dark"
    loose = _none if traced.look is None else traced.look.loose_at
    opinion = second_opinion(part, shifted(outline, -first), traced.pitch_px, loose, told, dark=dark)
    watch.lap("network")
    if traced.look is None:
        opinion = opinion._replace(over=None, laid=None)
    return judge_opinion(opinion.moved(*first.tolist()), traced.pitch_px)


def _none(points: Float64s) -> Bools:
    """Of points, (N, 2), which lie on loose pieces where none are known."""
    return np.zeros(len(points), np.bool_)


def rejections(findings: tuple[Finding, ...]) -> tuple[Rejection, ...]:
    """The findings by the names that journal and registers carry."""
    return tuple((Reason(int(finding.refusal)), finding.text) for finding in findings)


def trace_settings(recipe: AnyRecipe) -> TraceSettings:
    """The recipe's part that tracing needs."""
    sizes = {name: int(value) for name, value in recipe.parameters.items() if name.endswith("_px")}
    return TraceSettings(
        method=recipe.method,
        polarity=recipe.polarity,
        binarize=recipe.binarize,
        edge=recipe.edge,
        threshold=recipe.parameters.get("threshold"),
        **sizes,
    )


def step_doubt(recipe: AnyRecipe, pitch_px: float | None = None) -> str | None:
    """What speaks against the recipe's step; None where nothing does, or where the core follows from a pitch."""
    step, core = recipe.parameters.get("step_px"), recipe.parameters.get("core_px")
    if core is None and pitch_px is not None:
        core = default_core_px(pitch_px)
    return None if step is None or core is None else coarse_step(int(core), int(step))
