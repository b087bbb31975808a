"""The block's cells: their lattice, the tops of their walls, and what is seen down in them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.other_hand.fields import Field, Rng, Shape
from benchmarks.sixth_hand.drawings import blank, fill, shrink, turn
from benchmarks.sixth_hand.fields import noise, smoothstep
from contour.geometry.arrays import Float32s, Float64s, Int32s


@dataclass(frozen=True, eq=False)
class Lattice:
    """Middles of n cells, (n, 2) pixels; the number of each pixel's cell, from 1, 0 for none, (H, W); and how much of
    each pixel is a wall's top, (H, W) float32 from 0 to 1, beyond the block's outline too.
    """

    centres: Float64s
    owner: Int32s
    tops: Float32s


def _corners(pitch: float, stretch: float) -> Float64s:
    """A cell's corners, (6, 2) pixels, about its middle, two of its walls along x."""
    theta = np.arange(6) * np.pi / 3
    return np.asarray(pitch / np.sqrt(3) * np.stack([np.cos(theta) / stretch, np.sin(theta) * stretch], axis=1))


def _wobble(points: Float64s, pitch: float, amount: float, rng: Rng) -> Float64s:
    """The points, (..., 2), displaced by waves, so that corners that are shared stay so."""
    moved = points.copy()
    for wave in (30, 9, 3.1, 1.7, 1.3):
        for axis in (0, 1):
            angle, phase = rng.uniform(0, 6.3, 2)
            run = points @ np.array([np.cos(angle), np.sin(angle)]) * (6.283 / (wave * pitch))
            moved[..., axis] += amount * pitch * min(wave, 5) * 0.35 * np.sin(run + phase)
    return moved


def lattice(shape: Shape, box: Float64s, pitch: float, rng: Rng, crushed: Float32s | None) -> Lattice:
    """Cells of this pitch, pixels, over a box, (2, 2), its low and its high corner. crushed: how much they are squeezed
    together, (H, W) from 0 to 1.
    """
    stretch = float(rng.choice([1, 1, rng.uniform(0.85, 1.15)]))
    corners = _corners(pitch, stretch)
    step = np.array([1.5 * pitch / np.sqrt(3) / stretch, pitch * stretch])
    reach = float(np.hypot(*(box[1] - box[0]))) / 2 + 3 * pitch
    i, j = np.meshgrid(
        np.arange(-int(reach / step[0]), int(reach / step[0]) + 1),
        np.arange(-int(reach / step[1]), int(reach / step[1]) + 1),
    )
    centres = np.stack([i * step[0], (j + 0.5 * (i % 2)) * step[1]], axis=-1).reshape(-1, 2)
    thin = float(np.clip(rng.uniform(0.05, 0.15), 1.6 / pitch, 0.22))
    doubled = thin * float(rng.choice([1, 1.6, 2.2]))
    inner = corners * (1 - thin, 1 - doubled)
    spin, middle = turn(rng.uniform(0, np.pi)), box.mean(axis=0) + rng.uniform(-pitch, pitch, 2)
    openings: Float64s = (centres[:, None] + inner) @ spin.T + middle
    openings = _wobble(openings, pitch, float(rng.choice([0.003, 0.012, 0.03])), rng)
    if crushed is not None:
        openings = _crush(openings, crushed, pitch, rng)
    centres = openings.mean(axis=1)
    near = np.all((centres > box[0] - 2 * pitch) & (centres < box[1] + 2 * pitch), axis=1)
    openings, centres = openings[near], centres[near]
    drawn = blank(shape)
    fill(drawn, list(openings))
    owner = np.zeros(shape, np.int32)
    for index, corner in enumerate(np.round(openings).astype(np.int32)):
        cv2.fillConvexPoly(owner, corner, index + 1)
    return Lattice(centres, owner, np.asarray(1 - shrink(drawn), np.float32))


def _crush(openings: Float64s, crushed: Float32s, pitch: float, rng: Rng) -> Float64s:
    """The cells' openings, (n, 6, 2), flattened and shifted by as much as their middles are crushed."""
    centres = openings.mean(axis=1)
    x = np.clip(centres[:, 0], 0, crushed.shape[1] - 1).astype(int)
    y = np.clip(centres[:, 1], 0, crushed.shape[0] - 1).astype(int)
    amount = (crushed[y, x] * rng.uniform(0.3, 1, len(x)))[:, None, None]
    local = openings - centres[:, None]
    axis = np.array([np.cos(rng.uniform(0, 3.1)), np.sin(rng.uniform(0, 3.1))])
    squeezed = local - (local @ axis)[..., None] * axis * 0.9 * amount
    jolt = rng.normal(0, 0.12, (len(x), 1, 2)) * pitch * amount
    return np.asarray(centres[:, None] + squeezed + jolt)


@dataclass(frozen=True, eq=False)
class Look:
    """Light of the walls' tops, of their sides and of what lies below, to about 1, and the block's tint, (3,) BGR."""

    top: float
    side: float
    floor: float
    tint: Float32s


def random_look(rng: Rng) -> Look:
    """Aluminium or aramid, its walls' tops lighter than the cells or darker."""
    tints = ((1, 1, 1), (1.03, 1, 0.97), (0.97, 1, 1.03), (0.55, 0.8, 1.05), (0.4, 0.72, 1), (0.62, 0.75, 0.9))
    tint = np.array(tints[int(rng.integers(len(tints)))], np.float32)
    if rng.random() < 0.18:
        return Look(rng.uniform(0.08, 0.25), rng.uniform(0.35, 0.6), rng.uniform(0.45, 0.75), tint)
    top = rng.uniform(0.5, 0.98)
    return Look(top, top * rng.uniform(0.15, 0.6), top * rng.uniform(0.03, 0.3), tint)


def paint_comb(
    cells: Lattice, look: Look, pitch: float, foot: Float64s, deep: float, sun: Float64s, through: Field, rng: Rng
) -> Field:
    """The block's face all over the picture, (H, W, 3). foot: the point below the camera; deep: by what cells' floors
    are smaller than their tops; sun: the way shadows fall; through: the table below, (H, W, 3).
    """
    shape = (cells.owner.shape[0], cells.owner.shape[1])
    middles = np.vstack([[0, 0], cells.centres]).astype(np.float32)
    parallax = (foot - middles) * (1 - deep) / pitch
    parallax /= np.maximum(1, np.hypot(*parallax.T) / 1.2)[:, None]
    gain = 1 + rng.uniform(0.03, 0.25) * rng.standard_normal(len(middles))
    x, y = np.meshgrid(np.arange(shape[1], dtype=np.float32), np.arange(shape[0], dtype=np.float32))
    u, v = (x - middles[cells.owner, 0]) / pitch, (y - middles[cells.owner, 1]) / pitch
    lean = parallax.astype(np.float32)[cells.owner]
    off = np.hypot(u - lean[..., 0], v - lean[..., 1])
    floor = smoothstep(-off, -0.52, -0.36)
    facing = -(u * sun[0] + v * sun[1]) * 2
    side = look.side * np.clip(0.55 + 0.5 * facing, 0.08, 1.3) * (0.35 + 0.9 * np.minimum(1, np.hypot(u, v) * 2))
    side *= gain.astype(np.float32)[cells.owner]
    seen = float(rng.choice([0, 0, 0.3, 0.6]))
    ground = look.floor * (1 - seen) * look.tint + through * (seen * 0.6)
    depth = side[..., None] * look.tint + (ground - side[..., None] * look.tint) * floor[..., None]
    grain = 1 + rng.uniform(0.03, 0.14) * noise(shape, 2, rng) + rng.uniform(0.03, 0.15) * noise(shape, 4 * pitch, rng)
    sparkle = rng.uniform(0, 0.4) * smoothstep(noise(shape, max(2.0, pitch / 4), rng), 1.4, 2.4)
    tops = (look.top * grain + sparkle)[..., None] * look.tint
    return np.asarray(depth + (tops - depth) * cells.tops[..., None])
