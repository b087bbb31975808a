"""Where a known table lies in shadow: it is darker than it was, and its own pattern is still in view."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Float32s
from contour.image.opencv import closed_by_disc, pieces_of

# Samples a pitch, and how wide what is compared at once is, pitches and samples at least.
_SAMPLES, _WINDOW_PITCHES, _WINDOW = 24, 1.5, 25
# Blurs between which the pattern is, samples, and how much of it there must be, grey levels: less is the sensor's own.
_FINE, _ROUGH, _LEAST = 1.0, 4.0, 1.0
# Light is less than that share of what it was.
_DARKER = 0.95
# By how many more samples light and pattern go the same way than not: somewhere, and in a good share of a piece that is
# as large, square pitches. Noise alone does by 0.1.
_ALIKE, _SURE, _GOOD_SHARE, _LARGE = 0.12, 0.3, 0.3, 4.0


def in_shadow(light: Float32s, known: Float32s, shade: Float32s, pitch_px: float) -> Bools:
    """Where light that is a share `shade` of what is known of the table shows its pattern, all (H, W).

    What lies over the table hides its pattern, however dark it is. The signs of light and pattern are compared, since
    hot pixels are in both.
    """
    step = max(1, int(pitch_px / _SAMPLES))
    size = (light.shape[1] // step, light.shape[0] // step)
    samples = pitch_px / step
    window = max(_WINDOW, 2 * round(0.5 * _WINDOW_PITCHES * samples) + 1)
    now, then, dim = (
        np.asarray(cv2.resize(one, size, interpolation=cv2.INTER_AREA), np.float32) for one in (light, known, shade)
    )
    pattern = _pattern(then)
    patterned = cv2.blur(np.abs(pattern), (window, window)) > _LEAST
    if not patterned.any():
        return np.zeros(light.shape, np.bool_)
    seen = _pattern(now)
    dark = (dim < _DARKER).astype(np.float32)
    # Among what is dark: the table beside it is no shadow.
    same = cv2.blur(np.sign(seen) * np.sign(pattern) * dark, (window, window))
    alike = same / np.maximum(cv2.blur(dark, (window, window)), np.float32(1.0 / window**2))
    told = (alike > _ALIKE) & (dark > 0) & patterned
    thin = np.ones((window // 3, window // 3), np.uint8)
    count, pieces = pieces_of(np.asarray(cv2.morphologyEx(told.astype(np.uint8), cv2.MORPH_OPEN, thin), np.uint8), 8)
    area = np.bincount(pieces.ravel(), minlength=count)
    sure = np.bincount(pieces[alike > _SURE], minlength=count)
    kept = (sure > _GOOD_SHARE * area) & (area > _LARGE * samples**2)
    kept[0] = False
    shadow = closed_by_disc(kept.take(pieces).astype(np.uint8), samples) & (dim < _DARKER)
    return np.asarray(cv2.resize(shadow.astype(np.uint8), light.shape[::-1], interpolation=cv2.INTER_NEAREST) > 0)


def _pattern(light: Float32s) -> Float32s:
    return np.asarray(cv2.GaussianBlur(light, (0, 0), _FINE) - cv2.GaussianBlur(light, (0, 0), _ROUGH), np.float32)
