"""Sub-pixel wall ends: where a blurred step, fitted along each wall's axis, says that the material stops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bytes, Float64s, medians
from contour.image.pixel_sampling import sample_at

_STEP = 0.5
_TURNS = 4
# The wall's own light is read so far behind its tip and farther, the background's so far beyond it, pixels; behind thin
# walls, whose profiles are no longer than they are wide, that is one sample at least.
_ASIDE_PX, _LEAST_REACH = 1.0, 1.1
_FAR = 3.5
# A wall that meets the cut at less than 20° has no end worth the name; it is fitted as if it met it so.
_STEEPEST = 0.34
# Of the usual height: how walls differ in it, and what a blurred step leaves unexplained of a profile.
_HEIGHT_SPREAD = 0.4
_MISFIT = 0.1


@dataclass(frozen=True, eq=False)
class FittedEnds:
    """Ends in picture pixels (N, 2), unit axes out of the wall (N, 2), blur (standard deviation of the edge, N), wall
    level above background (N,), standard deviation across the outline (N,), residual in grey levels (N,).
    """

    point: Float64s
    axis: Float64s
    blur: Float64s
    height: Float64s
    sigma: Float64s
    residual: Float64s


def centred_axes(
    light: Bytes, tip: Float64s, axis: Float64s, *, wall: float, straight: Float64s, sign: float
) -> tuple[Float64s, Float64s]:
    """Tips and axes moved onto the wall's centre line: (N, 2), (N, 2), picture pixels.

    Cross profiles at five places from a third of a wall's width behind the tip to `straight` (N,) pixels give the
    centre; a line through them, the axis. Twice, because the first profiles may be taken askew. A stub shorter than
    one and a half wall widths gives no direction; only its middle is used.
    """
    first = 0.35 * wall + 0.3
    last = np.maximum(straight - 0.5 * wall - 0.5, first + 0.5)
    back = -(first + (last - first)[:, None] * np.linspace(0, 1, 5))
    turns = (straight > 1.5 * wall + 2)[:, None]
    half = 0.8 * wall + 1.5
    across = np.arange(-np.ceil(half), np.ceil(half) + 0.25, 0.5)
    for _ in range(2):
        values = sign * sample_across(light, tip, axis, back[:, :, None], across)
        floor = np.minimum(values[:, :, :2].mean(axis=2), values[:, :, -2:].mean(axis=2))[:, :, None]
        # Weights above half height only: the other side of a neighbouring wall must not draw the centre.
        peak = values.max(axis=2, keepdims=True)
        weight = np.maximum(values - floor - 0.4 * (peak - floor), 0.0) + 1e-6
        offset = (weight * across).sum(axis=2) / weight.sum(axis=2)
        slope, start = _line(back, offset)
        slope = np.clip(slope, -0.4, 0.4)[:, None] * turns
        start = np.where(turns[:, 0], start, offset[:, :2].mean(axis=1))
        normal = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
        tip = tip + np.clip(start, -0.6 * half, 0.6 * half)[:, None] * normal
        axis = axis + slope * normal
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return tip, axis


@dataclass(frozen=True)
class EndModel:
    """What is known of all ends beforehand: true wall width and blur in pixels (with blur_free only a start), the
    wall's usual height above the background (None: free), noise in grey levels, how far profiles run behind and
    beyond the tip, +1 for bright walls or −1.
    """

    width: float
    blur: float
    height: float | None
    noise: float
    reach: float
    out: float
    sign: float
    blur_free: bool = False


def fit_ends(light: Bytes, tip: Float64s, axis: Float64s, normal: Float64s, model: EndModel) -> FittedEnds:
    """Ends of walls fitted by background + height · Φ((end − s)/blur) to the profile over the wall's width.

    The half-height point of this model is the cut itself, also when the cut runs askew: wall and cut are both
    symmetric about the point where the axis meets the cut. Profiles are averaged along the cut as the coarse outline's
    `normal` (N, 2) gives it, so that a slanting end stays a sharp step.
    """
    along = np.arange(-max(model.reach, _LEAST_REACH), model.out + _STEP / 2, _STEP)
    cosine = np.maximum((axis * normal).sum(axis=1), _STEEPEST)
    sine = np.clip(axis[:, 0] * normal[:, 1] - axis[:, 1] * normal[:, 0], -1.0, 1.0)
    slope = np.where(cosine > _STEEPEST, sine / cosine, 0.0)
    # A wall much wider than the blur ends along the cut; a blurred thin one looks cut off square. Between them, with
    # the wall's profile taken as Gaussian, the share of its variance in the whole.
    share = model.width**2 / 12 / (model.width**2 / 12 + model.blur**2)
    shear, widening = share * slope, np.sqrt(1 + share * slope**2)
    width = max(0.4 * model.width, 0.5)
    across = np.linspace(-width, width, max(3, 2 * round(width) + 1))
    place = along[None, :, None] - shear[:, None, None] * across
    profile = model.sign * sample_across(light, tip, axis, place, across).mean(axis=2)
    fitted = _fit(profile, along, model.blur * widening, model)
    close = np.abs(fitted.end[:, None] - along) < _FAR * fitted.spread[:, None]
    misfit = np.sqrt((fitted.residual**2 * close).sum(axis=1) / np.maximum(close.sum(axis=1) - 3, 1))
    # Samples half a pixel apart share their noise: about two of them make one independent value.
    sigma = misfit * np.sqrt(2 * fitted.variance) * cosine
    point = tip + fitted.end[:, None] * axis
    return FittedEnds(point, axis, fitted.spread / widening, fitted.height, sigma, misfit)


@dataclass(frozen=True, eq=False)
class _Steps:
    """Fitted steps: where, how wide, how high (N,), variance of the place for unit noise (N,), residuals (N, S)."""

    end: Float64s
    spread: Float64s
    height: Float64s
    variance: Float64s
    residual: Float64s


def _fit(profile: Float64s, along: Float64s, spread: Float64s, model: EndModel) -> _Steps:
    """Least squares of background + height · Φ((end − s)/spread) to each profile (N, S), by Gauss-Newton on all at
    once.
    """
    top = medians(profile[:, along < -_ASIDE_PX], axis=1)
    bottom = profile[:, along > _ASIDE_PX].min(axis=1)
    end = _crossing(profile, along, 0.5 * (top + bottom))
    residual = profile
    variance = np.ones(len(profile))
    for _ in range(_TURNS):
        scaled = (end[:, None] - along) / spread[:, None]
        step = _normal_cdf(scaled)
        bell = np.exp(-0.5 * scaled * scaled) / (np.sqrt(2 * np.pi) * spread[:, None])
        # Far from the end other things than this end are seen: nodes behind it, dust and other walls beyond it.
        weight = np.where(np.abs(scaled) < _FAR, 1.0, 0.05)
        height = np.maximum(top - bottom, 1e-3)
        columns = [np.ones_like(step), step, height[:, None] * bell]
        if model.blur_free:
            columns.append(-height[:, None] * bell * scaled)
        jacobian = np.stack(columns, axis=1)
        residual = profile - (bottom[:, None] + height[:, None] * step)
        weighted = jacobian * weight[:, None, :]
        normal = weighted @ jacobian.transpose(0, 2, 1)
        right = (weighted @ residual[:, :, None])[:, :, 0]
        if model.height is not None:
            # A stub too short for a plateau is held by the usual height, loosely: walls differ in brightness.
            usual = ((model.noise / model.height) ** 2 + _MISFIT**2) / _HEIGHT_SPREAD**2
            normal[:, 1, 1] += usual
            right[:, 1] += usual * (model.height - height)
        normal += 1e-6 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(jacobian.shape[1])
        inverse = np.linalg.inv(normal)
        change = (inverse @ right[:, :, None])[:, :, 0]
        bottom = bottom + change[:, 0]
        top = bottom + np.maximum(height + change[:, 1], 1e-3)
        end = np.clip(end + np.clip(change[:, 2], -1.0, 1.0), along[0], along[-1])
        if model.blur_free:
            spread = np.clip(spread + np.clip(change[:, 3], -0.3, 0.3), 0.3, 6.0)
        variance = inverse[:, 2, 2]
    return _Steps(end, spread, top - bottom, variance, residual)


def sample_across(light: Bytes, tip: Float64s, axis: Float64s, along: Float64s, across: Float64s) -> Float64s:
    """Grey levels at tip + along · axis + across · normal, shape (N, S, A), for along (N, S, 1) or (N, S, A), across
    (A,).
    """
    along = np.broadcast_to(along, (len(tip), along.shape[1], len(across)))
    x = tip[:, 0, None, None] + along * axis[:, 0, None, None] - across * axis[:, 1, None, None]
    y = tip[:, 1, None, None] + along * axis[:, 1, None, None] + across * axis[:, 0, None, None]
    return sample_at(light, x, y)


def _line(x: Float64s, y: Float64s) -> tuple[Float64s, Float64s]:
    """Slope and value at 0 of the line through (x[n], y[n]) for each n."""
    centre = x - x.mean(axis=1, keepdims=True)
    slope = (y * centre).sum(axis=1) / (centre * centre).sum(axis=1)
    return slope, y.mean(axis=1) - slope * x.mean(axis=1)


def _crossing(profile: Float64s, along: Float64s, level: Float64s) -> Float64s:
    """Where each profile last falls through its level going outwards, shape (N,)."""
    above = profile >= level[:, None]
    falls = above[:, :-1] & ~above[:, 1:]
    near = np.where(falls, np.abs(along[:-1] + 0.5 * _STEP), np.inf)
    index = np.argmin(near, axis=1)
    rows = np.arange(len(profile))
    high, low = profile[rows, index], profile[rows, index + 1]
    part = np.clip((high - level) / np.maximum(high - low, 1e-6), 0, 1)
    return np.where(falls.any(axis=1), along[index] + part * _STEP, 0.0)


def _normal_cdf(x: Float64s) -> Float64s:
    """Standard normal distribution function, within 1e-5 (Abramowitz and Stegun 26.2.16)."""
    size = np.abs(x)
    t = 1 / (1 + 0.33267 * size)
    tail = np.exp(-0.5 * size * size) / np.sqrt(2 * np.pi) * t * (0.4361836 + t * (-0.1201676 + t * 0.9372980))
    return np.asarray(np.where(x >= 0, 1 - tail, tail), np.float64)


def true_width(seen: float, blur: float) -> float:
    """Width of a wall that measures `seen` pixels at half its height under `blur`, at least a quarter of it.

    Half height of a blurred strip: its own width when wide, 2.355 blur when thin; the 3.2-norm of both is within 2 %.
    """
    return float(max(seen**3.2 - (2.355 * blur) ** 3.2, (0.25 * seen) ** 3.2) ** (1 / 3.2))
