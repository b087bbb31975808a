"""Witnesses of a ring become its outline: straight edges, arcs and free curves, met in corners; few vertices."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bools, Complexes, Float64s, Indices, distinct, median, rolled
from contour.geometry.rectifier import Rectifier, rectified
from contour.geometry.rings import Ring
from contour.outline.bevels import bevelled
from contour.outline.chains import Chain, free_curves
from contour.outline.corners import Joints, arc_points, thinned, without_reversed
from contour.outline.doubtful import untold
from contour.outline.free_curves import curve_points, within
from contour.outline.labelling import label
from contour.outline.lines_and_arcs import distance
from contour.outline.missed_walls import overlooked, with_bounds
from contour.outline.proposals import FEW, gather, propose, renewed
from contour.outline.roundings import maybe_round, rounded
from contour.outline.runs import Segments, around, refitted, runs
from contour.outline.spread import Vertices, unseen_share, vertex_sigma
from contour.outline.witnesses import Witnesses, noise_from_neighbours, noise_from_residuals, prepare, scaled
from contour.walls.wall_evidence import RingEvidence

_FEWEST = 6
_ROUNDS = 4
_LOOKS = 2
# Residuals understate the noise where a segment has hardly more witnesses than parameters.
_LEAST_NOISE = 0.7
_CHORD_PX = 0.3
_FLAT_PX = 0.08


@dataclass(frozen=True, eq=False)
class FittedRing:
    """An outline ring and how well its witnesses support it.

    ring: vertices, shape (M, 2), raw pixels, in the coarse ring's direction. With a rectifier the outline is straight
    between them in the rectified plane, not in the picture. inlier: witnesses that lie on the outline, shape (N,).
    residual: signed distance of each witness from its own segment, shape (N,), pixels of the fitting plane, positive
    outside. spread_px: robust standard deviation of the inliers. unseen_share: share of the outline farther than a
    pitch from every inlier, 0 to 1. vertex_sigma_px: standard deviation of each vertex (across a segment, or of a
    corner's place), shape (M,); it knows random errors only, so add a floor. segments: number of lines, arcs and
    curves. untold: where hardly anything seen tells whether it is round or a corner, shape (K, 2), raw pixels.
    """

    ring: Ring
    inlier: Bools
    residual: Float64s
    spread_px: float
    unseen_share: float
    vertex_sigma_px: Float64s
    segments: int
    untold: Float64s


def fit_ring(evidence: RingEvidence, *, pitch_px: float, wall_px: float, rectifier: Rectifier | None) -> FittedRing:
    """The outline through a ring's witnesses, fitted in the rectified plane where `rectifier` is given.

    Raises NoBlockFound where there are fewer than six witnesses, few lie on any line or arc, or all on one line.
    """
    if len(evidence.points) < _FEWEST:
        raise NoBlockFound(
            f"no outline: {len(evidence.points)} wall ends along a ring, {_FEWEST} or more are needed; "
            "check focus and light, or that the ring is no single missing cell"
        )
    material = _material(evidence, rectifier)
    walls = material[: len(evidence.walls.points)]

    def left_outside(ring: Ring) -> tuple[Indices, float]:
        return overlooked(walls, rectified(ring, rectifier), pitch_px, is_hole=evidence.is_hole)

    fitted = _fitted(evidence, material, pitch_px=pitch_px, wall_px=wall_px, rectifier=rectifier)
    bounds, left_out = left_outside(fitted.ring)
    for _ in range(_LOOKS):
        if not len(bounds):
            break
        more, own = with_bounds(evidence, bounds)
        try:
            again = _fitted(more, material, pitch_px=pitch_px, wall_px=wall_px, rectifier=rectifier)
        except NoBlockFound:  # so many walls are left out that no line goes past all of them: nothing gets better
            break
        others, still = left_outside(again.ring)
        if still < left_out:
            fitted, left_out = replace(again, inlier=again.inlier[own], residual=again.residual[own]), still
        bounds = distinct(np.concatenate([bounds, others])) if len(others) else others
    return fitted


def _fitted(
    evidence: RingEvidence, material: Float64s, *, pitch_px: float, wall_px: float, rectifier: Rectifier | None
) -> FittedRing:
    """The outline through witnesses as they are; `material` as `_material` tells it."""
    witnesses = prepare(evidence, pitch_px, rectifier)
    witnesses = scaled(witnesses, max(noise_from_neighbours(witnesses), 0.7))
    witnesses, segments = segmented(witnesses)
    inlier = _inlying(witnesses, residuals(witnesses, segments))
    segments, found, arcs = rounded(witnesses, *without_reversed(witnesses, segments, inlier))
    residual = residuals(witnesses, segments)
    chains = free_curves(witnesses, segments, found, residual)
    for chain in chains:
        residual[chain.witnesses] = chain.curve.signed
    inlier = _inlying(witnesses, residual)
    doubtful = [
        untold(witnesses, segments, found, inlier, residual, chains),
        maybe_round(witnesses, segments, found, arcs),
    ]
    found, maybe_cut = bevelled(witnesses, segments, found, inlier, material[:, 0] + 1j * material[:, 1])
    doubtful.append(maybe_cut)
    vertices = _vertices(witnesses, segments, found, chains)
    if len(vertices.ring) < 3:
        raise NoBlockFound(
            f"no outline: of {len(witnesses)} wall ends along a ring those that agree lie on a single line; "
            "check that the block is in view, and that nothing lies around it"
        )
    spread = _spread(residual[inlier], wall_px)
    given = _given_leverage(segments, inlier, arcs, chains)
    sigma = vertex_sigma(witnesses, segments, inlier, vertices, given=given, spread=spread)
    ring, places = (_raw(points, rectifier) for points in (vertices.ring, np.concatenate(doubtful)))
    pieces = len(segments) - sum(len(chain.segments) - 1 for chain in chains)
    return FittedRing(ring, inlier, residual, spread, unseen_share(witnesses, inlier), sigma, pieces, places)


def _raw(points: Complexes, rectifier: Rectifier | None) -> Float64s:
    """Points of the fitting plane, (N,), as raw pixels, (N, 2)."""
    flat = np.column_stack([points.real, points.imag])
    return flat if rectifier is None else rectifier.unrectify(flat)


def _given_leverage(segments: Segments, inlier: Bools, arcs: Bools, chains: list[Chain]) -> Float64s:
    """Leverage of roundings, whose radius is all that their witnesses tell, and of free curves, on the mean; nan for
    other segments, shape (S,)."""
    seen = np.bincount(segments.owner(len(inlier)), inlier, len(segments))
    given = np.where(arcs, 1.0 / np.maximum(seen, 1.0), np.nan)
    for chain in chains:
        given[list(chain.segments)] = chain.curve.freedom / max(int(inlier[chain.witnesses].sum()), 1)
    return given


def _material(evidence: RingEvidence, rectifier: Rectifier | None) -> Float64s:
    """Points of walls, and behind them of what else may be material, in the fitting plane, shape (K, 2)."""
    return rectified(np.concatenate([evidence.walls.points, evidence.beside]), rectifier)


def segmented(witnesses: Witnesses) -> tuple[Witnesses, Segments]:
    """The ring as lines and arcs: label, refit, propose anew around what was found, until nothing changes.

    The noise is measured again twice on the way; the witnesses come back with it. Raises NoBlockFound where nothing is
    proposed.
    """
    proposals = propose(witnesses)
    if not len(proposals):
        raise NoBlockFound(
            f"no outline: the {len(witnesses)} wall ends along a ring lie on no line and no arc; "
            "check that the block is in view, and that nothing else with an edge is"
        )
    segments, first = runs(label(witnesses, proposals), proposals), proposals
    least = _LEAST_NOISE
    for round_ in range(_ROUNDS):
        segments = refitted(witnesses, segments)
        if round_ < 2:
            noise = max(noise_from_residuals(witnesses, residuals(witnesses, segments)), least)
            witnesses, least = scaled(witnesses, noise), least / noise
        proposals = around(witnesses, segments)
        if round_ == 1:
            # With the noise known, and free of what the first labelling took for granted.
            fresh = renewed(witnesses, first)
        if round_ == 1 or (round_ > 1 and len(witnesses) <= FEW):
            proposals = gather([proposals, fresh])
        found = runs(label(witnesses, proposals), proposals)
        settled = round_ >= 1 and len(found) == len(segments) and bool((found.first == segments.first).all())
        segments = found
        if settled:
            break
    return witnesses, refitted(witnesses, segments)


def residuals(witnesses: Witnesses, segments: Segments) -> Float64s:
    """Signed distance of each witness from its segment's model, shape (N,)."""
    return distance(segments.models.take(segments.owner(len(witnesses))), witnesses.points)


def _inlying(witnesses: Witnesses, residual: Float64s) -> Bools:
    sigma = np.where(residual > 0.0, witnesses.outer, witnesses.inner)
    inlying: Bools = (np.abs(residual) < 3.0 * sigma) & ~witnesses.bound
    return inlying


def _spread(residual: Float64s, wall_px: float) -> float:
    """Robust standard deviation of the inliers; a wall's width where there are too few to tell."""
    return 1.4826 * median(np.abs(residual)) if len(residual) >= _FEWEST else max(wall_px, 1.0)


def _vertices(witnesses: Witnesses, segments: Segments, found: Joints, chains: list[Chain]) -> Vertices:
    """The ring's vertices: joints, and between them the chords of arcs and curves."""
    if len(segments) == 1:
        return _alone(witnesses, segments)
    total = len(segments)
    curve_of = {chain.segments[0]: chain for chain in chains}
    inside = {k for chain in chains for k in chain.segments[1:]}
    begin = rolled(found.begin, 1)
    parts: list[Complexes] = []
    owners: list[tuple[int, int]] = []
    for k in range(total):
        if k in inside:
            continue
        chain = curve_of.get(k)
        last = k if chain is None else chain.segments[-1]
        if chain is not None:
            start, stop = within(chain.curve, complex(begin[k]), complex(found.end[last]))
            inner = curve_points(chain.curve, _CHORD_PX, start, stop)
            if chain.curve.closed:
                return Vertices(inner, _members(chain, len(inner)))
        elif segments.bend[k]:
            stops = complex(begin[k]), complex(found.end[k])
            inner = arc_points(
                segments.models.take((k,)), *stops, run=_run(witnesses, segments, k), tolerance=_CHORD_PX
            )
        else:
            inner = np.zeros(0, dtype=np.complex128)
        parts += [begin[k : k + 1], inner, found.end[last : last + 1]]
        owners += [((k - 1) % total, k)]
        owners += [(k, k)] * len(inner) if chain is None else [(int(a), int(b)) for a, b in _members(chain, len(inner))]
        owners += [(last, (last + 1) % total)]
    ring = np.concatenate(parts)
    keep = thinned(ring, _FLAT_PX)
    return Vertices(ring[keep], np.array(owners, dtype=np.intp)[keep])


def _members(chain: Chain, count: int) -> Indices:
    """The chain's segment at each of `count` vertices along it, twice, shape (count, 2); by share of its length."""
    share = np.arange(count) * len(chain.segments) // max(count, 1)
    return np.array(chain.segments, dtype=np.intp)[np.stack([share, share], axis=1)]


def _run(witnesses: Witnesses, segments: Segments, k: int) -> float:
    """Length of segment k along the coarse ring."""
    return float(witnesses.gap[segments.members(k, len(witnesses))].sum())


def _alone(witnesses: Witnesses, segments: Segments) -> Vertices:
    """The ring of a single circle."""
    start = complex(witnesses.points[0])
    ring = arc_points(segments.models.take((0,)), start, start, run=0.0, tolerance=_CHORD_PX, whole=True)
    return Vertices(ring, np.zeros((len(ring), 2), dtype=np.intp))
