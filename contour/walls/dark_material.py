"""How far dark material goes on beyond the last wall seen in it, where its cells are as dark as its walls."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float64s, median
from contour.image.pixel_sampling import sample_at
from contour.walls.coarse_rings import CoarseBlock

_STEP_PX = 0.5
# How far beyond the coarse edge and inside of it the edge of dark material is looked for, and how long it is where it
# is more than a speck.
_BEYOND_PITCHES, _WITHIN_PITCHES = 3.0, 0.5
_LONG_PITCHES = 6.0


def midway_to_table(light: Bytes, level: float, contrast: float) -> float | None:
    """Grey level midway from dark walls of `level` to the table at the picture's rim.

    None where the table is not lighter than walls by two `contrast` of walls in their cells: cells show the table.
    """
    margin = max(1, min(light.shape) // 50)
    rim = (light[:margin], light[-margin:], light[:, :margin], light[:, -margin:])
    table = median(np.concatenate([part[::3, ::3].ravel() for part in rim]))
    return 0.5 * (level + table) if table - level >= 2 * contrast else None


def dark_beyond(light: Bytes, place: Float64s, normal: Float64s, *, midway: float, reach: float) -> Float64s:
    """Distance from each place (N, 2) along its normal (N, 2) to where `light` first rises through `midway`, shape
    (N,), pixels; inf where that is farther than `reach`, 0 where the place itself is as light.
    """
    along = np.arange(0.0, reach + _STEP_PX, _STEP_PX)
    x, y = (place[:, axis, None] + along * normal[:, axis, None] for axis in (0, 1))
    value = sample_at(light, x, y)
    light_at = value >= midway
    first = np.argmax(light_at, axis=1)
    row = np.arange(len(place))
    before, there = value[row, np.maximum(first - 1, 0)], value[row, first]
    part = (midway - before) / np.maximum(there - before, 1e-9)
    distance = np.where(first > 0, _STEP_PX * (first - 1 + part), 0.0)
    return np.asarray(np.where(light_at.any(axis=1), distance, np.inf), np.float64)


def dark_edge(light: Bytes, coarse: CoarseBlock, pitch_px: float, midway: float) -> Float64s:
    """Points along the edge of what is darker than `midway` in `light` (H, W), where that hangs together around the
    block, shape (K, 2), pixels.
    """
    near = (coarse.depth > -_BEYOND_PITCHES * pitch_px) & (coarse.depth < _WITHIN_PITCHES * pitch_px)
    _, dark = cv2.threshold(light, midway, 255, cv2.THRESH_BINARY_INV)
    dark = cv2.bitwise_and(dark, coarse.enlarged(near.astype(np.uint8) * 255, light.shape))
    chains, _ = cv2.findContours(np.asarray(dark, np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    long = [chain[:, 0, :].astype(np.float64) for chain in chains if len(chain) > _LONG_PITCHES * pitch_px]
    return np.concatenate([np.empty((0, 2)), *long])
