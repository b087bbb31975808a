"""Poses worth measuring: all turns and shifts looked up on a coarse grid, the best of them moved uphill on a finer one.

For one turn, the least depth that any point of the part has in the block is an erosion of the depth field, with the
part's points as the structuring element: all shifts at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, Indices, Int16s
from contour.geometry.rings import Contour, bounding_box, densified
from contour.image.side_by_side import side_by_side
from contour.placement.clearance import Outline, contacts
from contour.placement.field import DepthField
from contour.placement.pose import Pose, Turns

_NODES = 640
_STRIDE = 4
_MOST_SAMPLES = 320
_CLIMBERS = 192
_MOST_STEPS = 32_000
_CLIMB_STEPS = 36
_PAD_SHARE = 0.04
"""Of the block's size, besides what the part is larger by however it is turned: beyond the grid nothing is known."""


@dataclass(frozen=True)
class Candidate:
    """A pose that may be the best or lead to it, the turns it may take from there, and its least depth, about."""

    pose: Pose
    turn_range: tuple[float, float]
    depth_mm: float


def pivot_of(part: Contour) -> Float64s:
    """The middle of the part's box in its drawing, (2,): turning about it moves the part least."""
    box = bounding_box(part.exterior)
    return np.array([(box.min_x + box.max_x) / 2, (box.min_y + box.max_y) / 2])


def candidates(part: Contour, block: Contour, turns: Turns) -> tuple[list[Candidate], DepthField]:
    """The best poses found, best first, no two alike, and the field of the block that they were found on."""
    pivot = pivot_of(part)
    box, own = bounding_box(block.exterior), bounding_box(part.exterior)
    size = max(box.width, box.height)
    pad = _PAD_SHARE * size + max(float(np.hypot(own.width, own.height)) - min(box.width, box.height), 0.0) / 2
    fine = DepthField.of(block, pad, _NODES)
    coarse = fine.every(_STRIDE)
    samples = _samples(part, block, coarse.spacing_mm) - pivot
    angles = turns.samples()
    half = len(angles) // 2
    field, step = _in_steps(coarse.depth), coarse.spacing_mm
    one, other = side_by_side(
        lambda: [_eroded(field, samples, step, angle) for angle, _ in angles[:half]],
        lambda: [_eroded(field, samples, step, angle) for angle, _ in angles[half:]],
    )
    levels = one + other
    chosen = _peaks(levels, turns)
    starts = np.array(
        [
            (coarse.origin[0] + x * coarse.spacing_mm, coarse.origin[1] + y * coarse.spacing_mm, angles[k][0])
            for k, y, x in chosen.tolist()
        ]
    )
    ranges = np.array([angles[k][1] for k, _, _ in chosen.tolist()])
    half = len(starts) // 2
    (climbed, depth), (others, their_depth) = side_by_side(
        lambda: _climbed(fine, samples, starts[:half], ranges[:half], coarse.spacing_mm),
        lambda: _climbed(fine, samples, starts[half:], ranges[half:], coarse.spacing_mm),
    )
    climbed, depth = np.concatenate([climbed, others]), np.concatenate([depth, their_depth])
    found = []
    for index in _distinct(climbed, depth, samples, fine.spacing_mm):
        x, y, angle = climbed[index].tolist()
        at = Pose(0.0, 0.0, angle).moved(pivot[None])[0]
        low, high = ranges[index].tolist()
        found.append(Candidate(Pose(x - float(at[0]), y - float(at[1]), angle), (low, high), float(depth[index])))
    return found, fine


def _samples(part: Contour, block: Contour, spacing: float) -> Float64s:
    """Points of the part that stand for it, (N, 2): along its rings and, where the block has holes, in its material.

    A hole of the block within the part's material would be seen by no point of its rings.
    """
    length = sum(float(np.hypot(*(ring - np.roll(ring, 1, axis=0)).T).sum()) for ring in part.rings)
    along = [densified(ring, max(length / _MOST_SAMPLES, spacing)) for ring in part.rings]
    if not block.holes:
        return np.concatenate(along)
    widest = min(min(bounding_box(hole).width, bounding_box(hole).height) for hole in block.holes)
    box = bounding_box(part.exterior)
    step = max(widest / 2, spacing, np.sqrt(box.width * box.height / _MOST_SAMPLES))
    x, y = np.meshgrid(np.arange(box.min_x, box.max_x, step), np.arange(box.min_y, box.max_y, step))
    grid = np.column_stack([x.ravel(), y.ravel()])
    # Points in the part's material have a negative distance from being out of it.
    inner = contacts(Outline(grid, grid), Outline.of(part), np.inf, np.arange(len(grid)))
    return np.concatenate([*along, grid[np.unique(inner.vertex[inner.distance > 0])]])


def _in_steps(depth: Float32s) -> Int16s:
    """The depths in whole steps, as fine as int16 holds: eroded twice as fast, and alike are only those that are."""
    steps = np.rint(depth * (_MOST_STEPS / max(float(np.abs(depth).max()), 1e-9)))
    return np.asarray(steps, np.int16)


def _eroded(depth: Int16s, samples: Float64s, spacing: float, angle: float) -> Int16s:
    """The least depth of any sample, where the pivot lies on each node; shape as the field's."""
    nodes = np.round(Pose(0.0, 0.0, angle).moved(samples) / spacing).astype(np.intp)
    reach = int(np.abs(nodes).max())
    element: Bytes = np.zeros((2 * reach + 1, 2 * reach + 1), np.uint8)
    element[nodes[:, 1] + reach, nodes[:, 0] + reach] = 1
    outside = (float(np.iinfo(np.int16).min), 0, 0, 0)
    return np.asarray(cv2.erode(depth, element, borderType=cv2.BORDER_CONSTANT, borderValue=outside), np.int16)


def _peaks(levels: list[Int16s], turns: Turns) -> Indices:
    """Places (turn, row, column) no worse than their neighbours, the best `_CLIMBERS`, shape (K, 3)."""
    around = [np.asarray(cv2.dilate(level, np.ones((3, 3), np.uint8)), np.int16) for level in levels]
    linked = [turns.cyclic, *turns.neighbours(), turns.cyclic]
    floor = min(int(level.min()) for level in levels)
    places, depths = [], []
    for k, level in enumerate(levels):
        beside = [
            around[k],
            *([around[k - 1]] if linked[k] else []),
            *([around[k + 1 - len(levels)]] if linked[k + 1] else []),
        ]
        # Where the part leaves the grid all is alike.
        row, column = np.nonzero((level >= np.maximum.reduce(beside)) & (level > floor))
        places.append(np.column_stack([np.full(len(row), k), row, column]))
        depths.append(level[row, column])
    order = np.argsort(-np.concatenate(depths).astype(np.intp), kind="stable")[:_CLIMBERS]
    return np.asarray(np.concatenate(places)[order], np.intp)


def _climbed(
    field: DepthField, samples: Float64s, starts: Float64s, ranges: Float64s, first_mm: float
) -> tuple[Float64s, Float64s]:
    """Poses of the pivot (x, y, angle), (K, 3), moved uphill all at once, and the least depth that each reached.

    The way is that of the samples that lie least deep, each the more the less; steps and what counts as least shrink.
    """
    if not len(starts):
        return starts, np.empty(0)
    arm = max(float(np.hypot(*samples.T).max()), 1e-9)
    now, best = starts.copy(), starts.copy()
    reached = np.full(len(starts), -np.inf)
    steps = np.geomspace(1.5 * first_mm, 0.3 * field.spacing_mm, _CLIMB_STEPS)
    for step in steps.tolist():
        cosine, sine = np.cos(now[:, 2, None]), np.sin(now[:, 2, None])
        x, y = samples[:, 0] * cosine - samples[:, 1] * sine, samples[:, 0] * sine + samples[:, 1] * cosine
        depth, slope_x, slope_y = field.at(np.stack([x + now[:, :1], y + now[:, 1:2]], axis=2))
        least = depth.min(axis=1)
        better = least > reached
        reached[better], best[better] = least[better], now[better]
        weight = np.exp((least[:, None] - depth) / step)
        weight /= weight.sum(axis=1, keepdims=True)
        turn = ((x * slope_y - y * slope_x) * weight).sum(axis=1) / arm
        way = np.column_stack([(slope_x * weight).sum(axis=1), (slope_y * weight).sum(axis=1), turn])
        way[:, 2] = np.where(ranges[:, 0] == ranges[:, 1], 0.0, way[:, 2])
        way *= (step / np.maximum(np.linalg.norm(way, axis=1), 0.2))[:, None]
        now = now + way / (1.0, 1.0, arm)
        now[:, 2] = np.clip(now[:, 2], *ranges.T)
    return best, reached


def _distinct(poses: Float64s, depth: Float64s, samples: Float64s, alike_mm: float) -> list[int]:
    """Indices of the poses, deepest first, without those that lie where a deeper one does."""
    arm = float(np.hypot(*samples.T).max())
    kept: list[int] = []
    for index in np.argsort(-depth, kind="stable").tolist():
        others = poses[kept] - poses[index]
        others[:, 2] = (others[:, 2] + np.pi) % (2 * np.pi) - np.pi
        apart: Bools = np.abs(others * (1.0, 1.0, arm)).max(axis=1, initial=0.0) > alike_mm
        if bool(apart.all()):
            kept.append(index)
    return kept
