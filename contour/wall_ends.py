"""Wall ends: points of the wall mask's boundary where a wall stops, found along the boundary chains."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.coarse_block import CoarseBlock

Gray = NDArray[np.uint8]
Points = NDArray[np.float64]

_BAND_PITCHES = 1.25
_DEPTH_PITCHES = 0.9


@dataclass(frozen=True)
class WallEnds:
    """Ends in mask pixels: tip (N, 2), unit axis pointing out of the wall (N, 2), and whether seen clean (N,)."""

    tip: Points
    axis: Points
    clean: NDArray[np.bool_]


@dataclass(frozen=True)
class Chains:
    """Boundary chains one after the other: points (N, 2), first index and length of each point's chain, both (N,)."""

    points: Points
    first: NDArray[np.int64]
    length: NDArray[np.int64]

    def shifted(self, steps: int) -> NDArray[np.int64]:
        """Index of the point `steps` further along each point's own closed chain."""
        return self.first + (np.arange(len(self.points)) - self.first + steps) % self.length


def edge_chains(mask: Gray, coarse: CoarseBlock, pitch: float) -> Chains:
    """Boundary chains of the walls within about a pitch of the coarse edge."""
    band = (np.abs(coarse.depth) < _BAND_PITCHES * pitch).astype(np.uint8) * 255
    height, width = mask.shape
    matrix = np.array([[1 / coarse.step, 0, 0.5 / coarse.step - 0.5 + 8], [0, 1 / coarse.step, 0.5 / coarse.step - 0.5 + 8]])
    near = cv2.warpAffine(band, matrix, (width, height), flags=cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP)
    chains, _ = cv2.findContours(cv2.bitwise_and(mask, near), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    kept = [chain for chain in chains if len(chain) >= 12]
    if not kept:
        return Chains(np.empty((0, 2)), np.empty(0, np.int64), np.empty(0, np.int64))
    sizes = np.array([len(chain) for chain in kept])
    starts = np.cumsum(sizes) - sizes
    points = np.concatenate(kept)[:, 0, :].astype(np.float64)
    return Chains(points, np.repeat(starts, sizes), np.repeat(sizes, sizes))


def find_ends(chains: Chains, coarse: CoarseBlock, pitch: float, wall: float) -> WallEnds:
    """Points where the two arms along the chain lie about a wall's width apart and the point sticks out of them."""
    arm = int(np.clip(round(1.1 * wall + 2), 3, max(3, 0.45 * pitch)))
    gap, stick, axis = _arms(chains, arm)
    candidate = (gap < 1.35 * wall + 2.0) & (stick > 0.5 * arm) & (chains.length > 3 * arm)
    peak = _peaks(chains, np.where(candidate, stick - 0.5 * gap, -np.inf), arm)
    depth = coarse.depth_at(chains.points[peak])
    peak = peak[(depth < _DEPTH_PITCHES * pitch) & (depth > -_DEPTH_PITCHES * pitch)]
    far_gap, far_stick, far_axis = _arms(chains, min(2 * arm, max(3, int(0.5 * pitch))))
    clean = (far_gap[peak] < 1.5 * wall + 2.0) & (far_stick[peak] > 1.2 * arm) & (gap[peak] < 1.2 * wall + 1.5)
    chosen = np.where(clean[:, None], far_axis[peak], axis[peak])
    return WallEnds(chains.points[peak], chosen, clean)


def _arms(chains: Chains, arm: int) -> tuple[NDArray[np.float64], NDArray[np.float64], Points]:
    """Distance of the points `arm` steps back and ahead, how far each point sticks out of their middle, and where to."""
    back, ahead = chains.points[chains.shifted(-arm)], chains.points[chains.shifted(arm)]
    out = chains.points - 0.5 * (back + ahead)
    stick = np.hypot(out[:, 0], out[:, 1])
    gap = np.hypot(*(back - ahead).T)
    return gap, stick, out / np.maximum(stick, 1e-9)[:, None]


def _peaks(chains: Chains, score: NDArray[np.float64], reach: int) -> NDArray[np.int64]:
    """Middle of each run of best scores that no score within `reach` steps along the chain exceeds."""
    best = np.isfinite(score)
    for step in range(1, reach + 1):
        best &= score >= score[chains.shifted(step)]
        best &= score > score[chains.shifted(-step)]
    return np.flatnonzero(best)


def outermost(chains: Chains, coarse: CoarseBlock, pitch: float) -> NDArray[np.int64]:
    """Indices of the chain points that reach furthest out, one in every half pitch of each ring."""
    depth = coarse.depth_at(chains.points)
    near = np.flatnonzero(depth < 0.5 * pitch)
    ring, arc, _ = coarse.feet(chains.points[near])
    slot = (ring << 32) + (arc / (0.5 * pitch)).astype(np.int64)
    order = np.lexsort((depth[near], slot))
    _, first = np.unique(slot[order], return_index=True)
    return np.asarray(near[order[first]], np.int64)
