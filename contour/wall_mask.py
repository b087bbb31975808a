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
# The maps of local light need no more than this many samples a pitch.
_MAP_SAMPLES = 8
_BYTE_CONTRAST = 40.0
_FINE_PITCH = 12.0


@dataclass(frozen=True)
class WallMask:
    """Mask (H, W), uint8, 255 on walls; noise and median wall contrast in grey levels of the picture it came from."""

    mask: Gray
    noise: float
    contrast: float


def wall_mask(light: Gray, pitch: float, *, bright: bool, contrast: float = 0.0) -> WallMask:
    """Walls of `light` (H, W) where cells are about `pitch` pixels apart and walls are brighter (or darker) than cells.

    The local mean over 1.5 pitches flattens the light without a model of it. The threshold lies midway between the
    local levels of wall and cell, each a mean weighted with its own difference, so thin and thick walls both keep
    their width; it is never below NOISE_FLOOR times the noise. `contrast`, where it is known, allows a faster way above 40 levels.
    """
    # Grey levels are kept in 1/32 where steps of one would show in the threshold; bytes are faster for the rest.
    unit = 1 if contrast > _BYTE_CONTRAST else 32
    smooth = cv2.GaussianBlur(light if unit == 1 else light.astype(np.uint16) * np.uint16(unit), (3, 3), 0)
    step = max(1, int(pitch / _MAP_SAMPLES))
    grid = (-(-light.shape[1] // step), -(-light.shape[0] // step))
    mean = (cv2.resize(smooth, grid, interpolation=cv2.INTER_AREA) if step > 1 else smooth).astype(np.float32)
    mean = cv2.blur(mean, (_odd(1.5 * pitch / step),) * 2, borderType=cv2.BORDER_REFLECT)
    # Every step-th pixel, not their average: an average would take the walls' contrast away.
    sample = smooth[step // 2 :: step, step // 2 :: step].astype(np.float32)
    local = sample - mean[: sample.shape[0], : sample.shape[1]]
    if not bright:
        local = -local
    noise = _noise_level(smooth, pitch, unit)
    upper, lower = _levels(local, pitch / step)
    offset = np.maximum(0.5 * (upper - lower), NOISE_FLOOR * noise)
    offset = cv2.copyMakeBorder(
        offset, 0, grid[1] - offset.shape[0], 0, grid[0] - offset.shape[1], cv2.BORDER_REPLICATE
    )
    threshold = np.clip(mean + offset if bright else mean - offset, 0, 255 * unit).astype(smooth.dtype)
    if step > 1:
        threshold = cv2.resize(threshold, (light.shape[1], light.shape[0]), interpolation=cv2.INTER_LINEAR)
    mask = cv2.compare(smooth, threshold, cv2.CMP_GT if bright else cv2.CMP_LT)
    span = upper + lower
    strong = span[span > 6 * noise]
    typical = float(np.median(strong[:: max(1, strong.size // 4096)])) if strong.size else 0.0
    return WallMask(np.asarray(mask, np.uint8), noise / unit, typical / unit)


def _noise_level(smooth: NDArray[np.uint8 | np.uint16], pitch: float, unit: int) -> float:
    """Standard deviation of what varies within the quietest tiles, each about a third of a pitch wide."""
    tile = max(3, round(pitch / 3))
    hop = max(1, round(np.sqrt(smooth.size / (2e5))))
    rows = smooth[: smooth.shape[0] // tile * tile]
    rows = rows.reshape(-1, tile, smooth.shape[1])[::hop]
    columns = smooth.shape[1] // tile
    tiles = rows[:, :, : columns * tile].reshape(rows.shape[0], tile, columns, tile)[:, :, ::hop]
    if tiles.size == 0:
        return 0.3 * unit
    quiet = float(np.quantile(tiles.astype(np.float32).std(axis=(1, 3)), 0.2))
    if pitch < _FINE_PITCH:
        # No tile of fine cells is quiet, but second differences see little of a blurred structure, and
        # keep the noise that the light blur left as it is.
        rows = smooth[::hop].astype(np.float32)
        second = rows[:, :-2] - 2 * rows[:, 1:-1] + rows[:, 2:]
        quiet = min(quiet, float(np.median(np.abs(second))) / 0.6745)
    return max(quiet, 0.3 * unit)


def _levels(local: Float, pitch: float) -> tuple[Float, Float]:
    """Local level of walls above, and of cells below, the local mean; `pitch` in samples of `local`."""
    # Glints and dust would raise the threshold around them and wipe out faint walls nearby.
    above = np.minimum(np.maximum(local, 0), _typical_peak(local, pitch))
    below = np.maximum(-local, 0)
    window = _odd(1.3 * pitch)
    return _weighted_mean(above, window), _weighted_mean(below, window)


def _typical_peak(local: Float, pitch: float) -> float:
    """What four fifths of the walls' peaks over tiles of a pitch stay below."""
    size = max(2, round(pitch))
    rows, columns = local.shape[0] // size, local.shape[1] // size
    if rows < 2 or columns < 2:
        return float(local.max())
    tiles = local[: rows * size, : columns * size].reshape(rows, size, columns, size).max(axis=(1, 3))
    walls = tiles[tiles > 0.25 * tiles.max()]
    return float(np.quantile(walls, 0.8))


def _weighted_mean(values: Float, window: int) -> Float:
    """Mean over a window weighted by the values themselves; 0 where they vanish."""
    weight = cv2.blur(values, (window, window), borderType=cv2.BORDER_REFLECT)
    square = cv2.blur(values * values, (window, window), borderType=cv2.BORDER_REFLECT)
    return np.asarray(square / np.maximum(weight, 1e-3), np.float32)


def _odd(size: float) -> int:
    return max(3, 2 * round(size / 2) + 1)
