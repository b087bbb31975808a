"""Free smooth curves: a robust smoothing spline through the witnesses of segments that flow into one another."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Bools, Complexes, Float64s, Indices
from contour.outline.witnesses import Witnesses, cost, weights

_KNOT_PITCHES = 1.3
_MOST_KNOTS = 60
_ROUNDS = 3
_SMOOTHNESS = 10.0 ** np.arange(-3.0, 5.0)
# Each effective parameter counts a little more than once in the cross-validation: errors of neighbours are alike.
_CAUTION = 1.4


@dataclass(frozen=True, eq=False)
class Curve:
    """A uniform cubic B-spline in the plane over arc length 0..length, closed or open.

    knots: control points, complex. freedom: effective number of its parameters. nats: what its witnesses cost.
    """

    knots: Complexes
    length: float
    closed: bool
    freedom: float
    nats: float
    signed: Float64s

    def at(self, place: Float64s) -> tuple[Complexes, Complexes]:
        """Points and derivatives (pixels per pixel of arc length) at `place`."""
        column, value, slope = _basis(place, len(self.knots), self.length, self.closed)
        near = self.knots[column]
        return (value * near).sum(axis=1), (slope * near).sum(axis=1)


@dataclass(frozen=True, eq=False)
class Guide:
    """A first guess of a curve: each witness's foot, its arc length along the curve (rising), the whole length, pixels,
    and whether it closes.
    """

    foot: Complexes
    place: Float64s
    length: float
    closed: bool


def smooth_curve(witnesses: Witnesses, index: Indices, guide: Guide, sound: Bools) -> Curve:
    """The spline through the witnesses at `index`, starting from a guide.

    sound: the feet to start from. Each round moves the feet along
    the curve and solves the robust penalised least squares of the distances across it, penalising the third
    derivative (a circle costs little); smoothness by generalised cross-validation.
    """
    closed, place, length = guide.closed, guide.place, max(guide.length, 1e-6)
    count = int(np.clip(np.ceil(length / (_KNOT_PITCHES * witnesses.pitch_px)), 4, _MOST_KNOTS))
    knots = count if closed else count + 3
    rough = _roughness(knots, closed)
    column, value, _ = _basis(place, knots, length, closed)
    bent = rough.T @ rough
    hold = np.where(sound, 1.0, 1e-3)
    control = np.linalg.solve(
        _gathered(column, value, value * hold[:, None], knots) + 1e-2 * bent + 1e-9 * np.eye(knots),
        _summed(column, value * (hold * guide.foot)[:, None], knots),
    )
    points = witnesses.points[index]
    freedom = float(knots)
    for _ in range(_ROUNDS):
        place = np.mod(place, length) if closed else np.clip(place, 0.0, length)
        column, value, slope = _basis(place, knots, length, closed)
        foot, along = (value * control[column]).sum(axis=1), (slope * control[column]).sum(axis=1)
        tangent = along / np.maximum(np.abs(along), 1e-9)
        signed = -((points - foot) * tangent.conj()).imag
        weight = weights(witnesses, signed, index)
        control, freedom = _solved((column, value), signed, tangent, weight=weight, bent=bent, control=control)
        foot = (value * control[column]).sum(axis=1)
        place = place + ((points - foot) * tangent.conj()).real / np.maximum(np.abs(along), 0.3)
    curve = Curve(control, length, closed, freedom, 0.0, np.zeros(len(index)))
    foot, along = curve.at(np.mod(place, length) if closed else np.clip(place, 0.0, length))
    signed = -((points - foot) * along.conj()).imag / np.maximum(np.abs(along), 1e-9)
    return replace(curve, signed=signed, nats=float(cost(witnesses, signed, index).sum()))


def _solved(
    basis: tuple[Indices, Float64s],
    signed: Float64s,
    tangent: Complexes,
    *,
    weight: Float64s,
    bent: Float64s,
    control: Complexes,
) -> tuple[Complexes, float]:
    """Control points and effective parameters of the penalised fit across the tangents, at the best of a few
    smoothnesses.

    Each control point moves along one normal only, so that it cannot slide along the curve; none where nothing pulls.
    """
    if not weight.any():
        return control, 0.0
    column, value = basis
    knots = len(control)
    normal = -1j * tangent
    lean = _summed(column, value * normal[:, None], knots)
    lean = np.where(np.abs(lean) > 1e-6, lean, -1j * (np.roll(control, -1) - np.roll(control, 1)))
    lean = lean / np.maximum(np.abs(lean), 1e-12)
    design = value * (normal.conj()[:, None] * lean[column]).real
    matrix = _gathered(column, design, design * weight[:, None], knots)
    right = _summed(column, design * (weight * signed)[:, None], knots)
    penalty = bent * (lean.conj()[:, None] * lean[None, :]).real
    pull = -(lean.conj() * (bent * control[None, :]).sum(axis=1)).real
    scale = float(np.trace(matrix)) / max(float(np.trace(penalty)), 1e-12)
    smoothness = _SMOOTHNESS * scale
    sides = np.empty((len(smoothness), knots, knots + 1))
    sides[:, :, 0] = right + smoothness[:, None] * pull
    sides[:, :, 1:] = matrix
    solved = np.linalg.solve(matrix + 1e-7 * scale * np.eye(knots) + smoothness[:, None, None] * penalty, sides)
    moves = solved[:, :, 0]
    freedom = np.trace(solved[:, :, 1:], axis1=1, axis2=2)
    misfit = ((signed - (moves[:, column] * design).sum(axis=2)) ** 2 * weight).sum(axis=1)
    active = float((weight > 0.0).sum())
    score = misfit / np.maximum(active - _CAUTION * freedom, 0.05 * active) ** 2
    best = int(score.argmin())
    return control + lean * moves[best], float(freedom[best])


def _gathered(column: Indices, one: Float64s, other: Float64s, knots: int) -> Float64s:
    """one.T @ other for rows of four entries at `column`, shape (knots, knots), without the dense product."""
    place = column[:, :, None] * knots + column[:, None, :]
    product = one[:, :, None] * other[:, None, :]
    sums: Float64s = np.bincount(place.ravel(), weights=product.ravel(), minlength=knots * knots).astype(np.float64)
    return sums.reshape(knots, knots)


def _summed(column: Indices, entries: NDArray[Any], knots: int) -> NDArray[Any]:
    """Sums of the entries of each column, shape (knots,), real or complex as they are."""
    flat = column.ravel()
    if np.iscomplexobj(entries):
        return np.bincount(flat, entries.real.ravel(), knots) + 1j * np.bincount(flat, entries.imag.ravel(), knots)
    return np.bincount(flat, entries.ravel(), knots)


def _basis(place: Float64s, knots: int, length: float, closed: bool) -> tuple[Indices, Float64s, Float64s]:
    """The four uniform cubic B-splines that live at each arc length: their columns, values and derivatives, shape (N,
    4)."""
    spans = knots if closed else knots - 3
    scaled = place * (spans / length)
    span = np.clip(np.floor(scaled), 0, spans - 1).astype(np.intp)
    t = (scaled - span)[:, None]
    value = (
        np.concatenate([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], axis=1) / 6.0
    )
    slope = np.concatenate([-((1 - t) ** 2), 3 * t**2 - 4 * t, -3 * t**2 + 2 * t + 1, t**2], axis=1) * (
        0.5 * spans / length
    )
    return (span[:, None] + np.arange(4)) % knots, value, slope


def _roughness(knots: int, closed: bool) -> Float64s:
    """Third differences of the control points, shape (knots or knots - 3, knots)."""
    if closed:
        unit = np.eye(knots)
        return np.roll(unit, 2, axis=1) - 3.0 * np.roll(unit, 1, axis=1) + 3.0 * unit - np.roll(unit, -1, axis=1)
    return np.diff(np.eye(knots), n=3, axis=0)


def within(curve: Curve, start: complex, stop: complex) -> tuple[float, float]:
    """Arc lengths between which the curve lies inside its joints at `start` and `stop`; the whole of a closed one."""
    if curve.closed:
        return 0.0, curve.length
    place = np.linspace(0.0, curve.length, 256)
    point, _ = curve.at(place)
    half = len(place) // 2
    low = int(np.abs(point[:half] - start).argmin())
    high = half + int(np.abs(point[half:] - stop).argmin())
    return float(place[low]), float(place[high])


def curve_points(curve: Curve, tolerance: float, start: float, stop: float) -> Complexes:
    """Few vertices along the curve between arc lengths `start` and `stop` (neither included unless closed), area kept.

    Spacing goes with the root of the curvature, so that each chord's sagitta is about `tolerance` pixels; each vertex
    stands out by two thirds of it.
    """
    count = max(int((stop - start) / 1.5), 16)
    place = np.linspace(start, stop, count + 1)
    point, along = curve.at(place)
    heading = np.unwrap(np.angle(along))
    step = np.abs(np.diff(point))
    bend = np.gradient(heading, np.concatenate([[0.0], np.cumsum(np.maximum(step, 1e-9))]))
    density = np.sqrt(np.abs(bend) / (8.0 * tolerance))
    density = np.maximum(density, 1e-4)
    total = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * step)])
    chords = max(int(np.ceil(total[-1])), 8 if curve.closed else 1)
    mark = total[-1] * np.arange(0 if curve.closed else 1, chords) / chords
    chosen = np.interp(mark, total, place)
    point, along = curve.at(chosen)
    sagitta = np.interp(chosen, place, bend) / 8.0 * (total[-1] / chords / np.interp(chosen, place, density)) ** 2
    few: Complexes = point - 1j * along / np.maximum(np.abs(along), 1e-9) * (2.0 / 3.0) * sagitta
    return few
