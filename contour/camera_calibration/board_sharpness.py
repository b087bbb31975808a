"""How sharp a board view is: the spread of its edges in pixels."""

from __future__ import annotations

import numpy as np

from contour.camera_calibration.board import Board
from contour.geometry.arrays import Bytes, Float64s, Int64s
from contour.image.opencv_boards import sampled

_STEPS_A_PIXEL = 4


def edge_sigma_px(levels: Bytes, board: Board, ids: Int64s, pixels: Float64s) -> float:
    """Median spread of the edges between neighbouring corners, as the sigma of a Gaussian blur, pixels.

    An edge's steepest slope s between levels that differ by c gives c / (sqrt(2 pi) s). NaN where no two seen corners
    are neighbours.
    """
    place = {int(number): index for index, number in enumerate(ids)}
    pairs = [
        (place[number], place[number + 1])
        for number in place
        if number + 1 in place and (number + 1) % board.columns != 0
    ]
    if not pairs:
        return float("nan")
    first, second = pixels[[one for one, _ in pairs]], pixels[[two for _, two in pairs]]
    along = second - first
    length = np.linalg.norm(along, axis=1)
    across = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]
    reach = max(0.35 * float(np.median(length)), 3.0)
    offsets = np.linspace(-reach, reach, int(2 * reach * _STEPS_A_PIXEL) + 1)
    middles = (first + second) / 2
    profiles = sampled(levels, middles[:, None] + offsets[None, :, None] * across[:, None])
    low, high = np.percentile(profiles, [5, 95])
    if high - low < 1:
        return float("inf")
    # Differences over a pixel: noise of single samples would feign steep edges.
    slopes = np.abs(profiles[:, _STEPS_A_PIXEL:] - profiles[:, :-_STEPS_A_PIXEL]).max(axis=1)
    return float(np.median((high - low) / (np.sqrt(2 * np.pi) * np.maximum(slopes, 1e-3))))
