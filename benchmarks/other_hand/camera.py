"""Light that falls on all, and what a lens and a sensor make of it."""

from __future__ import annotations

import math

import cv2
import numpy as np

from benchmarks.other_hand.canvas import Canvas
from benchmarks.other_hand.drawings import filled, share, stroke
from benchmarks.other_hand.fields import Field, Rng, axes, blurred, ramp, smoothstep, spread, tint
from benchmarks.other_hand.layout import Layout
from benchmarks.other_hand.outlines import across, around, curve, direction
from contour.geometry.arrays import Bytes, Float32s, Float64s


def light_up(canvas: Canvas, where: Layout, kind: str) -> None:
    """Uneven light, and shadows, glare and colours where the kind of picture has them."""
    rng, size, middle = canvas.rng, max(canvas.shape), 0.5 * np.array(canvas.shape[::-1])
    slope = ramp(canvas.shape, middle, direction(rng.uniform(0.0, 7.0))) / size
    spot = _away(canvas, middle + rng.uniform(-0.5, 0.5, 2) * size) / (rng.uniform(0.15, 0.5) * size)
    light = (1.0 + rng.uniform(0.0, 0.55) * slope) * (1.0 + rng.uniform(-0.2, 0.4) * np.exp(-0.5 * spot**2))
    light *= 1.0 - rng.uniform(0.05, 0.7) * (_away(canvas, middle) / size) ** 2
    if kind == "shadow":
        for _ in range(rng.integers(1, 4)):
            fallen = share(filled(canvas.shape, [_shadow(rng, where)]))
            light *= 1.0 - rng.uniform(0.4, 0.85) * blurred(fallen, spread(rng, 1.0, 50.0))
    canvas.dim(light)
    if kind == "glare":
        for _ in range(rng.integers(1, 4)):
            _glare(canvas, where)
    if canvas.coloured:
        canvas.picture *= tint(*np.exp(rng.standard_normal(3) * (0.4 if kind == "coloured" else 0.06)))
    if kind == "coloured":
        _colour(canvas, where, slope)


def _away(canvas: Canvas, place: Float64s) -> Float32s:
    x, y = axes(canvas.shape)
    return np.asarray(np.hypot(x - place[0], y - place[1]), np.float32)


def _shadow(rng: Rng, where: Layout) -> Float64s:
    """A band that may end, or something round."""
    width, middle = where.shape[1], where.middle + 0.3 * where.size * rng.standard_normal(2)
    if rng.random() < 0.4:
        knots = around(np.arange(7) * 2.0 * math.pi / 7.0, rng.uniform(0.05, 0.3, 7) * width)
        return middle + curve(knots, 80, closed=True)
    along = direction(rng.uniform(0.0, 7.0)) * width
    half = across(along) * rng.uniform(0.05, 0.35)
    one, other = (along * (2.0 if rng.random() < 0.5 else rng.uniform(0.0, 0.3)) for _ in range(2))
    far, narrower = 2.0 * along, half * rng.uniform(0.5, 1.2)
    return middle + np.stack([far + half, narrower - one, -half - other, far - half])


def _glare(canvas: Canvas, where: Layout) -> None:
    rng = canvas.rng
    place = where.edge(rng).point if rng.random() < 0.7 else rng.uniform(0.0, canvas.shape[::-1])
    along, long = direction(rng.uniform(0.0, 7.0)), spread(rng, 0.03, 0.2) * canvas.shape[1]
    ahead = ramp(canvas.shape, place, along) / long
    aside = ramp(canvas.shape, place, across(along)) / (long * rng.uniform(0.25, 1.0))
    glare = (rng.uniform(0.35, 1.6) * np.exp(-0.5 * (ahead**2 + aside**2))).astype(np.float32)[..., None]
    canvas.picture += glare * (rng.uniform(0.3, 1.0) + rng.uniform(0.0, 1.5) * canvas.picture)


def _colour(canvas: Canvas, where: Layout, slope: Field) -> None:
    """A table of a strong colour, and at times a second lamp of another from one side."""
    rng, table = canvas.rng, blurred(1.0 - share(where.comb), 1.0)[..., None]
    canvas.picture *= 1.0 + table * (tint(*np.exp(0.6 * rng.standard_normal(3))) - 1.0)
    if rng.random() < 0.4:
        falling = smoothstep(0.5 + rng.uniform(0.5, 1.5) * slope).astype(np.float32)[..., None]
        canvas.picture *= 1.0 + falling * (tint(*np.exp(0.5 * rng.standard_normal(3))) - 1.0)


def photograph(rng: Rng, light: Field, kind: str, pitch: float, top: float) -> Bytes:
    """The picture of light, (H, W) or (H, W, 3), in which walls' tops have that light."""
    sharp = blurred(light, rng.uniform(0.35, 0.85))
    if kind in {"defocus", "motion"}:
        smear = _out_of_focus(rng, pitch) if kind == "defocus" else _moved(rng, pitch)
        sharp = np.asarray(cv2.filter2D(sharp, -1, smear / smear.sum(), borderType=cv2.BORDER_REPLICATE), np.float32)
    gain = rng.uniform(150.0, 240.0) / max(top, 0.6)
    gain *= {"blown_out": rng.uniform(1.8, 4.5), "dim": rng.uniform(0.17, 0.23)}.get(kind, 1.0)
    levels = np.clip(sharp * gain + rng.uniform(0.0, 8.0), 0.0, 600.0 if kind == "blown_out" else 300.0)
    if kind == "gamma" or rng.random() < 0.25:
        strong = spread(rng, 0.4, 0.65) if rng.random() < 0.5 else spread(rng, 1.6, 2.5)
        levels = 255.0 * (levels / 255.0) ** (strong if kind == "gamma" else rng.uniform(0.75, 1.3))
    read, shot = spread(rng, 0.6, 4.0), rng.uniform(0.05, 0.25)
    levels += rng.standard_normal(levels.shape, np.float32) * np.sqrt(read**2 + shot**2 * levels)
    if kind == "row_noise":
        levels += _rows(rng, levels.shape[:2]).reshape(levels.shape[:2] + (1,) * (levels.ndim - 2))
    picture: Bytes = np.clip(np.round(levels), 0.0, 255.0).astype(np.uint8)
    if kind == "hot_pixels":
        count = int(spread(rng, 30.0, 6000.0))
        for level, number in ((255, count), (0, count // 2)):
            picture[tuple(rng.integers(0, size, number) for size in picture.shape[:2])] = level
    if kind == "jpeg" or rng.random() < 0.2:
        quality = 30 if kind == "jpeg" else int(rng.integers(70, 96))
        coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        picture = np.asarray(cv2.imdecode(coded, cv2.IMREAD_UNCHANGED), np.uint8)
    return picture


def _out_of_focus(rng: Rng, pitch: float) -> Float32s:
    """A disc of light, as a wide lens draws a point."""
    radius = min(6.0, max(1.0, pitch * rng.uniform(0.05, 0.2)))
    places = np.arange(-math.ceil(radius), math.ceil(radius) + 1)
    return np.clip(radius + 0.5 - np.hypot(places[:, None], places), 0.0, 1.0).astype(np.float32)


def _moved(rng: Rng, pitch: float) -> Float32s:
    """A line of light, as a point draws it that moves."""
    way = 0.5 * direction(rng.uniform(0.0, math.pi)) * pitch * rng.uniform(0.1, 0.33)
    half = math.ceil(float(np.abs(way).max())) + 2
    drawn = np.zeros((2 * half + 1, 2 * half + 1), np.uint8)
    stroke(drawn, half + np.stack([-way, way]), 255)
    return share(drawn)


def _rows(rng: Rng, shape: tuple[int, ...]) -> Float32s:
    """Noise of whole rows, at times with a hum, or of columns too, (H, W)."""
    strength = spread(rng, 2.0, 12.0)
    rows = strength * rng.standard_normal((shape[0], 1))
    if rng.random() < 0.4:
        rows += strength * np.sin(np.arange(shape[0])[:, None] * 2.0 * math.pi / rng.uniform(4.0, 60.0))
    columns = 0.5 * strength * rng.standard_normal(shape[1]) * (rng.random() < 0.4)
    return np.asarray(rows + columns, np.float32)
