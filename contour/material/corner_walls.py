"""Whether walls stand in a corner, where the comb's own order would put some: in one that was cut, or round, none do.

What lies beside a corner lies some cells farther inside as well, and what lies there at the corner's own place would
stand in it, were it whole (a template match). No lattice is asked for, only that cells go on as they do beside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, rolled
from contour.geometry.rings import Ring, signed_area

# Corners turn by so much between sides so long, pitches.
_TURN, _SIDE = np.radians(50.0), 2.5
# Walls are looked at in so many samples a pitch, so many pitches around a corner, blurred by so many samples.
_SAMPLES, _AROUND, _BLUR = 10, 6, 0.35
# What so many pitches around is compared with what lies so many away, so far within the outline that ends of walls are
# none of it; the corner's place there may lie nearer to it.
_NEAR, _LEAST_AWAY, _MOST_AWAY, _DEEP, _WITHIN = 2.6, 0.75, 3.4, 0.55, 0.2
# So much of it must lie in the block there, and of the corner's place.
_COVERED, _TIP_COVERED = 0.85, 0.98
# Of so many places, each so far from the others, that are most alike, the best is so much so: without order 0.71 is
# found.
_PLACES, _APART, _ALIKE = 5, 0.5, 0.75
# The corner's own place: the triangle so deep, pitches. Walls cover so much of it, of what they do of the block, if it
# were whole; if they do by no more of that, it is bare, and by so much, it is there. Of 23 corners of 190 random
# blocks that were drawn more than 0.55 of a cell outside none had more than 0.05, of 179 right ones none less than
# 0.09, and 17 less than 0.46.
_TIP, _EXPECTED, _BARE, _THERE = 0.55, 0.5, 0.12, 0.3
# Of a corner that is not doubted that is asked where walls cover no more of it than that.
_MAYBE_BARE = 0.2
_AT = 1.0


@dataclass(frozen=True, eq=False)
class CornerWalls:
    """Corners of an outline, (N, 2), pixels; whether walls are missing in each, and whether they stand there, (N,)."""

    corners: Float64s
    bare: Bools
    there: Bools

    def tells(self, points: Float64s, pitch_px: float) -> Bools:
        """In which of the points (K, 2) a corner lies whose walls are there, shape (K,)."""
        away = np.hypot(*(self.corners[self.there] - points[:, None]).transpose(2, 0, 1))
        return np.asarray((away < _AT * pitch_px).any(axis=1))


def corner_walls(mask: Bytes, scale: int, ring: Ring, doubted: Float64s, pitch_px: float) -> CornerWalls:
    """What walls tell of the corners of an exterior, (N, 2), in pixels.

    `mask`, (h, w), uint8, 255 on walls, of a picture `scale` times as large. `doubted`: places (K, 2) in which corners
    are doubted.
    """
    before, after = ring - rolled(ring, 1), rolled(ring, -1) - ring
    long = np.minimum(np.hypot(*before.T), np.hypot(*after.T)) > _SIDE * pitch_px
    turn = np.angle((after[:, 0] + 1j * after[:, 1]) * (before[:, 0] - 1j * before[:, 1]))
    corners = np.flatnonzero(long & (np.sign(signed_area(ring)) * turn > _TURN))
    told = np.zeros((len(corners), 2), dtype=bool)
    for one, k in enumerate(corners.tolist()):
        ways = np.stack([-before[k], after[k]]) / np.hypot(*np.stack([before[k], after[k]]).T)[:, None]
        near = np.hypot(*(doubted - ring[k]).T).min(initial=np.inf) < _AT * pitch_px
        told[one] = _told(mask, ring, ring[k], ways, pitch_px, scale, near)
    return CornerWalls(ring[corners], told[:, 0], told[:, 1])


def _told(
    mask: Bytes, ring: Ring, corner: Float64s, ways: Float64s, pitch_px: float, scale: int, doubted: bool
) -> tuple[bool, bool]:
    """Whether walls are missing in a corner whose sides lead these ways (2, 2), and whether they stand there."""
    half, near = _AROUND * _SAMPLES, round(_NEAR * _SAMPLES)
    step = pitch_px / scale / _SAMPLES
    first = (corner + 0.5) / scale - 0.5 - half * step
    walls = _walls(mask, first, step, 2 * half + 1)
    block = np.zeros(walls.shape, np.uint8)
    cv2.fillPoly(block, [np.rint(((ring + 0.5) / scale - 0.5 - first) / step).astype(np.int32)], 1)
    block[[0, -1]] = block[:, [0, -1]] = 0
    depth = cv2.distanceTransform(block, cv2.DIST_L2, 5) / _SAMPLES
    inside = (depth > _DEEP).astype(np.float32)
    middle = slice(half - near, half + near + 1)
    y, x = np.mgrid[-near : near + 1, -near : near + 1] / _SAMPLES
    beside = inside[middle, middle] * (np.hypot(x, y) < _NEAR).astype(np.float32)
    tip = np.zeros(beside.shape, np.uint8)
    # Unit ways add up to twice the cosine of half the angle between them.
    legs = 2.0 * _TIP * ways / max(float(np.hypot(*ways.sum(axis=0))), 0.1)
    corners = np.concatenate([[[0.0, 0.0]], legs]) * _SAMPLES + near
    cv2.fillPoly(tip, [np.rint(corners * 16).astype(np.int32)], 1, cv2.LINE_8, 4)
    usual = float(walls[inside > 0].mean()) if inside.any() else 0.0
    if beside.sum() < _SAMPLES**2 or not tip.any() or usual == 0.0:
        return False, False
    there = float(walls[middle, middle][tip > 0].mean()) / usual
    if not doubted and there > _MAYBE_BARE:
        return False, False
    at, beside = (part.astype(np.float32) / np.float32(part.sum()) for part in (tip, beside))
    alike, would = _alike(walls, beside, middle), _matched(walls, at) / usual
    away = np.hypot(*(np.mgrid[: len(alike), : len(alike)] - (half - near))) / _SAMPLES
    whole = _matched((depth > _WITHIN).astype(np.float32), at) > _TIP_COVERED
    whole &= _matched(inside, beside) > _COVERED
    alike[~whole | (away < _LEAST_AWAY) | (away > _MOST_AWAY)] = -1.0
    best = _best(alike)
    if len(best) == 0 or alike[best[0]] < _ALIKE:
        return False, False
    expected = float(np.median([would[place] for place in best]))
    return (there < _BARE * expected, there > _THERE * expected) if expected > _EXPECTED else (False, False)


def _walls(mask: Bytes, first: Float64s, step: float, size: int) -> Float32s:
    """Walls from a place (x, y) of the mask on, `step` of its samples apart, (size, size), 1 where all is wall."""
    low = np.clip(np.floor(first).astype(int) - 2, 0, np.subtract(mask.shape[::-1], 1))
    high = np.ceil(first + size * step).astype(int) + 2
    part = mask[low[1] : max(high[1], low[1] + 1), low[0] : max(high[0], low[0] + 1)].astype(np.float32) / 255
    blurred = cv2.GaussianBlur(part, (0, 0), max(0.3, _BLUR * step))
    there = np.array([[step, 0.0, first[0] - low[0]], [0.0, step, first[1] - low[1]]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(blurred, there, (size, size), flags=flags), np.float32)


def _alike(walls: Float32s, weight: Float32s, middle: slice) -> Float32s:
    """How alike what lies in the middle, with these weights of 1 in all, is to what lies elsewhere: correlations."""
    own = walls[middle, middle]
    off = own - np.float32((own * weight).sum())
    mean = _matched(walls, weight)
    spread = np.maximum(_matched(walls * walls, weight) - mean * mean, 1e-4) * float((off * off * weight).sum())
    return np.asarray(_matched(walls, off * weight) / np.sqrt(np.maximum(spread, 1e-8)), np.float32)


def _matched(picture: Float32s, weight: Float32s) -> Float32s:
    """Sums of the picture with these weights, laid everywhere within it."""
    return np.asarray(cv2.matchTemplate(picture, weight, cv2.TM_CCORR), np.float32)


def _best(alike: Float32s) -> list[tuple[int, int]]:
    """The places that are most alike, best first, no two close together, none that is unlike."""
    left, best = alike.copy(), list[tuple[int, int]]()
    y, x = np.mgrid[: left.shape[0], : left.shape[1]]
    while len(best) < _PLACES:
        row, column = divmod(int(left.argmax()), left.shape[1])
        if left[row, column] <= 0.0:
            break
        best.append((row, column))
        left[np.hypot(y - row, x - column) < _APART * _SAMPLES] = -1.0
    return best
