"""Wall ends: points of the wall mask's boundary where a wall stops, found along the boundary chains."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float64s, Int64s
from contour.geometry.rings import Ring, densified
from contour.walls.coarse_rings import CoarseBlock

_BAND_PITCHES = 1.25
_DEPTH_PITCHES = 0.9
# A disc half again as wide as a wall gets to within one of its radii of the tip of a triangle's tooth of 60 degrees, to
# within 0.4 of that of a corner of 90.
_THIN_WALLS, _THIN_PX = 0.6, 1.0


@dataclass(frozen=True, eq=False)
class WallEnds:
    """Ends in mask pixels: tip (N, 2), unit axis pointing out of the wall (N, 2), length of straight wall behind
    (N,).
    """

    tip: Float64s
    axis: Float64s
    straight: Float64s


@dataclass(frozen=True, eq=False)
class Chains:
    """Boundary chains one after the other: points (N, 2), first index and length of each point's chain, both (N,)."""

    points: Float64s
    first: Int64s
    length: Int64s

    def shifted(self, steps: int, at: Int64s) -> Int64s:
        """Index of the point `steps` further along the own closed chain of each point `at`."""
        first = self.first[at]
        return first + (at - first + steps) % self.length[at]

    def free_side(self, at: Int64s, arm: int) -> Float64s:
        """Vector towards the side without wall, as long as the points `arm` steps ahead and back of `at` are apart."""
        # findContours runs with the free side at (−dy, dx) of its direction, for outer boundaries and inner ones alike.
        across = self.across(at, arm)
        return np.stack([across[:, 1], -across[:, 0]], axis=1)

    def across(self, at: Int64s, arm: int) -> Float64s:
        """From the point `arm` steps ahead of each point `at` to that as far back, (K, 2)."""
        return self.points.take(self.shifted(-arm, at), axis=0) - self.points.take(self.shifted(arm, at), axis=0)


def edge_chains(mask: Bytes, coarse: CoarseBlock, pitch_px: float) -> Chains:
    """Boundary chains of the walls within about a pitch of the coarse edge."""
    # A sample's margin around the block's own walls keeps chips that lie beside it out, and their thin ends in.
    own = cv2.dilate(coarse.walls, np.ones((3, 3), np.uint8))
    band = ((np.abs(coarse.depth) < _BAND_PITCHES * pitch_px) & (own > 0)).astype(np.uint8) * 255
    chains, _ = cv2.findContours(
        cv2.bitwise_and(mask, coarse.enlarged(band, mask.shape)), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE
    )
    kept = [chain for chain in chains if len(chain) >= 12]
    if not kept:
        return Chains(np.empty((0, 2)), np.empty(0, np.int64), np.empty(0, np.int64))
    sizes = np.array([len(chain) for chain in kept])
    starts = np.cumsum(sizes) - sizes
    points = np.concatenate(kept)[:, 0, :].astype(np.float64)
    return Chains(points, np.repeat(starts, sizes), np.repeat(sizes, sizes))


def find_ends(chains: Chains, coarse: CoarseBlock, pitch_px: float, wall: float) -> WallEnds:
    """Points where the two arms along the chain lie about a wall's width apart and the point sticks out of them."""
    arm, peak = _tips(chains, pitch_px, wall)
    depth = coarse.depth_at(chains.points[peak])
    peak = peak[np.abs(depth) < _DEPTH_PITCHES * pitch_px]
    # The arms are let out for as long as they stay a wall's width apart: that much of the wall is straight.
    longest = max(arm + 1, round(0.55 * pitch_px))
    straight, axis = np.full(len(peak), float(arm)), _arms(chains, peak, arm)[2]
    still = np.ones(len(peak), np.bool_)
    for length in range(arm + 1, longest + 1):
        gap, stick, out = _arms(chains, peak, length)
        still &= (gap < 1.35 * wall + 2.0) & (stick > length - 0.75 * wall - 2.0) & (chains.length[peak] > 2 * length)
        straight = np.where(still, stick, straight)
        axis = np.where(still[:, None], out, axis)
    return WallEnds(chains.points[peak], axis, straight)


def ring_tips(ring: Ring, pitch_px: float, wall: float) -> Float64s:
    """Where a ring around material, negative shoelace, comes back on itself within a wall's width: the ends of walls
    that stand out of it, shape (K, 2), in its order.
    """
    points = densified(ring, 1.0)
    one = Chains(points, np.zeros(len(points), np.int64), np.full(len(points), len(points), np.int64))
    return points[_tips(one, pitch_px, wall)[1]]


def thin(region: Bytes, tips: Float64s, wall_px: float, radii: float) -> Bools:
    """Which tips, (N, 2), pixels, of a region (H, W) of walls and closed cells, 1 there, are as thin as a wall for so
    many `radii` of a disc that is half again as wide, shape (N,).
    """
    radius = _THIN_WALLS * wall_px + _THIN_PX
    pad = int(radius) + 2
    framed = cv2.copyMakeBorder(region, pad, pad, pad, pad, cv2.BORDER_CONSTANT, value=0)
    thick = (cv2.distanceTransform(framed, cv2.DIST_L2, 5) > radius).astype(np.uint8)
    away = cv2.distanceTransform(1 - thick, cv2.DIST_L2, 5)
    column, row = (np.rint(tips) + pad).astype(int).T
    return np.asarray(away[row, column] > (1.0 + radii) * radius)


def _tips(chains: Chains, pitch_px: float, wall: float) -> tuple[int, Int64s]:
    """How long arms along the chains are, and the points that stick out of two arms a wall's width apart."""
    arm = int(np.clip(round(1.1 * wall + 2), 3, max(3, 0.45 * pitch_px)))
    everywhere = np.arange(len(chains.points))
    across = chains.across(everywhere, arm)
    near = np.flatnonzero((np.hypot(across[:, 0], across[:, 1]) < 1.35 * wall + 2.0) & (chains.length > 3 * arm))
    gap, stick, out = _arms(chains, near, arm)
    # A sharp corner of a small cell has close arms too, but sticks out into the wall. A wall one pixel wide has none
    # of both.
    free = across[near, 1] * out[:, 0] - across[near, 0] * out[:, 1]
    candidate = (stick > 0.5 * arm) & (free > -0.5)
    score = np.full(len(everywhere), -np.inf)
    score[near[candidate]] = (stick - 0.5 * gap)[candidate]
    return arm, _peaks(chains, score, arm)


def _arms(chains: Chains, at: Int64s, arm: int) -> tuple[Float64s, Float64s, Float64s]:
    """Distance of the points `arm` steps back and ahead of `at`, how far each sticks out of their middle, and where
    to.
    """
    points = chains.points
    back, ahead = points.take(chains.shifted(-arm, at), axis=0), points.take(chains.shifted(arm, at), axis=0)
    out = points.take(at, axis=0) - 0.5 * (back + ahead)
    stick = np.hypot(out[:, 0], out[:, 1])
    gap = np.hypot(*(back - ahead).T)
    return gap, stick, out / np.maximum(stick, 1e-9)[:, None]


def _peaks(chains: Chains, score: Float64s, reach: int) -> Int64s:
    """Middle of each run of best scores that no score within `reach` steps along the chain exceeds."""
    best = np.flatnonzero(np.isfinite(score))
    for step in range(1, reach + 1):
        ahead, back = score[chains.shifted(step, best)], score[chains.shifted(-step, best)]
        best = best[(score[best] >= ahead) & (score[best] > back)]
    return best


def outermost(chains: Chains, coarse: CoarseBlock, pitch_px: float) -> Int64s:
    """Indices of the chain points that reach further out of the block than all within 0.4 pitch along their chain.

    The wall must lie behind them, seen from outside, and no other such point within a pitch may reach a third of a
    pitch further out: that one would hide it from the cut.
    """
    near = np.flatnonzero(np.abs(coarse.depth_at(chains.points)) < 0.5 * pitch_px)
    height = np.full(len(chains.points), -np.inf)
    height[near] = coarse.height_at(chains.points.take(near, axis=0))
    peak = _peaks(chains, height, max(2, round(0.4 * pitch_px)))
    _, _, normal = coarse.feet(chains.points[peak])
    peak = peak[(chains.free_side(peak, 3) * normal).sum(axis=1) > 0]
    points, level = chains.points[peak], height[peak]
    x, y = points[:, 0], points[:, 1]
    close = (x[:, None] - x) ** 2 + (y[:, None] - y) ** 2 < pitch_px * pitch_px
    envelope = np.where(close, level[None, :], -np.inf).max(axis=1) if len(peak) else level
    return np.asarray(peak[level > envelope - pitch_px / 3], np.int64)
