"""Witnesses made ready for the fit: complex points, one noise scale, and what an outlier costs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from contour.geometry.arrays import Bools, Complexes, Float64s, Indices, median, quantile, rolled
from contour.geometry.rectifier import Rectifier
from contour.outline.lines_and_arcs import Models, distance
from contour.walls.wall_evidence import RingEvidence, WitnessKind

# Shares of witnesses that are no clean wall end, for the price of calling one an outlier.
_SHARE_INSIDE = 0.20
_SHARE_OUTSIDE = 0.02
_LEAST_SIGMA_PX = 0.04
_DEEPEST = 1.3
# Noise and the wall behind a zigzag edge take a witness about a quarter of a pitch out; a pitch farther costs so many
# nats more.
_DUST = 0.4
_FAR_OUTSIDE = 8.0
# Corners and outliers are most of a ring of so few witnesses, and pass for noise.
_FEW = 48
_NOISIEST, _NOISIEST_OF_FEW = 3.0, 1.5
# How much dearer an outlier is along a hole: each side has few witnesses, and an arc that passes half of them would do.
_HOLE = 1.7
# How much cheaper an outermost point's depth is: the wall behind a zigzag edge lies anywhere within half a pitch.
_SERRATION = 0.03
# What it costs to leave a bound outside, over what it costs with a witness.
_DEARER_BOUND = 2.0
# For what costs nothing inside, but must not come to 0 / 0.
_NOTHING = 1e-6


@dataclass(frozen=True, eq=False)
class Witnesses:
    """Witnesses of one ring in travel order, shape (N,) each, in pixels of the fitting plane.

    points and normal (outwards) are complex. inner, outer: standard deviations for points inside and outside of the
    outline; inner is infinite for a bound, which costs nothing inside. cap_inside, cap_outside: the most a point costs
    there (nats). clean: a wall end, fit to measure the noise by. gap: distance to the next witness along the coarse
    ring (cyclic). rare: -1 where turns to the right are the rare ones (an exterior runs to the left on the whole), 1
    for a hole.
    """

    points: Complexes
    normal: Complexes
    inner: Float64s
    outer: Float64s
    cap_inside: Float64s
    cap_outside: Float64s
    clean: Bools
    gap: Float64s
    pitch_px: float
    rare: float

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def bound(self) -> Bools:
        """Which are no witnesses of the edge, but bound it from inside."""
        return np.isinf(self.inner)

    @cached_property
    def bounded(self) -> bool:
        """Whether any is."""
        return bool(self.bound.any())

    @cached_property
    def sigmas(self) -> Float64s:
        """Standard deviations inside, then outside, (2 N,)."""
        return np.concatenate([self.inner, self.outer])

    @cached_property
    def caps(self) -> Float64s:
        """The most that points cost inside, then outside, (2 N,)."""
        return np.concatenate([self.cap_inside, self.cap_outside])


def prepare(evidence: RingEvidence, pitch_px: float, rectifier: Rectifier | None) -> Witnesses:
    """The ring's witnesses in the fitting plane (rectified where `rectifier` is given), with noise as the evidence
    states it."""
    points, normal = evidence.points, evidence.normal
    if rectifier is not None:
        ahead = rectifier.rectify(points + normal)
        points = rectifier.rectify(points)
        normal = ahead - points
    z = points[:, 0] + 1j * points[:, 1]
    outwards = normal[:, 0] + 1j * normal[:, 1]
    outwards = (outwards / np.maximum(np.abs(outwards), 1e-12)).astype(np.complex128)
    ends = evidence.kind < WitnessKind.OUTERMOST
    sigma = np.maximum(evidence.sigma, _LEAST_SIGMA_PX)
    coarse = evidence.coarse
    length = float(np.hypot(*(rolled(coarse, -1) - coarse).T).sum())
    gap = np.diff(evidence.position, append=evidence.position[:1] + length)
    inner = np.where(ends, sigma, np.maximum(sigma, _SERRATION * pitch_px))
    inner = np.where(evidence.kind == WitnessKind.BOUND, np.inf, inner)
    gap = np.maximum(gap, 0.0)
    rare = 1.0 if evidence.is_hole else -1.0
    witnesses = Witnesses(z, outwards, inner, sigma, inner, inner, ends, gap, pitch_px, rare)
    return scaled(witnesses, 1.0)


def scaled(witnesses: Witnesses, factor: float) -> Witnesses:
    """The same witnesses with all standard deviations times `factor`, and outlier prices that follow from them.

    A point is an outlier when a uniform law over a pitch explains it better than its normal law: the price is the log
    of their odds at the outline itself.
    """
    inner, outer = witnesses.inner * factor, witnesses.outer * factor
    odds = witnesses.pitch_px / (np.sqrt(2.0 * np.pi) * np.minimum(inner, outer))
    inside = np.log((1.0 - _SHARE_INSIDE) / _SHARE_INSIDE * odds)
    dearer = _HOLE if witnesses.rare > 0.0 else 1.0
    inside = np.where(witnesses.inner > witnesses.outer * 1.01, 4.0, np.clip(inside, 3.0, 5.5))
    outside = np.clip(np.log((1.0 - _SHARE_OUTSIDE) / _SHARE_OUTSIDE * odds), 5.0, 6.5)
    bound = witnesses.bound
    return replace(
        witnesses,
        inner=inner,
        outer=outer,
        cap_inside=np.where(bound, _NOTHING, dearer * inside),
        cap_outside=np.where(bound, _DEARER_BOUND * outside, outside),
    )


def cost(witnesses: Witnesses, signed: Float64s, index: Indices | slice = slice(None)) -> Float64s:
    """Nats of signed distances (last axis: the witnesses at `index`, or index's own shape): half squares near the
    outline, bent towards a cap either side.

    They bend early, as Geman's and McClure's function does: about one wall end in five lies two to five standard
    deviations off, and three of those in a row are no edge of their own. Beyond a cell's depth the cap rises again:
    one missing cell or broken wall reaches no deeper. Outside of an exterior it rises sooner: nothing but debris that
    hangs on the block takes a witness there.
    """
    # In place, for this is most of what a fit does.
    place = _places(signed, index, len(witnesses))
    sigma, cap = witnesses.sigmas.take(place), witnesses.caps.take(place)
    square = signed / sigma
    square *= square
    square *= 0.5
    bent: Float64s = cap * square
    square += cap
    bent /= square
    out = signed / witnesses.pitch_px
    beyond = np.abs(out)
    beyond -= _DEEPEST
    if witnesses.bounded:
        beyond[np.isinf(sigma)] = 0.0
    if beyond.max(initial=0.0) > 0.0:
        np.minimum(np.maximum(beyond, 0.0, out=beyond), 3.0, out=beyond)
        beyond *= beyond
        beyond *= 4.0
        bent += beyond
    if witnesses.rare <= 0.0:
        out -= _DUST
        np.minimum(np.maximum(out, 0.0, out=out), 1.0, out=out)
        out *= _FAR_OUTSIDE
        bent += out
    return bent


def _places(signed: Float64s, index: Indices | slice, count: int) -> Indices:
    """Where the figures of witnesses at an index, of so many, lie among those of all inside and then all outside."""
    place = np.multiply(signed > 0.0, count, dtype=np.intp)
    place += np.arange(count)[index] if isinstance(index, slice) else index
    return place


def weights(witnesses: Witnesses, signed: Float64s, index: Indices | slice = slice(None)) -> Float64s:
    """Weights of a robust fit, 1/pixel^2: inverse variance, falling smoothly as the cost bends towards its inner cap.

    The same cap on both sides, or clean noise alone would pull the outline outwards.
    """
    sigma = witnesses.sigmas.take(_places(signed, index, len(witnesses)))
    cap = witnesses.cap_inside[index]
    inverse = 1.0 / sigma**2
    return inverse / (1.0 + 0.5 * signed**2 * inverse / cap) ** 3


def noise_from_neighbours(witnesses: Witnesses) -> float:
    """Noise over the stated one, from how far each witness lies off the chord of its neighbours; between 0.5 and 3
    (1.5 for few witnesses).

    The lesser of that and of its excess over the neighbours' own (which a bend does not raise). Reads the lower
    quarter of the deviations: a fifth of deep witnesses spoils about half of the triples.
    """
    if len(witnesses) < 8:
        return 1.0
    points = witnesses.points
    back, ahead = rolled(points, 1), rolled(points, -1)
    chord = ahead - back
    share = np.clip(((points - back) * chord.conj()).real / np.maximum(np.abs(chord) ** 2, 1e-12), 0.0, 1.0)
    off = ((points - back - share * chord) * witnesses.normal.conj()).real
    sound = witnesses.clean & rolled(witnesses.clean, 1) & rolled(witnesses.clean, -1)
    if sound.sum() < 8:
        return 1.0
    simple = off / (witnesses.outer * np.sqrt(1.0 + share**2 + (1.0 - share) ** 2))
    # 1.5, -1, -1, 1/4, 1/4 are the weights of five even neighbours in the excess: 2.09 is the root of their squares'
    # sum.
    excess = (off - 0.5 * (rolled(off, 1) + rolled(off, -1))) / (2.09 * witnesses.outer)
    level = min(quantile(np.abs(simple[sound]), 0.25), quantile(np.abs(excess[sound]), 0.25))
    most = _NOISIEST if len(witnesses) > _FEW else _NOISIEST_OF_FEW
    return float(np.clip(level / 0.36, 0.5, most))


def noise_from_residuals(witnesses: Witnesses, signed: Float64s) -> float:
    """Noise over the present one, from the clean witnesses' distances to their own models; 1 where there are too
    few."""
    ratio = np.abs(signed[witnesses.clean] / witnesses.outer[witnesses.clean])
    ratio = ratio[ratio < 4.0]
    if len(ratio) < 8:
        return 1.0
    return float(np.clip(median(ratio) / 0.6745, 0.5, 2.0))


def window_cost(witnesses: Witnesses, models: Models, index: Indices) -> Float64s:
    """Cost of each model at its own witnesses: models of shape (K,), index of shape (K, m); result (K, m)."""
    signed = distance(models.take((slice(None), None)), witnesses.points[index])
    return cost(witnesses, signed, index)
