"""The machine frame against the work frame: a rigid fit in the plane through points that a person jogged to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from contour.calibration.calibration import Alignment
from contour.camera_calibration.length_check import rounded_up
from contour.camera_calibration.point_calibration import FLAT_SHARE, flatness
from contour.camera_calibration.student_t import two_sided_95
from contour.errors import CalibrationFailed
from contour.geometry.arrays import Float64s, Int64s

FEWEST_POINTS = 3
JOG_SPREAD_MM = 0.15
"""Standard deviation of a coordinate, of a tool tip set over a printed corner by eye: 0.3 mm either way."""

FINEST_SPREAD_MM = 0.02
"""Repeats never count as nearer than this: they may be read off twice without having been jogged to twice."""

SCALE_BOUND = 0.001
_MISSED_SHARE = 0.05
"""Sets of sound points of which one lies beyond the bound nevertheless."""


@dataclass(frozen=True)
class AlignmentLimits:
    """What an alignment must keep to.

    `accept_mm` is the largest residual, None = what the jogging's spread explains. `accept_scale` is how far from 1 the
    scale may be. `jog_mm`, one standard deviation of a coordinate, counts where no point was jogged to twice.
    `square_mm`: of the calibration's board, for advice; None = not known.
    """

    accept_mm: float | None = None
    accept_scale: float = SCALE_BOUND
    jog_mm: float = JOG_SPREAD_MM
    square_mm: float | None = None


@dataclass(frozen=True)
class AlignmentRefusal:
    """Why an alignment may not be used, and the options that, given together, take it; () where none should."""

    text: str
    overrides: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class AlignmentFit:
    """The alignment, and what speaks for it.

    `residuals_mm`, shape (N,), are the points' distances from it; `place_misses_mm`, shape (P,), those of the mean of
    all points jogged to at one place, and `allowed_mm`, shape (P,), what the spread explains of them. `first_points`
    are the places' first points, from 0. `spread_mm` is one standard deviation of a coordinate, by `repeats` points
    beyond the first of their place, or else as told. `scale` is the best one, told and not applied, `scale_95` the half
    width of its 95 % interval.
    """

    alignment: Alignment
    residuals_mm: Float64s
    place_misses_mm: Float64s
    allowed_mm: Float64s
    first_points: Int64s
    spread_mm: float
    repeats: int
    scale: float
    scale_95: float
    refusal: AlignmentRefusal | None


def fit_alignment(work_mm: Float64s, machine_mm: Float64s, limits: AlignmentLimits = AlignmentLimits()) -> AlignmentFit:
    """The turn and shift of least squares that take work points (N, 2) to machine points (N, 2) (Kabsch, 1976).

    Points at the same work place are repeats of it. Raises CalibrationFailed for fewer than three points, and points on
    one line; what else speaks against it stands in `refusal`.
    """
    _check(work_mm, machine_mm)
    one, other = work_mm - work_mm.mean(axis=0), machine_mm - machine_mm.mean(axis=0)
    angle = float(np.arctan2(_cross(one, other), _dot(one, other)))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    shift = machine_mm.mean(axis=0) - turn @ work_mm.mean(axis=0)
    alignment = Alignment(float(np.degrees(angle)), (float(shift[0]), float(shift[1])))
    misses = alignment.apply(work_mm) - machine_mm
    scale = float(np.hypot(_cross(one, other), _dot(one, other)) / (one**2).sum())
    scaled = (scale * one @ turn.T) - other
    _, first, place, counts = np.unique(work_mm, axis=0, return_index=True, return_inverse=True, return_counts=True)
    place = place.reshape(-1)
    spread, freedom = _spread(misses, place, counts, limits.jog_mm)
    place_misses = np.linalg.norm(_means(misses, place, counts), axis=1)
    fit = AlignmentFit(
        alignment,
        np.linalg.norm(misses, axis=1),
        place_misses,
        explained(spread, freedom, len(counts)) / np.sqrt(counts),
        first,
        spread,
        len(work_mm) - len(counts),
        scale,
        _scale_95(one, _means(scaled, place, counts), counts),
        None,
    )
    return replace(
        fit, refusal=_refusal(fit, one, other, np.linalg.norm(_means(scaled, place, counts), axis=1), limits)
    )


def explained(spread_mm: float, freedom: int, places: int) -> float:
    """The distance that the largest of so many places' misses stays below in 95 of 100 sets, by the spread alone.

    Both coordinates' squares over their variance follow F with 2 and `freedom` degrees, whose quantile is closed:
    1 - (1 + 2 F / n)^(-n/2); with freedom 0 the spread counts as known, and it is Rayleigh's. Each place has its share
    of the 5 % (Bonferroni). What the fit takes up of a miss is left aside: it makes the bound wider, never narrower.
    (Abramowitz and Stegun, 26.6.4; Draper and Smith, Applied Regression Analysis, 1.5 on pure error.)
    """
    share = _MISSED_SHARE / places
    if not freedom:
        return float(spread_mm * np.sqrt(-2 * np.log(share)))
    return float(spread_mm * np.sqrt(freedom * (share ** (-2 / freedom) - 1)))


def _spread(misses: Float64s, place: Int64s, counts: Int64s, told_mm: float) -> tuple[float, int]:
    """Standard deviation of a coordinate and its degrees of freedom: pooled over repeats, as told (0) without any."""
    freedom = 2 * int((counts - 1).sum())
    if not freedom:
        return told_mm, 0
    rest = misses - _means(misses, place, counts)[place]
    return max(float(np.sqrt((rest**2).sum() / freedom)), FINEST_SPREAD_MM), freedom


def _scale_95(one: Float64s, place_misses: Float64s, counts: Int64s) -> float:
    """Half the 95 % interval of the scale.

    A turn with a scale is linear in its four numbers (the plane conformal, or Helmert's, transformation; Ghilani,
    Adjustment Computations, chapter 18), so the scale's variance is that of a coordinate over the sum of squared
    distances from the middle. That of a coordinate comes from the places' misses, 2 P - 4 degrees of freedom.
    """
    freedom = 2 * len(counts) - 4
    variance = float((counts[:, None] * place_misses**2).sum()) / freedom
    return float(two_sided_95(freedom) * np.sqrt(variance / (one**2).sum()))


def _means(values: Float64s, place: Int64s, counts: Int64s) -> Float64s:
    """The mean of the values (N, 2) at each place, shape (P, 2)."""
    sums = np.zeros((len(counts), 2))
    np.add.at(sums, place, values)
    return np.asarray(sums / counts[:, None])


def _refusal(
    fit: AlignmentFit, one: Float64s, other: Float64s, scaled_mm: Float64s, limits: AlignmentLimits
) -> AlignmentRefusal | None:
    """What speaks against a fit; `scaled_mm` are the places' distances from the fit that scales, too."""
    allowed = fit.allowed_mm if limits.accept_mm is None else np.full(len(fit.allowed_mm), limits.accept_mm)
    far = bool((fit.place_misses_mm > allowed).any())
    off = abs(fit.scale - 1) > limits.accept_scale
    if not far and not off:
        return None
    mirrored = one * np.array([1.0, -1.0])
    reach = np.hypot(_cross(one, other), _dot(one, other))
    if np.hypot(_cross(mirrored, other), _dot(mirrored, other)) > 1.05 * reach:
        text = f"{_far(fit, allowed, limits)}. A mirrored fit is better: x and y are swapped, or one is reversed"
        return AlignmentRefusal(text, ())
    overrides = []
    if far:
        overrides.append(f"--accept-mm {rounded_up(float(fit.place_misses_mm.max()), 0.001):.9g}")
    if off:
        overrides.append(f"--accept-scale-percent {rounded_up(100 * abs(fit.scale - 1), 0.01):.9g}")
    # A point that is off bends the scale, too; a scale that is off leaves nothing once it is allowed for.
    if off and not (scaled_mm > allowed).any():
        return AlignmentRefusal(_scaled(fit, limits), tuple(overrides))
    return AlignmentRefusal(
        f"{_far(fit, allowed, limits)}. Jog to that point again, or check its row", tuple(overrides)
    )


def _far(fit: AlignmentFit, allowed: Float64s, limits: AlignmentLimits) -> str:
    worst = int(np.argmax(fit.place_misses_mm / allowed))
    why = "" if limits.accept_mm is not None else f" by a jogging spread of {fit.spread_mm:.3g} mm"
    return (
        f"point {fit.first_points[worst] + 1} lies {fit.place_misses_mm[worst]:.3f} mm from the rigid fit, "
        f"{allowed[worst]:.3g} are allowed{why}; all: " + ", ".join(f"{value:.3f}" for value in fit.residuals_mm)
    )


def _scaled(fit: AlignmentFit, limits: AlignmentLimits) -> str:
    text = (
        f"the scale between both is {fit.scale:.5f} ± {fit.scale_95:.5f} (95 %), within {100 * limits.accept_scale:g} "
        "% of 1 is allowed"
    )
    if abs(fit.scale - 1) <= fit.scale_95:
        return f"{text}. The points' own scatter explains as much: jog to points farther apart, or to each again"
    squares = "" if limits.square_mm is None else f" (squares of {fit.scale * limits.square_mm:.3f} mm would give 1)"
    return f"{text}. Check --square-mm of the calibration{squares}, units, and the machine's own steps per millimetre"


def _check(work_mm: Float64s, machine_mm: Float64s) -> None:
    if len(work_mm) < FEWEST_POINTS:
        raise CalibrationFailed(
            f"{len(work_mm)} points, expected {FEWEST_POINTS} or more: two leave no residual to check by. Jog to more"
        )
    if not (np.isfinite(work_mm).all() and np.isfinite(machine_mm).all()):
        raise CalibrationFailed("a coordinate is not finite, expected numbers. Correct the file")
    for name, points in (("work", work_mm), ("machine", machine_mm)):
        if flatness(points) < FLAT_SHARE:
            raise CalibrationFailed(
                f"the {name} points lie on one line: a mirrored or turned axis would not be seen. Jog to points spread "
                "over the table, such as three of its corners"
            )


def _dot(one: Float64s, other: Float64s) -> float:
    return float((one * other).sum())


def _cross(one: Float64s, other: Float64s) -> float:
    return float((one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]).sum())
