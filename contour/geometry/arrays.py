"""Arrays by the type of their values, for annotations; shape and unit stand in docstrings. And their medians."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]
Bytes = NDArray[np.uint8]
Int16s = NDArray[np.int16]
Int32s = NDArray[np.int32]
Int64s = NDArray[np.int64]
Indices = NDArray[np.intp]
Float32s = NDArray[np.float32]
Float64s = NDArray[np.float64]
Complexes = NDArray[np.complex128]
A = TypeVar("A", bound=NDArray[Any])


def median(values: NDArray[Any]) -> float:
    """The median of all values, of which there must be one at least and no nan.

    numpy's own medians, quantiles and distinct values load numpy.ma, which takes a process some 10 ms, and take
    several times as long for the few values of a ring.
    """
    return float(medians(values.ravel(), axis=0))


def medians(values: NDArray[Any], axis: int) -> Float64s:
    """The medians along an axis, without it; as `median`."""
    middle, odd = divmod(values.shape[axis], 2)
    ordered = np.partition(values, middle if odd else (middle - 1, middle), axis=axis)
    high = ordered.take(middle, axis=axis).astype(np.float64)
    return np.asarray(high if odd else 0.5 * (ordered.take(middle - 1, axis=axis) + high), np.float64)


def quantile(values: NDArray[Any], share: float) -> float:
    """What this share of all values lies below, linear between two; as `median`."""
    return float(quantiles(values.ravel(), (share,))[0])


def quantiles(values: NDArray[Any], shares: tuple[float, ...]) -> Float64s:
    """What these shares of the values along the first axis lie below, linear between two, in its place."""
    place = np.array(shares) * (len(values) - 1)
    low = np.floor(place).astype(np.intp)
    high = np.minimum(low + 1, len(values) - 1)
    ordered = np.partition(values, sorted({*low.tolist(), *high.tolist()}), axis=0)
    below, above = ordered[low].astype(np.float64), ordered[high].astype(np.float64)
    part = (place - low).reshape(-1, *(1 for _ in values.shape[1:]))
    return np.asarray(below + (above - below) * part, np.float64)


def distinct(numbers: NDArray[Any]) -> Indices:
    """The numbers, none negative, each once, rising."""
    return np.flatnonzero(np.bincount(numbers.ravel()))


def rolled(values: A, by: int) -> A:
    """The values shifted by so many places along the first axis, at most all of them either way, those at the end to
    the other; np.roll takes several times as long for the few values of a ring.
    """
    return np.concatenate((values[-by:], values[:-by]))  # type: ignore[return-value]
