"""The walls' faces below the top plane, seen by perspective, and how much of the table they leave visible.

A point of the block at depth d below the top plane is seen where the top plane's picture is shifted by the parallax of
d. So the cover by walls at any depth is the top plane's cover looked up at shifted pixels, and what hides first wins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Float32s
from contour.synthetic.scene import Scene

_NO_MAP = np.empty(0, dtype=np.float32)
_BAND = 64


@dataclass(frozen=True)
class Relief:
    """All that is seen of the block: `cover` share of each pixel, `light` it returns (premultiplied), shape (H, W)."""

    cover: Float32s
    light: Float32s


def relief(scene: Scene, cover: Float32s, light: Float32s) -> Relief:
    """The top plane's cover and light completed by the walls' sides."""
    shift = _parallax(scene)
    longest = float(np.abs(shift).max(initial=0.0))
    if longest < 0.25:
        return Relief(cover, light)
    total, radiance = cover.copy(), light.copy()
    steps = int(np.clip(math.ceil(longest), 2, 18))
    height, width = cover.shape
    steps_px = cv2.resize(shift / np.float32(steps), (width, height), interpolation=cv2.INTER_LINEAR)
    fine = np.asarray(steps_px, dtype=np.float32)
    pair = np.stack((cover, light), axis=-1)
    margin = math.ceil(longest) + 2
    rows, columns = np.flatnonzero(cover.any(axis=1)), np.flatnonzero(cover.any(axis=0))
    if len(rows) == 0:
        return Relief(cover, light)
    left, right = max(0, int(columns[0]) - margin), min(width, int(columns[-1]) + margin)
    first, last = max(0, int(rows[0]) - margin), min(height, int(rows[-1]) + margin)
    for top in range(first, last, _BAND):  # bands stay in the processor's cache
        part = (slice(top, min(last, top + _BAND)), slice(left, right))
        _march(scene, pair, fine[part], (left, top), steps, Relief(total[part], radiance[part]))
    return Relief(total, radiance)


def _march(
    scene: Scene,
    pair: Float32s,
    step: Float32s,
    origin: tuple[int, int],
    steps: int,
    seen: Relief,
) -> None:
    """Follow each pixel's ray down to the table, adding what it meets first to what is seen, in place."""
    total, radiance = seen.cover, seen.light
    reach = 1.1 * scene.cells.pitch_mm
    x = np.arange(origin[0], origin[0] + step.shape[1], dtype=np.float32)
    y = np.arange(origin[1], origin[1] + step.shape[0], dtype=np.float32)
    at = np.stack(np.meshgrid(x, y), axis=-1)
    for k in range(1, steps + 1):
        at += step
        here = cv2.remap(pair, at, _NO_MAP, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        below, tone = here[..., 0], here[..., 1]
        gain = np.maximum(below - total, 0.0)
        depth = (k - 0.5) / steps * scene.thickness_mm
        level = scene.material.side / scene.material.top * (0.25 + 0.75 * math.exp(-depth / reach))
        radiance += gain * np.float32(level) * tone / np.maximum(below, np.float32(1e-3))
        total += gain


def _parallax(scene: Scene) -> Float32s:
    """Where the top plane shows the place that a pixel's ray meets on the table, relative to it; coarse, (h, w, 2)."""
    camera, step = scene.camera, 16
    u = np.linspace(-0.5, camera.width - 0.5, max(2, camera.width // step) * 2 + 1)[1::2]
    v = np.linspace(-0.5, camera.height - 0.5, max(2, camera.height // step) * 2 + 1)[1::2]
    grid = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    there = camera.project(camera.back_project(grid, 0.0), scene.thickness_mm)
    return np.asarray((there - grid).reshape(len(v), len(u), 2), dtype=np.float32)
