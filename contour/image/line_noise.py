"""Noise that a cheap sensor adds by whole rows or columns: found, and taken out.

Each row has an offset of its own, the same in all of it, on table and block alike. That tells it from whatever lies in
view: no seam, slot or grain runs on through the walls and cells of a block.
"""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s, Float64s, median, medians

# The picture is looked at in so many strips and bands, and in so many lines of each strip.
_PARTS, _LINES = 8, 12
_FIRST_LINES = 32
# Grey levels, standard deviation. Less does no harm.
_LEAST = 1.2
_FIRST_ROWS, _SURELY_NONE = 256, 0.8
# Of its part in a strip, what the offsets must show in each part of the picture.
_ALIKE = (0.55, 1.45)
# Where blacks or whites are cut off, so are offsets: by so many standard deviations parts must be clear of that.
_CLEAR, _FEWEST_PARTS = 1.5, 4
# The light itself varies over more rows than this.
_SMOOTH_ROWS = 31
_NEAR_ROWS = 2.5
_QUIET_PX = 15
_QUIET_PERCENT = 40
_PASSES = 2


def without_line_noise(picture: Bytes) -> Bytes:
    """The picture, (H, W) grey or (H, W, 3) BGR, uint8, without the offsets of its rows and columns.

    The same array where none stand out.
    """
    if min(picture.shape[:2]) < 4 * _PARTS:
        return picture
    channels = [picture] if picture.ndim == 2 else [picture[..., k] for k in range(3)]
    clean = [_without_columns(_without_rows(channel)) for channel in channels]
    if all(new is old for new, old in zip(clean, channels, strict=True)):
        return picture
    return np.ascontiguousarray(clean[0] if picture.ndim == 2 else np.stack(clean, axis=-1))


def _without_columns(channel: Bytes) -> Bytes:
    turned = channel.T
    clean = _without_rows(turned)
    return channel if clean is turned else clean.T


def _without_rows(channel: Bytes) -> Bytes:
    steps = _common_steps(channel)
    if steps is None:
        return channel
    offset = np.concatenate([[0.0], np.cumsum(steps)]).astype(np.float32)
    offset -= _smooth(offset)
    light = np.ascontiguousarray(channel, dtype=np.float32)
    for _ in range(_PASSES):
        offset += _left_over(light - offset[:, None])
    return np.asarray(np.clip(np.rint(light - offset[:, None]), 0, 255), np.uint8)


def _common_steps(channel: Bytes) -> Float32s | None:
    """From each row to the next, what all strips of the picture rise by, (H − 1,); None where there is no row noise."""
    some = np.linspace(0, channel.shape[1] - 1, _FIRST_LINES).astype(int)
    # A few rows tell of most pictures that there is none, at a tenth of what all of them cost.
    first = np.linspace(0, channel.shape[0] - 2, _FIRST_ROWS).astype(int)
    above, below = (channel[np.ix_(rows, some)].astype(np.int16) for rows in (first, first + 1))
    if _spread(medians(below - above, axis=1)) < _SURELY_NONE:
        return None
    if _spread(medians(np.diff(channel[:, some].astype(np.int16), axis=0), axis=1)) < _LEAST:
        return None
    width = channel.shape[1] // _PARTS
    columns = (np.arange(_PARTS)[:, None] * width + np.linspace(0, width - 1, _LINES).astype(int)).ravel()
    sample = channel[:, columns].astype(np.int16).reshape(-1, _PARTS, _LINES)
    steps = medians(np.diff(sample, axis=0), axis=2)
    common = medians(steps, axis=1)
    noise = _spread(common)
    if noise < _LEAST:
        return None
    rows = len(common) // _PARTS
    alike = []
    for band in range(_PARTS):
        part = slice(band * rows, (band + 1) * rows)
        levels = np.median(sample[part], axis=(0, 2))
        for strip in np.flatnonzero((levels > _CLEAR * noise) & (levels < 255 - _CLEAR * noise)):
            others = medians(np.delete(steps[part], strip, axis=1), axis=1)
            alike.append(float(others @ steps[part, strip]) / max(float(others @ others), 1e-6))
    low, high = _ALIKE
    found = len(alike) >= _FEWEST_PARTS and low < np.min(alike) and np.max(alike) < high
    return np.asarray(common, np.float32) if found else None


def _spread(steps: Float64s) -> float:
    """Standard deviation of the rows that make these steps, of which each has the noise of two; robust."""
    return 1.4826 * median(np.abs(steps)) / float(np.sqrt(2.0))


def _left_over(light: Float32s) -> Float32s:
    """What each row lies above its neighbours where the picture is quiet, grey levels, (H,)."""
    off = light - cv2.GaussianBlur(light, (1, 0), sigmaX=0, sigmaY=_NEAR_ROWS)
    busy = cv2.blur(np.abs(off), (_QUIET_PX, _QUIET_PX))
    quiet = busy <= np.percentile(busy[:, ::4], _QUIET_PERCENT, axis=1, keepdims=True)
    most = 3.0 * median(np.abs(off[quiet][::7]))
    return np.asarray((np.clip(off, -most, most) * quiet).sum(axis=1) / np.maximum(quiet.sum(axis=1), 1), np.float32)


def _smooth(offset: Float32s) -> Float32s:
    return np.asarray(cv2.blur(offset[:, None], (1, _SMOOTH_ROWS)), np.float32).ravel()
