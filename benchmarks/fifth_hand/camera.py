"""Light over the table, and what a camera makes of it."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.fifth_hand.noise import turned_axes
from benchmarks.other_hand.fields import Rng, Shape
from contour.geometry.arrays import Bools, Bytes, Float32s


def light_field(rng: Rng, shape: Shape, glare: float) -> Float32s:
    """Light all over the picture, (H, W) float32 about 1: a slope, a vignette, and a spot as strong as `glare`."""
    small = (shape[0] // 8 + 1, shape[1] // 8 + 1)
    along, _ = turned_axes(small, rng.uniform(0, 2 * np.pi))
    slope = (along - along.mean()) / np.hypot(*small) * rng.uniform(0, 0.7)
    y, x = np.mgrid[0 : small[0], 0 : small[1]].astype(np.float32)
    radius = np.hypot(x / small[1] - 0.5, y / small[0] - 0.5)
    spot = np.hypot(x / small[1] - rng.random(), (y / small[0] - rng.random()) * rng.uniform(0.5, 2))
    field = 1 + slope - rng.uniform(0, 0.6) * radius**2 + glare * np.exp(-((spot / rng.uniform(0.08, 0.3)) ** 2))
    large = cv2.resize(field.astype(np.float32), (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return np.asarray(large, np.float32)


def metered(rng: Rng, canvas: Float32s, block: Bools) -> float:
    """A gain that brings the block's bright parts, or the whole picture's, near a usual level."""
    sample = canvas[::5, ::5, 1]
    bright = float(np.percentile(sample[block[::5, ::5]], 96))
    whole = float(np.percentile(sample, 97))
    level = bright if rng.random() < 0.6 else max(bright, whole)
    gain = min(rng.uniform(0.35, 1.0) / max(level, 1e-3), rng.uniform(0.9, 1.4) / max(whole, 1e-3))
    return float(np.clip(gain, 0.3, 9.0))


def expose(rng: Rng, canvas: Float32s, noise: float, *, colour: bool) -> Bytes:
    """The photograph of the canvas, (H, W) grey or (H, W, 3) BGR: blur, noise, tone, sharpening and JPEG."""
    light = np.asarray(canvas if colour else cv2.cvtColor(canvas, cv2.COLOR_BGR2GRAY), np.float32)
    light = np.asarray(cv2.GaussianBlur(light, (0, 0), rng.uniform(0.35, 0.9)), np.float32)
    if rng.random() < 0.3:
        soft = np.asarray(cv2.GaussianBlur(light, (0, 0), 1.2), np.float32)
        light = np.asarray(light + (light - soft) * rng.uniform(0.3, 0.9), np.float32)
    gain, lift = rng.uniform(0.75, 1.2), rng.uniform(0, 0.05)
    light = np.clip(light * gain + lift, 0, None) ** rng.uniform(0.8, 1.2)
    sigma = rng.uniform(0.3, 1.0) * noise
    grain = np.empty_like(light)
    cv2.setRNGSeed(int(rng.integers(1, 2**30)))
    cv2.randn(grain, np.zeros(1), np.ones(1))
    light = light + grain * (sigma * (0.5 + np.sqrt(np.clip(light, 0, 1))))
    picture: Bytes = (np.clip(light, 0, 1) * 255 + 0.5).astype(np.uint8)
    if rng.random() < 0.6:
        packed = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(55, 96))])[1]
        how = cv2.IMREAD_COLOR if colour else cv2.IMREAD_GRAYSCALE
        picture = np.asarray(cv2.imdecode(packed, how), np.uint8)
    return picture
