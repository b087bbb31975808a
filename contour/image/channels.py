"""What is told of each pixel over its channels: plane by plane, as a last axis of three takes several times as long."""

from __future__ import annotations

from functools import reduce
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from contour.geometry.arrays import Bytes

A = TypeVar("A", bound=NDArray[Any])


def planes(values: A) -> list[A]:
    """The channels of an image, (H, W) or (H, W, C), each (H, W), none of them a copy."""
    return [values] if values.ndim == 2 else [values[:, :, k] for k in range(values.shape[2])]  # type: ignore[misc]


def largest(values: A) -> A:
    """The largest of each pixel's channels, (H, W), of an image, (H, W) or (H, W, C)."""
    return reduce(np.maximum, planes(values))  # type: ignore[arg-type]


def mean(picture: Bytes) -> Bytes:
    """The mean of each pixel's channels, rounded down, (H, W), uint8, of a picture, grey (H, W) or BGR (H, W, 3)."""
    if picture.ndim == 2:
        return picture
    total = reduce(np.add, [plane.astype(np.uint16) for plane in planes(picture)])
    return np.asarray(total // np.uint16(picture.shape[2]), np.uint8)
