"""Wall mask: where the picture shows wall, at a share of the local wall contrast, whatever the lighting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar, cast

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Bytes, Float32s, median, quantile
from contour.image.opencv import pieces_and_areas
from contour.image.pixel_grid import whole_averaged

AnyFloat = NDArray[np.floating[Any] | np.integer[Any]]
Levels = Bytes | NDArray[np.uint16]
L = TypeVar("L", bound=NDArray[Any])

# Standard deviations above the level that walls stand on, itself about 1.5 below the mean where there is nothing but
# noise: lower, and the table fills with specks.
NOISE_FLOOR = 3.3
# The maps of local light need no more than this many samples a pitch.
_MAP_SAMPLES = 8
# Foils side by side differ in brightness by a factor of three: a threshold any higher loses the dimmer ones.
_RISE = 0.44
# Walls of fine cells run into each other at that height: cells to be counted are kept apart, but once they are known,
# no faint wall may be lost, and blur takes most from thin ones.
_FINE_RISE = (0.08, -0.05)
_REGION_RISE = 0.25
# Of the rise that makes a wall, what makes a faint one, which only may lead from the block to other walls.
_FAINT = 0.5
# Of the contrast in the block's busiest part; far from the block only this stands against a structured table.
_PICTURE_RISE = 0.2
# Squares wider than any wall and narrower than most cells.
_BESIDE_PITCHES = 0.8
# What so many walls side by side would fill is wider than one (blur adds to it on both sides), and what rises by
# less than this share of the region's walls is fainter. Walls rise above it by this share of what they must elsewhere.
_WIDE_WALLS, _HALO_PX = 1.3, 4.0
_TALL, _OVER = 0.5, 0.4
_BYTE_CONTRAST = 40.0
FINE_PITCH = 12.0
_LEAST_OVER_NOISE = 14.0
# Where walls stand out less, noise makes specks here and there on so large a picture.
_CLEAR_OF_NOISE = 40.0
_SPECK_LENGTH = 0.15
# What a fifth of normal deviates stay below in size, in standard deviations.
_FIFTH_OF_NORMAL = 0.2533


@dataclass(frozen=True, eq=False)
class WallMask:
    """Mask (H, W), uint8, 255 on walls; noise and median wall contrast in grey levels of the picture it came from.

    faint: makes the mask at a lower threshold; few pictures need it.
    """

    mask: Bytes
    noise: float
    contrast: float
    faint: Callable[[], Bytes]

    @property
    def may_be_noise(self) -> bool:
        """Whether walls stand out so little that only its order tells a fine comb from noise alone, which makes 11."""
        return self.contrast < _LEAST_OVER_NOISE * self.noise


@dataclass(frozen=True, eq=False)
class Smooth:
    """A lightly blurred picture, filled up to a whole number of samples both ways, its units a grey level, and its
    noise in these: what masks of bright and of dark walls have in common.
    """

    levels: Levels
    unit: int
    noise: float

    @classmethod
    def of(cls, light: Bytes, pitch_px: float, contrast: float = 0.0) -> Smooth:
        """As `wall_mask` takes it."""
        levels, unit = _smoothed(light, _step(pitch_px), contrast)
        return cls(levels, unit, _noise_level(levels, pitch_px, unit))


def wall_mask(
    light: Bytes,
    pitch_px: float,
    *,
    bright: bool,
    contrast: float = 0.0,
    wall: float = 0.0,
    least: float = _REGION_RISE,
    smooth: Smooth | None = None,
) -> WallMask:
    """Walls of `light` (H, W) where cells are about `pitch_px` apart and walls are brighter (or darker) than cells.

    Walls are what stands out on both sides over less than a cell, whatever the light: a table as light as the walls is
    no wall, nor is the edge of a shadow or of a lamp's spot on it. The threshold lies at 0.44 of the local height of
    walls, a mean weighted with itself, whatever share of the area is wall; it is never below NOISE_FLOOR times the
    noise. `contrast`, where it is known, sets one more floor, and above 40 levels allows a faster way. Where the width
    of walls is known, `wall` in pixels, what is both wider and fainter than they is none: a table's light between its
    holes, or between a groove and the block. `least`: the share of the region's walls that a wall rises by at least.
    """
    step = _step(pitch_px)
    smooth = smooth or Smooth.of(light, pitch_px, contrast)
    levels, unit = smooth.levels, smooth.unit
    sign = 1 if bright else -1
    beside = light_beside_walls(_shrunk(levels, step), pitch_px / step, closed=not bright).astype(np.float32)
    beside *= sign
    # Every step-th pixel, not their average: an average would take the walls' contrast away.
    height = levels[step // 2 :: step, step // 2 :: step].astype(np.float32)
    height *= sign
    height -= beside
    np.maximum(height, 0.0, out=height)
    walls, region, typical = _heights(height, beside, pitch_px / step)
    share = _RISE + _FINE_RISE[contrast > 0] * float(np.clip((16 - pitch_px) / 8, 0, 1))
    rise = np.maximum(share * walls, least * region)
    np.maximum(rise, _PICTURE_RISE * contrast * unit, out=rise)
    floor = NOISE_FLOOR * smooth.noise
    size = _odd(_WIDE_WALLS * wall + _HALO_PX)
    wide: Float32s | float = 0.0
    if wall and size < _BESIDE_PITCHES * pitch_px:
        wide = sign * _shrunk(_opened(levels, size, closed=not bright), step).astype(np.float32)
        wide -= beside
        np.minimum(wide, _TALL * region, out=wide)

    def standing_out(part: float) -> Bytes:
        level = np.maximum(_OVER * part * rise, floor)
        level += wide
        np.maximum(level, part * rise, out=level)
        level += beside
        level *= sign
        return _beyond(levels, level, unit, light.shape, bright=bright)

    return WallMask(standing_out(1.0), smooth.noise / unit, _typical(typical) / unit, lambda: standing_out(_FAINT))


def _step(pitch_px: float) -> int:
    return max(1, int(pitch_px / _MAP_SAMPLES))


def _beyond(smooth: Levels, level: Float32s, unit: int, shape: tuple[int, ...], *, bright: bool) -> Bytes:
    """Where the picture, its first (H, W), is brighter (or darker) than a coarser map of the level, in `unit`s."""
    np.clip(level, 0, 255 * unit, out=level)
    levels: Levels = level.astype(np.uint8) if unit == 1 else level.astype(np.uint16)
    size = (smooth.shape[1], smooth.shape[0])
    full = levels if levels.shape == smooth.shape else cv2.resize(levels, size, interpolation=cv2.INTER_LINEAR)
    mask = cv2.compare(smooth, full, cv2.CMP_GT if bright else cv2.CMP_LT)
    return np.ascontiguousarray(mask[: shape[0], : shape[1]], np.uint8)


def without_specks(seen: WallMask, pitch_px: float, wall: float) -> WallMask:
    """The mask without pieces smaller than a stub of wall 0.15 pitch long, where there may be noise among them."""
    if seen.contrast > _CLEAR_OF_NOISE * seen.noise:
        return seen
    labels, area = pieces_and_areas(seen.mask, 8)
    kept = (area > max(4.0, _SPECK_LENGTH * pitch_px * wall)).astype(np.uint8) * np.uint8(255)
    kept[0] = 0
    return replace(seen, mask=kept.take(labels))


def _smoothed(light: Bytes, step: int, contrast: float) -> tuple[Levels, int]:
    """Lightly blurred picture, filled up to a multiple of `step` both ways, and its units a grey level.

    Grey levels are kept in 1/32 where steps of one would show in the threshold; bytes are faster for the rest.
    """
    down, right = -light.shape[0] % step, -light.shape[1] % step
    even = cv2.copyMakeBorder(light, 0, down, 0, right, cv2.BORDER_REPLICATE) if down or right else light
    if contrast > _BYTE_CONTRAST:
        return np.asarray(cv2.GaussianBlur(even, (3, 3), 0), np.uint8), 1
    return np.asarray(cv2.GaussianBlur(even.astype(np.uint16) * np.uint16(32), (3, 3), 0), np.uint16), 32


def _shrunk(smooth: L, step: int) -> L:
    if smooth.dtype == np.uint8:
        return cast(L, whole_averaged(cast(Bytes, smooth), step))
    size = (smooth.shape[1] // step, smooth.shape[0] // step)
    return cast(L, cv2.resize(smooth, size, interpolation=cv2.INTER_AREA)) if step > 1 else smooth


def light_beside_walls(small: L, samples: float, *, closed: bool) -> L:
    """The level on which walls stand: what stays of `small` when all is taken away that is narrower than a cell, and
    brighter (with `closed`, darker).

    A morphological opening (Matheron): the highest of the lowest levels of all squares that hold a sample. A table's
    edge of light or shadow stays, for it stands out on one side only.
    """
    return _opened(small, _odd(_BESIDE_PITCHES * samples - 1), closed=closed)


def _opened(light: L, size: int, *, closed: bool = False) -> L:
    """What stays of light when all brighter (with `closed`, darker) than what lies beside it within `size` is gone."""
    square, way = np.ones((size, size), np.uint8), cv2.MORPH_CLOSE if closed else cv2.MORPH_OPEN
    return cast(L, cv2.morphologyEx(light, way, square, borderType=cv2.BORDER_REFLECT))


def _typical(span: Float32s) -> float:
    """Median of the wall contrast where there is any to speak of."""
    strong = span[span > 0.5 * quantile(span[::4, ::4], 0.98)]
    return median(strong[:: max(1, strong.size // 4096)]) if strong.size else 0.0


def _noise_level(smooth: Levels, pitch_px: float, unit: int) -> float:
    """Standard deviation of what varies within the quietest tiles, each about a third of a pitch wide."""
    tile = max(3, round(pitch_px / 3))
    hop = max(1, round(np.sqrt(smooth.size / 2e5)))
    rows = smooth[: smooth.shape[0] // tile * tile].reshape(-1, tile, smooth.shape[1])[::hop]
    columns = smooth.shape[1] // tile
    tiles = rows[:, :, : columns * tile].reshape(rows.shape[0], tile, columns, tile)[:, :, ::hop]
    if tiles.size == 0:
        return 0.3 * unit
    # Of noise alone, after the light blur, a fifth of all tiles of n pixels show no more than 1 − 1.5 / n.
    # Each tile's pixels in a row of their own: their deviation is told several times faster so.
    flat = tiles.transpose(0, 2, 1, 3).astype(np.float32, order="C").reshape(rows.shape[0] * tiles.shape[2], -1)
    quiet = quantile(flat.std(axis=1), 0.2) / (1 - 1.5 / tile)
    if pitch_px < FINE_PITCH:
        # No tile of fine cells is quiet, but second differences both ways see little of a blurred structure, and keep
        # the noise that the light blur left as it is.
        part = smooth[: 1 << 9, : 1 << 9].astype(np.float32)
        bent = part[:, :-2] - 2 * part[:, 1:-1] + part[:, 2:]
        second = np.abs(bent[:-2] - 2 * bent[1:-1] + bent[2:])
        quiet = min(quiet, quantile(second, 0.2) / _FIFTH_OF_NORMAL)
        # Walls of no more than twelve times their noise would not show as cells at all.
        quiet = min(quiet, float(smooth[::hop].std()) / 6)
    return max(quiet, 0.3 * unit)


def _heights(height: Float32s, beside: Float32s, samples: float) -> tuple[Float32s, Float32s, Float32s]:
    """How far walls near each sample rise above the level beside it, how far walls of the wider region, and the walls
    near it, rise above what lies beside themselves.

    `samples` is the pitch in samples of `height`. Beside a light table the first is less than the last: walls end at
    the same level. The region spans a dozen pitches: on the table beside a block it still holds the height of the
    block's walls, so that the table's own texture stays below the threshold.
    """
    # Glints and dust would raise the threshold around them and wipe out faint walls nearby.
    np.minimum(height, _typical_peak(height, samples), out=height)
    square = height * height
    coarse = max(1, round(samples / 2))
    grid = (max(1, height.shape[1] // coarse), max(1, height.shape[0] // coarse))
    far = _odd(12 * samples / coarse)
    values, weight = (_mean(cv2.resize(one, grid, interpolation=cv2.INTER_AREA), far) for one in (square, height))
    region = cv2.resize(values / np.maximum(weight, 1e-3), height.shape[::-1], interpolation=cv2.INTER_LINEAR)
    near = _odd(1.3 * samples)
    # Means over a window of values weighted by the walls' height; 0 where there is none.
    weight = _mean(height, near)
    np.maximum(weight, 1e-3, out=weight)
    own = _mean(square, near)
    own /= weight
    walls = _mean(np.multiply(beside, height, out=square), near)
    walls /= weight
    walls += own
    walls -= beside
    return walls, np.asarray(region, np.float32), own


def _typical_peak(local: Float32s, samples: float) -> float:
    """What half of the walls' peaks over tiles of a pitch stay below."""
    size = max(2, round(samples))
    rows, columns = local.shape[0] // size, local.shape[1] // size
    if rows < 2 or columns < 2:
        return float(local.max())
    bands = local[: rows * size, : columns * size].reshape(rows, size, columns * size).max(axis=1)
    tiles = bands.reshape(rows, columns, size).max(axis=2)
    walls = tiles[tiles > 0.25 * tiles.max()]
    return median(walls) if walls.size else 0.0


def _mean(values: AnyFloat, window: int) -> Float32s:
    return np.asarray(cv2.blur(values, (window, window)), np.float32)


def _odd(size: float) -> int:
    return max(3, 2 * round(size / 2) + 1)
