"""What speaks against a polygon because of what hides the block's edge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from contour.acceptance.findings import Finding, Limits, Refusal
from contour.acceptance.sent_evidence import SentStretch
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring
from contour.polygon.polygon import Polygon

_HIDERS = {
    "object": ("An object lies", "Take it away."),
    "compound": ("Potting compound lies", "Clean the edge, or measure before it is potted."),
    "ink": ("Ink lies", "Clean the edge."),
    "glare": ("Glare lies", "Move the lamp or the block."),
    None: ("Something lies", "Look at the overlay, and clear the edge."),
}


@dataclass(frozen=True)
class _Run:
    """Hidden stretches that follow one another on a ring, also across its first vertex: one hidden part of the edge."""

    stretches: tuple[SentStretch, ...]

    @property
    def length_px(self) -> float:
        return sum(stretch.to_px - stretch.from_px for stretch in self.stretches)

    @property
    def length_mm(self) -> float | None:
        lengths = [s.to_mm - s.from_mm for s in self.stretches if s.to_mm is not None and s.from_mm is not None]
        return sum(lengths) if len(lengths) == len(self.stretches) else None

    @property
    def by(self) -> str | None:
        """What hides most of it."""
        return max(self.stretches, key=lambda stretch: stretch.to_px - stretch.from_px).by

    def objection(self, limits: Limits) -> str | None:
        """Why it is not to be bridged; None where it is."""
        if any(stretch.state == "covered" for stretch in self.stretches):
            return "how it runs below cannot be told"
        if self.length_mm is None or self.length_mm > limits.max_bridged_mm:
            return f"the recipe allows {limits.max_bridged_mm:g} mm to be bridged"
        if limits.bridge == "straight" and not all(stretch.straight for stretch in self.stretches):
            return "it is not straight there, and the recipe has straight edges bridged alone"
        return None


def edge_covered(evidence: Sequence[SentStretch] | None, polygon: Polygon, limits: Limits) -> Finding | None:
    """Parts of the edge that are hidden and not to be bridged, or not over that length."""
    runs = [run for run in _hidden_runs(evidence or ()) if run.objection(limits)]
    if not runs:
        return None
    worst = max(runs, key=lambda run: run.length_px)
    what, advice = _HIDERS[worst.by]
    ring = worst.stretches[0].ring
    edge = f"the edge of hole {ring}" if ring else "the block's edge"
    more = f", and {len(runs) - 1} more" if runs[1:] else ""
    seen = f"{what} over {_long(worst)} of {edge} near {_place(worst, polygon)}{more}"
    return Finding(Refusal.EDGE_COVERED, f"{seen}: {worst.objection(limits)}. {advice}")


def _hidden_runs(evidence: Sequence[SentStretch]) -> list[_Run]:
    found = []
    for _, ring in groupby(evidence, key=lambda stretch: stretch.ring):
        groups = [
            (hidden, tuple(group)) for hidden, group in groupby(ring, key=lambda stretch: stretch.state != "seen")
        ]
        if len(groups) > 1 and groups[0][0] and groups[-1][0]:
            # The ring goes on behind its first vertex.
            groups[0] = (True, groups.pop()[1] + groups[0][1])
        found += [_Run(stretches) for hidden, stretches in groups if hidden]
    return found


def _long(run: _Run) -> str:
    pixels = f"{run.length_px:.0f} px"
    return pixels if run.length_mm is None else f"{run.length_mm:.1f} mm ({pixels})"


def _place(run: _Run, polygon: Polygon) -> str:
    """The middle of the run, in pixels, and in millimetres of the machine frame where they are known."""
    first = run.stretches[0]
    x, y = _middle(polygon.pixels.rings[first.ring], first.from_px, run.length_px)
    told = f"({x:.0f}, {y:.0f}) px"
    if polygon.millimetres is not None and first.from_mm is not None and run.length_mm is not None:
        x, y = _middle(polygon.millimetres.rings[first.ring], first.from_mm, run.length_mm)
        told += f", ({x:.1f}, {y:.1f}) mm"
    return told


def _middle(ring: Ring, start: float, long: float) -> tuple[float, float]:
    x, y = RingLengths.of(ring).at(np.array([start + long / 2]))[0].tolist()
    return x, y
