"""The best pose by trying a million of them, with shapely's word on the best: slow, and none of our code in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import affinity

from contour.geometry.rings import Contour

POSES = 1_000_000
_KEPT = (20_000, 300, 12)
_SAMPLES = (24, 240)
_NODE_MM = 0.5
_POLISH_MM = (4.0, 1e-3)
_AT_ONCE = 25_000

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Found:
    """The best margin of the poses tried, and what a pattern search from the best dozen of them made of it, mm."""

    searched_mm: float
    polished_mm: float


def shape_of(contour: Contour) -> shapely.Polygon:
    """The contour as shapely has it."""
    return shapely.Polygon(contour.exterior, list(contour.holes))


def margin(part: shapely.Polygon, block: shapely.Polygon) -> float:
    """How far the part's material keeps from the block's edge; -inf where it leaves the block's material."""
    return float(shapely.distance(part, block.boundary)) if block.contains(part) else -math.inf


def signed_margin(part: shapely.Polygon, block: shapely.Polygon) -> float:
    """The margin; where the part leaves the block's material, minus how far: of the part's places outside, and of the
    block's edge within the part, the farthest from where it should be.
    """
    if block.contains(part):
        return margin(part, block)
    outside = shapely.points(shapely.get_coordinates(part.difference(block)))
    within = shapely.points(shapely.get_coordinates(block.boundary.intersection(part)))
    far = shapely.distance(outside, block).max(initial=0.0), shapely.distance(within, part.boundary).max(initial=0.0)
    return -float(max(far))


def search(part: Contour, block: Contour, seed: int) -> Found:
    """Poses at random over the block's box and all turns; of the best ones the margin is measured."""
    rng = np.random.default_rng([seed, 77])
    low, high = block.exterior.min(axis=0), block.exterior.max(axis=0)
    middle = (part.exterior.min(axis=0) + part.exterior.max(axis=0)) / 2
    poses = rng.uniform([*low, 0.0], [*high, 2 * math.pi], (POSES, 3))
    depth, origin = _depths(block)
    outline = shape_of(part)
    for kept, count in zip(_KEPT[:2], _SAMPLES, strict=True):
        samples = _along(outline, count) - middle
        least = np.concatenate(
            [_least(depth, origin, samples, poses[k : k + _AT_ONCE]) for k in range(0, len(poses), _AT_ONCE)]
        )
        poses = poses[np.argsort(-least)[:kept]]
    whole = shape_of(block)
    drawn = affinity.translate(outline, *(-middle).tolist())
    margins = [margin(_laid(drawn, pose), whole) for pose in poses]
    order = np.argsort(margins)[::-1][: _KEPT[2]]
    best = float(margins[order[0]])
    return Found(best, max(_polished(drawn, whole, poses[index]) for index in order))


def _laid(drawn: shapely.Polygon, pose: Array) -> shapely.Polygon:
    turned = affinity.rotate(drawn, float(pose[2]), origin=(0, 0), use_radians=True)
    return affinity.translate(turned, float(pose[0]), float(pose[1]))


def _polished(drawn: shapely.Polygon, block: shapely.Polygon, pose: Array) -> float:
    """Moves along each axis and diagonal, halved where none helps."""
    left, bottom, right, top = drawn.bounds
    arm = math.hypot(right - left, top - bottom) / 2
    ways = [
        np.array([x, y, turn / arm]) for x in (-1, 0, 1) for y in (-1, 0, 1) for turn in (-1, 0, 1) if x or y or turn
    ]
    now, best, step = pose, margin(_laid(drawn, pose), block), _POLISH_MM[0]
    while step > _POLISH_MM[1]:
        tried = [(margin(_laid(drawn, now + way * step), block), index) for index, way in enumerate(ways)]
        gained, index = max(tried)
        if gained > best:
            best, now = gained, now + ways[index] * step
        else:
            step /= 2
    return best


def _depths(block: Contour) -> tuple[NDArray[np.float32], Array]:
    """Depth in the block at nodes, mm, by shapely's word on inside and a distance transform; and the first node."""
    low, high = block.exterior.min(axis=0) - 2 * _NODE_MM, block.exterior.max(axis=0) + 2 * _NODE_MM
    x, y = (np.arange(a, b, _NODE_MM) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=2)
    whole = shape_of(block)
    shapely.prepare(whole)
    inside = shapely.contains_xy(whole, grid[..., 0], grid[..., 1]).astype(np.uint8)
    within, outside = (cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) for mask in (inside, 1 - inside))
    return np.asarray((within - outside) * _NODE_MM, np.float32), low


def _least(depth: NDArray[np.float32], origin: Array, samples: Array, poses: Array) -> Array:
    cosine, sine = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    x = samples[:, 0] * cosine - samples[:, 1] * sine + poses[:, :1] - origin[0]
    y = samples[:, 0] * sine + samples[:, 1] * cosine + poses[:, 1:2] - origin[1]
    column = np.clip((x / _NODE_MM + 0.5).astype(np.intp), 0, depth.shape[1] - 1)
    row = np.clip((y / _NODE_MM + 0.5).astype(np.intp), 0, depth.shape[0] - 1)
    return np.asarray(depth[row, column].min(axis=1), np.float64)


def _along(outline: shapely.Polygon, count: int) -> Array:
    rings = [outline.exterior, *outline.interiors]
    length = sum(ring.length for ring in rings)
    found = []
    for ring in rings:
        places = np.linspace(0.0, ring.length, max(round(count * ring.length / length), 4), endpoint=False)
        found.append(shapely.get_coordinates(shapely.line_interpolate_point(ring, places)))
    return np.concatenate(found)
