"""Lamps, and what a lens and a sensor make of the light."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.fourth_hand.textures import coat
from benchmarks.other_hand.fields import Rng, Shape
from contour.geometry.arrays import Bools, Bytes, Float32s


def lamps(rng: Rng, shape: Shape) -> Float32s:
    """Light all over the picture, (H, W, 3) float32 about 1: a wash, and one to three lamps of mixed colours."""
    x = np.linspace(-1, 1, shape[1], dtype=np.float32)[None, :]
    y = np.linspace(-1, 1, shape[0], dtype=np.float32)[:, None]
    wash = rng.uniform(0.35, 0.75) * (1 + rng.uniform(-0.3, 0.3) * x + rng.uniform(-0.3, 0.3) * y)
    out = coat(shape, np.ones(3, np.float32), wash)
    for _ in range(int(rng.integers(1, 4))):
        cx, cy = rng.uniform(-1.2, 1.2, 2).astype(np.float32)
        warm = rng.uniform(-0.22, 0.22)
        pool = np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / np.float32(rng.uniform(0.4, 3.0)))
        out += pool[..., None] * np.array([1 - warm, 1, 1 + warm], np.float32) * np.float32(rng.uniform(0.1, 0.6))
    return np.asarray(out * np.float32(rng.uniform(0.75, 1.15)) / out.mean(), np.float32)


def expose(rng: Rng, lit: Float32s, comb: Bools) -> Bytes:
    """The photograph of light, (H, W) grey or (H, W, 3) BGR: blur, gain, noise, tone curve, JPEG. comb: where the block
    is, (H, W).
    """
    light = np.asarray(cv2.GaussianBlur(lit, (0, 0), rng.uniform(0.35, 0.95)), np.float32)
    thin = light[::5, ::5]
    bright = np.maximum(np.percentile(thin[comb[::5, ::5]], 95), np.percentile(thin, 96) / 1.15)
    light = np.clip(light * np.float32(rng.uniform(0.6, 1.05) / max(bright, 0.05)), 0, 2)
    light = np.where(light > 0.85, 0.85 + 0.17 * np.tanh((light - 0.85) / 0.17), light)
    grey = rng.random() < 0.4
    if grey:
        light = light @ np.array([0.114, 0.587, 0.299], np.float32)
    light = np.power(light, np.float32(rng.uniform(0.7, 1.0)))
    noise = rng.standard_normal(light.shape, dtype=np.float32) * np.float32(rng.uniform(0.004, 0.025))
    picture: Bytes = np.clip((light + noise) * 255, 0, 255).astype(np.uint8)
    if rng.random() < 0.7:
        data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(55, 96))])[1]
        how = cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR
        picture = np.asarray(cv2.imdecode(data, how), np.uint8)
    return picture
