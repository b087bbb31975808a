"""The lattice that cells' centres make: the steps from a cell to its neighbours, and which cells these join."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Float64s, Indices, median, medians

_LEAST_PAIRS = 12
_REFERENCES = 400
_NEAR_PITCHES = (0.6, 1.45)
_BINS = 96
_SMOOTH_BINS = 2.0
_FAR_TURNED = math.radians(35.0)
_AREA = (0.75, 1.3)
"""Of a cell of this pitch: lattices of every second cell, or of corners, have another."""

_MET = 0.3
"""Of a pitch: a neighbour lies no farther from where the step says."""

# Of 132 drawn combs, warped and with broken walls, the fewest neighbours are 0.45 of six a cell, the farthest off by
# 0.098 pitch, the median. Foam has 0.18 and 0.19, irregular cells 0.07 to 0.17.
_LEAST_JOINED, _MOST_OFF = 0.35, 0.11
_ROUNDS = 3
_IDS_PER_PITCH = 4


@dataclass(frozen=True, eq=False)
class CellLattice:
    """Steps to three of six neighbours, shape (3, 2), in the centres' unit, the third the second less the first; and
    for each the pairs of cells that it joins, numbers shape (K, 2).
    """

    steps: Float64s
    pairs: tuple[Indices, Indices, Indices]


def cell_lattice(centres: Float64s, pitch: float) -> CellLattice | None:
    """The lattice of centres (N, 2) about `pitch` apart; None where they make none, or lie in no good order."""
    steps = _first_steps(centres, pitch)
    if steps is None:
        return None
    for _ in range(_ROUNDS):
        pairs = _neighbours(centres, steps, pitch)
        if min(len(one) for one in pairs) < _LEAST_PAIRS:
            return None
        mean = np.array([medians(centres[one[:, 1]] - centres[one[:, 0]], axis=0) for one in pairs])
        # Their sum is nothing but for what each was measured off.
        open_by = (mean[1] - mean[0] - mean[2]) / 3.0
        steps = np.stack([mean[0] + open_by, mean[1] - open_by, mean[2] + open_by])
    off = [
        np.hypot(*(centres[one[:, 1]] - centres[one[:, 0]] - step).T) for one, step in zip(pairs, steps, strict=True)
    ]
    joined = sum(map(len, pairs)) / (3 * len(centres))
    orderly = joined > _LEAST_JOINED and median(np.concatenate(off)) < _MOST_OFF * pitch
    return CellLattice(steps, pairs) if orderly else None


def _first_steps(centres: Float64s, pitch: float) -> Float64s | None:
    """The three shortest steps by where neighbours of some cells lie most often."""
    chosen = np.linspace(0, len(centres) - 1, min(len(centres), _REFERENCES)).astype(np.intp)
    apart = (centres[None, :, :] - centres[chosen, None, :]).reshape(-1, 2)
    square = (apart**2).sum(axis=1)
    near = apart[(square > (_NEAR_PITCHES[0] * pitch) ** 2) & (square < (_NEAR_PITCHES[1] * pitch) ** 2)]
    reach = _NEAR_PITCHES[1] * pitch
    place = np.floor((near + reach) / (2 * reach) * _BINS).astype(np.intp)
    counts = np.zeros((_BINS, _BINS), np.float32)
    np.add.at(counts, (place[:, 1], place[:, 0]), 1.0)
    counts = np.asarray(cv2.GaussianBlur(counts + counts[::-1, ::-1], (0, 0), _SMOOTH_BINS), np.float32)
    axis = (np.arange(_BINS) + 0.5) / _BINS * 2 * reach - reach
    x, y = np.meshgrid(axis, axis)
    found = []
    for _ in range(2):
        row, column = np.unravel_index(int(np.argmax(counts)), counts.shape)
        step = np.array([axis[column], axis[row]])
        found.append(step)
        turned = np.abs(np.arctan2(x * step[1] - y * step[0], x * step[0] + y * step[1]))
        counts[np.minimum(turned, math.pi - turned) < _FAR_TURNED] = 0.0
    return _reduced(found[0], found[1], pitch)


def _reduced(one: Float64s, other: Float64s, pitch: float) -> Float64s | None:
    """The three shortest steps of the lattice of two, the third the second less the first (Lagrange and Gauss)."""
    for _ in range(8):
        if one @ one > other @ other:
            one, other = other, one
        times = round(float(one @ other / (one @ one)))
        if times == 0:
            break
        other = other - times * one
    if one @ other < 0:
        one = -one
    area = abs(float(one[0] * other[1] - one[1] * other[0])) / (pitch**2 * math.sqrt(3.0) / 2.0)
    return np.stack([one, other, other - one]) if _AREA[0] < area < _AREA[1] else None


def _neighbours(centres: Float64s, steps: Float64s, pitch: float) -> tuple[Indices, Indices, Indices]:
    """Pairs of cells that each step joins, looked up on a grid that knows which centre is nearest, about."""
    spacing = pitch / _IDS_PER_PITCH
    low = centres.min(axis=0) - 2 * pitch
    place = np.rint((centres - low) / spacing).astype(np.intp)
    wide, high = (place.max(axis=0) + 3 * _IDS_PER_PITCH).tolist()
    number = np.full((high, wide), -1, np.intp)
    for down in (-1, 1, 0):
        for right in (-1, 1, 0):
            number[place[:, 1] + down, place[:, 0] + right] = np.arange(len(centres))
    found = []
    for step in steps:
        aim = np.rint((centres + step - low) / spacing).astype(np.intp)
        aim = np.clip(aim, 0, (wide - 1, high - 1))
        other = number[aim[:, 1], aim[:, 0]]
        off = np.hypot(*(centres[other] - centres - step).T)
        own = np.flatnonzero((other >= 0) & (off < _MET * pitch))
        found.append(np.column_stack([own, other[own]]))
    return found[0], found[1], found[2]
