"""What makes patches the cells of a comb: neighbours all around at one distance, and no dents."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Float64s, Indices, Int32s

_SAMPLED = 64
# Six neighbours of a honeycomb's cell are 1 pitch away, of an over-expanded one 0.8 to 1.2, the next ones 1.5.
_NEIGHBOUR_PITCHES = (0.75, 1.35)
_NEIGHBOURS = 4


def lattice_order(places: Float64s, pitch_px: float) -> float:
    """Share of cells with four neighbours or more about a pitch away, 0 to 1; centroids of cells (N, 2), pixels."""
    some = places[_spread(len(places))]
    near = np.abs(some[:, None, :] - places[None, :, :])
    square = (near[:, :, 0] ** 2 + near[:, :, 1] ** 2) / pitch_px**2
    low, high = _NEIGHBOUR_PITCHES
    neighbours = ((square > low**2) & (square < high**2)).sum(axis=1)
    return float(np.mean(neighbours >= _NEIGHBOURS))


def solidity(labels: Int32s, numbers: Indices, stats: Int32s) -> float:
    """Median share of their convex hull that the pieces of these numbers fill, 0 to 1."""
    shares = []
    for number in numbers[_spread(len(numbers))]:
        left, top, wide, high, area = stats[number].tolist()
        piece = (labels[top : top + high, left : left + wide] == number).astype(np.uint8)
        outlines, _ = cv2.findContours(piece, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        hull = cv2.convexHull(outlines[0])
        # Pixels have an area, the polygon through their centres lacks half of its boundary and one more.
        shares.append(area / (cv2.contourArea(hull) + 0.5 * cv2.arcLength(hull, True) + 1.0))
    return float(np.median(shares))


def _spread(count: int) -> Indices:
    return np.linspace(0, count - 1, min(count, _SAMPLED)).astype(np.intp)
