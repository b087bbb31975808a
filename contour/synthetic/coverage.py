"""Exact area coverage of polygons on a pixel raster.

`cv2.fillPoly` paints every pixel it touches, which inflates an outline by about 0.4 pixel. Here the share of each
pixel's area inside the polygon is accumulated edge by edge and summed along the rows (the signed-area scan conversion
of font rasterisers), so a pixel that is cut in half has exactly one half.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contour.geometry.arrays import Float32s, Float64s
from contour.geometry.rings import Ring


def area_coverage(rings: Sequence[Ring], width: int, height: int) -> Float32s:
    """Share of each pixel inside the rings, shape (height, width), float32, 0…1.

    Rings are in pixels with (0, 0) the centre of the top-left pixel; the exterior comes first, holes run the other way.
    """
    start = np.concatenate([np.asarray(ring, dtype=np.float64) for ring in rings]) + 0.5
    end = np.concatenate([np.roll(np.asarray(ring, dtype=np.float64), -1, axis=0) for ring in rings]) + 0.5
    pieces = _pieces(start, end, width, height)
    total = np.zeros((height, width + 2), dtype=np.float32)
    middle = 0.5 * (pieces[:, 1] + pieces[:, 3])
    row = np.floor(middle).astype(np.int64)
    inside = (row >= 0) & (row < height)
    pieces, row = pieces[inside], row[inside]
    rise = pieces[:, 3] - pieces[:, 1]
    x = np.clip(0.5 * (pieces[:, 0] + pieces[:, 2]), 0.0, float(width))
    column = np.floor(x).astype(np.int64)
    right = rise * (x - column)
    np.add.at(total, (row, column), (rise - right).astype(np.float32))
    np.add.at(total, (row, column + 1), right.astype(np.float32))
    np.cumsum(total, axis=1, out=total)
    sign = 1.0 if _signed_area(rings[0]) < 0.0 else -1.0
    return np.asarray(np.clip(total[:, :width] * np.float32(sign), 0.0, 1.0), dtype=np.float32)


def _signed_area(ring: Ring) -> float:
    x, y = ring[:, 0], ring[:, 1]
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def _pieces(start: Ring, end: Ring, width: int, height: int) -> Float64s:
    """Edges from `start` to `end` cut at every pixel border they cross, as x0, y0, x1, y1, shape (M, 4)."""
    edges = [np.arange(len(start)), np.arange(len(start))]
    shares = [np.zeros(len(start)), np.ones(len(start))]
    for axis, limit in ((0, width), (1, height)):
        low = np.floor(np.minimum(start[:, axis], end[:, axis])) + 1.0
        high = np.ceil(np.maximum(start[:, axis], end[:, axis])) - 1.0
        low, high = np.clip(low, 0, limit + 1), np.clip(high, -1, limit)
        counts = np.maximum(0, high - low + 1).astype(np.int64)
        edge = np.repeat(np.arange(len(start)), counts)
        line = np.repeat(low, counts) + np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
        edges.append(edge)
        shares.append((line - start[edge, axis]) / (end[edge, axis] - start[edge, axis]))
    edge_of, share = np.concatenate(edges), np.concatenate(shares)
    order = np.lexsort((share, edge_of))
    edge_of, share = edge_of[order], share[order]
    points = start[edge_of] + (end[edge_of] - start[edge_of]) * share[:, None]
    same = edge_of[1:] == edge_of[:-1]
    return np.column_stack((points[:-1][same], points[1:][same]))
