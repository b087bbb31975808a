"""The paper's sliding matrix: windows with enough wall inside are filled, then the largest outer contour is the block.

The window is the square [x - core, x + core) x [y - core, y + core), centred on core, core + step, … while it fits
inside the picture. Means are taken from the binarised picture, never from the one being filled; a window is filled
when its mean is greater than the threshold; the result is the binarised picture with all filled windows.
"""

from __future__ import annotations

import math

import numpy as np

from contour.errors import NoBlockFound, ParameterError
from contour.geometry.arrays import Bools, Bytes, Indices
from contour.geometry.rings import Contour, largest_loop, signed_area
from contour.image.opencv import above, contours_in_two_levels, either, enclosed_area, integral
from contour.tracing.paper_cells import EnclosedCells

CORE_PITCHES = 0.4
"""Over 22 rendered blocks: up to 0.3 cells stay open or the contour comes in pieces, larger cores stick out more."""

STEP_CORES = 1.0
"""Half the advised limit: at 2 windows miss walls between them and leave holes, below 1 the outline grows fat."""

WIDEST_STEP_CORES = 2
"""As the paper advises: further apart, windows leave strips between them."""

WALL_SHARES = 0.5
"""A window half of which lies on the block is filled. The text names no number, and none suits thin walls and thick."""


def default_core_px(pitch_px: float) -> int:
    """`core` for a cell pitch, px."""
    return max(math.ceil(CORE_PITCHES * pitch_px), 1)


def default_step_px(core_px: int) -> int:
    """`step` for a core, px."""
    return max(round(STEP_CORES * core_px), 1)


def default_threshold(cells: EnclosedCells) -> float:
    """Half of what a window deep inside the block sees, 0 to 255."""
    return 255 * cells.wall_share * WALL_SHARES


def coarse_step(core_px: int, step_px: int) -> str | None:
    """What a step above twice the core does, for people; None up to there."""
    widest = WIDEST_STEP_CORES * core_px
    if step_px <= widest:
        return None
    return (
        f"step_px is {step_px}, expected up to {widest}, twice core_px: between windows lie strips that none fills, "
        "and the contour may come in pieces. Lower step_px"
    )


def fill_windows(mask: Bytes, core_px: int, step_px: int, threshold: float) -> Bytes:
    """The filled picture, 0 or 255, shape of `mask` (H, W), whose white is any value but 0. Raises ParameterError."""
    check_parameters(core_px, step_px, threshold)
    height, width = mask.shape
    size = 2 * core_px
    rows = np.arange(0, height - size + 1, step_px)
    columns = np.arange(0, width - size + 1, step_px)
    white = (mask != 0).view(np.uint8)
    filled = above(mask, 0) if mask.size else mask.copy()
    if len(rows) == 0 or len(columns) == 0:
        return filled
    # Sums of ones, not of 255: they stay below 2^31 for any picture that can be held.
    sums = integral(white)
    top, bottom = sums[rows], sums[rows + size]
    counts = bottom[:, columns + size] - bottom[:, columns] - top[:, columns + size] + top[:, columns]
    chosen = counts * 255 / size**2 > threshold
    return either(filled, _painted(chosen, mask.shape, size, step_px)) if chosen.any() else filled


def _painted(chosen: Bools, shape: tuple[int, ...], size: int, step: int) -> Bytes:
    """255 where any chosen window lies: window (r, c) covers `size` pixels from (r · step, c · step).

    The windows over a pixel are those from first to last along each axis, and these change twice in `step` pixels
    only. So each such stretch is decided once, in a small table, and then repeated over its pixels.
    """
    any_row, row_repeats = _covering(chosen.shape[0], shape[0], size, step)
    any_column, column_repeats = _covering(chosen.shape[1], shape[1], size, step)
    before = np.zeros((chosen.shape[0] + 1, chosen.shape[1] + 1), np.int32)
    before[1:, 1:] = chosen.cumsum(axis=0, dtype=np.int32).cumsum(axis=1, dtype=np.int32)
    bands = before[any_row[1]] - before[any_row[0]]
    table = bands[:, any_column[1]] > bands[:, any_column[0]]
    stretched = np.repeat(table.view(np.uint8) * np.uint8(255), column_repeats, axis=1)
    return np.repeat(stretched, row_repeats, axis=0)


def _covering(count: int, length: int, size: int, step: int) -> tuple[Indices, Indices]:
    """Along one axis: [first, end) of the windows over each stretch of pixels, shape (2, S), and its length, px."""
    starts = np.arange(count) * step
    cuts = np.unique(np.concatenate([[0], starts, starts + size]))
    cuts = cuts[cuts < length]
    first = np.clip(-(-(cuts - size + 1) // step), 0, count)
    end = np.clip(cuts // step + 1, 0, count)
    return np.stack([np.minimum(first, end), end]), np.diff(np.append(cuts, length))


def check_parameters(core_px: int, step_px: int, threshold: float) -> None:
    """Raise ParameterError for a size below 1 px or a threshold off the scale of the binarised picture."""
    for name, value in (("core_px", core_px), ("step_px", step_px)):
        if value < 1:
            raise ParameterError(f"{name} is {value}: expected 1 or more.")
    if not 0 <= threshold <= 255:
        raise ParameterError(f"threshold is {threshold}: expected 0 to 255, the scale of the binarised picture.")


def sliding_matrix_contour(filled: Bytes, smallest_hole_px2: float) -> Contour:
    """The largest outer contour of the filled picture, with its inner contours above a size: openings, not gaps.

    Filaments of one pixel, along which a contour would run out and back, are left out. Raises NoBlockFound where
    nothing is white.
    """
    found = contours_in_two_levels(filled)
    outer = [k for k, parent in enumerate(found.parents) if parent < 0]
    largest = max(outer, key=lambda k: enclosed_area(found.rings[k]), default=None)
    if largest is None or enclosed_area(found.rings[largest]) == 0:
        raise NoBlockFound("No block found: the filled picture has no white area. Check the light and the polarity.")
    inner = [
        largest_loop(ring.astype(np.float64))
        for ring, parent in zip(found.rings, found.parents, strict=True)
        if parent == largest and enclosed_area(ring) > smallest_hole_px2
    ]
    holes = tuple(hole for hole in inner if abs(signed_area(hole)) > smallest_hole_px2)
    return Contour(largest_loop(found.rings[largest].astype(np.float64)), holes)
