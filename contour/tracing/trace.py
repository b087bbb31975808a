"""What to trace with, and what a method has traced."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

from contour.edge.edge_parts import EdgePart
from contour.edge.stretches import Stretch
from contour.edge.table_look import TableLook
from contour.geometry.arrays import Bytes, Float64s
from contour.geometry.rings import Contour
from contour.image.opencv import shrunk
from contour.image.pixel_grid import place_of, samples_of
from contour.image.region import shifted
from contour.walls.comb_likeness import Comb
from contour.walls.pieces import Piece

Method = Literal["wall-tips", "sliding-matrix", "direct-scan", "find-contours"]
Polarity = Literal["bright", "dark"]
Edge = Literal["cut", "cells", "mixed"]
OnStage = Callable[[str], None]


@dataclass(frozen=True)
class TraceSettings:
    """What to trace with. Sizes left at None follow from the picture's own cell pitch.

    `least_rise`: walls no fainter than that share of what walls of the wider region rise by; None takes fainter ones.
    """

    method: Method = "wall-tips"
    polarity: Literal["auto", "bright", "dark"] = "auto"
    binarize: Literal["flat", "otsu"] | int = "flat"
    edge: Literal["auto", "cut", "cells"] = "auto"
    core_px: int | None = None
    step_px: int | None = None
    threshold: float | None = None
    max_gap_px: int | None = None
    min_width_px: int | None = None
    least_rise: float | None = None


@dataclass(frozen=True)
class Trace:
    """A traced contour in pixels: exterior counter-clockwise as seen in the work frame, so negative by the shoelace.

    `light` is the channel in which its walls were seen, (H, W), uint8, of what was looked at. `others` are pieces of
    comb beside it, `comb` what a cut block's cells look like (None where no method looked).
    `edge` says whether its border was cut through cells or closes them; None where no method looked.
    `reaches_frame`: its walls go on to the last pixels of what was looked at.
    `evidence`: what the contour rests on, stretches without gaps along each ring, and `look` what lies about it; None
    where the method does not say.
    `untold_px`: where (x, y) hardly anything seen tells whether it is round or a corner; None where nowhere.
    `outside_px`: where (x, y) a wall ends outside of it beside a corner; None where nowhere.
    `opening_px`: where (x, y) cells are missing or a hole too small to be traced lies, and how wide, pixels; None where
    nowhere.
    `wide`: the longest line along it that is wider than walls; None where there is none.
    `parted`: the smaller of two parts of it between which no walls lead; None where it is one.
    """

    method: Method
    polarity: Polarity
    pitch_px: float | None
    contour: Contour
    light: Bytes = field(compare=False, repr=False)
    uncertainty_px: float | None = None
    others: tuple[Piece, ...] = ()
    comb: Comb | None = None
    edge: Edge | None = None
    reaches_frame: bool = False
    evidence: tuple[Stretch, ...] | None = None
    look: TableLook | None = field(default=None, compare=False, repr=False)
    untold_px: tuple[float, float] | None = None
    outside_px: tuple[float, float] | None = None
    opening_px: tuple[float, float, float] | None = None
    wide: EdgePart | None = None
    parted: Piece | None = None

    @property
    def closed(self) -> bool:
        """Whether its border closes cells, all of them or some."""
        return self.edge in ("cells", "mixed")

    def less_sure(self, pitches: float) -> Trace:
        """The same, known so much less well all along."""
        more = pitches * (self.pitch_px or 0.0)
        evidence = self.evidence and tuple(replace(part, bound_px=part.bound_px + more) for part in self.evidence)
        bound_px = None if self.uncertainty_px is None else self.uncertainty_px + more
        return replace(self, uncertainty_px=bound_px, evidence=evidence)

    def reduced(self, times: int) -> Trace:
        """The trace in the picture that the traced one shows so many times as large."""
        opening = self.opening_px and (*place_of(self.opening_px[:2], times), self.opening_px[2] / times)
        return replace(
            self,
            pitch_px=self.pitch_px and self.pitch_px / times,
            contour=Contour.of(samples_of(ring, times) for ring in self.contour.rings),
            light=shrunk(self.light, times),
            uncertainty_px=self.uncertainty_px and self.uncertainty_px / times,
            others=tuple(piece.reduced(times) for piece in self.others),
            comb=self.comb
            and replace(self.comb, pitch_px=self.comb.pitch_px / times, wall_px=self.comb.wall_px / times),
            evidence=self.evidence and tuple(part.reduced(times) for part in self.evidence),
            look=self.look and self.look.reduced(times),
            untold_px=self.untold_px and place_of(self.untold_px, times),
            outside_px=self.outside_px and place_of(self.outside_px, times),
            opening_px=opening,
            wide=self.wide and replace(self.wide, place_px=place_of(self.wide.place_px, times)),
            parted=self.parted and self.parted.reduced(times),
        )

    def moved(self, first: Float64s) -> Trace:
        """The trace in a picture of which the traced one is a part, whose first pixel is `first` (x, y) of it."""
        x, y = first.astype(int).tolist()
        others = tuple(piece.moved(x, y) for piece in self.others)
        untold, outside = (
            None if place is None else (place[0] + x, place[1] + y) for place in (self.untold_px, self.outside_px)
        )
        parted = None if self.parted is None else self.parted.moved(x, y)
        opening = None
        if self.opening_px is not None:
            left, top, wide = self.opening_px
            opening = left + x, top + y, wide
        contour = shifted(self.contour, first)
        return replace(
            self,
            contour=contour,
            others=others,
            untold_px=untold,
            outside_px=outside,
            opening_px=opening,
            wide=None if self.wide is None else self.wide.moved(x, y),
            parted=parted,
        )
