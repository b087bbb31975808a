"""Wall mask: where the picture shows wall, at half the local wall contrast, whatever the lighting."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Gray = NDArray[np.uint8]
Float = NDArray[np.float32]

# Below 2.5 standard deviations of the noise a threshold fills the table with specks.
NOISE_FLOOR = 2.5


@dataclass(frozen=True)
class WallMask:
    """Mask (H, W), uint8, 255 on walls; noise and median wall contrast in grey levels of the picture it came from."""

    mask: Gray
    noise: float
    contrast: float


def wall_mask(light: Gray, pitch: float, *, bright: bool) -> WallMask:
    """Walls of `light` (H, W) where cells are about `pitch` pixels apart and walls are brighter (or darker) than cells.

    The local mean over 1.5 pitches flattens the light without a model of it. The threshold lies midway between the
    local levels of wall and cell, each a mean weighted with its own difference, so thin and thick walls both keep
    their width; it is never below NOISE_FLOOR times the noise.
    """
    local = local_difference(light, 1.5 * pitch)
    if not bright:
        local = -local
    noise = noise_level(local, pitch)
    upper, lower = _levels(local, pitch)
    contrast_map = upper + lower
    threshold = np.maximum(0.5 * (upper - lower), NOISE_FLOOR * noise)
    # Where the walls give out (the table), their last contrast still governs a pitch further out through the window.
    fine = cv2.resize(threshold, (light.shape[1], light.shape[0]), interpolation=cv2.INTER_LINEAR)
    mask = cv2.compare(local, fine, cv2.CMP_GT)
    strong = contrast_map[contrast_map > 6 * noise]
    contrast = float(np.median(strong)) if strong.size else 0.0
    return WallMask(np.asarray(mask, np.uint8), noise, contrast)


def local_difference(light: Gray, window: float) -> Float:
    """Lightly blurred picture less its mean over `window` pixels, shape (H, W), float32, grey levels."""
    smooth = cv2.GaussianBlur(light.astype(np.float32), (3, 3), 0)
    size = max(3, 2 * round(window / 2) + 1)
    return np.asarray(smooth - cv2.blur(smooth, (size, size), borderType=cv2.BORDER_REFLECT), np.float32)


def noise_level(local: Float, pitch: float) -> float:
    """Standard deviation of the noise in `local`: of its quietest tiles, each about a third of a pitch wide."""
    sample = local[::2, ::2]
    tile = max(3, round(pitch / 6))
    shape = (max(1, sample.shape[1] // tile), max(1, sample.shape[0] // tile))
    crop = sample[: shape[1] * tile, : shape[0] * tile]
    mean = cv2.resize(crop, shape, interpolation=cv2.INTER_AREA)
    square = cv2.resize(crop * crop, shape, interpolation=cv2.INTER_AREA)
    deviation = np.sqrt(np.maximum(square - mean * mean, 0.0))
    return max(float(np.quantile(deviation, 0.2)), 0.3)


def _levels(local: Float, pitch: float) -> tuple[Float, Float]:
    """Local level of walls above, and of cells below, the local mean: two maps of about six samples a pitch."""
    step = max(1, int(pitch / 12))
    sample = local[::step, ::step]
    # Glints and dust would raise the threshold around them and wipe out faint walls nearby.
    ceiling = _typical_peak(sample, pitch / step)
    above = np.minimum(np.maximum(sample, 0), ceiling)
    below = np.maximum(-sample, 0)
    window = max(3, 2 * round(0.65 * pitch / step) + 1)
    return _weighted_mean(above, window), _weighted_mean(below, window)


def _typical_peak(sample: Float, pitch: float) -> float:
    """What four fifths of the local maxima over a pitch stay below."""
    size = max(2, round(pitch))
    rows, columns = sample.shape[0] // size, sample.shape[1] // size
    if rows < 2 or columns < 2:
        return float(sample.max())
    tiles = sample[: rows * size, : columns * size].reshape(rows, size, columns, size).max(axis=(1, 3))
    walls = tiles[tiles > 0.25 * tiles.max()]
    return float(np.quantile(walls, 0.8))


def _weighted_mean(values: Float, window: int) -> Float:
    """Mean over a window weighted by the values themselves; 0 where they vanish."""
    weight = cv2.blur(values, (window, window), borderType=cv2.BORDER_REFLECT)
    square = cv2.blur(values * values, (window, window), borderType=cv2.BORDER_REFLECT)
    return np.asarray(square / np.maximum(weight, 1e-3), np.float32)
