"""What is drawn over a job's frame: its contour, what of it was hidden, its uncertainty, the part in it, fixed marks,
and millimetres.

All in pixels of the full frame, (0, 0) the centre of the top-left one.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np

from contour.acceptance.sent_evidence import SentStretch
from contour.calibration.calibration import Calibration
from contour.errors import CalibrationError
from contour.geometry.arrays import Float64s
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Contour, area
from service.measuring.calibration_file import CalibrationFileError, CalibrationRecord, record_of
from service.parts.fit import PartFit
from service.records.archived_job import ArchivedJob
from service.records.evidence import EvidenceError
from service.web.models import Axis, Drawing, Grid, HiddenPart, LaidPart, SentinelMark, WantedPart

GRID_COLUMNS, GRID_ROWS = 33, 25  # a browser interpolates between them: docs/how-to/operators-guide.md says how well
LINES_WANTED = 10
LINE_POINTS = 33


def drawing(archived: ArchivedJob) -> Drawing:
    """What is drawn over the frame of an archived job; raise EvidenceError where there is no frame."""
    document = archived.document
    if document["frame"] is None:
        raise EvidenceError(f"job {archived.job_id}: no frame was archived")
    height, width = document["frame"]["shape"][:2]
    measured = document["measurement"]
    pixels = archived.contour("pixels") if measured else None
    millimetres = archived.contour("millimetres") if measured else None
    kept = document["calibration"]
    backdrop = _backdrop(json.dumps(kept and kept["content"]), width, height, document["thickness_mm"])
    return Drawing(
        job_id=archived.job_id,
        width=width,
        height=height,
        refused=document["job"]["outcome"] not in ("accepted", "written"),
        exterior=_pairs(pixels.exterior) if pixels else [],
        holes=[_pairs(hole) for hole in pixels.holes] if pixels else [],
        hidden=_hidden(archived.evidence or (), pixels) if measured and pixels else [],
        shown=[_pairs(path) for path in archived.shown_px] if measured else [],
        band_px=_band_px(measured["uncertainty_mm"] if measured else None, pixels, millimetres),
        part=_part(archived.part) if measured else None,
        parts=[part for fit in archived.parts if (part := _part(fit)) is not None] if measured else [],
        wanted=_wanted(archived) if measured and archived.parts else [],
        ribbon=_ribbon(archived) if measured else [],
        size_mm=None if millimetres is None else _size(millimetres),
        sentinels=list(backdrop.sentinels),
        grid=backdrop.grid,
        axes=list(backdrop.axes),
    )


@dataclass(frozen=True)
class Backdrop:
    """What follows from the calibration: the same for one job after another."""

    sentinels: tuple[SentinelMark, ...] = ()
    grid: Grid | None = None
    axes: tuple[Axis, ...] = ()


@lru_cache(8)
def _backdrop(calibration: str, width: int, height: int, thickness_mm: float) -> Backdrop:
    """calibration: the file's content, JSON, null where there was none."""
    content = json.loads(calibration)
    if content is None:
        return Backdrop()
    try:
        record = record_of(content, "the archived calibration")
    except CalibrationFileError:  # of a form that this version does not know: then without millimetres
        return Backdrop()
    grid = _grid(record.calibration, width, height, thickness_mm)
    axes = [] if grid is None else _axes(record.calibration, grid, thickness_mm)
    return Backdrop(tuple(_marks(record)), grid, tuple(axes))


def _pairs(points: Float64s) -> list[tuple[float, float]]:
    return [(round(float(x), 2), round(float(y), 2)) for x, y in points]


def _hidden(evidence: Sequence[SentStretch], pixels: Contour) -> list[HiddenPart]:
    rings = [RingLengths.of(ring) for ring in pixels.rings]
    return [
        HiddenPart(covered=part.state == "covered", points=_pairs(rings[part.ring].path(part.from_px, part.to_px)))
        for part in evidence
        if part.state != "seen"
    ]


def _part(fit: PartFit | None) -> LaidPart | None:
    if fit is None or fit.drawn is None:
        return None
    from service.parts.shapely_contours import point_within

    return LaidPart(
        exterior=_pairs(fit.drawn.outline.exterior),
        holes=[_pairs(hole) for hole in fit.drawn.outline.holes],
        tightest=_pairs(np.array(fit.drawn.tightest)),
        fits=fit.fits,
        margin_mm=round(fit.margin_mm, 3),
        asked_mm=fit.asked_mm,
        needed_mm=round(fit.needed_mm, 3),
        px_per_mm=round(fit.drawn.margin_px / fit.needed_mm, 4),
        number=fit.number,
        middle=point_within(fit.drawn.outline),
        file=fit.part.path.name,
    )


def _ribbon(archived: ArchivedJob) -> list[tuple[float, float]]:
    seen = archived.ribbon
    return [] if seen is None or seen.line_px is None else list(seen.line_px)


def _wanted(archived: ArchivedJob) -> list[WantedPart]:
    asked = enumerate(archived.recipe_settings.get("parts", ()), start=1)
    return [WantedPart(number=k, file=Path(one["file"]).name, quantity=one["quantity"]) for k, one in asked]


def _size(millimetres: Contour) -> tuple[float, float]:
    width, height = np.ptp(millimetres.exterior, axis=0).tolist()
    return round(width, 2), round(height, 2)


def _band_px(uncertainty_mm: float | None, pixels: Contour | None, millimetres: Contour | None) -> float | None:
    """What the contour may be off by, in pixels of about where it lies."""
    if uncertainty_mm is None or pixels is None or millimetres is None:
        return None
    seen, true = area(pixels), area(millimetres)
    return round(uncertainty_mm * math.sqrt(seen / true), 2) if true > 0 else None


def _marks(record: CalibrationRecord) -> list[SentinelMark]:
    if record.sentinels is None:
        return []
    return [SentinelMark(id=mark.id, corners=_pairs(mark.corners_px)) for mark in record.sentinels.marks]


def _grid(calibration: Calibration, width: int, height: int, thickness_mm: float) -> Grid | None:
    """Millimetres at nodes over the picture, row by row from the top; None where a node does not look at the plane."""
    if (calibration.image_width, calibration.image_height) != (width, height):
        return None
    columns, rows = np.linspace(-0.5, width - 0.5, GRID_COLUMNS), np.linspace(-0.5, height - 0.5, GRID_ROWS)
    nodes = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    try:
        points = calibration.to_machine(calibration.to_work(nodes, thickness_mm))
    except CalibrationError:
        return None
    flat = [round(value, 2) for value in points.ravel().tolist()]
    return Grid(columns=GRID_COLUMNS, rows=GRID_ROWS, millimetres=flat)


def _axes(calibration: Calibration, grid: Grid, thickness_mm: float) -> list[Axis]:
    """Lines of whole millimetres across the picture, of x then of y."""
    points = np.array(grid.millimetres).reshape(-1, 2)
    least, most = points.min(axis=0), points.max(axis=0)
    step = nice_step(float(max(most - least)) / LINES_WANTED)
    lines = []
    name: Literal["x", "y"]
    for name, along, across in (("x", 0, 1), ("y", 1, 0)):
        for k in range(math.ceil(least[along] / step), math.floor(most[along] / step) + 1):
            line = np.empty((LINE_POINTS, 2))
            line[:, along] = k * step
            line[:, across] = np.linspace(least[across], most[across], LINE_POINTS)
            try:
                seen = calibration.to_pixels(line, thickness_mm)
            except CalibrationError:  # behind the camera
                continue
            lines.append(Axis(axis=name, mm=round(k * step, 6), points=_pairs(seen)))
    return lines


def nice_step(least: float) -> float:
    """The smallest of 1, 2, 5, 10, 20, 50 … (also below 1) that is not below `least`."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least * (1 - 1e-9))
