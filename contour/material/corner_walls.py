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
from contour.geometry.signed_distance import nearest
from contour.image.opencv import slid
from contour.image.pixel_grid import fill_finely, samples_of

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

# What is looked at, in samples: its half and all of it, and in its middle what is compared.
_HALF, _SIZE, _REACH = _AROUND * _SAMPLES, 2 * _AROUND * _SAMPLES + 1, round(_NEAR * _SAMPLES)
_MIDDLE = slice(_HALF - _REACH, _HALF + _REACH + 1)
_AROUND_IT = (np.hypot(*np.mgrid[-_REACH : _REACH + 1, -_REACH : _REACH + 1] / _SAMPLES) < _NEAR).astype(np.float32)


@dataclass(frozen=True, eq=False)
class CornerWalls:
    """Corners of an outline, (N, 2), pixels; whether walls are missing in each, and whether they stand there, (N,)."""

    corners: Float64s
    bare: Bools
    there: Bools

    def tells(self, points: Float64s, pitch_px: float) -> Bools:
        """In which of the points (K, 2) a corner lies whose walls are there, shape (K,)."""
        return nearest(points, self.corners[self.there]) < _AT * pitch_px


def corner_walls(mask: Bytes, scale: int, ring: Ring, doubted: Float64s, pitch_px: float) -> CornerWalls:
    """What walls tell of the corners of an exterior, (N, 2), in pixels.

    `mask`, (h, w), uint8, 255 on walls, of a picture `scale` times as large. `doubted`: places (K, 2) in which corners
    are doubted.
    """
    sides = np.stack([rolled(ring, 1) - ring, rolled(ring, -1) - ring], axis=1)
    long = np.hypot(sides[..., 0], sides[..., 1])
    along = sides[..., 0] + 1j * sides[..., 1]
    turn = np.angle(-along[:, 1] * along[:, 0].conj()) * np.sign(signed_area(ring))
    at = np.flatnonzero((long.min(axis=1) > _SIDE * pitch_px) & (turn > _TURN))
    near = nearest(ring[at], doubted) < _AT * pitch_px
    samples, step = samples_of(ring, scale), pitch_px / scale / _SAMPLES
    told = np.zeros((len(at), 2), dtype=bool)
    for one, k in enumerate(at.tolist()):
        first = samples[k] - _HALF * step
        walls, depth = _walls(mask, first, step), _depth((samples - first) / step)
        told[one] = _told(walls, depth, _tip(sides[k] / long[k, :, None]), doubted=bool(near[one]))
    return CornerWalls(ring[at], told[:, 0], told[:, 1])


def _walls(mask: Bytes, first: Float64s, step: float) -> Float32s:
    """Walls from a place (x, y) of the mask on, `step` of its samples apart, (_SIZE, _SIZE), 1 where all is wall."""
    low = np.clip(np.floor(first).astype(int) - 2, 0, np.subtract(mask.shape[::-1], 1))
    high = np.maximum(np.ceil(first + _SIZE * step).astype(int) + 2, low + 1)
    part = mask[low[1] : high[1], low[0] : high[0]].astype(np.float32) / 255
    blurred = cv2.GaussianBlur(part, (0, 0), max(0.3, _BLUR * step))
    there = np.array([[step, 0.0, first[0] - low[0]], [0.0, step, first[1] - low[1]]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(blurred, there, (_SIZE, _SIZE), flags=flags), np.float32)


def _depth(ring: Ring) -> Float32s:
    """How deep in a ring of samples, (N, 2), each lies, pitches, (_SIZE, _SIZE): outside 0, as is what is beyond."""
    block = np.zeros((_SIZE, _SIZE), np.uint8)
    cv2.fillPoly(block, [np.rint(ring).astype(np.int32)], 1)
    block[[0, -1]] = block[:, [0, -1]] = 0
    return np.asarray(cv2.distanceTransform(block, cv2.DIST_L2, 5) / _SAMPLES, np.float32)


def _tip(ways: Float64s) -> Bytes:
    """1 in the tip of a corner in the middle whose sides lead these ways, unit vectors (2, 2), around it."""
    tip = np.zeros(_AROUND_IT.shape, np.uint8)
    # Unit ways add up to twice the cosine of half the angle between them.
    legs = 2.0 * _TIP * ways / max(float(np.hypot(*ways.sum(axis=0))), 0.1)
    corners = np.concatenate([[[0.0, 0.0]], legs]) * _SAMPLES + len(tip) // 2
    fill_finely(tip, [corners], 1)
    return tip


def _told(walls: Float32s, depth: Float32s, tip: Bytes, *, doubted: bool) -> tuple[bool, bool]:
    """Whether walls are missing in the tip of the corner in the middle, and whether they stand there."""
    inside = (depth > _DEEP).astype(np.float32)
    beside = inside[_MIDDLE, _MIDDLE] * _AROUND_IT
    usual = float(walls[inside > 0].mean()) if inside.any() else 0.0
    if beside.sum() < _SAMPLES**2 or not tip.any() or usual == 0.0:
        return False, False
    there = float(walls[_MIDDLE, _MIDDLE][tip > 0].mean()) / usual
    if not doubted and there > _MAYBE_BARE:
        return False, False
    at, beside = (part.astype(np.float32) / np.float32(part.sum()) for part in (tip, beside))
    alike = _alike(walls, beside)
    away = np.hypot(*(np.mgrid[: len(alike), : len(alike)] - _MIDDLE.start)) / _SAMPLES
    whole = (slid((depth > _WITHIN).astype(np.float32), at) > _TIP_COVERED) & (slid(inside, beside) > _COVERED)
    alike[~whole | (away < _LEAST_AWAY) | (away > _MOST_AWAY)] = -1.0
    best = _best(alike)
    if not best or alike[best[0]] < _ALIKE:
        return False, False
    would = slid(walls, at) / usual
    expected = float(np.median([would[place] for place in best]))
    return (there < _BARE * expected, there > _THERE * expected) if expected > _EXPECTED else (False, False)


def _alike(walls: Float32s, weight: Float32s) -> Float64s:
    """How alike what lies in the middle, with these weights of 1 in all, is to what lies elsewhere: correlations."""
    own = walls[_MIDDLE, _MIDDLE]
    off = own - np.float32((own * weight).sum())
    mean = slid(walls, weight)
    spread = np.maximum(slid(walls * walls, weight) - mean * mean, 1e-4) * float((off * off * weight).sum())
    return np.asarray(slid(walls, off * weight) / np.sqrt(np.maximum(spread, 1e-8)))


def _best(alike: Float64s) -> list[tuple[int, int]]:
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
