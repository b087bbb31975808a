"""What cells have, a light or a size, in two kinds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from contour.geometry.arrays import Bools, Float64s, median, quantile

FEWEST = 15
"""So many cells are of each kind at the least."""


@dataclass(frozen=True, eq=False)
class Kinds:
    """Which cells have more of it, (N,), the step between both kinds, what those of one kind differ by, and how much
    of the step parts most of one from most of the other.
    """

    more: Bools
    step: float
    spread: float
    gap: float


def two_kinds(value: Float64s) -> Kinds | None:
    """Values, (N,), in the two kinds between whose means they differ most (Otsu 1979); None where they are too few."""
    if len(value) < 2 * FEWEST:
        return None
    order = np.argsort(value)
    total, count = np.cumsum(value[order]), np.arange(1, len(value))
    mean, rest = total[:-1] / count, (total[-1] - total[:-1]) / count[::-1]
    between = count * count[::-1] * (rest - mean) ** 2
    first = FEWEST + int(between[FEWEST - 1 : len(value) - FEWEST].argmax())
    more = np.zeros(len(value), np.bool_)
    more[order[first:]] = True
    low, high = median(value[~more]), median(value[more])
    spread = 1.4826 * median(np.abs(value - np.where(more, high, low)))
    gap = quantile(value[more], 0.1) - quantile(value[~more], 0.9)
    return Kinds(more, high - low, spread, gap / max(high - low, 1e-9))
