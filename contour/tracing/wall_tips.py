"""`wall-tips`: the line along which a block was cut, through the ends of its cell walls."""

from __future__ import annotations

import numpy as np

from contour.errors import NoBlockFound, ParameterError
from contour.geometry.arrays import Bytes
from contour.geometry.rectifier import Rectifier
from contour.geometry.rings import Contour
from contour.outline.evidence_check import check_against_evidence
from contour.outline.fit import FittedRing, fit_ring
from contour.outline.uncertainty import uncertainty
from contour.tracing.closed_cells import material_edge
from contour.tracing.trace import OnStage, Trace, TraceSettings
from contour.walls.cell_scale import probe
from contour.walls.lightness import wall_light
from contour.walls.pieces import pieces_beside
from contour.walls.see_block import see_block
from contour.walls.wall_evidence import BlockEvidence, RingEvidence
from contour.walls.wall_mask import wall_mask

_LEAST_WITNESSES = 8
# With more of the outline unseen than this there is nothing to say about its corners.
_MOST_UNSEEN = 0.5


def wall_tips(
    picture: Bytes,
    settings: TraceSettings,
    *,
    rectifier: Rectifier | None = None,
    on_stage: OnStage = lambda _name: None,
) -> Trace:
    """The outline of the largest block in `picture`, grey (H, W) or BGR (H, W, 3), uint8, exterior and holes, in
    pixels.

    `rectifier`, where the lens is known, lets straight edges be fitted in undistorted coordinates. `on_stage` hears
    "mask" and "trace". Raises PictureError, ParameterError, NoBlockFound.
    """
    if settings.binarize != "flat":
        raise ParameterError(
            f"binarize is {settings.binarize!r}, but wall-tips finds its own threshold; use flat, or another method"
        )
    light = wall_light(picture)
    if settings.edge == "cells":
        return _closed_cells(picture, light, settings, on_stage)
    seen = see_block(picture, light, settings.polarity, lambda: on_stage("mask"))
    if seen.leaves_picture:
        return _cut_off(light, seen, on_stage)
    rings = [_fitted(ring, seen, rectifier) for ring in seen.rings]
    for evidence, ring in zip(seen.rings, rings, strict=True):
        check_against_evidence(evidence, ring.ring, seen.pitch_px, rectifier)
    exterior = rings[0]
    if exterior.unseen_share > _MOST_UNSEEN:
        raise NoBlockFound(
            f"no block found: wall ends witness {100 * (1 - exterior.unseen_share):.0f} % of the outline, "
            f"expected at least {100 * (1 - _MOST_UNSEEN):.0f} %. "
            "Check the light, and that all of the block lies in view"
        )
    # Rings are fitted with the material on their left in pixels; seen in the work frame, whose y runs up, that is
    # clockwise.
    contour = Contour(exterior.ring[::-1].copy(), tuple(hole.ring[::-1].copy() for hole in rings[1:]))
    sure_px = uncertainty(
        list(zip(seen.rings, rings, strict=True)),
        pitch_px=seen.pitch_px,
        blur_px=seen.blur_px,
        dark=seen.polarity == "dark",
    )
    on_stage("trace")
    return _trace(seen, contour, light, uncertainty_px=sure_px)


def _cut_off(light: Bytes, seen: BlockEvidence, on_stage: OnStage) -> Trace:
    """The coarse outline of a block that leaves the picture, along its border there: for a refusal to show."""
    last = np.array([light.shape[1] - 1.0, light.shape[0] - 1.0])
    rings = [np.clip(ring.coarse, 0.0, last)[::-1].copy() for ring in seen.rings]
    on_stage("trace")
    contour = Contour(rings[0], tuple(rings[1:]))
    return _trace(seen, contour, light)


def _trace(seen: BlockEvidence, contour: Contour, light: Bytes, *, uncertainty_px: float | None = None) -> Trace:
    return Trace(
        "wall-tips",
        "dark" if seen.polarity == "dark" else "bright",
        seen.pitch_px,
        contour,
        light,
        uncertainty_px=uncertainty_px,
        others=seen.others,
        comb=seen.comb,
        reaches_frame=seen.reaches_frame,
    )


def _closed_cells(picture: Bytes, light: Bytes, settings: TraceSettings, on_stage: OnStage) -> Trace:
    """The serrated boundary of a block whose border cells are closed; its cells must show that it is one."""
    cells = probe(light, settings.polarity)
    walls = wall_mask(light, cells.pitch_px, bright=cells.bright, contrast=cells.contrast).mask
    on_stage("mask")
    contour = material_edge(picture, cells.pitch_px, walls)
    others = pieces_beside(walls, contour.exterior, cells.pitch_px)
    on_stage("trace")
    return Trace("wall-tips", "bright" if cells.bright else "dark", cells.pitch_px, contour, light, others=others)


def _fitted(ring: RingEvidence, seen: BlockEvidence, rectifier: Rectifier | None) -> FittedRing:
    if len(ring.points) < _LEAST_WITNESSES:
        what = "a hole's edge" if ring.is_hole else "the block's edge"
        raise NoBlockFound(
            f"no block found: {len(ring.points)} wall ends along {what}, expected at least {_LEAST_WITNESSES}. "
            "Check focus and light"
        )
    return fit_ring(ring, pitch_px=seen.pitch_px, wall_px=seen.wall_px, rectifier=rectifier)
