"""Slabs of closed foam on a bright table, drawn from their truth: bubbles of all sizes, torn edges, a hard shadow."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.geometry.rings import Contour

WIDTH, HEIGHT = 1000, 760
_FINER = 2

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Slab:
    """A picture, BGR (H, W, 3), uint8, with its true outline in pixels and how large most bubbles are, pixels."""

    picture: NDArray[np.uint8]
    outline: Contour
    bubble_px: float


def foam_slab(seed: int, *, heap: bool = False) -> Slab:
    """The slab of this seed: a rectangle or an L, sawn along straight lines, its skin torn by a few pixels; or a round
    `heap` that looks like it.
    """
    rng = np.random.default_rng([seed, 77])
    bubble = float(rng.uniform(14.0, 34.0))
    wide, high = WIDTH * _FINER, HEIGHT * _FINER
    y, x = np.mgrid[0:high, 0:wide].astype(np.float32) / _FINER
    body = _heap(rng, x, y) if heap else _sawn(rng, x, y)
    torn = cv2.GaussianBlur(rng.standard_normal(body.shape).astype(np.float32), (0, 0), 0.15 * bubble * _FINER)
    inside = cv2.distanceTransform(body, cv2.DIST_L2, 5) - cv2.distanceTransform(1 - body, cv2.DIST_L2, 5)
    body = (inside + float(rng.uniform(0.04, 0.1)) * bubble * _FINER * torn / torn.std() > 0).astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(body, connectivity=4)
    body = (labels == 1 + int(np.argmax(stats[1:count, cv2.CC_STAT_AREA]))).astype(np.uint8)
    table = np.float32(rng.uniform(170, 215)) * (1.0 - 0.25 * (((x - 450) / 900) ** 2 + ((y - 330) / 800) ** 2))
    light = _with_shadow(rng, table, body)
    light = np.where(body > 0, _skin(rng, body.shape, bubble) * table / table.max(), light)
    small = cv2.GaussianBlur(
        cv2.resize(light, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA), (0, 0), float(rng.uniform(0.5, 1.0))
    )
    tint = 1.0 + rng.uniform(-0.03, 0.03, 3)
    seen = small[:, :, None] * tint + rng.normal(0.0, float(rng.uniform(0.5, 2.0)), (HEIGHT, WIDTH, 3))
    chains, _ = cv2.findContours(body, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    ring = max(chains, key=cv2.contourArea)[:, 0].astype(np.float64)
    outline = Contour((ring + 0.5) / _FINER - 0.5)
    return Slab(np.asarray(np.clip(np.rint(seen), 0, 255), np.uint8), outline, bubble)


def _sawn(rng: np.random.Generator, x: Floats, y: Floats) -> NDArray[np.uint8]:
    angle = float(rng.uniform(0, np.pi))
    u = (x - WIDTH / 2) * np.cos(angle) + (y - HEIGHT / 2) * np.sin(angle)
    v = -(x - WIDTH / 2) * np.sin(angle) + (y - HEIGHT / 2) * np.cos(angle)
    a = float(rng.uniform(200, 260))
    b = a * float(rng.uniform(0.6, 0.9))
    box = (np.abs(u) < a) & (np.abs(v) < b)
    if rng.random() < 0.5:
        box &= ~((u > float(rng.uniform(-0.2, 0.3)) * a) & (v > float(rng.uniform(-0.2, 0.3)) * b))
    return box.astype(np.uint8)


def _heap(rng: np.random.Generator, x: Floats, y: Floats) -> NDArray[np.uint8]:
    angle = np.arctan2(y - HEIGHT / 2, x - WIDTH / 2)
    bulges = sum(float(rng.uniform(0, 14)) * np.cos(k * angle + float(rng.uniform(0, 6.3))) for k in range(2, 6))
    return np.asarray(np.hypot(x - WIDTH / 2, y - HEIGHT / 2) < 220.0 + bulges, np.uint8)


def _with_shadow(rng: np.random.Generator, table: Floats, body: NDArray[np.uint8]) -> Floats:
    """The table with what the slab keeps lamps from: hard beside it, or soft."""
    light = table.copy()
    for _ in range(int(rng.integers(0, 3))):
        way, far = float(rng.uniform(0, 2 * np.pi)), float(rng.uniform(3, 16)) * _FINER
        moved = np.float32([[1, 0, far * np.cos(way)], [0, 1, far * np.sin(way)]])
        cast = cv2.warpAffine(body, moved, body.shape[::-1]).astype(np.float32)
        soft = cv2.GaussianBlur(cv2.dilate(cast, np.ones((3, 3))), (0, 0), float(rng.uniform(0.8, 6.0)) * _FINER)
        light *= 1.0 - float(rng.uniform(0.2, 0.55)) * soft
    return light


def _skin(rng: np.random.Generator, shape: tuple[int, ...], bubble: float) -> Floats:
    """Bubbles in relief, of all sizes and drawn out, lit from a side: dark metal with glints."""
    height = np.zeros(shape, np.float32)
    for size, weight in ((1.0, 1.0), (0.5, 0.5), (0.2, 0.2)):
        noise = rng.standard_normal((int(shape[0] / 2), int(shape[1] / 2))).astype(np.float32)
        along = float(rng.uniform(0.5, 0.9)) * size * bubble * _FINER / 4
        layer = cv2.GaussianBlur(noise, (0, 0), along, sigmaY=along * float(rng.uniform(0.4, 0.8)))
        layer = cv2.resize(layer, shape[::-1], interpolation=cv2.INTER_CUBIC)
        height += np.float32(weight * size) * np.abs(layer / layer.std())
    way = float(rng.uniform(0, 2 * np.pi))
    slope = cv2.Sobel(height, cv2.CV_32F, 1, 0, ksize=3) * np.cos(way) + cv2.Sobel(
        height, cv2.CV_32F, 0, 1, ksize=3
    ) * np.sin(way)
    slope /= slope.std()
    return np.clip(float(rng.uniform(90, 130)) + 35 * slope + 25 * np.maximum(slope - 1, 0) ** 2, 8, 250)
