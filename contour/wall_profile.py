"""Sub-pixel wall ends: where a blurred step, fitted along each wall's axis, says that the material stops."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Gray = NDArray[np.uint8]
Points = NDArray[np.float64]
Vector = NDArray[np.float64]

_STEP = 0.5
_TURNS = 4


@dataclass(frozen=True)
class FittedEnds:
    """Ends in picture pixels (N, 2), unit axes out of the wall (N, 2), blur (standard deviation of the edge, N), wall level
    above background (N,), standard deviation along the axis (N,), residual in grey levels (N,)."""

    point: Points
    axis: Points
    blur: Vector
    height: Vector
    sigma: Vector
    residual: Vector


def centred_axes(light: Gray, tip: Points, axis: Points, wall: float, straight: Vector, sign: float) -> tuple[Points, Points]:
    """Tips and axes moved onto the wall's centre line: (N, 2), (N, 2), picture pixels.

    Cross profiles at five places from a third of a wall's width behind the tip to `straight` (N,) pixels give the centre;
    a line through them, the axis. Twice, because the first profiles may be taken askew. A stub shorter than one and a
    half wall widths gives no direction; only its middle is used.
    """
    first = 0.35 * wall + 0.3
    last = np.maximum(straight - 0.5 * wall - 0.5, first + 0.5)
    back = -(first + (last - first)[:, None] * np.linspace(0, 1, 5))
    turns = (straight > 1.5 * wall + 2)[:, None]
    half = 0.8 * wall + 1.5
    across = np.arange(-np.ceil(half), np.ceil(half) + 0.25, 0.5)
    for _ in range(2):
        values = sign * _sample(light, tip, axis, back, across)
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


def fit_ends(
    light: Gray, tip: Points, axis: Points, *, wall: float, blur: float | None, reach: float, out: float, sign: float
) -> FittedEnds:
    """Ends of walls fitted by background + height · Φ((end − s)/blur) on the profile averaged over the middle of the wall.

    The half-height point of this model is the cut itself, also when the cut runs askew: wall and cut are both
    symmetric about the point where the axis meets the cut. `blur` None leaves it free. `reach` and `out` are how far
    the profile runs behind and beyond the tip, pixels.
    """
    along = np.arange(-reach, out + _STEP / 2, _STEP)
    width = max(0.3 * wall, 0.5)
    across = np.linspace(-width, width, 3 if width < 1 else 5)
    profile = sign * _sample(light, tip, axis, np.broadcast_to(along, (len(tip), len(along))), across).mean(axis=2)
    return _fit(profile, along, tip, axis, blur)


def _fit(profile: NDArray[np.float64], along: Vector, tip: Points, axis: Points, blur: float | None) -> FittedEnds:
    count, samples = profile.shape
    top = np.median(profile[:, along < -1.0], axis=1)
    bottom = profile[:, along > 1.0].min(axis=1)
    end = _crossing(profile, along, 0.5 * (top + bottom))
    spread = np.full(count, blur if blur is not None else 0.9)
    residual = profile
    covariance = np.zeros((count, 3, 3))
    for _ in range(_TURNS):
        scaled = (end[:, None] - along) / spread[:, None]
        step = _normal_cdf(scaled)
        bell = np.exp(-0.5 * scaled * scaled) / (np.sqrt(2 * np.pi) * spread[:, None])
        # Far from the end other things than this end are seen: nodes behind it, dust and other walls beyond it.
        weight = np.where(np.abs(scaled) < 3.5, 1.0, 0.05) + 1e-9
        height = np.maximum(top - bottom, 1e-3)[:, None]
        columns = [np.ones_like(step), step, height * bell]
        if blur is None:
            columns.append(-height * bell * scaled)
        jacobian = np.stack(columns, axis=2)
        residual = profile - (bottom[:, None] + height * step)
        weighted = jacobian * weight[:, :, None]
        normal = np.einsum("nsi,nsj->nij", weighted, jacobian)
        normal += 1e-6 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(jacobian.shape[2])
        change = np.linalg.solve(normal, np.einsum("nsi,ns->ni", weighted, residual)[:, :, None])[:, :, 0]
        bottom = bottom + change[:, 0]
        top = bottom + np.maximum(height[:, 0] + change[:, 1], 1e-3)
        end = np.clip(end + np.clip(change[:, 2], -1.0, 1.0), along[0], along[-1])
        if blur is None:
            spread = np.clip(spread + np.clip(change[:, 3], -0.3, 0.3), 0.3, 4.0)
        covariance = np.linalg.inv(normal)
    close = np.abs(end[:, None] - along) < 3.5 * spread[:, None]
    misfit = np.sqrt((residual**2 * close).sum(axis=1) / np.maximum(close.sum(axis=1) - 3, 1))
    # Samples half a pixel apart share their noise: about two of them make one independent value.
    sigma = misfit * np.sqrt(2 * covariance[:, 2, 2])
    return FittedEnds(tip + end[:, None] * axis, axis, spread, top - bottom, sigma, misfit)


def _sample(light: Gray, tip: Points, axis: Points, along: NDArray[np.float64], across: Vector) -> NDArray[np.float64]:
    """Grey levels at tip + along · axis + across · normal, shape (N, S, A), for along (N, S) and across (A,)."""
    normal = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
    place = (
        tip[:, None, None, :]
        + along[:, :, None, None] * axis[:, None, None, :]
        + across[None, None, :, None] * normal[:, None, None, :]
    ).astype(np.float32)
    count = len(tip)
    flat = place.reshape(count, -1, 2)
    values = cv2.remap(light, flat, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(values, np.float64).reshape(count, along.shape[1], len(across))


def _line(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[Vector, Vector]:
    """Slope and value at 0 of the line through (x[n], y[n]) for each n."""
    centre = x - x.mean(axis=1, keepdims=True)
    slope = (y * centre).sum(axis=1) / (centre * centre).sum(axis=1)
    return slope, y.mean(axis=1) - slope * x.mean(axis=1)


def _crossing(profile: NDArray[np.float64], along: Vector, level: Vector) -> Vector:
    """Where each profile last falls through its level going outwards, shape (N,)."""
    above = profile >= level[:, None]
    falls = above[:, :-1] & ~above[:, 1:]
    near = np.where(falls, np.abs(along[:-1] + 0.5 * _STEP), np.inf)
    index = np.argmin(near, axis=1)
    rows = np.arange(len(profile))
    high, low = profile[rows, index], profile[rows, index + 1]
    part = np.clip((high - level) / np.maximum(high - low, 1e-6), 0, 1)
    return np.where(falls.any(axis=1), along[index] + part * _STEP, 0.0)


def _normal_cdf(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Standard normal distribution function, within 1e-5 (Abramowitz and Stegun 26.2.16)."""
    size = np.abs(x)
    t = 1 / (1 + 0.33267 * size)
    tail = np.exp(-0.5 * size * size) / np.sqrt(2 * np.pi) * t * (0.4361836 + t * (-0.1201676 + t * 0.9372980))
    return np.where(x >= 0, 1 - tail, tail)
