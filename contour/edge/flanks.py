"""The lines of an edge on both sides of a run of it that is in doubt."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Float64s, median, medians
from contour.geometry.rings import perimeter
from contour.walls.wall_evidence import RingEvidence

_PITCHES, _FEWEST = 6.0, 4


def out_of_flanks(
    clear: RingEvidence, stops: tuple[float, float], points: Float64s, pitch_px: float
) -> Float64s | None:
    """How far points (N, 2), pixels, stand out of the edge that goes on straight from both sides of a run, up to the
    corner where these meet, shape (N,), negative inside. None where too few witnesses on one side tell.

    `clear`: the witnesses that are not in doubt; the run begins and ends at `stops` along the coarse ring.
    """
    whole = perimeter(clear.coarse)
    lines = [_lines(clear, stop, way, (whole, pitch_px)) for stop, way in zip(stops, (-1.0, 1.0), strict=True)]
    if not all(lines):
        return None
    each = [np.maximum(*[(points - line[0]) @ line[1] for line in pair]) for pair in zip(*lines, strict=True)]
    return np.asarray(np.where(np.abs(each[0]) > np.abs(each[1]), *each), np.float64)


def _lines(
    clear: RingEvidence, stop: float, way: float, lengths: tuple[float, float]
) -> list[tuple[Float64s, Float64s]]:
    """A point and the outward normal of lines through witnesses before (-1) or behind (1) `stop`: of least squares, and
    the one that as many pairs of points rise from as fall (Theil and Sen). Two broken walls in eight turn the first,
    walls along a curve the second; where they differ, what lies on one of them only is not in line.
    """
    whole, pitch_px = lengths
    beside = (way * (clear.position - stop)) % whole < _PITCHES * pitch_px
    if np.count_nonzero(beside) < _FEWEST:
        return []
    points = clear.points[beside]
    middle = medians(points, axis=0)
    spread = points - middle
    _, vectors = np.linalg.eigh(spread.T @ spread)
    normal = vectors[:, 0]
    normal = normal if normal @ clear.normal[beside].mean(axis=0) >= 0 else -normal
    # Broken walls lie inside: the line goes through the outer half.
    return [(middle + median(spread @ one) * one, one) for one in (normal, _straightened(spread, normal, pitch_px))]


def _straightened(spread: Float64s, normal: Float64s, pitch_px: float) -> Float64s:
    """The normal of the line through points (N, 2) with the median slope of all pairs that lie apart."""
    along = np.array([normal[1], -normal[0]])
    one, other = np.triu_indices(len(spread), 1)
    across = spread[other] - spread[one]
    far = np.abs(across @ along) > pitch_px / 2
    if not far.any():
        return normal
    tilt = median((across[far] @ normal) / (across[far] @ along))
    return np.asarray((normal - tilt * along) / np.hypot(1.0, tilt), np.float64)
