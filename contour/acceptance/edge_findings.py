"""What speaks against a polygon because of what hides the block's edge."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from contour.acceptance.findings import SHOWN_PITCHES, Finding, Limits, Refusal, around, edge_of
from contour.acceptance.sent_evidence import ToMillimetres
from contour.acceptance.trace_check import CheckedTrace
from contour.edge.edge_parts import EdgePart
from contour.edge.stretches import Stretch
from contour.geometry.ring_lengths import RingLengths
from contour.tracing.trace import Trace

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

    stretches: tuple[Stretch, ...]
    ring: RingLengths
    to_mm: ToMillimetres | None

    @property
    def length_px(self) -> float:
        return sum(stretch.length_px for stretch in self.stretches)

    @property
    def length_mm(self) -> float | None:
        if self.to_mm is None:
            return None
        paths = [self.to_mm(self.ring.path(stretch.from_px, stretch.to_px)) for stretch in self.stretches]
        return float(sum(np.hypot(*np.diff(path, axis=0).T).sum() for path in paths))

    @property
    def by(self) -> str | None:
        """What hides most of it."""
        return max(self.stretches, key=lambda stretch: stretch.length_px).by

    def objection(self, limits: Limits) -> str | None:
        """Why it is not to be bridged; None where it is."""
        if any(stretch.state == "covered" for stretch in self.stretches):
            return "how it runs below cannot be told"
        length_mm = self.length_mm
        if length_mm is None or length_mm > limits.max_bridged_mm:
            return f"the recipe allows {limits.max_bridged_mm:g} mm to be bridged"
        if limits.bridge == "straight" and not all(stretch.straight for stretch in self.stretches):
            return "it is not straight there, and the recipe has straight edges bridged alone"
        return None

    def __str__(self) -> str:
        """How long it is, and where its middle lies, in pixels, and in millimetres where they are known."""
        number = self.stretches[0].ring
        middle = self.ring.at(np.array([self.stretches[0].from_px + self.length_px / 2]))
        long, place = f"{self.length_px:.0f} px", _place(middle[0], self.to_mm)
        if self.to_mm is not None:
            long = f"{self.length_mm:.1f} mm ({long})"
        return f"{long} of {edge_of(number)} near {place}"


def edge_covered(traced: Trace | None, to_mm: ToMillimetres | None, limits: Limits) -> Finding | None:
    """Parts of the edge that are hidden and not to be bridged, or not over that length."""
    if traced is None or traced.evidence is None:
        return None
    runs = [run for run in _hidden_runs(traced, traced.evidence, to_mm) if run.objection(limits)]
    if not runs:
        return None
    worst = max(runs, key=lambda run: run.length_px)
    what, advice = _HIDERS[worst.by]
    more = f", and {len(runs) - 1} more" if runs[1:] else ""
    return Finding(Refusal.EDGE_COVERED, f"{what} over {worst}{more}: {worst.objection(limits)}. {advice}")


def border_goes_on(traced: CheckedTrace | None, to_mm: ToMillimetres | None) -> Finding | None:
    """An edge of the outline that goes on past its corner as a border on the table."""
    if traced is None or traced.runs_on is None:
        return None
    return _covered_at(
        traced.runs_on,
        traced.trace,
        f"An edge of the contour goes on past its corner near {_place(traced.runs_on.place_px, to_mm)} as a border on "
        "the table: walls may end there because something lies over them. Take it away, or turn the block off lines on "
        "the table.",
    )


def line_at_edge(traced: CheckedTrace | None, to_mm: ToMillimetres | None) -> Finding | None:
    """A line along the outline that is none of the block's walls."""
    if traced is None or traced.trace.wide is None:
        return None
    return _covered_at(
        traced.trace.wide,
        traced.trace,
        f"Along the contour near {_place(traced.trace.wide.place_px, to_mm)} runs a line that is wider than walls: "
        "ink, tape or a cable may lie at the edge. Clear the edge, and the table beside it.",
    )


def _place(place_px: Iterable[float], to_mm: ToMillimetres | None) -> str:
    """A place (x, y) in pixels, and in millimetres where they are known."""
    x, y = place_px
    place = f"({x:.0f}, {y:.0f}) px"
    if to_mm is None:
        return place
    x, y = to_mm(np.array([[x, y]]))[0]
    return f"{place}, ({x:.1f}, {y:.1f}) mm"


def _covered_at(part: EdgePart, trace: Trace, text: str) -> Finding:
    """What may cover the edge along a part of it."""
    return Finding(Refusal.EDGE_COVERED, text, (around(*part.place_px, SHOWN_PITCHES * (trace.pitch_px or 0.0)),))


def _hidden_runs(traced: Trace, evidence: Sequence[Stretch], to_mm: ToMillimetres | None) -> list[_Run]:
    found = []
    for number, ring in groupby(evidence, key=lambda stretch: stretch.ring):
        groups = [
            (hidden, tuple(group)) for hidden, group in groupby(ring, key=lambda stretch: stretch.state != "seen")
        ]
        if len(groups) > 1 and groups[0][0] and groups[-1][0]:
            # The ring goes on behind its first vertex.
            groups[0] = (True, groups.pop()[1] + groups[0][1])
        lengths = RingLengths.of(traced.contour.rings[number])
        found += [_Run(stretches, lengths, to_mm) for hidden, stretches in groups if hidden]
    return found
