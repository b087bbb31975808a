"""The block: a lattice of thin walls, drawn as a deep body below its top."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.fifth_hand.noise import smooth_noise
from benchmarks.fifth_hand.outlines import projected, turned
from benchmarks.fifth_hand.raster import FINE, SHIFT, fixed_points, paint, shrink
from benchmarks.other_hand.fields import Rng
from contour.geometry.arrays import Bools, Float32s, Float64s, Int64s


@dataclass(frozen=True, eq=False)
class CombStyle:
    """How a block looks: lengths in pixels, light from 0 to 1."""

    pitch: float
    wall: float  # its thickness
    doubled: float  # by how much walls of one way are thicker
    jitter: float  # of corners, in pitches
    stretch: float
    angle: float
    wall_light: float
    face_light: float
    through: float  # the share of the table's light that comes through cells
    depth: float  # by how much its foot is smaller than its top
    tint: Float64s
    glint: float
    crushed: int  # rows of cells that are pushed together


@dataclass(frozen=True, eq=False)
class Lattice:
    """Walls' ends, (N, 2, 2), with their way from 0 to 2, (N,), and cells' corners, (M, 6, 2), pixels."""

    edges: Float64s
    way: Int64s
    cells: Float64s


def lattice(rng: Rng, style: CombStyle, size: tuple[int, int], matrix: Float64s) -> Lattice:
    """A lattice over a picture of this width and height, bent slowly and quickly, and seen through a homography."""
    pitch, centre = style.pitch, np.array(size, float) / 2
    reach = int(np.hypot(*size) / pitch * 0.75 * max(style.stretch, 1 / style.stretch)) + 4
    row, shift = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    column = shift - row // 2
    base = np.stack([column * pitch + row * pitch / 2, row * pitch * np.sqrt(0.75)], -1)
    ends = []
    for sign in (1, -1):
        points = base + np.array([0, sign * pitch / np.sqrt(3)]) + rng.normal(0, style.jitter * pitch, base.shape)
        points = turned(points * [style.stretch, 1 / style.stretch], style.angle)
        for wave in (9, 23):
            phase = points @ rng.normal(0, 1 / (wave * pitch), (2, 2)) + rng.uniform(0, 6.3, 2)
            points = points + np.sin(phase) * style.jitter * pitch * wave * 0.12
        ends.append(points + centre)
    lower, upper = (projected(_crush(rng, points, style, centre), matrix) for points in ends)
    return _linked(lower, upper, size)


def _crush(rng: Rng, points: Float64s, style: CombStyle, centre: Float64s) -> Float64s:
    """The points, (..., 2), with rows pushed together along lines."""
    for _ in range(style.crushed):
        normal = turned(np.array([1.0, 0.0]), rng.uniform(0, np.pi))
        offset = (points - centre) @ normal - rng.uniform(-0.25, 0.25) * centre.min() * 2
        width = style.pitch * rng.uniform(1, 4)
        pull = -offset * np.exp(-((offset / width) ** 2)) * rng.uniform(0.4, 0.85)
        rough = rng.normal(0, 0.16 * style.pitch, points.shape) * np.exp(-((offset / width) ** 2))[..., None]
        points = points + pull[..., None] * normal + rough
    return points


def _linked(lower: Float64s, upper: Float64s, size: tuple[int, int]) -> Lattice:
    """Walls and cells between both kinds of corners, (rows, columns, 2); even rows begin half a cell off."""
    count = lower.shape[0]
    reach = count // 2
    row, shift = np.mgrid[2 : count - 2, 2 : count - 2]
    skew = (row - reach) // 2

    def at(points: Float64s, columns: int, rows: int) -> Float64s:
        other = row + rows
        return np.asarray(points[other, np.clip(shift - skew + columns + (other - reach) // 2, 0, count - 1)])

    here = at(lower, 0, 0)
    edges = np.stack([np.stack([here, at(upper, c, r)], -2) for c, r in ((-1, 2), (0, 1), (-1, 1))], 2)
    cells = np.stack([at(upper, 0, 0), at(lower, 1, -1), at(upper, 0, 1), here, at(upper, -1, 1), at(lower, 0, -1)], 2)
    edges, cells = edges.reshape(-1, 2, 2), cells.reshape(-1, 6, 2)
    way = np.tile(np.arange(3), len(edges) // 3)
    frame = np.array(size)
    near = (np.abs(edges.mean(1) - frame / 2) < frame / 2 + 8).all(1)
    seen = (np.abs(cells.mean(1) - frame / 2) < frame / 2).all(1)
    return Lattice(edges[near], way[near], cells[seen])


def near_block(points: Float64s, block: Float32s, margin: int) -> Bools:
    """Which points, (N, 2), lie on the block or so many pixels off it, (N,)."""
    grown = cv2.dilate((block > 0.01).astype(np.uint8), np.ones((2 * margin + 1,) * 2, np.uint8))
    spot = np.rint(points).astype(int)
    height, width = block.shape
    return np.asarray(grown[np.clip(spot[:, 1], 0, height - 1), np.clip(spot[:, 0], 0, width - 1)] > 0)


def draw_comb(rng: Rng, canvas: Float32s, block: Float32s, net: Lattice, style: CombStyle, eye: Float64s) -> Float32s:
    """How much of each pixel is a wall's top, (H, W) float32; paints the block on the canvas, (H, W, 3), in place.
    block: how much of each pixel is block, (H, W); eye: the point below the camera, pixels.
    """
    cover, shade = _wall_cover(rng, net, style, block)
    tops, shade = cover * block, shade * block
    body = np.maximum(block, _sunk(block, eye, style.depth))
    canvas *= (1 - body * np.float32(1 - style.through))[..., None]
    faces, alpha = _wall_faces(tops, shade, style, eye)
    paint(canvas, alpha, faces, style.tint)
    shape = (block.shape[0], block.shape[1])
    patch = smooth_noise(rng, shape, rng.uniform(1.5, 4)) * style.glint
    patch += smooth_noise(rng, shape, style.pitch * rng.uniform(3, 9)) * style.glint * 0.5
    paint(canvas, tops, np.clip(style.wall_light * (1 + patch), 0, 1.2), style.tint)
    return tops


def _wall_cover(rng: Rng, net: Lattice, style: CombStyle, block: Float32s) -> tuple[Float32s, Float32s]:
    """How much of each pixel is a wall's top, beyond the outline too, and how light its faces are, (H, W) both."""
    shape = (block.shape[0], block.shape[1])
    drawn = np.zeros((shape[0] * FINE, shape[1] * FINE), np.uint8)
    shade = np.zeros_like(drawn)
    near = near_block(net.edges.mean(1), block, int(style.pitch) // 2 + 2)
    mood = rng.integers(0, 3, len(near))
    light = rng.uniform(0.35, 1.0, 3)
    for way in range(3):
        thick = style.wall * (style.doubled if way == 0 else 1.0)
        for step in range(3):
            lines = list(fixed_points(net.edges[near & (net.way == way) & (mood == step)]))
            grey = int(255 * min(1.0, light[way] * (0.75 + 0.25 * step)))
            cv2.polylines(drawn, lines, False, 255, max(1, round(thick * FINE)), cv2.LINE_8, SHIFT)
            cv2.polylines(shade, lines, False, grey, max(2, round((thick + 0.8) * FINE)), cv2.LINE_8, SHIFT)
    return shrink(drawn, shape), shrink(shade, shape)


def _sunk(mask: Float32s, eye: Float64s, depth: float) -> Float32s:
    """The mask, (H, W) float32, as it lies deeper, drawn towards the point below the camera."""
    matrix = np.array([[1 - depth, 0, eye[0] * depth], [0, 1 - depth, eye[1] * depth]])
    return np.asarray(cv2.warpAffine(mask, matrix, mask.shape[::-1]), np.float32)


def _wall_faces(tops: Float32s, shade: Float32s, style: CombStyle, eye: Float64s) -> tuple[Float32s, Float32s]:
    """How light walls' faces are, darker towards the floor, and how much of each pixel they are, (H, W) both."""
    far = float(np.abs(np.array(tops.shape[::-1]) / 2 - eye).max()) + max(tops.shape) * 0.35
    layers = int(np.clip(far * style.depth / 1.3, 5, 30))
    light, bare = np.zeros_like(tops), np.ones_like(tops)
    for share in np.linspace(1, 1 / layers, layers):
        alpha = _sunk(tops, eye, style.depth * share)
        fall = np.float32(style.face_light * (1 - 0.8 * share**0.7))
        light += alpha * (_sunk(shade, eye, style.depth * share) * fall - light)
        bare *= 1 - alpha
    cover = np.asarray(1 - bare, np.float32)
    return np.asarray(light / np.maximum(cover, 0.05), np.float32), cover
