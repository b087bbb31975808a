"""Where light is at full scale, so that nothing shows."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, median
from contour.image import channels
from contour.image.opencv import box_mean, within

# The mean light within that of a place, noise included. What lies beside a comb is looked at so far, pitches.
_GLARE, _GLARE_PITCHES, _BESIDE_PITCHES = 242.0, 0.19, 2.5


def glare(picture: Bytes, comb: Bools, pitch_px: float) -> Bools:
    """Where a picture, grey (H, W) or BGR (H, W, 3), uint8, is at full scale all around, at the size of a map of comb
    that lies in it, (h, w), with cells of that pitch there; nowhere if most of what lies beside the comb is.
    """
    light = channels.mean(np.asarray(cv2.resize(picture, comb.shape[::-1], interpolation=cv2.INTER_AREA), np.uint8))
    around = box_mean(light.astype(np.float32), 2 * round(_GLARE_PITCHES * pitch_px) + 1)
    beside = around[~comb & (within(comb, _BESIDE_PITCHES * pitch_px) > 0)]
    if not len(beside) or median(beside) > _GLARE:
        return np.zeros(comb.shape, np.bool_)
    return np.asarray(around > _GLARE)
