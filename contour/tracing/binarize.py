"""A picture becomes a wall mask: 255 on the cell walls, 0 elsewhere, whatever is brighter.

`flat` looks at each pixel against the mean around it, so uneven light drops out, and asks for a share of the contrast
that walls have *here*, but never less than a multiple of the noise. `otsu` and a fixed level are global.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Bytes, Float32s
from contour.image import opencv as _cv
from contour.tracing.paper_cells import EnclosedCells, measure_cells
from contour.tracing.trace import Polarity

_CONTRAST_SHARE = 0.45
"""Where a wall's profile is cut, as a share of the contrast of walls around; half, less a little for dim walls."""

_NOISES = 4.0
"""Contrast below 4 sigma is no wall: of a million pixels of table, 30 pass."""

_FEWEST_LEVELS = 3.0
"""Grey levels a wall must differ by whatever the noise: 8-bit pictures of nothing have a noise near 0."""

_FIRST_SHARE = 1 / 12
_FIRST_WINDOW_PX = (33, 129)
"""The first window, before the pitch is known: a share of the shorter side within bounds. It holds several fine cells,
and is more than twice as wide as the walls of coarse ones."""

_PITCHES = 0.8
_WALLS = 3.0
"""The second window: close to a pitch, so that the table beside the block hardly counts, but wider than walls."""

_CLIP_SHARE = 0.8

_EASY_PX = 3_000_000
"""Above this the first look is taken at a smaller size, and statistics are taken from parts."""

_MOST_TILES = 10_000
_WIDE_TILE_PX, _WIDE_PERCENTILE, _WIDE_FACTOR = 16, 10, 1.14
_NARROW_TILE_PX, _NARROW_PERCENTILE, _NARROW_FACTOR = 6, 5, 2 * 1.61
"""Noise is the spread within the quietest tiles. Wide ones see the table's texture too, but a picture full of cells
has none that are quiet; narrow ones fit into cells, and twice their white noise bounds what the wide ones say. (In
white noise after the 3 x 3 blur these percentiles are 0.88 and 0.62 of the standard deviation.)"""


@dataclass(frozen=True)
class BinarizedPicture:
    """The wall mask, shape (H, W), 0 or 255, with what it was made for and the cells seen in it (None: too few)."""

    mask: Bytes
    polarity: Polarity
    cells: EnclosedCells | None


def binarize(
    picture: Bytes, mode: Literal["flat", "otsu"] | int = "flat", polarity: Literal["auto", "bright", "dark"] = "auto"
) -> BinarizedPicture:
    """The wall mask of a grey (H, W) or BGR (H, W, 3) picture, uint8. Raises ParameterError.

    A fixed `mode` is a grey level 0 … 255: bright walls are above it, dark ones at or below. With polarity `auto`
    the one whose mask looks more like a honeycomb is taken.
    """
    if isinstance(mode, int) and not 0 <= mode <= 255:
        raise ParameterError(f"binarize is {mode}: expected flat, otsu, or a grey level of 0 to 255.")
    grey = _cv.grey(picture)
    wanted: tuple[Polarity, ...] = ("bright", "dark") if polarity == "auto" else (polarity,)
    if mode == "flat":
        masks = _flat_masks(grey, wanted)
    else:
        level = _cv.otsu_threshold(grey) if mode == "otsu" else float(mode)
        bright = _cv.above(grey, level)
        masks = [_measured(bright if name == "bright" else _cv.inverted(bright), name) for name in wanted]
    return max(masks, key=_plausibility)


def _measured(mask: Bytes, polarity: Polarity) -> BinarizedPicture:
    return BinarizedPicture(mask, polarity, measure_cells(mask))


def _plausibility(found: BinarizedPicture) -> tuple[float, float]:
    """How many regular cells, and how much they enclose; where neither polarity has any, how little is at the border.

    By area alone the squares between a table's grooves would outweigh a small block's cells, by number alone specks of
    noise would. The square of the number times the area is right on all of 112 rendered scenes, by a factor of 5.
    """
    border = np.concatenate([found.mask[0], found.mask[-1], found.mask[:, 0], found.mask[:, -1]])
    return (found.cells.count**2 * found.cells.area_px2 if found.cells else 0.0, -float(np.mean(border)))


def _flat_masks(grey: Bytes, polarities: tuple[Polarity, ...]) -> list[BinarizedPicture]:
    """The better polarity's mask, flattened twice: with a window from the picture's size, then from the cells seen."""
    first, shrink = _first_look(grey, polarities)
    if first.cells is None:
        return [first]
    cells = first.cells.enlarged(shrink)
    window = round(max(_PITCHES * cells.pitch_px, _WALLS * cells.wall_px)) | 1
    smooth = _cv.gaussian(grey)
    mask = _flattened(smooth, _noise(smooth), window, first.polarity)
    measured = _measured_near(mask, cells)
    if measured is None and shrink == 1:
        return [first]
    return [BinarizedPicture(mask, first.polarity, measured or cells)]


def _first_look(grey: Bytes, polarities: tuple[Polarity, ...]) -> tuple[BinarizedPicture, int]:
    """The better polarity's mask with the first window, and how much smaller than the picture it is.

    Large pictures are looked at small; only where that shows no cells (they may be too fine) as they are.
    """
    shrink = max(round(np.sqrt(grey.size / _EASY_PX)), 1)
    for factor in (shrink, 1) if shrink > 1 else (1,):
        smooth = _cv.gaussian(_cv.shrunk(grey, factor))
        noise = _noise(smooth)
        low, high = _FIRST_WINDOW_PX
        window = int(np.clip(min(smooth.shape) * _FIRST_SHARE, low, high)) | 1
        masks = [_measured(_flattened(smooth, noise, window, name), name) for name in polarities]
        found = max(masks, key=_plausibility)
        if found.cells:
            break
    return found, factor


def _measured_near(mask: Bytes, cells: EnclosedCells) -> EnclosedCells | None:
    """The cells of the mask; in a large one those around the middle of where cells were seen: they are many enough."""
    if mask.size <= _EASY_PX:
        return measure_cells(mask)
    half = round(np.sqrt(_EASY_PX)) // 2
    left, top, right, bottom = cells.box
    x, y = max((left + right) // 2 - half, 0), max((top + bottom) // 2 - half, 0)
    return measure_cells(np.ascontiguousarray(mask[y : y + 2 * half, x : x + 2 * half]))


def _flattened(smooth: Bytes, noise: float, window_px: int, polarity: Polarity) -> Bytes:
    if polarity == "dark":
        smooth = _cv.inverted(smooth)
    # Means over a window are smooth themselves: at about 8 px a window they are exact enough, and cost nothing.
    shrink = max(window_px // 8, 1)
    around = window_px // shrink | 1
    mean: Bytes = _cv.box_mean(_cv.shrunk(smooth, shrink), around)
    rise = _cv.subtracted(smooth, _cv.grown(mean, smooth.shape))
    if smooth.size > _EASY_PX:
        # The contrast of walls is a mean over many: every second pixel tells as much.
        rise = np.ascontiguousarray(rise[::2, ::2])
    floor = max(_NOISES * noise, _FEWEST_LEVELS)
    least = np.maximum(_CONTRAST_SHARE * _wall_contrast(rise, floor, mean.shape, around), floor)
    bound = np.clip(mean + least, 0, 255).astype(np.uint8)
    return _cv.exceeding(smooth, _cv.grown(bound, smooth.shape))


def _wall_contrast(rise: Bytes, floor: float, shape: tuple[int, ...], around: int) -> Float32s:
    """How far walls rise above the mean around them, shrunk to a shape: the rises' mean, weighted by themselves.

    Rises up to the floor are noise and count nothing; those above the 80th percentile count as that, or a glint would
    set the bound for the faint walls around it.
    """
    counts = _cv.levels(rise)
    counts[: int(floor) + 1] = 0
    total = np.cumsum(counts)
    clip = int(np.searchsorted(total, _CLIP_SHARE * total[-1])) if total[-1] else 255
    level = np.minimum(np.arange(256), clip)
    level[: int(floor) + 1] = 0
    # 16 bits hold 255²; 64 keeps the mean of a few walls in a large square from being rounded away.
    sums = [
        _cv.box_mean(_cv.as_float32(_cv.shrunk_to(_cv.looked_up(rise, table.astype(np.uint16)), shape)), 2 * around + 1)
        for table in (level * 64, level**2)
    ]
    return np.asarray(64 * sums[1] / np.maximum(sums[0], np.float32(1)), np.float32)


def _noise(smooth: Bytes) -> float:
    """Standard deviation of the noise and the table's texture."""
    wide = _WIDE_FACTOR * _quiet_spread(smooth, _WIDE_TILE_PX, _WIDE_PERCENTILE)
    narrow = _NARROW_FACTOR * _quiet_spread(smooth, _NARROW_TILE_PX, _NARROW_PERCENTILE)
    return min(wide, narrow)


def _quiet_spread(smooth: Bytes, tile_px: int, percentile: int) -> float:
    """A low percentile of the standard deviations within square tiles; 0 for a picture smaller than one."""
    height, width = (side // tile_px * tile_px for side in smooth.shape)
    if not (height and width):
        return 0.0
    tiles = smooth[:height, :width].reshape(height // tile_px, tile_px, width // tile_px, tile_px)
    every = int(np.ceil(np.sqrt(height * width / tile_px**2 / _MOST_TILES)))
    chosen = tiles[::every, :, ::every].astype(np.float32)
    return float(np.percentile(chosen.std(axis=(1, 3)), percentile))
