"""What a picture says of a contour that was traced in it: how well it shows the walls, and where it says otherwise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np

from contour.acceptance.bare_edge import comb_at_edge
from contour.acceptance.disagreement import Disagreement, disagreement
from contour.acceptance.edge_contrast import alike_edge
from contour.acceptance.quality import Quality, block_quality
from contour.edge.border_beyond import border_beyond
from contour.edge.edge_parts import EdgePart
from contour.edge.reflection import reflection
from contour.edge.table_look import TableLook
from contour.geometry.agreement import rectified_edges
from contour.geometry.arrays import Bytes, Float64s
from contour.geometry.rectifier import CroppedRectifier, EnlargedRectifier, Rectifier
from contour.geometry.rings import Contour
from contour.image.opencv import grey
from contour.image.pixel_grid import drawn, place_of
from contour.image.region import Region
from contour.image.side_by_side import side_by_side
from contour.narrow_features.feature import NarrowFeature
from contour.narrow_features.narrow_feature import narrow_feature
from contour.relief.relief import Relief
from contour.tracing.trace import OnStage, Trace, TraceSettings
from contour.tracing.tracing import trace
from contour.walls.see_block import Source

# A chord as long as this leaves the curve of the widest lens in use by less than a tenth of a cell.
_BENT_PITCHES = 5.0
# As much seems left out of hardly any right contour; less is not worth the look at both sides of it.
_LEFT_OUT_PITCHES = 1.0


@dataclass(frozen=True)
class CheckedTrace:
    """A trace with what its picture says of it.

    `quality` says how well its walls are seen. `disagreement` is the widest one with the busy part of the picture, None
    without a pitch. `narrow`: its deepest bump or dent that is no wider than a chip. `alike`: the longest part of its
    edge along which the table is as light as the walls. `bare`: the longest part of its edge without cells behind it;
    `beyond`: the longest with comb beyond it. `runs_on`: a border on the table with which one of its edges goes on past
    its corner.
    """

    trace: Trace
    quality: Quality | None = None
    disagreement: Disagreement | None = None
    narrow: NarrowFeature | None = None
    alike: EdgePart | None = None
    bare: EdgePart | None = None
    beyond: EdgePart | None = None
    runs_on: EdgePart | None = None

    def moved(self, first: Float64s) -> CheckedTrace:
        """The same in a picture of which the traced one is a part, whose first pixel is `first` (x, y) of it."""
        x, y = first.astype(int).tolist()
        moved = {name: one.moved(x, y) for name, one in self._said().items()}
        return replace(self, trace=self.trace.moved(first), **moved)

    def reduced(self, times: int) -> CheckedTrace:
        """The same in the picture that the traced one shows so many times as large."""
        there = {name: replace(one, place_px=place_of(one.place_px, times)) for name, one in self._said().items()}
        quality = self.quality and self.quality.reduced(times)
        return replace(self, trace=self.trace.reduced(times), quality=quality, **there)

    def _said(self) -> dict[str, Any]:
        """All that has a place, by name."""
        said = {name: getattr(self, name) for name in ("disagreement", "narrow", "alike", "bare", "beyond", "runs_on")}
        return {name: one for name, one in said.items() if one is not None}


def checked_trace(
    picture: Bytes,
    settings: TraceSettings,
    region: Region | None = None,
    rectifier: Rectifier | None = None,
    relief: Relief | None = None,
    source: Source | None = None,
    *,
    times: int = 1,
    on_stage: OnStage = lambda _name: None,
) -> CheckedTrace:
    """The block traced in the region alone, and checked there, in pixels of the whole picture; otherwise as `trace`.

    times: how many times as large as that is the picture that is given. `on_stage` hears "quality" as well. Raises what
    `trace` does, and what `Region.cut` does.
    """
    if times > 1:
        larger = None if rectifier is None else EnlargedRectifier(rectifier, times)
        there = None if region is None else region.enlarged(times)
        return checked_trace(picture, settings, there, larger, relief, source, on_stage=on_stage).reduced(times)
    if region is None:
        traced = trace(picture, settings, rectifier=rectifier, relief=relief, source=source, on_stage=on_stage)
        notches = source is None and settings.least_rise is None
        checked = check_trace(picture, traced, rectifier, relief, source, notches=notches)
        on_stage("quality")
        return checked
    part, first = region.cut(picture)
    within = None if rectifier is None else CroppedRectifier(rectifier, first)
    apart = None if relief is None else relief.cut(first, (part.shape[1], part.shape[0]))
    drawn_from = None if source is None else source.cut(region)
    return checked_trace(part, settings, None, within, apart, drawn_from, on_stage=on_stage).moved(first)


def check_trace(
    picture: Bytes,
    traced: Trace,
    rectifier: Rectifier | None,
    relief: Relief | None = None,
    source: Source | None = None,
    *,
    notches: bool = False,
) -> CheckedTrace:
    """The trace with its quality and its disagreement with the picture, (H, W) grey or (H, W, 3) BGR, uint8.

    All are those it was traced with. `notches`: its walls are all that the picture shows, so that what they leave out
    may have been cut.
    """
    quality = block_quality(picture, traced.light, traced.contour, traced.pitch_px)
    # What is at full scale beside dark walls is the table; their ends are seen all the better.
    if traced.polarity == "dark":
        quality = replace(quality, clipped_share=0.0)
    if traced.pitch_px is None:
        return CheckedTrace(traced, quality)
    pitch_px = traced.pitch_px
    flat = None if traced.look is None else _flat(traced.look, traced.contour)
    loose = None if traced.look is None or traced.look.loose is None else traced.look.loose.astype(np.uint8)
    apart, edge = side_by_side(
        lambda: disagreement(picture, _bent(traced, pitch_px, rectifier), pitch_px, flat, loose),
        lambda: _checked_edge(picture, traced, pitch_px, relief, source, notches=notches),
    )
    return _without_image(CheckedTrace(traced, quality, apart, *edge), pitch_px)


def _flat(look: TableLook, contour: Contour) -> Bytes:
    """1 where something flat lies that is not the table, on the look's grid; within the contour no shadow is."""
    block = drawn([contour.exterior], look.things.shape, look.step)
    return np.asarray(look.lit | (look.things & (block == 0)), np.uint8)


def _without_image(checked: CheckedTrace, pitch_px: float) -> CheckedTrace:
    """Without what a polished table says against a trace: what it shows beyond the edge is the block once more, so both
    sides are alike, and it is no comb that was left out.
    """
    apart = checked.disagreement
    left_out = apart is not None and not apart.claimed and apart.pitches > _LEFT_OUT_PITCHES
    outside = checked.trace.outside_px is not None
    if checked.trace.evidence is None or not (left_out or outside or checked.bare or checked.beyond):
        return checked
    if not reflection(checked.trace.light, checked.trace.contour, pitch_px).whole:
        return checked
    kept = replace(apart, pitches=0.0) if apart is not None and left_out else apart
    trace = replace(checked.trace, outside_px=None)
    return replace(checked, trace=trace, disagreement=kept, bare=None, beyond=None)


def _checked_edge(
    picture: Bytes, traced: Trace, pitch_px: float, relief: Relief | None, source: Source | None, *, notches: bool
) -> tuple[NarrowFeature | None, EdgePart | None, EdgePart | None, EdgePart | None, EdgePart | None]:
    """What is narrow, alike, bare, overrun and runs on of an edge; the last alone where closed cells are serrated, and
    where two networks have told the edge."""
    # What was drawn has no borders on its table.
    taken, light = (picture, traced.light) if source is None else (source.picture, source.light)
    runs_on = border_beyond(_planes(taken, light), traced.contour, pitch_px)
    if runs_on is None and relief is not None and relief.even:
        runs_on = border_beyond(_planes(relief.lit, grey(relief.lit)), traced.contour, pitch_px, of_any_light=True)
    if traced.evidence is None or (source is not None and source.outline is not None):
        return None, None, None, None, runs_on
    return (
        narrow_feature(traced.contour, pitch_px, notches=notches),
        alike_edge(picture, traced.contour, pitch_px, dark=traced.polarity == "dark"),
        *comb_at_edge(traced, pitch_px),
        runs_on,
    )


def _planes(picture: Bytes, light: Bytes) -> list[Bytes]:
    """Light, and how blue a picture in colour is rather than red: a sheet may be as light as the table, and warmer."""
    if picture.ndim == 2:
        return [light]
    blue, red = (np.asarray(cv2.extractChannel(picture, channel)) for channel in (0, 2))
    return [light, np.asarray(cv2.addWeighted(blue, 1.0, red, -1.0, 128.0), np.uint8)]


def _bent(traced: Trace, pitch_px: float, rectifier: Rectifier | None) -> Contour:
    """The contour with vertices every few cells, on the curves that a lens makes of its straight edges."""
    if rectifier is None or traced.method != "wall-tips":
        return traced.contour
    return rectified_edges(traced.contour, rectifier, _BENT_PITCHES * pitch_px)
