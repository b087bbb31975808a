"""Noise, smooth or drawn out, and turned axes, over a picture: fields (H, W) float32."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.other_hand.fields import Rng, Shape
from contour.geometry.arrays import Float32s


def smooth_noise(rng: Rng, shape: Shape, grain: float, stretch: float = 1.0) -> Float32s:
    """Noise of about unit spread, its grains so many pixels high and `stretch` times as wide."""
    rows = max(2, int(shape[0] / grain) + 3)
    columns = max(2, int(shape[1] / (grain * stretch)) + 3)
    small = rng.standard_normal((rows, columns)).astype(np.float32)
    size = (max(shape[1], int(columns * grain * stretch)), max(shape[0], int(rows * grain)))
    if size[0] > 3 * shape[1] or size[1] > 3 * shape[0]:
        size = (shape[1], shape[0])
    large = cv2.resize(small, size, interpolation=cv2.INTER_CUBIC)[: shape[0], : shape[1]]
    return np.asarray(large * 1.3, np.float32)


def fractal_noise(rng: Rng, shape: Shape, grain: float, octaves: int) -> Float32s:
    """So many octaves of noise, coarse ones strongest."""
    total = np.zeros(shape, np.float32)
    for octave in range(octaves):
        total += smooth_noise(rng, shape, max(1.2, grain / 2**octave)) * 0.6**octave
    return np.asarray(total * 0.75, np.float32)


def turned_axes(shape: Shape, angle: float) -> tuple[Float32s, Float32s]:
    """How far pixels lie along an angle, radians, and across it, from the first pixel."""
    across, along = np.mgrid[0 : shape[0], 0 : shape[1]].astype(np.float32)
    cosine, sine = np.float32(np.cos(angle)), np.float32(np.sin(angle))
    return along * cosine + across * sine, across * cosine - along * sine


def turned_noise(rng: Rng, shape: Shape, angle: float, grain: float, stretch: float) -> Float32s:
    """Noise drawn out `stretch` times along an angle, radians."""
    side = int(np.hypot(*shape)) + 4
    flat = smooth_noise(rng, (side, side), grain, stretch)
    turn = np.asarray(cv2.getRotationMatrix2D((side / 2, side / 2), -float(np.degrees(angle)), 1.0), np.float64)
    turn[:, 2] += np.array([shape[1], shape[0]]) / 2 - side / 2
    return np.asarray(cv2.warpAffine(flat, turn, shape[::-1], borderMode=cv2.BORDER_REFLECT), np.float32)
