"""The table's own light, followed from the picture's border in under the block."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Bytes, Float64s, median, medians

OUTLIER = 4.0
"""Spreads of the table's light beyond which something is not the table."""

_BORDER_SHARE = 0.015
_ROUNDS = 6


def table_surface(small: Float64s, texture: Bytes) -> tuple[Float64s, float]:
    """The table's light under the block too, shape of `small` (h, w, channels), and its spread: a surface of second
    order.

    First through the picture's border, then through all that lies near it and is as smooth as most of the border, so
    that vignetting is followed inwards while a board whose mean colour is the table's stays out.
    """
    height, width, _ = small.shape
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=2).reshape(-1, 6)
    values = small.reshape(len(terms), -1)
    rim = np.maximum(np.abs(x), np.abs(y)).ravel() > 1 - 2 * _BORDER_SHARE
    smooth = texture.ravel() <= 2 * max(1.0, median(texture.ravel()[rim]))
    rim &= smooth
    used = rim
    fitted = np.broadcast_to(medians(values[rim], axis=0), values.shape)
    spread = 1.0
    for _ in range(_ROUNDS):
        off = np.abs(values - fitted).max(axis=1)
        spread = max(1.4826 * median(off[used]), 1.0)
        # Weights that fall with the distance: a block that touches the border must not bend the table.
        weighted = terms.T * (used / (1 + (off / spread) ** 4))
        # Normal equations: terms between -1 and 1 are far from alike, and a hundred thousand rows for six unknowns.
        fitted = terms @ np.linalg.solve(weighted @ terms, weighted @ values)
        off = np.abs(values - fitted).max(axis=1)
        near = smooth & (off < OUTLIER * spread)
        used = near if np.count_nonzero(near) > 0.3 * np.count_nonzero(rim) else rim
    return fitted.reshape(small.shape), spread
