"""Witnesses of a ring become its outline: straight edges, arcs and free curves, met in corners; few vertices."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contour.geometry import Ring
from contour.outline_chains import Chain, free_curves
from contour.outline_curves import curve_points
from contour.outline_joints import Flags, Joints, arc_points, thinned, without_reversed
from contour.outline_labelling import label
from contour.outline_models import Complex, Real, distance
from contour.outline_proposals import propose
from contour.outline_segments import Segments, around, fitted, runs
from contour.outline_witnesses import Witnesses, noise_from_neighbours, noise_from_residuals, prepare, scaled
from contour.tracing import Rectifier
from contour.wall_evidence import RingEvidence

_ROUNDS = 4
_CHORD_PX = 0.3
_FLAT_PX = 0.08


@dataclass(frozen=True)
class FittedRing:
    """An outline ring and how well its witnesses support it.

    ring: vertices, shape (M, 2), raw pixels, in the coarse ring's direction. inlier: witnesses that lie on the outline, shape
    (N,). residual: signed distance of each witness from its own segment, shape (N,), pixels of the fitting plane, positive
    outside. spread_px: robust standard deviation of the inliers. unseen_share: share of the outline farther than half a pitch
    from any inlying witness along it.
    """

    ring: Ring
    inlier: NDArray[np.bool_]
    residual: NDArray[np.float64]
    spread_px: float
    unseen_share: float


def fit_ring(evidence: RingEvidence, *, pitch_px: float, wall_px: float, rectifier: Rectifier | None) -> FittedRing:
    """The outline through a ring's witnesses."""
    witnesses = prepare(evidence, pitch_px, rectifier)
    witnesses = scaled(witnesses, max(noise_from_neighbours(witnesses), 0.7))
    witnesses, segments = segmented(witnesses)
    residual = residuals(witnesses, segments)
    inlier = _inlying(witnesses, residual)
    segments, found = without_reversed(witnesses, segments, inlier)
    residual = residuals(witnesses, segments)
    chains = free_curves(witnesses, segments, found, residual)
    for chain in chains:
        residual[chain.witnesses] = chain.curve.signed
    inlier = _inlying(witnesses, residual)
    ring = polygon(witnesses, segments, found, chains)
    vertices = np.column_stack([ring.real, ring.imag])
    if rectifier is not None:
        vertices = rectifier.unrectify(vertices)
    spread = float(1.4826 * np.median(np.abs(residual[inlier]))) if inlier.any() else float(np.median(witnesses.outer))
    return FittedRing(vertices, inlier, residual, spread, 0.0)


def segmented(witnesses: Witnesses) -> tuple[Witnesses, Segments]:
    """The ring as lines and arcs: label, refit, propose anew around what was found, until nothing changes."""
    proposals = propose(witnesses)
    labelling = label(witnesses, proposals)
    segments = runs(labelling, proposals)
    for round_ in range(_ROUNDS):
        segments = _refitted(witnesses, segments)
        if round_ < 2:
            witnesses = scaled(witnesses, noise_from_residuals(witnesses, residuals(witnesses, segments)))
        proposals = around(witnesses, segments)
        labelling = label(witnesses, proposals)
        found = runs(labelling, proposals)
        settled = round_ >= 2 and len(found) == len(segments) and bool((found.first == segments.first).all())
        segments = found
        if settled:
            break
    return witnesses, _refitted(witnesses, segments)


def _refitted(witnesses: Witnesses, segments: Segments) -> Segments:
    models, _ = fitted(witnesses, segments.models, segments.bend, segments.first, segments.length)
    return replace(segments, models=models)


def residuals(witnesses: Witnesses, segments: Segments) -> Real:
    """Signed distance of each witness from its segment's model, shape (N,)."""
    return distance(segments.models.take(segments.owner(len(witnesses))), witnesses.points)


def _inlying(witnesses: Witnesses, residual: Real) -> Flags:
    sigma = np.where(residual > 0.0, witnesses.outer, witnesses.inner)
    inlying: Flags = np.abs(residual) < 3.0 * sigma
    return inlying


def polygon(witnesses: Witnesses, segments: Segments, found: Joints, chains: list[Chain]) -> Complex:
    """Vertices of the ring, complex: joints, and between them the chords of arcs and curves."""
    if len(segments) == 1:
        return _alone(witnesses, segments)
    curve_of = {chain.segments[0]: chain for chain in chains}
    inside = {k for chain in chains for k in chain.segments[1:]}
    parts: list[Complex] = []
    begin = np.roll(found.begin, 1)
    for k in range(len(segments)):
        if k in inside:
            continue
        chain = curve_of.get(k)
        if chain is not None and chain.curve.closed:
            return curve_points(chain.curve, _CHORD_PX, 0.0, chain.curve.length)
        parts.append(begin[k : k + 1])
        if chain is not None:
            parts.append(curve_points(chain.curve, _CHORD_PX, 0.0, chain.curve.length))
        elif segments.bend[k]:
            parts.append(arc_points(segments.models.take((k,)), complex(begin[k]), complex(found.end[k]), _run(witnesses, segments, k), _CHORD_PX, False))
        last = k if chain is None else chain.segments[-1]
        parts.append(found.end[last : last + 1])
    ring = np.concatenate(parts)
    return ring[thinned(ring, _FLAT_PX)]


def _run(witnesses: Witnesses, segments: Segments, k: int) -> float:
    """Length of segment k along the coarse ring."""
    inner = (segments.first[k] + np.arange(segments.length[k])) % len(witnesses)
    return float(witnesses.gap[inner].sum())


def _alone(witnesses: Witnesses, segments: Segments) -> Complex:
    model = segments.models.take((0,))
    start = complex(witnesses.points[0])
    return arc_points(model, start, start, 0.0, _CHORD_PX, True)
