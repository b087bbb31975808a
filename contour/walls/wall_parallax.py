"""How far the walls' sides show below their top edges, read from the widths of the walls themselves.

Under a camera that looks down, the lower edge of a wall lies nearer to the picture's middle than its top: the wall
shows its side, and where side and top are alike (black foil on a bright table) the wall looks wider by the parallax
across it. Width against parallax over the ends around a block gives both the true width and the parallax.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bytes, Float64s, median, quantile
from contour.walls.end_profile import sample_across

_ROUNDS = 8
_LEAST_ENDS = 16
# The slope must stand this many of its standard deviations above zero.
_SIGNIFICANT = 4.0
# And make this much of a width at the block's far end, or correcting it adds more noise than it takes away.
_LEAST_PX = 1.0
_MIDDLE_HOLD = 0.5


@dataclass(frozen=True, eq=False)
class Parallax:
    """Displacement of the walls' lower edges towards `middle` (picture pixels), as a share of the distance from it;
    width of the walls' tops in pixels, or None where no parallax shows.
    """

    share: float
    middle: Float64s
    width: float | None

    def across(self, points: Float64s, direction: Float64s) -> Float64s:
        """Displacement along unit vectors `direction` (N, 2) at `points` (N, 2), positive away from the middle,
        pixels.
        """
        return np.asarray(self.share * ((points - self.middle) * direction).sum(axis=1), np.float64)


def parallax(light: Bytes, tip: Float64s, axis: Float64s, *, straight: Float64s, wall: float, sign: float) -> Parallax:
    """Parallax that the ends `tip` (N, 2) with unit `axis` (N, 2) and `straight` (N,) pixels of wall behind them
    show.
    """
    middle = np.array([(light.shape[1] - 1) / 2.0, (light.shape[0] - 1) / 2.0])
    none = Parallax(0.0, middle, None)
    long = straight > 0.7 * wall
    if np.count_nonzero(long) < _LEAST_ENDS:
        return none
    tip, axis = tip[long], axis[long]
    normal = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
    width = _widths(light, tip, axis, straight=straight[long], wall=wall, sign=sign)
    seen = np.isfinite(width)
    if np.count_nonzero(seen) < _LEAST_ENDS:
        return none
    lever, normal, width = (((tip - middle) * normal).sum(axis=1))[seen], normal[seen], width[seen]
    factors, deviation = _fitted(lever, normal, width)
    share = float(factors[1])
    largest = quantile(np.abs(share * lever - normal @ factors[2:4]), 0.9)
    if share < _SIGNIFICANT * deviation or largest < _LEAST_PX or factors[0] < 1.0:
        return none
    return Parallax(share, middle + factors[2:4] / share, float(factors[0]))


def _fitted(lever: Float64s, normal: Float64s, width: Float64s) -> tuple[Float64s, float]:
    """Top width, share and displacement (x, y) at the picture's middle, and the share's standard deviation.

    width = top + |share · lever − normal · displacement|: linear once the signs are known, which the last turn gives. A
    tilted camera stands over another place than the picture's middle. Walls of one direction, the glued ribbons, are
    thicker by themselves: two terms in twice the angle take that up.
    """
    side = np.sign(lever)
    weight = np.ones_like(width)
    factors: Float64s = np.zeros(6)
    covariance: Float64s = np.eye(6)
    twice = (normal[:, 0] + 1j * normal[:, 1]) ** 2
    spread = 1.0
    for _ in range(_ROUNDS):
        ribbons = (twice.real, twice.imag)
        moved = (-side * normal[:, 0], -side * normal[:, 1])
        terms = np.stack([np.ones_like(lever), side * lever, *moved, *ribbons], axis=1)
        root = np.sqrt(weight)[:, None]
        # Held near the middle by a few pixels' worth of doubt: ends on one side of it cannot tell both apart.
        matrix = (terms * root).T @ (terms * root) + np.diag([0.0, 0.0, _MIDDLE_HOLD, _MIDDLE_HOLD, 1.0, 1.0])
        factors = np.asarray(np.linalg.solve(matrix, (terms * root).T @ (width * root[:, 0])), np.float64)
        off = np.abs(width - terms @ factors)
        spread = max(1.4826 * median(off), 0.1)
        weight = 1 / (1 + (off / (2 * spread)) ** 2)
        side = np.where(factors[1] * lever - normal @ factors[2:4] >= 0, 1.0, -1.0)
        covariance = np.asarray(np.linalg.inv(matrix), np.float64)
    return factors, spread * float(np.sqrt(covariance[1, 1]))


def _widths(light: Bytes, tip: Float64s, axis: Float64s, *, straight: Float64s, wall: float, sign: float) -> Float64s:
    """Width at half height a little behind each end, nan where the profile does not fall off on both sides."""
    half = np.ceil(1.2 * wall + 3)
    across = np.arange(-half, half + 0.1, 0.25)
    back = -(0.6 * wall + (np.maximum(straight - wall, 0.5))[:, None] * np.array([0.2, 0.5, 0.8]))
    profile = sign * sample_across(light, tip, axis, back[:, :, None], across).mean(axis=1)
    centre = len(across) // 2
    peak = profile[:, centre - 2 : centre + 3].mean(axis=1)
    floor = np.maximum(profile[:, :centre].min(axis=1), profile[:, centre:].min(axis=1))
    below = profile < (0.5 * (peak + floor))[:, None]
    right, left = below[:, centre:], below[:, centre::-1]
    width = 0.25 * (np.argmax(right, axis=1) + np.argmax(left, axis=1) - 1.0)
    return np.where(right.any(axis=1) & left.any(axis=1) & (peak > floor), width, np.nan)
