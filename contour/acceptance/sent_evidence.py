"""What the polygon that is sent rests on: the trace's stretches along its rings, in pixels and in millimetres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace

import numpy as np

from contour.acceptance.error_budget import ErrorBudget
from contour.edge.carried import carried
from contour.edge.stretches import Stretch
from contour.geometry.arrays import Float64s
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import Ring
from contour.polygon.polygon import Polygon
from contour.tracing.trace import Trace

ToMillimetres = Callable[[Float64s], Float64s]
"""Pixels, shape (N, 2), to millimetres of the machine frame on the traced plane."""


@dataclass(frozen=True)
class SentStretch(Stretch):
    """A stretch along the polygon that is sent, from its ring's first vertex on, with the polygon's own bound.

    Millimetres are None without a calibration, `bound_mm` also where the error budget is not known.
    """

    from_mm: float | None = None
    to_mm: float | None = None
    bound_mm: float | None = None


def sent_evidence(
    trace: Trace, polygon: Polygon, budget: ErrorBudget | None, to_mm: ToMillimetres | None
) -> tuple[SentStretch, ...] | None:
    """The stretches along the polygon that was made of the trace's contour; None where its method does not say."""
    if trace.evidence is None:
        return None
    told = []
    for stretch in carried(trace.evidence, trace.contour, polygon.pixels):
        bound_px = polygon.bound_px(stretch.bound_px)
        bound_mm = None
        if budget is not None and polygon.mm_per_px is not None:
            bound_mm = replace(budget, picture_mm=bound_px * polygon.mm_per_px).total_mm
        told.append(SentStretch(**{**asdict(stretch), "bound_px": bound_px}, bound_mm=bound_mm))
    if to_mm is None or polygon.millimetres is None:
        return tuple(told)
    return tuple(
        replace(stretch, from_mm=low, to_mm=high)
        for number, (pixels, millimetres) in enumerate(
            zip(polygon.pixels.rings, polygon.millimetres.rings, strict=True)
        )
        for stretch, (low, high) in _with_lengths(told, number, pixels, millimetres, to_mm)
    )


def _with_lengths(
    told: list[SentStretch], number: int, pixels: Ring, millimetres: Ring, to_mm: ToMillimetres
) -> list[tuple[SentStretch, tuple[float, float]]]:
    """The ring's stretches, each with where it begins and ends on the ring in millimetres.

    The rings share their vertices, but between two of them the scale may change: the places themselves are converted.
    """
    own = [stretch for stretch in told if stretch.ring == number]
    here, there = RingLengths.of(pixels), RingLengths.of(millimetres)
    cuts = np.array([*(stretch.from_px for stretch in own), here.length])
    edge, _ = here.places(cuts)
    lengths = there.along_edge(edge, to_mm(here.at(cuts)))
    lengths[0], lengths[-1] = 0.0, there.length
    ends = zip(lengths[:-1].tolist(), lengths[1:].tolist(), strict=True)
    return list(zip(own, ends, strict=True))
