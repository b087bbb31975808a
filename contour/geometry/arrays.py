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
    below, high = _parted(values, middle, axis)
    return np.asarray(high if odd else 0.5 * (below.max(axis=0) + high), np.float64)


def _parted(values: NDArray[Any], place: int, axis: int = 0) -> tuple[NDArray[Any], Float64s]:
    """The values that come before a place along an axis where they rise along it, in any order, and the one there."""
    # Parted at one place, as numpy does with vectors for all but bytes: at two of them it takes ten times as long.
    wide = values.astype(np.int16) if values.dtype == np.uint8 else values
    ordered = np.partition(wide, place, axis=axis)
    if axis:
        ordered = ordered.transpose(axis, *(other for other in range(values.ndim) if other != axis))
    return ordered[:place], ordered[place].astype(np.float64)


def quantile(values: NDArray[Any], share: float) -> float:
    """What this share of all values lies below, linear between two; as `median`."""
    return float(quantiles(values.ravel(), (share,))[0])


def quantiles(values: NDArray[Any], shares: tuple[float, ...]) -> Float64s:
    """What these shares of the values along the first axis lie below, linear between two, in its place."""
    found = []
    for share in shares:
        place = share * (len(values) - 1)
        low = int(place)
        lower, above = _parted(values, min(low + 1, len(values) - 1))
        below = lower.max(axis=0).astype(np.float64) if low + 1 < len(values) else above
        found.append(below + (above - below) * (place - low))
    return np.array(found, np.float64)


def distinct(numbers: NDArray[Any]) -> Indices:
    """The numbers, none negative, each once, rising."""
    return np.flatnonzero(np.bincount(numbers.ravel()))


def with_sides(values: A, count: float) -> A:
    """Values at places around a ring, (..., N), with those of half so many places on each side, (..., N, M)."""
    half = round(0.5 * count)
    turned = np.take(values, np.arange(-half, values.shape[-1] + half), axis=-1, mode="wrap")
    return np.lib.stride_tricks.sliding_window_view(turned, 2 * half + 1, axis=-1)  # type: ignore[return-value]


def rolled(values: A, by: int) -> A:
    """The values shifted by so many places along the first axis, at most all of them either way, those at the end to
    the other; np.roll takes several times as long for the few values of a ring.
    """
    return np.concatenate((values[-by:], values[:-by]))  # type: ignore[return-value]
