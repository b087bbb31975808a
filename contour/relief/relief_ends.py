"""Walls' ends by their tops and the sides below: a strip that ends at the cut, and what it sweeps as it goes down.

A wall's top may be as light as the table while its side is darker, or the other way round. The side ends on a slant,
from the top's end to where the camera sees the foot below it, up to ten pixels off: half of it inwards where the edge
looks away from the middle of the picture, beyond the cut where it looks towards it. So both are fitted together, each
with a height of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Float32s, Float64s, Int64s
from contour.image.opencv import slid
from contour.image.pixel_sampling import sample_at
from contour.relief.relief import Relief

# Layers between top and table.
_LAYERS = 6
_AROUND_PX = 3.0
# Widths of tops that are tried, of what walls measure, on so many ends.
_WIDTHS, _FEW = (1.0, 0.7, 0.5, 0.35), 24
# Width of a ramp over the standard deviation of a blurred step as steep.
_RAMP = 3.46
# In pixels' worth of doubt: how little a height may rest on.
_LEAST_WEIGHT = 0.5
# A wall that meets the cut at less than 20° is fitted as if it met it so.
_STEEPEST = 0.34
_STEEPEST_SLOPE = 2.0
# Neighbouring pixels share noise.
_SHARED_NOISE = 1.5


@dataclass(frozen=True, eq=False)
class ReliefEnds:
    """Ends of walls' tops (N, 2), picture pixels, standard deviations across the outline (N,), inf where nothing tells,
    the share of all difference around each end that top and side explain (N,), and how much top and side differ from
    the table there, root mean square, grey levels (N,).
    """

    point: Float64s
    sigma: Float64s
    told: Float64s
    height: Float64s


def relief_ends(
    relief: Relief, tip: Float64s, axis: Float64s, normal: Float64s, *, pitch_px: float, blur_px: float
) -> ReliefEnds:
    """Ends of the walls that seem to end at `tip` (N, 2), by unit `axis` out of the wall (N, 2) and the outline's
    outward `normal` (N, 2).
    """
    ends = list(zip(tip, axis, normal, relief.displacement.at(tip), strict=True))

    def fitted(some: slice, width: float) -> Float64s:
        return np.array([_fitted(relief, end, width, pitch_px, blur_px) for end in ends[some]]).reshape(-1, 5)

    # Walls in which top and side are alike measure as wide as both: the width by which most is explained is the top's.
    few = slice(None, None, max(1, len(ends) // _FEW))
    width = max((part * relief.wall_px for part in _WIDTHS), key=lambda width: float(fitted(few, width)[:, 3].sum()))
    values = fitted(slice(None), width)
    return ReliefEnds(values[:, :2], values[:, 2], values[:, 3], values[:, 4])


def _fitted(
    relief: Relief, seen_end: tuple[Float64s, ...], width: float, pitch_px: float, blur_px: float
) -> tuple[float, float, float, float, float]:
    """Point x and y, standard deviation, share explained, height, of an end's tip, axis, normal and what lies below."""
    tip, axis, normal, below = seen_end
    across = np.array([-axis[1], axis[0]])
    inwards, aside = float(below @ axis), float(below @ across)
    step = float(np.clip(width / 4.0, 0.5, 1.0))
    cosine = max(float(axis @ normal), _STEEPEST)
    slope = float(np.clip((axis[0] * normal[1] - axis[1] * normal[0]) / cosine, -_STEEPEST_SLOPE, _STEEPEST_SLOPE))
    # Where the top may end and its centre line lie, from the tip of what is seen of both: in whole steps.
    ends = _steps(-max(inwards, 0.0) - _AROUND_PX, max(-inwards, 0.0) + _AROUND_PX, step)
    centres = _steps(min(0.0, -aside) - 0.5 * width - 0.5, max(0.0, -aside) + 0.5 * width + 0.5, step)
    back, half = min(0.35 * pitch_px, 3.0 * width + 4.0), min(0.5 * pitch_px, width + abs(aside) + 2.0)
    along = _steps(step * ends[0] - back, step * ends[-1] + min(0.3 * pitch_px, 8.0), step)
    sideways = _steps(-half, half, step)
    s, y = step * along[:, None], step * sideways[None, :]
    x_at, y_at = (tip[k] + s * axis[k] + y * across[k] for k in (0, 1))
    seen = [sample_at(plane, x_at, y_at).astype(np.float32) for plane in relief.signed]
    # What an end at the tip looks like, as far around as the patch reaches from any end in question.
    reach = step * np.arange(along[0] - ends[-1], along[-1] - ends[0] + 1)
    beside = step * np.arange(sideways[0] - centres[-1], sideways[-1] - centres[0] + 1)
    top, side = _strip(reach[:, None], beside[None, :], (inwards, aside), slope, width, blur_px)
    # Slid over each other: the patch moves against the end.
    ones = np.ones_like(seen[0])
    squares = [slid(part, ones) for part in (top * top, top * side, side * side)]
    explained = sum(_explained(slid(top, plane), slid(side, plane), *squares) for plane in seen)
    total = float(sum((plane * plane).sum() for plane in seen))
    lost = np.maximum(total - explained, 1e-3 * total)
    # Sliding counts from the last end and centre to the first.
    rows = lost.min(axis=1)
    row = int(np.argmin(rows))
    column = int(np.argmin(lost[row]))
    end, centre = float(ends[-1 - row]), float(centres[-1 - column])
    covered = squares[0][row, column] + squares[2][row, column] + _LEAST_WEIGHT
    height = float(np.sqrt((total - rows[row]) / covered))
    told, sigma = 1.0 - float(rows[row]) / max(total, 1e-9), np.inf
    if 0 < row < len(rows) - 1:
        before, here, after = rows[row - 1 : row + 2].tolist()
        bend = before - 2.0 * here + after
        if bend > 0.0:
            end -= 0.5 * (before - after) / bend
            free = max(len(seen) * ones.size * step * step - 5.0, 1.0)
            sigma = _SHARED_NOISE * cosine * step * float(np.sqrt(2.0 * here / free / bend))
    x, y = (tip + step * end * axis + step * centre * across).tolist()
    return x, y, sigma, told, height


def _explained(of_top: Float64s, of_side: Float64s, top: Float64s, both: Float64s, side: Float64s) -> Float64s:
    """How much of the difference top and side explain, each at its best height; a side is darker than the table."""
    top, side = top + _LEAST_WEIGHT, side + _LEAST_WEIGHT
    determinant = np.maximum(top * side - both * both, 1e-6)
    high, low = (of_top * side - of_side * both) / determinant, (of_side * top - of_top * both) / determinant
    return np.where(low < 0.0, high * of_top + low * of_side, of_top * of_top / top)


def _strip(
    s: Float64s, y: Float64s, below: tuple[float, float], slope: float, width: float, blur_px: float
) -> tuple[Float32s, Float32s]:
    """Cover by the top of a wall that ends at 0, and by its side below, at places along and across it."""

    def layer(part: float) -> Float64s:
        there, aside = s - part * below[0], y - part * below[1]
        return _ramp(-slope * aside - there, blur_px) * (
            _ramp(aside + 0.5 * width, blur_px) - _ramp(aside - 0.5 * width, blur_px)
        )

    top = layer(0.0)
    all_of_it = np.maximum.reduce([layer(k / _LAYERS) for k in range(_LAYERS + 1)])
    return top.astype(np.float32), (all_of_it - top).astype(np.float32)


def _ramp(x: Float64s, sigma: float) -> Float64s:
    return np.clip(0.5 + x / (_RAMP * sigma), 0.0, 1.0)


def _steps(first: float, last: float, step: float) -> Int64s:
    """Whole steps from first to last."""
    return np.arange(int(np.floor(first / step)), int(np.ceil(last / step)) + 1)
