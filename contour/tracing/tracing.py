"""One way in: a picture and settings become a traced contour in pixels, whatever the method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np

from contour.edge.stretches import bound_with_bridges
from contour.errors import NoBlockFound, ParameterError
from contour.geometry.arrays import Bytes
from contour.geometry.rectifier import Rectifier
from contour.geometry.rings import Contour, oriented_contour
from contour.image.line_noise import without_line_noise
from contour.image.opencv import grey
from contour.image.picture_check import check_picture
from contour.relief.relief import Relief
from contour.tracing import binarize, direct_scan, find_contours, sliding_matrix
from contour.tracing.paper_cells import FEWEST_CELLS, EnclosedCells
from contour.tracing.trace import OnStage, Trace, TraceSettings
from contour.tracing.wall_tips import wall_tips
from contour.walls.pieces import pieces_beside
from contour.walls.see_block import Source


def trace(
    picture: Bytes,
    settings: TraceSettings,
    *,
    rectifier: Rectifier | None = None,
    relief: Relief | None = None,
    source: Source | None = None,
    on_stage: OnStage = lambda _name: None,
) -> Trace:
    """The block's contour in `picture` (shape (H, W) grey or (H, W, 3) BGR, uint8), in pixels.

    `on_stage` is called with "mask" and "trace" when each of these stages has ended. `rectifier`, where the lens is
    known, lets a method fit straight edges in undistorted coordinates; `relief` says that the picture is the difference
    from a known table, `source` what it was drawn from. Methods on pixel centres ignore all three. Raises PictureError,
    ParameterError, NoBlockFound.
    """
    check_picture(picture)
    picture = without_line_noise(picture)
    method = _METHODS.get(settings.method)
    if method is None:
        raise ParameterError(f"method is {settings.method!r}: expected one of {', '.join(_METHODS)}.")
    found = method(picture, settings, rectifier=rectifier, relief=relief, source=source, on_stage=on_stage)
    sure_px = bound_with_bridges(found.uncertainty_px, found.evidence or ())
    # As seen is y up: counter-clockwise then is clockwise by the formula, whose y runs down in pixels.
    contour = oriented_contour(found.contour, counter_clockwise=False)
    return replace(found, contour=contour, uncertainty_px=sure_px)


class _MethodCall(Protocol):
    def __call__(
        self,
        picture: Bytes,
        settings: TraceSettings,
        *,
        rectifier: Rectifier | None,
        relief: Relief | None,
        source: Source | None,
        on_stage: OnStage,
    ) -> Trace: ...


_FromMask = Callable[[binarize.BinarizedPicture, TraceSettings], Contour]


def _on_mask(contour_of: _FromMask) -> _MethodCall:
    """A method that works on the wall mask's pixel centres alone."""

    def call(
        picture: Bytes,
        settings: TraceSettings,
        *,
        rectifier: Rectifier | None,
        relief: Relief | None,
        source: Source | None,
        on_stage: OnStage,
    ) -> Trace:
        light = grey(picture)
        walls = binarize.binarize(light, settings.binarize, settings.polarity)
        on_stage("mask")
        contour = contour_of(walls, settings)
        pitch_px = walls.cells.pitch_px if walls.cells else None
        others = pieces_beside(walls.mask, contour.exterior, pitch_px) if pitch_px else ()
        on_stage("trace")
        return Trace(settings.method, walls.polarity, pitch_px, contour, light, others=others)

    return call


def _find_contours(walls: binarize.BinarizedPicture, settings: TraceSettings) -> Contour:
    return Contour(find_contours.largest_contour(walls.mask))


def _direct_scan(walls: binarize.BinarizedPicture, settings: TraceSettings) -> Contour:
    gap, width = settings.max_gap_px, settings.min_width_px
    if gap is None:
        gap = direct_scan.default_gap_px(_cells(walls, "max_gap_px"))
    if width is None:
        width = direct_scan.default_width_px(_cells(walls, "min_width_px"))
    return Contour(direct_scan.direct_scan_ring(walls.mask, gap, width))


def _sliding_matrix(walls: binarize.BinarizedPicture, settings: TraceSettings) -> Contour:
    core, step, threshold = settings.core_px, settings.step_px, settings.threshold
    if core is None:
        core = sliding_matrix.default_core_px(_cells(walls, "core_px").pitch_px)
    if step is None:
        step = sliding_matrix.default_step_px(core)
    if threshold is None:
        threshold = sliding_matrix.default_threshold(_cells(walls, "threshold"))
    filled = sliding_matrix.fill_windows(walls.mask, core, step, threshold)
    smallest_hole_px2 = walls.cells.cell_px2 if walls.cells else float((2 * core) ** 2)
    return sliding_matrix.sliding_matrix_contour(filled, smallest_hole_px2)


def _cells(walls: binarize.BinarizedPicture, parameter: str) -> EnclosedCells:
    if walls.cells is None:
        share = np.count_nonzero(walls.mask) / walls.mask.size
        raise NoBlockFound(
            f"No block found: {walls.polarity} walls cover {100 * share:.1f} % of the picture, but they enclose fewer "
            f"than {FEWEST_CELLS} regular cells, so there is no cell pitch to take {parameter} from. Check the light, "
            f"the sharpness and the polarity, or give {parameter}."
        )
    return walls.cells


_METHODS: dict[str, _MethodCall] = {
    "wall-tips": wall_tips,
    "sliding-matrix": _on_mask(_sliding_matrix),
    "direct-scan": _on_mask(_direct_scan),
    "find-contours": _on_mask(_find_contours),
}
