"""Parts of examples, on other tables, beneath other things, in other light, and as other cameras would see them."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from benchmarks.segmentation.examples import Example
from benchmarks.segmentation.patterns import lay, noise, pattern
from contour.geometry.arrays import Bools, Bytes, Float32s, median, quantile
from contour.image.opencv import grey

SIZE = 192
_SURE = 0.9


class Crop(NamedTuple):
    """What the network is shown, and what it is to say of it: shares of a wall's top, comb, a thing, each (SIZE, SIZE),
    float32.
    """

    light: Float32s
    wall: Float32s
    comb: Float32s
    thing: Float32s


def crop(one: Example, rng: np.random.Generator) -> Crop:
    """A part of the example, drawn at random."""
    light, (wall, comb, thing) = _part(one, rng)
    if rng.random() < 0.3:
        light = _of_other_foil(light, comb, rng)
    if rng.random() < 0.5:
        gone = _cut_out(rng) if rng.random() < 0.4 else np.zeros_like(comb)
        wall, comb = wall * (1.0 - gone), comb * (1.0 - gone)
        light = _on_other_table(light, comb, thing, gone, rng, dark=one.dark)
    if rng.random() < 0.2:
        light, thing = _covered(light, thing, rng)
    light = (_seen(light, rng) - np.float32(one.mean)) / np.float32(one.spread)
    light = light * np.float32(math.exp(rng.uniform(-0.4, 0.4))) + np.float32(rng.uniform(-0.5, 0.5))
    if rng.random() < 0.08:
        light = -light
    return Crop(light, wall * (1.0 - thing), comb * (1.0 - thing), thing)


def _part(one: Example, rng: np.random.Generator) -> tuple[Float32s, list[Float32s]]:
    """Light of the picture, or of one of its channels, about a place that mostly is near the outline, turned, mirrored
    and sized at random; and the shares of walls, comb and things there.
    """
    channel = grey(one.picture)
    if one.picture.ndim == 3 and rng.random() < 0.3:
        channel = np.ascontiguousarray(one.picture[..., int(rng.integers(3))])
    rows, columns = np.nonzero(_places(one.comb[::4, ::4], rng.random()))
    place = int(rng.integers(len(rows)))
    middle = 4.0 * np.array([columns[place], rows[place]]) + rng.uniform(-60.0, 60.0, 2)
    matrix = cv2.getRotationMatrix2D(
        middle.tolist(), float(rng.uniform(0.0, 360.0)), math.exp(rng.uniform(-0.12, 0.12))
    )
    matrix[:, 2] += 0.5 * SIZE - middle
    if rng.random() < 0.5:
        matrix = np.diag([-1.0, 1.0]) @ matrix + np.array([[0.0, 0.0, SIZE - 1.0], [0.0, 0.0, 0.0]])
    shares = [_moved(plane, matrix, cv2.INTER_LINEAR) / np.float32(255.0) for plane in (one.wall, one.comb, one.thing)]
    return _moved(channel, matrix, cv2.INTER_CUBIC), shares


def _places(comb: Bytes, which: float) -> Bools:
    """Seven of ten times the outline, else comb, or all else."""
    if which < 0.7:
        return cv2.morphologyEx(comb, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 100
    return comb > 100 if which < 0.85 else comb < 100


def _moved(plane: Bytes, matrix: np.ndarray[tuple[int, ...], np.dtype[np.float64]], how: int) -> Float32s:
    moved = cv2.warpAffine(plane, matrix, (SIZE, SIZE), flags=how, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(moved, np.float32)


def _of_other_foil(light: Float32s, comb: Float32s, rng: np.random.Generator) -> Float32s:
    """With walls that stand out less, or more here than there."""
    within = light[comb > _SURE]
    if len(within) < 50:
        return light
    middle = np.float32(np.mean(within))
    strength = 1.0 + np.float32(rng.uniform(0.0, 0.5)) * noise(rng, SIZE, float(rng.uniform(6.0, 40.0)))
    strength = np.float32(rng.uniform(0.35, 1.2)) * np.clip(strength, 0.3, 1.7)
    return np.asarray(light + comb * (strength - 1.0) * (light - middle), np.float32)


def _cut_out(rng: np.random.Generator) -> Float32s:
    """A hole or a notch, if it lies in comb: a disc or something with corners, some cells wide."""
    middle, mask = rng.uniform(0.2 * SIZE, 0.8 * SIZE, 2), np.zeros((SIZE, SIZE), np.uint8)
    if rng.random() < 0.5:
        axes = rng.uniform(18.0, 60.0, 2).astype(int) * 8
        cv2.ellipse(mask, (middle * 8).astype(int).tolist(), axes.tolist(), 0.0, 0.0, 360.0, 255, -1, cv2.LINE_AA, 3)
    else:
        sides = rng.uniform(35.0, 120.0, 2).tolist()
        corners = cv2.boxPoints((middle.tolist(), sides, float(rng.uniform(0.0, 180.0))))
        lay(mask, corners, 255)
    return mask.astype(np.float32) / np.float32(255.0)


def _on_other_table(
    light: Float32s, comb: Float32s, thing: Float32s, gone: Float32s, rng: np.random.Generator, *, dark: bool
) -> Float32s:
    """With another table, mostly about as light as walls, mostly in the shade that the block casts on its own; in what
    is gone of the block in shade beside its rim.
    """
    out, within = (1.0 - comb) * (1.0 - thing), light[comb > _SURE]
    walls, floors = 160.0, 60.0
    if len(within) > 50:
        walls, floors = (quantile(within, share) for share in ((0.05, 0.8) if dark else (0.95, 0.1)))
    level = rng.uniform(0.5, 1.1) * max(floors, 60.0) if dark else rng.uniform(0.55 * walls, 1.2 * walls)
    if not dark and rng.random() < 0.3:
        level = rng.uniform(floors, max(1.2 * walls, floors + 1.0))
    table = np.float32(level) * (1.0 + np.float32(rng.uniform(0.03, 0.4)) * pattern(rng, SIZE))
    rim = np.exp(-cv2.distanceTransform((gone > 0.5).astype(np.uint8), cv2.DIST_L2, 5) / float(rng.uniform(2.0, 12.0)))
    table = table * np.where(gone > 0.0, 1.0 - np.float32(rng.uniform(0.1, 0.6)) * rim, 1.0)
    there = out * (1.0 - gone)
    own = light[there > _SURE]
    if len(own) > 50 and rng.random() < 0.7:
        shade = cv2.GaussianBlur(light * there, (0, 0), 3.0) / np.maximum(cv2.GaussianBlur(there, (0, 0), 3.0), 1e-3)
        usual = median(own)
        shade = np.where(gone > 0.0, np.float32(usual), shade)
        table = table * np.clip(shade / max(usual, 1.0), 0.35, 1.1)
    return np.asarray(light * (1.0 - out) + np.clip(table, 0.0, 255.0) * out, np.float32)


def _covered(light: Float32s, thing: Float32s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """Beneath a strip or something with corners, half of them with a shadow."""
    middle, mask = rng.uniform(0.0, SIZE, 2), np.zeros((SIZE, SIZE), np.uint8)
    if rng.random() < 0.6:
        size = float(rng.uniform(20.0, 200.0)), float(rng.uniform(8.0, 50.0))
        corners = cv2.boxPoints((middle.tolist(), size, float(rng.uniform(0.0, 180.0))))
    else:
        corners = middle + rng.uniform(-50.0, 50.0, (6, 2))
    lay(mask, corners, 255)
    over = mask.astype(np.float32) / np.float32(255.0)
    if rng.random() < 0.5:
        away = tuple(rng.integers(-5, 6, 2).tolist())
        cast = np.roll(cv2.GaussianBlur(over, (0, 0), float(rng.uniform(1.0, 5.0))), away, (0, 1))
        light = light * (1.0 - np.float32(rng.uniform(0.1, 0.6)) * cast)
    printed = rng.uniform(0.0, 0.25) * (rng.random() < 0.7)
    body = np.float32(rng.uniform(15.0, 240.0)) * (1.0 + np.float32(printed) * pattern(rng, SIZE))
    return np.asarray(light * (1.0 - over) + body * over, np.float32), np.maximum(thing, over)


def _seen(light: Float32s, rng: np.random.Generator) -> Float32s:
    """In uneven light, moved, out of focus, brightened, blown out and noisy."""
    if rng.random() < 0.3:
        lamp = np.clip(noise(rng, SIZE, float(rng.uniform(40.0, 200.0))), -2.0, 2.0)
        light = light * (1.0 + np.float32(rng.uniform(0.05, 0.4)) * lamp)
    if rng.random() < 0.15:
        far = int(rng.integers(3, 8))
        line = np.pad(np.ones((1, far), np.float32), far)
        turn = cv2.getRotationMatrix2D((1.5 * far, float(far)), float(rng.uniform(0.0, 180.0)), 1.0)
        smear = cv2.warpAffine(line, turn, line.shape[::-1])
        light = np.asarray(cv2.filter2D(light, -1, smear / smear.sum()), np.float32)
    if rng.random() < 0.4:
        light = np.asarray(cv2.GaussianBlur(light, (0, 0), float(rng.uniform(0.3, 1.3))), np.float32)
    light = np.clip(light, 0.0, 255.0)
    if rng.random() < 0.3:
        light = 255.0 * (light / np.float32(255.0)) ** np.float32(math.exp(rng.uniform(-0.8, 0.8)))
    if rng.random() < 0.15:
        light = np.minimum(light * np.float32(rng.uniform(1.0, 2.2)), 255.0)
    if rng.random() < 0.5:
        light = light + np.float32(math.exp(rng.uniform(0.0, 2.8))) * rng.standard_normal(light.shape, np.float32)
    if rng.random() < 0.1:
        light = light + np.float32(rng.uniform(1.0, 6.0)) * rng.standard_normal((SIZE, 1), np.float32)
    if rng.random() < 0.15:
        coded = cv2.imencode(
            ".jpg", np.clip(light, 0.0, 255.0).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(20, 80))]
        )
        light = cv2.imdecode(coded[1], cv2.IMREAD_GRAYSCALE)
    return np.asarray(light, np.float32)
