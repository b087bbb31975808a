"""Figures of a picture that a person reads while a camera is set up: sharpness, lightness, clipping."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bytes

DARKEST, BRIGHTEST = 2, 253  # noise moves clipped pixels by a level or two
MOST_CLIPPED = 0.01
"""Of a picture's pixels: beyond, light or exposure is to be changed."""


@dataclass(frozen=True)
class PictureFigures:
    """sharpness: gradient energy over contrast, % a pixel; independent of gain and light, to be compared for one scene
    only. mean: grey level, 0 to 255. dark_share, bright_share: pixels at the ends of the range, 0 to 1."""

    sharpness: float
    mean: float
    dark_share: float
    bright_share: float

    def __str__(self) -> str:
        return (
            f"sharpness {self.sharpness:.1f} %, mean grey {self.mean:.0f}, "
            f"{self.dark_share:.1%} black, {self.bright_share:.1%} white"
        )


def picture_figures(pixels: Bytes) -> PictureFigures:
    """Figures of a picture, shape (H, W) grey or (H, W, 3) BGR, uint8.

    Sharpness is the root mean square of the Sobel gradient over the standard deviation of the grey levels (Tenenbaum's
    measure, made independent of contrast); 0 for a picture of one grey.
    """
    grey = pixels if pixels.ndim == 2 else np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    mean, deviation = (float(value[0, 0]) for value in cv2.meanStdDev(grey))
    total = grey.size
    # In eighths of a grey level a pixel, whole numbers.
    energy = sum(cv2.norm(way, cv2.NORM_L2SQR) for way in cv2.spatialGradient(grey)) / 64 / total
    return PictureFigures(
        sharpness=100 * float(np.sqrt(energy)) / deviation if deviation > 0 else 0.0,
        mean=mean,
        dark_share=cv2.countNonZero(cv2.inRange(grey, 0, DARKEST)) / total,
        bright_share=cv2.countNonZero(cv2.inRange(grey, BRIGHTEST, 255)) / total,
    )
