"""How deep every place lies in the block, on a grid: what a search over all poses looks up instead of measuring."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Float32s, Float64s
from contour.geometry.rings import Contour, bounding_box

_FRACTION_BITS = 8
_ERROR_NODES = 1.5
"""A pixel's corner, and as much again for what a depth of half a pixel rounds."""


@dataclass(frozen=True)
class DepthField:
    """Depth in the block, mm, negative outside, at nodes `spacing_mm` apart; the first node lies at `origin` (x, y).

    Off by up to `_ERROR_NODES`. Beyond the grid its border's values go on.
    """

    depth: Float32s
    slope_x: Float32s
    slope_y: Float32s
    origin: tuple[float, float]
    spacing_mm: float

    @classmethod
    def of(cls, block: Contour, pad_mm: float, nodes: int) -> DepthField:
        """`nodes` along the longer side of the block's box with `pad_mm` around it."""
        box = bounding_box(block.exterior)
        spacing = (max(box.width, box.height) + 2 * pad_mm) / nodes
        origin = (box.min_x - pad_mm, box.min_y - pad_mm)
        shape = (
            int(np.ceil((box.height + 2 * pad_mm) / spacing)) + 1,
            int(np.ceil((box.width + 2 * pad_mm) / spacing)) + 1,
        )
        mask = np.zeros(shape, np.uint8)
        rings = [
            np.round((ring - origin) / spacing * (1 << _FRACTION_BITS)).astype(np.int32).reshape(-1, 1, 2)
            for ring in block.rings
        ]
        # Even-odd over all rings at once: holes stay free.
        cv2.fillPoly(mask, rings, 1, cv2.LINE_8, _FRACTION_BITS)
        if not mask.any():  # beside a part many times its size the block is no node wide
            mask[tuple(np.array(shape) // 2)] = 1
        inside = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        outside = cv2.distanceTransform(1 - mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        depth = np.where(mask > 0, inside - 0.5, 0.5 - outside).astype(np.float32) * np.float32(spacing)
        slope_y, slope_x = np.gradient(depth, np.float32(spacing))
        return cls(depth, np.asarray(slope_x), np.asarray(slope_y), origin, spacing)

    def every(self, stride: int) -> DepthField:
        """Only every `stride`-th node."""
        parts = [np.ascontiguousarray(one[::stride, ::stride]) for one in (self.depth, self.slope_x, self.slope_y)]
        return DepthField(parts[0], parts[1], parts[2], self.origin, self.spacing_mm * stride)

    def at(self, points: Float64s) -> tuple[Float32s, Float32s, Float32s]:
        """Depth and its slopes along x and y at points (..., M, 2), shapes (..., M)."""
        nodes = ((points - self.origin) / self.spacing_mm).astype(np.float32)
        x, y = np.ascontiguousarray(nodes[..., 0]), np.ascontiguousarray(nodes[..., 1])
        return _looked_up(self.depth, x, y), _looked_up(self.slope_x, x, y), _looked_up(self.slope_y, x, y)

    def bounds(self, points: Float64s) -> tuple[Float64s, Float64s]:
        """Least and largest depth that points (N, 2) may have, shapes (N,); also beyond the grid."""
        last = np.array(self.depth.shape[::-1]) - 1.0
        nodes = (points - self.origin) / self.spacing_mm
        within = np.clip(nodes, 0.0, last)
        x, y = np.ascontiguousarray(within.astype(np.float32)[None].transpose(2, 0, 1))
        depth = _looked_up(self.depth, x, y)[0].astype(np.float64)
        beyond = np.hypot(*(nodes - within).T) * self.spacing_mm
        error = _ERROR_NODES * self.spacing_mm
        border = max(float(line.max()) for line in (self.depth[0], self.depth[-1], self.depth[:, 0], self.depth[:, -1]))
        return depth - beyond - error, np.where(beyond > 0, border - beyond, depth) + error


def _looked_up(values: Float32s, x: Float32s, y: Float32s) -> Float32s:
    return np.asarray(cv2.remap(values, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32)
