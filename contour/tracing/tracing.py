"""One way in: a picture and settings become a traced contour in pixels, whatever the method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from contour.acceptance.disagreement import Disagreement, disagreement
from contour.acceptance.quality import Quality, block_quality
from contour.errors import NoBlockFound, ParameterError, PictureError
from contour.geometry.rings import Contour, densified, oriented_contour
from contour.image.region import Region, shifted
from contour.tracing import binarize, direct_scan, find_contours, sliding_matrix
from contour.tracing.paper_cells import FEWEST_CELLS, Cells
from contour.walls.comb_likeness import Comb
from contour.walls.pieces import Piece, pieces_beside

# A chord as long as this leaves the curve of the widest lens in use by less than a tenth of a cell.
_BENT_PITCHES = 5.0

Method = Literal["wall-tips", "sliding-matrix", "direct-scan", "find-contours"]
Polarity = Literal["bright", "dark"]
OnStage = Callable[[str], None]


class Rectifier(Protocol):
    """Maps raw pixels to a plane without lens distortion, in units of about a pixel, and back.

    Both verbs take and return shape (N, 2), float64.
    """

    def rectify(self, points_px: NDArray[np.float64]) -> NDArray[np.float64]: ...

    def unrectify(self, points: NDArray[np.float64]) -> NDArray[np.float64]: ...


@dataclass(frozen=True)
class TraceSettings:
    """What to trace with. Sizes left at None follow from the picture's own cell pitch."""

    method: Method = "wall-tips"
    polarity: Literal["auto", "bright", "dark"] = "auto"
    binarize: Literal["flat", "otsu"] | int = "flat"
    edge: Literal["cut", "cells"] = "cut"
    core_px: int | None = None
    step_px: int | None = None
    threshold: float | None = None
    max_gap_px: int | None = None
    min_width_px: int | None = None


@dataclass(frozen=True)
class Trace:
    """A traced contour in pixels: exterior counter-clockwise as seen in the work frame, so negative by the shoelace.

    `others` are pieces of comb beside it, `quality` says how well its walls are seen, `comb` what a cut block's cells
    look like (None where no method looked). `reaches_frame`: its walls go on to the last pixels of what was looked at.
    `disagreement` is the widest one with the busy part of the picture, None without a pitch.
    """

    method: Method
    polarity: Polarity
    pitch_px: float | None
    contour: Contour
    uncertainty_px: float | None = None
    others: tuple[Piece, ...] = ()
    quality: Quality | None = None
    comb: Comb | None = None
    reaches_frame: bool = False
    disagreement: Disagreement | None = None


def trace(
    picture: NDArray[np.uint8],
    settings: TraceSettings,
    *,
    region: Region | None = None,
    rectifier: Rectifier | None = None,
    on_stage: OnStage = lambda _name: None,
) -> Trace:
    """The block's contour in `picture` (shape (H, W) grey or (H, W, 3) BGR, uint8), in pixels.

    `on_stage` is called with "mask", "trace" and "quality" when each of these stages has ended. Outside of `region`
    nothing is seen. `rectifier`, where the lens is known, lets a method fit straight edges in undistorted coordinates;
    methods on pixel centres ignore it. Raises PictureError, ParameterError, NoBlockFound.
    """
    check_picture(picture)
    method = _METHODS.get(settings.method)
    if method is None:
        raise ParameterError(f"method is {settings.method!r}: expected one of {', '.join(_METHODS)}.")
    first = np.zeros(2)
    if region is not None:
        picture, first = region.cut(picture)
        rectifier = None if rectifier is None else _Moved(rectifier, first)
    found = method(picture, settings, rectifier=rectifier, on_stage=on_stage)
    # As seen is y up: counter-clockwise then is clockwise by the formula, whose y runs down in pixels.
    contour = oriented_contour(found.contour, counter_clockwise=False)
    quality = block_quality(picture, contour, found.pitch_px)
    apart = None
    if found.pitch_px is not None:
        apart = disagreement(picture, _bent(contour, found, rectifier), found.pitch_px)
    on_stage("quality")
    if region is not None:
        x, y = first.astype(int).tolist()
        contour = shifted(contour, first)
        found = replace(found, others=tuple(piece.moved(x, y) for piece in found.others))
        apart = None if apart is None else apart.moved(x, y)
    return replace(found, contour=contour, quality=quality, disagreement=apart)


def _bent(contour: Contour, found: Trace, rectifier: Rectifier | None) -> Contour:
    """The contour with vertices every few cells, on the curves that a lens makes of its straight edges."""
    if rectifier is None or found.method != "wall-tips" or found.pitch_px is None:
        return contour
    step = _BENT_PITCHES * found.pitch_px
    exterior, *holes = (rectifier.unrectify(densified(rectifier.rectify(ring), step)) for ring in contour.rings)
    return Contour(exterior, tuple(holes))


@dataclass(frozen=True)
class _Moved:
    """A rectifier for pixels that are counted from another first one."""

    whole: Rectifier
    first: NDArray[np.float64]

    def rectify(self, points_px: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.whole.rectify(points_px + self.first)

    def unrectify(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.whole.unrectify(points) - self.first


def check_picture(picture: NDArray[np.uint8]) -> None:
    """Raise PictureError unless the array is a grey (H, W) or BGR (H, W, 3) picture, uint8, with pixels in it."""
    kind = f"{picture.dtype} of shape {picture.shape}"
    if picture.dtype != np.uint8:
        raise PictureError(f"The picture is {kind}: expected 8 bits a channel (uint8). Convert it first.")
    if picture.ndim != 2 and not (picture.ndim == 3 and picture.shape[2] == 3):
        raise PictureError(f"The picture is {kind}: expected (H, W) grey or (H, W, 3) BGR. Convert it first.")
    if picture.size == 0:
        raise PictureError(f"The picture is {kind}: it has no pixels. Check the camera or the file.")


class _MethodCall(Protocol):
    def __call__(
        self,
        picture: NDArray[np.uint8],
        settings: TraceSettings,
        *,
        rectifier: Rectifier | None,
        on_stage: OnStage,
    ) -> Trace: ...


_FromMask = Callable[[binarize.WallMask, TraceSettings], Contour]


def _on_mask(contour_of: _FromMask) -> _MethodCall:
    """A method that works on the wall mask's pixel centres alone."""

    def call(
        picture: NDArray[np.uint8], settings: TraceSettings, *, rectifier: Rectifier | None, on_stage: OnStage
    ) -> Trace:
        walls = binarize.binarize(picture, settings.binarize, settings.polarity)
        on_stage("mask")
        contour = contour_of(walls, settings)
        pitch_px = walls.cells.pitch_px if walls.cells else None
        others = pieces_beside(walls.mask, contour.exterior, pitch_px) if pitch_px else ()
        on_stage("trace")
        return Trace(settings.method, walls.polarity, pitch_px, contour, others=others)

    return call


def _find_contours(walls: binarize.WallMask, settings: TraceSettings) -> Contour:
    return Contour(find_contours.largest_contour(walls.mask))


def _direct_scan(walls: binarize.WallMask, settings: TraceSettings) -> Contour:
    gap, width = settings.max_gap_px, settings.min_width_px
    if gap is None:
        gap = direct_scan.default_gap_px(_cells(walls, "max_gap_px"))
    if width is None:
        width = direct_scan.default_width_px(_cells(walls, "min_width_px"))
    return Contour(direct_scan.direct_scan_ring(walls.mask, gap, width))


def _sliding_matrix(walls: binarize.WallMask, settings: TraceSettings) -> Contour:
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


def _cells(walls: binarize.WallMask, parameter: str) -> Cells:
    if walls.cells is None:
        share = np.count_nonzero(walls.mask) / walls.mask.size
        raise NoBlockFound(
            f"No block found: {walls.polarity} walls cover {100 * share:.1f} % of the picture, but they enclose fewer "
            f"than {FEWEST_CELLS} regular cells, so there is no cell pitch to take {parameter} from. Check the light, "
            f"the sharpness and the polarity, or give {parameter}."
        )
    return walls.cells


def _wall_tips(
    picture: NDArray[np.uint8], settings: TraceSettings, *, rectifier: Rectifier | None, on_stage: OnStage
) -> Trace:
    from contour.tracing.wall_tips import wall_tips  # it needs the types above

    return wall_tips(picture, settings, rectifier=rectifier, on_stage=on_stage)


_METHODS: dict[str, _MethodCall] = {
    "wall-tips": _wall_tips,
    "sliding-matrix": _on_mask(_sliding_matrix),
    "direct-scan": _on_mask(_direct_scan),
    "find-contours": _on_mask(_find_contours),
}
