"""Arrays by the type of their values, for annotations; shape and unit stand in docstrings. And their medians."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]
Bytes = NDArray[np.uint8]
Int32s = NDArray[np.int32]
Int64s = NDArray[np.int64]
Indices = NDArray[np.intp]
Float32s = NDArray[np.float32]
Float64s = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def median(values: NDArray[Any]) -> float:
    """The median of all values, of which there must be one at least and no nan.

    np.median of floats loads numpy.ma, which takes a process some 15 ms, and is slower on the few values of a ring.
    """
    return float(medians(values.ravel(), axis=0))


def medians(values: NDArray[Any], axis: int) -> Float64s:
    """The medians along an axis, without it; as `median`."""
    middle, odd = divmod(values.shape[axis], 2)
    ordered = np.partition(values, middle if odd else (middle - 1, middle), axis=axis)
    high = ordered.take(middle, axis=axis).astype(np.float64)
    return np.asarray(high if odd else 0.5 * (ordered.take(middle - 1, axis=axis) + high), np.float64)
