"""The rings of a coarse block, along which witnesses are ordered, and the maps that place any point by them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s, Float64s, Int32s, Int64s, rolled
from contour.geometry.rings import Ring
from contour.image.pixel_grid import Grey, enlarged, pixels_of, samples_of
from contour.image.pixel_sampling import sample_at

PAD = 8
"""Samples of margin around the coarse grid."""
_FRAME_PX = 2


def padded(grid: Grey, border: int) -> Grey:
    """A grid with its margin, filled by a border of OpenCV's, constant 0."""
    return cast(Grey, cv2.copyMakeBorder(grid, PAD, PAD, PAD, PAD, border, value=0))


@dataclass(frozen=True, eq=False)
class CoarseRing:
    """One ring of the coarse block: vertices (M, 2), the same smoothed over two pitches (M, 2), arc length at each
    (M,), outward unit normals (M, 2), total length.

    In pixels of the wall mask. Exterior: positive shoelace; hole: negative.
    """

    vertices: Ring
    base: Float64s
    arc: Float64s
    normal: Float64s
    length: float
    is_hole: bool


@dataclass(frozen=True, eq=False)
class CoarseBlock:
    """Rings (exterior first) and the maps that place any point: signed distance and nearest ring vertex.

    filled, walls, strands: coarse grid, uint8, 1 in the block, where it has walls, and where there are others that hang
    on nothing. depth: coarse grid, float32, mask pixels, positive inside. nearest: coarse grid, int32, index into all
    vertices of all rings one after the other. step: mask pixels a coarse sample. leaves: whether the block runs out of
    the picture.
    """

    rings: tuple[CoarseRing, ...]
    filled: Bytes
    walls: Bytes
    strands: Bytes
    depth: Float32s
    nearest: Int32s
    step: int
    leaves: bool

    def depth_at(self, points: Float64s) -> Float64s:
        """Distance inside the coarse edge, negative outside, shape (N,), mask pixels, for points (N, 2) in mask
        pixels.
        """
        grid = self._grid(points)
        return sample_at(self.depth, grid[:, 0], grid[:, 1])

    def height_at(self, points: Float64s) -> Float64s:
        """How far points (N, 2) stand out of the ring smoothed over two pitches, along its normal, shape (N,), mask
        pixels.
        """
        index = self._nearest_at(points)
        base = np.concatenate([r.base for r in self.rings])[index]
        normal = np.concatenate([r.normal for r in self.rings])[index]
        return np.asarray(((points - base) * normal).sum(axis=1), np.float64)

    def strands_near(self, reach: float) -> Float64s:
        """Places of strands within `reach` mask pixels outside of the coarse edge, shape (K, 2), mask pixels."""
        near = np.flatnonzero(self.strands.view(np.bool_) & (self.depth > -reach))
        rows, columns = np.divmod(near, self.strands.shape[1])
        return pixels_of(np.stack([columns, rows], axis=1) - PAD, self.step)

    def feet(self, points: Float64s) -> tuple[Int64s, Float64s, Float64s]:
        """Ring number, arc length and outward normal at the foot of each point on its nearest ring."""
        index = self._nearest_at(points)
        sizes = np.array([len(ring.vertices) for ring in self.rings])
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        ring = np.searchsorted(starts, index, side="right") - 1
        vertices = np.concatenate([r.vertices for r in self.rings])
        normals = np.concatenate([r.normal for r in self.rings])
        arcs = np.concatenate([r.arc for r in self.rings])
        lengths = np.array([r.length for r in self.rings])[ring]
        tangent = np.stack([-normals[index, 1], normals[index, 0]], axis=1)
        along = ((points - vertices[index]) * tangent).sum(axis=1)
        arc = (arcs[index] + np.clip(along, -self.step, self.step)) % lengths
        return ring, arc, normals[index]

    def unpadded(self, grid: Bytes) -> Bytes:
        """A map on the coarse grid without its margin: sample (i, j) covers mask pixels from step · i and step · j
        on.
        """
        return grid[PAD:-PAD, PAD:-PAD]

    def enlarged(self, grid: Bytes, shape: tuple[int, ...]) -> Bytes:
        """A map on the coarse grid at the size of the wall mask, whose `shape` is (H, W)."""
        return enlarged(self.unpadded(grid), self.step, shape)

    def _nearest_at(self, points: Float64s) -> Int32s:
        grid = np.rint(self._grid(points)).astype(np.int64)
        height, width = self.nearest.shape
        return self.nearest[np.clip(grid[:, 1], 0, height - 1), np.clip(grid[:, 0], 0, width - 1)]

    def _grid(self, points: Float64s) -> Float64s:
        return samples_of(points, self.step) + PAD


def sides(filled: Bytes, at_frame: list[bool], samples: float) -> list[int]:
    """Sides of the picture (top, bottom, left, right as 0…3) that the block meets over more than half a pitch, with
    walls in its last pixels: a coarse sample may be several of these wide.
    """
    inner = filled[PAD:-PAD, PAD:-PAD]
    sides = (inner[:2].max(axis=0), inner[-2:].max(axis=0), inner[:, :2].max(axis=1), inner[:, -2:].max(axis=1))
    return [number for number, side in enumerate(sides) if at_frame[number] and np.count_nonzero(side) > 0.5 * samples]


def walls_at_frame(mask: Bytes, walls: Bytes, step: int) -> list[bool]:
    """Whether a wall of the block, `walls` on the coarse grid, lies in the last two pixels of the wall mask (H, W),
    uint8, for each side of it: top, bottom, left, right.
    """
    own = walls[PAD:-PAD, PAD:-PAD]
    sides = (
        (mask[:_FRAME_PX].max(axis=0), own[0]),
        (mask[-_FRAME_PX:].max(axis=0), own[-1]),
        (mask[:, :_FRAME_PX].max(axis=1), own[:, 0]),
        (mask[:, -_FRAME_PX:].max(axis=1), own[:, -1]),
    )
    return [bool((line[samples.repeat(step)[: len(line)] > 0] > 0).any()) for line, samples in sides]


def with_rings(filled: Bytes, walls: Bytes, strands: Bytes, step: int, samples: float, *, leaves: bool) -> CoarseBlock:
    """The block with the rings around what is filled of it; `samples` is the pitch on the coarse grid."""
    chains, hierarchy = cv2.findContours(filled, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    order = sorted(range(len(chains)), key=lambda i: (hierarchy[0][i][3] >= 0, -len(chains[i])))
    pixels = [
        _turned(np.asarray(chains[i][:, 0, :], np.int32), hierarchy[0][i][3] >= 0) for i in order if len(chains[i]) >= 8
    ]
    rings = []
    seeds = np.ones(filled.shape, np.uint8)
    for number, chain in enumerate(pixels):
        seeds[chain[:, 1], chain[:, 0]] = 0
        rings.append(_ring(chain, number > 0, step, samples))
    _, labels = cv2.distanceTransformWithLabels(seeds, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    joined = np.concatenate(pixels)
    index_of_label = np.zeros(int(labels.max()) + 1, np.int32)
    index_of_label[labels[joined[:, 1], joined[:, 0]]] = np.arange(len(joined))
    inside = cv2.distanceTransform(filled, cv2.DIST_L2, 5)
    outside = cv2.distanceTransform(1 - filled, cv2.DIST_L2, 5)
    depth = np.asarray(inside, np.float32) - np.asarray(outside, np.float32)
    depth += np.float32(0.5) - filled
    depth *= step
    nearest = index_of_label.take(np.asarray(labels, np.int32))
    return CoarseBlock(tuple(rings), filled, walls, strands, depth, nearest, step, leaves)


def _ring(chain: Int32s, is_hole: bool, step: int, samples: float) -> CoarseRing:
    """A chain of coarse samples as a ring in mask pixels with normals smoothed over about two pitches."""
    points = chain.astype(np.float64)
    smooth = cyclic_mean(points, max(1, round(samples / 4)))
    half = max(2, round(samples))
    ahead = cyclic_mean(points, half)
    tangent = np.roll(ahead, -half, axis=0) - np.roll(ahead, half, axis=0)
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-9)
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    # The chain runs through sample centres, half a sample inside the filled block (outside of it along a hole).
    vertices = pixels_of(smooth - PAD, step) + (0.5 * step) * normal
    lengths = np.linalg.norm(rolled(vertices, -1) - vertices, axis=1)
    arc = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    base = pixels_of(ahead - PAD, step)
    return CoarseRing(vertices, base, arc, normal, float(lengths.sum()), is_hole)


def cyclic_mean(points: Float64s, half: int) -> Float64s:
    """Mean of each point with its `half` neighbours on both sides around a ring, shape (N, 2)."""
    count = len(points)
    half = min(half, (count - 1) // 2)
    padded = np.concatenate([points[count - half :], points, points[: half + 1]])
    total = np.cumsum(np.concatenate([np.zeros((1, 2)), padded]), axis=0)
    return np.asarray((total[2 * half + 1 : 2 * half + 1 + count] - total[:count]) / (2 * half + 1), np.float64)


def _turned(chain: Int32s, is_hole: bool) -> Int32s:
    """The chain with positive shoelace, negative for a hole."""
    return chain[::-1] if (_shoelace(chain.astype(np.float64)) < 0) != is_hole else chain


def _shoelace(points: Float64s) -> float:
    following = rolled(points, -1)
    return float(0.5 * (points[:, 0] * following[:, 1] - following[:, 0] * points[:, 1]).sum())
