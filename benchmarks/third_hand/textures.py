"""Noise, colours that vary, and prints that repeat; fields are (H, W), colours BGR to 255."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.other_hand.fields import Field, Rng
from contour.geometry.arrays import Bytes, Float32s

F32 = np.float32


def noise(rng: Rng, shape: tuple[int, ...], cell: float, cell_y: float | None = None, angle: float = 0.0) -> Float32s:
    """Smooth noise of about unit spread, (H, W) float32, its grains so many pixels wide and, unless told, as high,
    turned by radians.
    """
    h, w = shape[:2]
    side = int(np.hypot(h, w)) + 8 if angle else 0
    bh, bw = (side, side) if angle else (h, w)
    small = rng.standard_normal((max(2, int(bh / (cell_y or cell)) + 2), max(2, int(bw / cell) + 2))).astype(F32)
    big = cv2.resize(small, (bw, bh), interpolation=cv2.INTER_LINEAR if cell < 3 else cv2.INTER_CUBIC)
    if not angle:
        return np.asarray(big, F32)
    turn = np.asarray(cv2.getRotationMatrix2D((bw / 2, bh / 2), np.degrees(angle), 1.0), np.float64)
    turn[:, 2] += [(w - bw) / 2, (h - bh) / 2]
    return np.asarray(cv2.warpAffine(big, turn, (w, h), borderMode=cv2.BORDER_REFLECT), F32)


def shaded(colour: Field, field: Field, amount: float) -> Float32s:
    """The colour, (3,) or (H, W, 3), made lighter and darker by so much of a field, (H, W); (H, W, 3) float32."""
    return np.asarray(np.clip(1 + F32(amount) * field, 0.1, 2)[..., None] * np.asarray(colour, F32), F32)


def tiled(tile: Bytes, u: Float32s, v: Float32s, scale: float) -> Float32s:
    """A tile, (h, w, 3), repeated over places along and across, pixels, each of which is `scale` of its own; (H, W, 3)
    float32.
    """
    h, w = tile.shape[:2]
    mu, mv = np.mod(u * F32(scale), F32(w)), np.mod(v * F32(scale) + F32(h / 2), F32(h))
    return cv2.remap(tile, mu, mv, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP).astype(F32)


def text_tile(rng: Rng, ground: Field, ink: Field, lines: int) -> Bytes:
    """A tile of lines of print, (40 a line, 420, 3)."""
    tile = np.empty((40 * lines, 420, 3), np.uint8)
    tile[:] = ground
    for k in range(lines):
        words = "".join(chr(c) for c in rng.integers(48, 90, int(rng.integers(4, 20))))
        size = float(rng.uniform(0.5, 1.1))
        at, font = (int(rng.integers(4, 80)), 40 * k + 29), int(rng.integers(0, 4))
        cv2.putText(tile, words, at, font, size, ink.tolist(), 2, cv2.LINE_AA)
    return tile


def ruler_tile(ground: Field, ink: Field) -> Bytes:
    """A tile of a ruler's scale, (80, 1000, 3)."""
    tile = np.empty((80, 1000, 3), np.uint8)
    tile[:] = ground
    for k in range(100):
        long = 30 if k % 10 == 0 else 20 if k % 5 == 0 else 12
        cv2.line(tile, (k * 10, 2), (k * 10, long), ink.tolist(), 2, cv2.LINE_AA)
        if k % 10 == 0:
            cv2.putText(tile, str(k // 10 + 1), (k * 10 + 3, 56), 0, 0.8, ink.tolist(), 2, cv2.LINE_AA)
    return tile
