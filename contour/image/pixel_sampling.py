"""Values of an image between its pixels, for any number of places at once."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s, Float64s

_ROW = 1024
FULL_SCALE = 254
"""Grey level from which light may be brighter than the sensor tells."""


def planes_of(picture: Bytes) -> list[Bytes]:
    """The channels of a picture, grey (H, W) or BGR (H, W, 3), each (H, W), as `sample_at` takes them."""
    return [picture] if picture.ndim == 2 else [np.asarray(plane, np.uint8) for plane in cv2.split(picture)]


def sample_at(image: Bytes | Float32s, x: Float64s, y: Float64s) -> Float64s:
    """Bilinear values of `image` (H, W) at (x, y), in the shape of x and y; the border goes on outside."""
    # cv2.remap takes no more than 32767 rows or columns: rows of 1024, the last one filled up.
    flat = np.zeros((2, -(-x.size // _ROW) * _ROW), np.float32)
    flat[0, : x.size], flat[1, : x.size] = x.ravel(), y.ravel()
    if not x.size:
        return np.zeros(x.shape)
    places = flat.reshape(2, -1, _ROW)
    values = cv2.remap(image, places[0], places[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(values, np.float64).ravel()[: x.size].reshape(x.shape)


def light_beside(plane: Bytes, place: Float64s, outward: Float64s, steps: Float64s) -> Float64s:
    """Light so many steps, (K,), out of places (N, 2), pixels, by vectors of one outwards (N, 2): (K, N)."""
    x, y = (place[:, axis] + steps[:, None] * outward[:, axis] for axis in (0, 1))
    return sample_at(plane, x, y)
