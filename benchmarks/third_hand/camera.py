"""Lamps with their shadows, and what a lens and a sensor make of the light."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from benchmarks.other_hand.fields import Field, Rng
from benchmarks.third_hand.plans import Plan
from benchmarks.third_hand.stage import Spot, Stage
from benchmarks.third_hand.textures import F32
from contour.geometry.arrays import Bytes, Float32s


class Lamp(NamedTuple):
    """Azimuth and elevation, radians, the lamp's share of the light, and how soft its shadows are."""

    azimuth: float
    elevation: float
    strength: float
    softness: float


def lamps_of(rng: Rng, style: str | None) -> list[Lamp]:
    """One lamp, hard or soft, or two."""
    first = rng.uniform(0, 2 * np.pi)
    if style == "hard":
        return [Lamp(first, rng.uniform(0.5, 1.0), rng.uniform(0.55, 0.85), rng.uniform(0.03, 0.1))]
    if style == "two":
        turn = rng.uniform(0.8, 5.4)
        low, high = [0.5, 0.3, 0.03], [1.0, 0.45, 0.2]
        return [Lamp(first + k * turn, *rng.uniform(low, high)) for k in (0, 1)]
    return [Lamp(first, rng.uniform(0.7, 1.3), rng.uniform(0.25, 0.6), rng.uniform(0.3, 1.0))]


def light(st: Stage, lamps: list[Lamp]) -> Float32s:
    """The stage's light, (H, W, 3) float32, to 255 and over: from all around less what stands in its way, lamps with
    their shadows, and highlights.
    """
    gx, gy = (np.asarray(cv2.Sobel(st.relief, cv2.CV_32F, *d, ksize=3, scale=st.ss / 8), F32) for d in ((1, 0), (0, 1)))
    nz = 1 / np.sqrt(gx * gx + gy * gy + 1)
    wide = cv2.GaussianBlur(cv2.resize(st.ground, None, fx=0.25, fy=0.25), (0, 0), 0.12 * st.depth * st.ss + 1)
    deep = np.clip((cv2.resize(wide, st.x.shape[::-1]) - st.ground) / F32(st.depth + 1), 0, 1)
    total = F32(1 - sum(lamp.strength for lamp in lamps)) * (1 - F32(0.7) * deep) * (F32(0.5) + F32(0.5) * nz)
    shine = np.zeros_like(total)
    for lamp in lamps:
        lx, ly, lz = (
            np.cos(lamp.azimuth) * np.cos(lamp.elevation),
            np.sin(lamp.azimuth) * np.cos(lamp.elevation),
            np.sin(lamp.elevation),
        )
        lit = _lit(st, lamp) * F32(lamp.strength)
        total += lit * np.clip((F32(lz) - gx * F32(lx) - gy * F32(ly)) * nz / F32(lz), 0, 2.2)
        half = np.array([lx, ly, lz + 1.0]) / np.sqrt(lx * lx + ly * ly + (lz + 1) ** 2)
        shine += lit * np.clip((F32(half[2]) - gx * F32(half[0]) - gy * F32(half[1])) * nz, 0, 1) ** 36
    return np.asarray(st.albedo * total[..., None] + (F32(190) * st.gloss * shine)[..., None], F32)


def _lit(st: Stage, lamp: Lamp) -> Float32s:
    """How much of a lamp's light falls on each pixel, (H, W) float32, 1 all: marched towards it over the heights."""
    low = cv2.resize(st.ground, (st.width, st.height), interpolation=cv2.INTER_AREA)
    slope, high = float(np.tan(lamp.elevation)), float(low.max())
    blocked = np.zeros_like(low)
    reach = min(high / slope, 0.35 * st.width)
    for far in np.arange(1.0, reach, max(1.6, reach / 45)):
        move = np.array([[1, 0, -far * np.cos(lamp.azimuth)], [0, 1, -far * np.sin(lamp.azimuth)]], F32)
        seen = cv2.warpAffine(low, move, (st.width, st.height), borderMode=cv2.BORDER_REPLICATE)
        np.maximum(blocked, (seen - low - F32(far * slope)) / F32(1.5 + lamp.softness * far) + F32(0.3), out=blocked)
    lit = 1 - np.minimum(blocked, 1)
    return np.asarray(cv2.resize(cv2.GaussianBlur(lit, (0, 0), 0.8), st.x.shape[::-1]), F32)


def photograph(st: Stage, lit: Field, plan: Plan) -> Bytes:
    """The picture of the stage's light, (height, width) grey or (height, width, 3) BGR: light that is uneven, glare,
    exposure, blur, noise and JPEG.
    """
    r, w, h = st.rng, st.width, st.height
    u, v = st.frame(Spot(w / 2, h / 2, r.uniform(0, 6.3), 0))
    fall = 1 + F32(r.normal(0, 0.22)) * u / w - F32(r.uniform(0, 0.35)) * (u * u + v * v) / (w * w)
    lit = lit * np.maximum(fall, 0.3)[..., None]
    if plan.glare or r.random() < 0.12:
        u, v = st.frame(Spot(w * r.random(), h * r.random(), r.uniform(0, 3), 0))
        blob = np.exp(-(u * u * 2 + v * v) / F32(2 * (r.uniform(0.08, 0.25) * w) ** 2))
        lit = lit * (1 + F32(r.uniform(0.2, 1.2)) * blob[..., None]) + F32(r.uniform(10, 80)) * blob[..., None]
    exposed = cv2.resize(lit, (w, h), interpolation=cv2.INTER_AREA) * F32(r.uniform(0.75, 1.3))
    seen: Field = np.asarray(cv2.GaussianBlur(exposed, (0, 0), r.uniform(0.3, 1.1)), F32)
    if r.random() < 0.5:
        seen = 255 * (1 - np.exp(-np.maximum(seen, 0) / 255 * 1.6)) / (1 - np.exp(-1.6))
    seen = seen * (1 + r.normal(0, 0.03, 3)) + r.uniform(0, 12)
    if r.random() < 0.45:
        seen = seen @ np.array([0.114, 0.587, 0.299])
    grain = r.standard_normal(seen.shape, F32) * F32(r.uniform(0.6, 6))
    picture: Bytes = np.clip(seen + grain * (0.5 + np.sqrt(np.maximum(seen, 0) / 255)), 0, 255).astype(np.uint8)
    if r.random() < 0.7:
        coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, int(r.integers(45, 96))])[1]
        picture = np.asarray(cv2.imdecode(coded, cv2.IMREAD_UNCHANGED), np.uint8)
    return picture
