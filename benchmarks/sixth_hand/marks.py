"""Stains, lines and cuts, on a table or on the block, drawn into a picture, (H, W, 3)."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.other_hand.drawings import share
from benchmarks.other_hand.fields import Field, Rng, Shape
from benchmarks.sixth_hand.drawings import coverage, lobes
from benchmarks.sixth_hand.fields import noise, soften
from contour.geometry.arrays import Float64s


def random_level(rng: Rng) -> float:
    """A light from black, 0, to white, 1."""
    bands = ((0.02, 0.1), (0.08, 0.3), (0.2, 0.55), (0.45, 0.8), (0.75, 1.0))
    return float(rng.uniform(*bands[int(rng.integers(len(bands)))]))


def outline_spots(rings: list[Float64s], count: int, rng: Rng) -> Float64s:
    """So many places of the exterior, (count, 2) pixels."""
    index = rng.integers(len(rings[0]), size=count)
    part = rng.random((count, 1))
    return np.asarray(rings[0][index] * part + np.roll(rings[0], -1, axis=0)[index] * (1 - part))


def blot(shape: Shape, centre: Float64s, size: float, rng: Rng) -> Field:
    """A blot of about so many pixels about a place, (H, W) from 0 to 1, its edge soft."""
    ring = lobes(rng, 0.6) * size * rng.uniform(0.5, 1.4, 2) + centre
    return soften(coverage(shape, [ring]), rng.uniform(0.5, 4))


def stain(picture: Field, spots: Float64s, size: float, rng: Rng) -> None:
    """Stain the picture about places, (N, 2) pixels, by about so many pixels, in place."""
    shape = (picture.shape[0], picture.shape[1])
    for spot in spots:
        mask = blot(shape, spot, size * rng.uniform(0.3, 1.6), rng) * np.clip(0.6 + 0.4 * noise(shape, 25, rng), 0, 1)
        gain = rng.uniform(0.15, 0.8) if rng.random() < 0.7 else rng.uniform(1.2, 2)
        picture *= (1 + (gain - 1) * mask * rng.uniform(0.5, 1))[..., None]


def rule_lines(picture: Field, spots: Float64s, pitch: float, rng: Rng) -> None:
    """Draw chalk, ink and old cuts through places, (N, 2) pixels, in place; pitch in pixels."""
    shape = (picture.shape[0], picture.shape[1])
    for spot in spots:
        angle, length, bend = rng.uniform(0, 6.3), rng.uniform(3, 60) * pitch, rng.normal(0, 0.15)
        t = np.linspace(-1, 1, 40)
        points = spot + length * np.stack(
            [t * np.cos(angle) - bend * t * t * np.sin(angle), t * np.sin(angle) + bend * t * t * np.cos(angle)], axis=1
        )
        mask = np.zeros(shape, np.uint8)
        thick = int(rng.integers(1, 1 + max(2, int(pitch / 2))))
        cv2.polylines(mask, [np.round(points * 16).astype(np.int32)], False, 255, thick, cv2.LINE_AA, 4)
        worn = share(mask) * np.clip(rng.uniform(0.4, 1) + 0.3 * noise(shape, 3, rng), 0, 1)
        picture += (np.float32(random_level(rng)) - picture) * worn[..., None]
