"""Noise, colours and patterns over a picture: fields (H, W) float32, colours BGR from 0 to 1."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.other_hand.drawings import share
from benchmarks.other_hand.fields import Field, Rng, Shape
from contour.geometry.arrays import Float32s, Float64s


def clouds(rng: Rng, shape: Shape, size: float, octaves: int = 2) -> Float32s:
    """Smooth noise about from -1 to 1, (H, W) float32, its largest blobs so many pixels wide."""
    out = np.zeros(shape, np.float32)
    for octave in range(octaves):
        cell = max(1.5, size / 2**octave)
        small = rng.uniform(-1, 1, (int(shape[0] / cell) + 3, int(shape[1] / cell) + 3)).astype(np.float32)
        out += cv2.resize(small, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC) / 2**octave
    return np.asarray(out / 1.6, np.float32)


def blur(image: Float32s, sigma: float) -> Float32s:
    """The field, (H, W) float32, under a Gaussian of so many pixels, large ones through a smaller picture."""
    if sigma < 4:
        return np.asarray(cv2.GaussianBlur(image, (0, 0), max(sigma, 0.3)), np.float32)
    small = cv2.resize(image, None, fx=1 / 3, fy=1 / 3, interpolation=cv2.INTER_AREA)
    soft = cv2.GaussianBlur(small, (0, 0), sigma / 3)
    return np.asarray(cv2.resize(soft, image.shape[1::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def local(shape: Shape, at: Float64s, along: Float64s) -> tuple[Float32s, Float32s]:
    """How far pixels lie from a point along a unit vector, and across it, pixels, (H, W) float32 both."""
    x = np.arange(shape[1], dtype=np.float32)[None, :] - np.float32(at[0])
    y = np.arange(shape[0], dtype=np.float32)[:, None] - np.float32(at[1])
    c, s = np.float32(along[0]), np.float32(along[1])
    return c * x + s * y, c * y - s * x


def tiled(tile: Float32s, u: Float32s, v: Float32s, scale: float) -> Float32s:
    """A tile, (h, w) float32, repeated over places along and across, `scale` of which are one of its pixels, (H, W)
    float32.
    """
    x = np.mod(u / np.float32(scale), tile.shape[1]).astype(np.float32)
    y = np.mod(v / np.float32(scale), tile.shape[0]).astype(np.float32)
    return np.asarray(cv2.remap(tile, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP), np.float32)


def paint(rng: Rng, low: float = 0.03, high: float = 0.8, colour: float = 0.5) -> Float32s:
    """A colour, (3,) float32: of any light between two levels, often grey, at times of a strong colour."""
    level = low + (high - low) * rng.beta(0.7, 0.8)
    tint = rng.uniform(-1, 1, 3) * (colour if rng.random() < 0.55 else 0.08)
    return np.asarray(np.clip(level * (1 + tint - tint.mean()), 0.015, 0.97), np.float32)


def coat(shape: Shape, colour: Float32s, tone: Field | float = 1.0) -> Float32s:
    """A colour all over the picture, times a number or a field, (H, W, 3) float32."""
    field = np.broadcast_to(np.asarray(tone, np.float32), shape)
    return np.asarray(cv2.merge([field * np.float32(c) for c in colour]), np.float32)


def mix(base: Float32s, amount: Field, colour: Field) -> Float32s:
    """The base, (H, W, 3), with as much of a colour, (3,), as the amount, (H, W), says, clipped to 0 and 1."""
    part = np.clip(amount, 0, 1).astype(np.float32)[..., None]
    return np.asarray(base + part * (colour.astype(np.float32) - base), np.float32)


def weave(u: Float32s, v: Float32s, thread: float) -> Float32s:
    """The relief of woven threads, so many pixels wide, from -1 to 1, (H, W) float32."""
    k = np.float32(2 * np.pi / thread)
    return np.asarray(np.sin(k * u) * np.sin(k * v), np.float32)


def grain(rng: Rng, u: Float32s, v: Float32s, size: float) -> Float32s:
    """Long fibres along u, as in wood or brushed metal, about from -1 to 1, (H, W) float32."""
    tile = np.zeros((288, 576), np.float32)
    for sigma_u, sigma_v in ((14, 0.9), (40, 4)):
        noise = cv2.copyMakeBorder(rng.normal(0, 1, (256, 512)).astype(np.float32), 16, 16, 32, 32, cv2.BORDER_WRAP)
        noise = cv2.GaussianBlur(noise, (0, 0), sigmaX=sigma_u, sigmaY=sigma_v)
        tile += noise / noise.std()
    return tiled(tile[16:-16, 32:-32], u, v, size) / np.float32(2.2)


def text_tile(rng: Rng, lines: int) -> Float32s:
    """A tile of so many lines of letters, at times with bars, (40 a line, 320) float32, 1 where there is ink."""
    tile = np.zeros((40 * lines, 320), np.uint8)
    alphabet = np.array(list("ABCDEFGHIKLMNOPRSTUVXYZ0123456789 -./"))
    for row in range(lines):
        word = "".join(rng.choice(alphabet, int(rng.integers(4, 15))))
        font = int(rng.choice([cv2.FONT_HERSHEY_SIMPLEX, cv2.FONT_HERSHEY_DUPLEX, cv2.FONT_HERSHEY_TRIPLEX]))
        where = (int(rng.integers(2, 50)), 30 + 40 * row)
        cv2.putText(tile, word, where, font, rng.uniform(0.6, 1.15), 255, int(rng.integers(1, 4)), cv2.LINE_AA)
    if rng.random() < 0.4:
        for x in np.cumsum(rng.integers(2, 9, 40)):
            cv2.line(tile, (int(x), 4), (int(x), 30), 255, int(rng.integers(1, 4)))
    return share(tile)
