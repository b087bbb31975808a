"""What a camera makes of light: an uneven lamp, exposure, blur, noise and JPEG."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.other_hand.fields import Field, Rng, Shape, axes
from benchmarks.sixth_hand.fields import noise, soften
from contour.geometry.arrays import Bytes, Float32s


@dataclass(frozen=True)
class Lens:
    """What a kind asks of the camera: ranges that its gain, its blur in pixels and its noise, to 1, are drawn from."""

    gain: tuple[float, float] = (0.85, 1.35)
    blur: tuple[float, float] = (0.0, 0.8)
    noise: tuple[float, float] = (0.003, 0.02)


def _uneven(shape: Shape, rng: Rng) -> Float32s:
    """The lamps' light, (H, W) float32 about 1: it changes slowly, and has a bright pool at times."""
    x, y = axes(shape)
    slope = rng.normal(0, 0.15, 2)
    light: Field = 1 + slope[0] * (2 * x / shape[1] - 1) + slope[1] * (2 * y / shape[0] - 1)
    light = light + rng.uniform(0, 0.1) * noise(shape, 0.4 * shape[1], rng)
    if rng.random() < 0.4:
        spot = rng.random(2) * (shape[1], shape[0])
        width = rng.uniform(0.1, 0.4) * shape[1]
        light = light + rng.uniform(0.1, 0.5) * np.exp(-((x - spot[0]) ** 2 + (y - spot[1]) ** 2) / width**2)
    return np.clip(light, 0.25, 2).astype(np.float32)


def shoot(light: Field, lens: Lens, rng: Rng) -> Bytes:
    """The picture of light, (H, W, 3) to about 1: (H, W) grey or (H, W, 3) BGR."""
    shape = (light.shape[0], light.shape[1])
    light = light * (_uneven(shape, rng) * np.float32(rng.uniform(*lens.gain)))[..., None]
    if rng.random() < 0.4:
        light = np.asarray(cv2.cvtColor(light.astype(np.float32), cv2.COLOR_BGR2GRAY)[..., None], np.float32)
    elif rng.random() < 0.5:
        light = light * rng.uniform(0.88, 1.1, 3).astype(np.float32)
    light = soften(light.astype(np.float32).squeeze(), rng.uniform(*lens.blur))
    if rng.random() < 0.4:
        light = light + rng.uniform(0.02, 0.12) * soften(np.maximum(light - 0.7, 0), 12)
    light = np.clip(light, 0, 1.6) ** np.float32(rng.uniform(0.8, 1.25))
    strength = np.float32(rng.uniform(*lens.noise))
    grain = rng.standard_normal(light.shape, np.float32)
    light = light + strength * grain * np.sqrt(0.3 + np.clip(light, 0, 1))
    picture: Bytes = np.clip(light * 255 + 0.5, 0, 255).astype(np.uint8)
    if rng.random() < 0.6:
        _, coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(50, 96))])
        return np.asarray(cv2.imdecode(coded, cv2.IMREAD_UNCHANGED), np.uint8)
    return picture
