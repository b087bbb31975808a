"""Pixels of a picture and samples of a coarser grid over it, each of which covers `step` x `step` pixels.

Pixel (0, 0) and sample (0, 0) are centres: sample 0 covers pixels 0 to step − 1, so its centre lies between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar, cast

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, Int64s

_SAMPLES_PER_PITCH = 6.5
"""They hold a wall's place and make every later pass cheap."""
_BLURRED = (3, 5)
"""Means over so many pixels are had from those about all of them in half the time, and of odd numbers round alike."""

Values = TypeVar("Values", Bytes, Bools, Float32s)
Grey = TypeVar("Grey", Bytes, Float32s)


def coarse_step(pitch_px: float) -> int:
    """Pixels of a sample of the grids that a block is looked for on; whole ones: averaging is several times faster."""
    return max(1, round(pitch_px / _SAMPLES_PER_PITCH))


def pixels_of(samples: Float64s | Int64s, step: float | Float64s) -> Float64s:
    """Places in pixels of places in samples, any shape; of (N, 2) the step may be one each across and down."""
    return np.asarray((samples + 0.5) * step - 0.5, np.float64)


def samples_of(pixels: Float64s, step: float | Float64s) -> Float64s:
    """Places in samples of places in pixels, any shape; of (N, 2) the step may be one each across and down."""
    return np.asarray((pixels + 0.5) / step - 0.5, np.float64)


def place_of(place_px: tuple[float, float], step: int) -> tuple[float, float]:
    """A place (x, y) in samples of the same in pixels."""
    x, y = samples_of(np.array(place_px), step).tolist()
    return x, y


def fill(mask: Bytes, ring: Float64s, step: float, value: int = 1) -> None:
    """Set a mask's samples, (h, w), within a ring, (N, 2), pixels, its border's own among them."""
    cv2.fillPoly(mask, [np.rint(samples_of(ring, step)).astype(np.int32)], value)


def fill_finely(mask: Bytes, rings: Sequence[Float64s], value: int) -> None:
    """Set what lies within rings, (N, 2) each, in the mask's own pixels, to a sixteenth, but for rings in them."""
    cv2.fillPoly(mask, [np.rint(ring * 16).astype(np.int32) for ring in rings], value, cv2.LINE_8, 4)


def drawn(rings: Sequence[Float64s], shape: tuple[int, ...], step: float) -> Bytes:
    """A mask of `shape` (h, w) of samples, 1 inside of rings, (N, 2) each, pixels, and outside of those within them."""
    mask = np.zeros(shape[:2], np.uint8)
    cv2.fillPoly(mask, [np.rint(samples_of(ring, step)).astype(np.int32) for ring in rings], 1)
    return mask


def averaged(picture: Grey, step: int, border: int = cv2.BORDER_CONSTANT) -> Grey:
    """Mean over the pixels of each sample, (H, W); the last ones are filled up by a border of OpenCV's, constant 0."""
    if step == 1:
        return picture
    # No more is filled up than what is left over, for that takes a copy.
    high, wide = (size // step * step for size in picture.shape)
    means = [
        _filled_averaged(part, step, border) for part in (picture[:high, :wide], picture[:high, wide:]) if part.size
    ]
    rows = [np.hstack(means)] if means else []
    if high < picture.shape[0]:
        rows.append(_filled_averaged(picture[high:], step, border))
    return np.vstack(rows)


def _filled_averaged(part: Grey, step: int, border: int) -> Grey:
    wide, high = -part.shape[1] % step, -part.shape[0] % step
    even = cv2.copyMakeBorder(part, 0, high, 0, wide, border, value=0) if wide or high else part
    return _averaged(cast(Grey, even), step)


def whole_averaged(picture: Bytes, step: int) -> Bytes:
    """Mean over the pixels of each sample, (H, W) or (H, W, 3), of those that lie in the picture whole."""
    if step == 1:
        return picture
    size = (max(1, picture.shape[1] // step), max(1, picture.shape[0] // step))
    # A whole number of pixels each: averaging them is several times faster then.
    return _averaged(picture[: size[1] * step, : size[0] * step], step)


def _averaged(even: Grey, step: int) -> Grey:
    size = (max(1, even.shape[1] // step), max(1, even.shape[0] // step))
    if step in _BLURRED and min(even.shape[:2]) >= step:
        blurred = cv2.blur(even, (step, step))
        return cast(Grey, np.ascontiguousarray(blurred[step // 2 :: step, step // 2 :: step]))
    return cast(Grey, cv2.resize(even, size, interpolation=cv2.INTER_AREA))


def enlarged(grid: Values, step: int, shape: tuple[int, ...]) -> Values:
    """The grid's value at each pixel of a picture of `shape` (H, W)."""
    # Columns first: rows are then copied whole.
    return np.repeat(np.repeat(grid, step, axis=1), step, axis=0)[: shape[0], : shape[1]]
