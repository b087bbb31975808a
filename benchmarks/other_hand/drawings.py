"""What is drawn with bytes: rings, lines and discs; places are pixels, x before y, whole in the middle of pixels."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from benchmarks.other_hand.fields import Field, Shape
from contour.geometry.arrays import Bytes, Float32s, Float64s, Int32s


def sixteenths(points: Field) -> Int32s:
    """Points, (..., 2), as OpenCV draws them with a shift of 4."""
    return np.round(points * 16.0).astype(np.int32)


def filled(shape: Shape, rings: Sequence[Float64s], line: int = cv2.LINE_8) -> Bytes:
    """255 within the rings, of which one inside another is a hole, else 0, (H, W)."""
    drawn = np.zeros(shape, np.uint8)
    cv2.fillPoly(drawn, [sixteenths(ring) for ring in rings], 255, line, 4)
    return drawn


def within(shape: Shape, rings: Sequence[Float64s]) -> Bytes:
    """As `filled`, but of pixels whose middles lie within, to a sixth of a pixel: OpenCV paints the outline too."""
    fine = filled((3 * shape[0], 3 * shape[1]), [3.0 * ring + 1.0 for ring in rings])
    return np.ascontiguousarray(fine[1::3, 1::3])


def share(drawn: Bytes) -> Float32s:
    """What is drawn with levels to 255, from 0 to 1."""
    return np.asarray(drawn / np.float32(255.0), np.float32)


def stroke(drawn: Bytes, points: Field, level: float | tuple[float, float], thick: int = 1) -> None:
    """Draw a line through the points, (N, 2), in place."""
    cv2.polylines(drawn, [sixteenths(points)], False, level, thick, cv2.LINE_AA, 4)


def disc(drawn: Bytes, middle: Field, radius: float, level: float) -> None:
    """Draw a disc in place."""
    cv2.circle(drawn, sixteenths(middle).tolist(), int(16.0 * radius), level, -1, cv2.LINE_AA, 4)


def depth(drawn: Bytes) -> Float32s:
    """How far pixels that are drawn lie from those that are not, pixels, (H, W)."""
    return np.asarray(cv2.distanceTransform((drawn > 127).astype(np.uint8), cv2.DIST_L2, 5), np.float32)
