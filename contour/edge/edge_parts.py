"""Parts of an outline that the picture says something of, told by light beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from contour.edge.ring_places import runs_of
from contour.geometry.arrays import Bools, Float64s
from contour.geometry.ring_lengths import RingLengths


@dataclass(frozen=True)
class EdgePart:
    """A part of an outline: its length, cell pitches, and its middle, pixels (x, y)."""

    length_pitches: float
    place_px: tuple[float, float]

    def moved(self, x: float, y: float) -> EdgePart:
        """The same in a picture whose first pixel lies at (-x, -y) of this one's."""
        return replace(self, place_px=(self.place_px[0] + x, self.place_px[1] + y))


def longest_part(chosen: Bools, lengths: RingLengths, at: Float64s, spacing_pitches: float) -> EdgePart | None:
    """The longest run of chosen places at lengths along a ring, so many pitches apart, (N,); None without any."""
    if not chosen.any():
        return None
    run = max(runs_of(chosen), key=len)
    x, y = lengths.at(at[run[len(run) // 2 :][:1]])[0].tolist()
    return EdgePart(spacing_pitches * len(run), (x, y))


def changes(values: Float64s, count: float) -> Float64s:
    """By how much values at places around a ring, (K, N), change over so many places about each, (K, N)."""
    half = round(0.5 * count)
    turned = np.take(values, np.arange(-half, values.shape[-1] + half), axis=-1, mode="wrap")
    window = np.ones((1, 2 * half + 1), np.uint8)
    spread = cv2.dilate(turned, window) - cv2.erode(turned, window)
    return np.asarray(spread[:, half : half + values.shape[-1]], np.float64)
