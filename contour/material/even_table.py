"""An even table as it would look without the block: told from what of it the picture shows."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float32s, quantile
from contour.image.channels import largest
from contour.image.opencv import grown, pieces_and_areas, shrunk_to
from contour.image.taught_table import TableLook
from contour.material.table_surface import second_order

_SAMPLES = 1.2e5
# Light that changes by so many levels from sample to sample, or by this share of how much it does at most, has a border
# there. A block is where that much of a window, of this share of the picture's longer side, has.
_LEAST_STEP, _OF_STEPS, _AT_MOST = 3.0, 0.2, 0.95
_WINDOW, _BUSY = 0.02, 0.3
# The table is the largest part without borders: so much of the picture, and of all that is no block.
_LEAST_SHOWN, _LEAST_PLAIN = 0.05, 0.6
# Most of it is off its light by no more than this share of what most of the rest is: 0.08 on each of 19 even tables,
# 0.19 in one of wood that has hardly a border.
_MOST, _PATTERN = 0.9, 0.12
# Its light beneath the block is the mean of the nearest that so much of a window shows.
_ENOUGH = 0.12


def even_table(picture: Bytes) -> TableLook | None:
    """The picture, grey (H, W) or BGR (H, W, 3), uint8, beside its table as it would look empty; None where that has
    borders of its own, or too little of it shows.
    """
    height, width = picture.shape[:2]
    step = max(1.0, np.sqrt(height * width / _SAMPLES))
    small = shrunk_to(picture, (round(height / step), round(width / step)))
    table = _table(small)
    if table is None:
        return None
    # The block's own shade reaches far: what lies in it is darker than the table, never lighter.
    light = np.asarray(cv2.max(_filled(small, table), _even(small, table)), np.uint8)
    off = largest(np.asarray(cv2.absdiff(small, light), np.uint8))
    if table.all() or quantile(off[table], _MOST) > _PATTERN * quantile(off[~table], _MOST):
        return None
    return TableLook(picture, grown(light, (height, width)), gain=1.0, shift_px=None, rim_share=1.0, changed_share=0.0)


def _table(small: Bytes) -> Bools | None:
    """Which samples show the table, (h, w), at some distance from the block; None where it is not even."""
    near = np.ones((3, 3), np.uint8)
    change = largest(np.asarray(cv2.morphologyEx(small, cv2.MORPH_GRADIENT, near), np.uint8))
    border = (change > max(_LEAST_STEP, _OF_STEPS * quantile(change, _AT_MOST))).astype(np.uint8)
    window = (2 * round(_WINDOW * max(small.shape)) + 1,) * 2
    block = _largest(cv2.blur(border.astype(np.float32), window) > _BUSY)
    outside = cv2.dilate(block.astype(np.uint8), cv2.getStructuringElement(cv2.MORPH_ELLIPSE, window)) == 0
    table = _largest(outside & (cv2.dilate(border, near) == 0))
    shown, beside = np.count_nonzero(table), np.count_nonzero(outside)
    return table if shown > max(_LEAST_SHOWN * table.size, _LEAST_PLAIN * beside) else None


def _largest(mask: Bools) -> Bools:
    """The largest of a mask's pieces, (h, w); nothing where it is empty."""
    pieces, area = pieces_and_areas(mask.astype(np.uint8), 4)
    return np.asarray(mask & (pieces == area.argmax()))


def _even(small: Bytes, table: Bools) -> Bytes:
    """The table's light everywhere in the shape of `small`, if it changes no more than by squares of x and y."""
    terms = second_order(*(np.linspace(-1.0, 1.0, size) for size in small.shape[1::-1]))
    weights, *_ = np.linalg.lstsq(terms[table], small[table].astype(np.float64), rcond=None)
    return np.asarray(np.clip(np.rint(terms @ weights), 0, 255), np.uint8)


def _filled(small: Bytes, table: Bools) -> Bytes:
    """The table's light everywhere, smooth, in the shape of `small`: near the table its own, far from it that of a
    larger part of it.
    """
    shown = table.astype(np.float32)
    light = small.astype(np.float32) * (shown if small.ndim == 2 else shown[..., None])
    filled, unknown = np.zeros_like(light), np.ones(table.shape, np.bool_)
    sigma = 0.5 * _WINDOW * max(table.shape)
    first = sigma
    while unknown.any():
        much, sums = _blurred(shown, sigma), _blurred(light, sigma)
        told = unknown & (much > _ENOUGH) if sigma < max(table.shape) else unknown
        filled[told] = sums[told] / (much[told] if light.ndim == 2 else much[told, None])
        unknown &= ~told
        sigma *= 2.0
    return np.asarray(cv2.convertScaleAbs(_blurred(filled, first)), np.uint8)


def _blurred(samples: Float32s, sigma: float) -> Float32s:
    """Blurred by a Gaussian, a wide one in steps."""
    hop = max(1, int(0.25 * sigma))
    height, width = samples.shape[:2]
    fewer = shrunk_to(samples, (max(2, height // hop), max(2, width // hop)))
    smooth = np.asarray(cv2.GaussianBlur(fewer, (0, 0), sigma / hop), np.float32)
    return grown(smooth, (height, width))
