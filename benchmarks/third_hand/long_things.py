"""Long things: hoses, cables, sleeves, zip ties, and bars of all kinds."""

from __future__ import annotations

import numpy as np

from benchmarks.third_hand.shapes import bevel, box, disc, dome, spine
from benchmarks.third_hand.stage import Patch, Spot, Stage
from benchmarks.third_hand.textures import F32, noise, ruler_tile, shaded, tiled
from contour.geometry.arrays import Float32s, Float64s


def _winding(st: Stage, sp: Spot, wild: float, whole: bool = False) -> Float64s:
    """A line, (N, 2) pixels, that starts on the block, or beyond the picture, and winds outward beyond the picture."""
    r = st.rng
    start = -sp.reach if r.random() < 0.5 or not whole else -2.2 * st.width
    along = np.linspace(start, 1.6 * st.width, 22 if start < -st.width else 14)
    side = np.cumsum(r.normal(0, wild * st.unit, along.size))
    side -= np.interp(0, along, side)
    c, s = np.cos(sp.angle), np.sin(sp.angle)
    return np.stack([sp.x + along * c - side * s, sp.y + along * s + side * c], 1)


def line_thing(st: Stage, sp: Spot, style: str) -> list[Patch]:
    """Round long things: a hose (ribbed or plain), cables, thin wires, a bundle, or a sleeve with an arm in it."""
    r, out = st.rng, []
    count = {"bundle": int(r.integers(3, 6)), "wire": int(r.integers(1, 4))}.get(style, 1)
    spans = {"hose": (12, 38), "cable": (4, 12), "bundle": (3, 7), "wire": (1.5, 3.5), "tube": (5, 11)}
    arm = style == "sleeve"
    path = _winding(st, sp, r.uniform(5, 20) if arm else r.uniform(8, 55), sp.reach > 1 and not arm)
    ribs, pitch = (r.uniform(0.04, 0.2) if r.random() < 0.6 else 0.0), r.uniform(4, 14) * st.unit
    normal = np.array([-np.sin(sp.angle), np.cos(sp.angle)])
    for i in range(count):
        half = max(1.4, r.uniform(*spans.get(style, (38, 85))) * st.unit)
        along, away = spine(st, path + normal * (i - count / 2) * half * r.uniform(1.8, 3.2))
        colour: Float32s = st.tone()
        relief = np.zeros_like(away)
        if style == "hose":
            relief = F32(ribs * half) * np.cos(along * F32(6.28 / pitch))
        elif style == "sleeve":
            fold = noise(r, st.x.shape, 50 * st.ss) * 6
            away = away + noise(r, st.x.shape, 40 * st.ss) * 3
            relief = F32(half * 0.07) * np.sin((along + fold * 3) * F32(4.0 / half)) + fold * F32(0.4)
            colour = shaded(colour, noise(r, st.x.shape, 1.6), 0.07)
        elif style == "cable" and r.random() < 0.3:
            colour = shaded(colour, np.sign(np.sin(along * F32(0.4 / st.unit) + away)), 0.35)
        sd = away - F32(half)
        out.append(
            Patch(
                sd,
                dome(sd, half, half * (1.0 if style == "sleeve" else 1.8)) + relief,
                colour,
                0.03 if style == "sleeve" else r.uniform(0.1, 0.8),
                1.0,
                style in ("wire", "cable"),
                0.5,
            )
        )
    return out


def zip_tie(st: Stage, sp: Spot) -> list[Patch]:
    """A zip tie: a thin toothed strip with its head on the block or off it."""
    r, half = st.rng, max(1.8, st.rng.uniform(2, 5) * st.unit)
    path = _winding(st, sp, r.uniform(4, 30))[: int(r.integers(3, 6))]
    along, away = spine(st, path)
    colour = np.full(3, r.choice([r.uniform(15, 45), r.uniform(200, 245)]), F32)
    sd = away - F32(half)
    teeth = F32(0.5) * np.sin(along * F32(2.2 / st.unit))
    u, v = st.frame(Spot(float(path[0, 0]), float(path[0, 1]), sp.angle, 0.0))
    head = box(u, v, half * 2.2, half * 2, 1)
    strip = Patch(sd, bevel(sd, 2, 1) + teeth, colour, 0.5, 1, True)
    return [strip, Patch(head, bevel(head, 3 * half, 2), colour, 0.4)]


def bar(st: Stage, sp: Spot, style: str) -> list[Patch]:
    """Straight long things: a ruler, strap, wood batten, foam strip or stop block."""
    r, shape = st.rng, st.x.shape
    halves = {"ruler": (13, 26), "strap": (12, 34), "batten": (18, 55), "foam": (25, 90), "stop": (22, 65)}[style]
    half = r.uniform(*halves) * st.unit
    across = style in ("strap", "ruler", "batten") and r.random() < 0.5 and sp.reach > 1
    tail = {"stop": (10, 110), "foam": (20, 200)}.get(style, (60, 900))
    length = 3 * st.width if across else sp.reach + r.uniform(*tail) * st.unit
    u, v = st.frame(sp, r.normal(0, 0.35))
    u = u + F32(1.5 * st.width if across else sp.reach)
    sd = box(u - F32(length / 2), v, length / 2, half, r.uniform(0.5, 0.4 * half) if style in ("foam", "stop") else 1)
    tone, turn = st.tone(), -sp.angle
    if style == "ruler":
        metal = np.full(3, r.uniform(120, 225), F32) if r.random() < 0.6 else tone
        ink = np.full(3, 20.0) if metal.mean() > 100 else np.full(3, 235.0)
        return [Patch(sd, bevel(sd, 3, 2), tiled(ruler_tile(metal, ink), u, v, 80 / (2 * half)), 0.4, lift=1)]
    if style == "strap":
        weave = np.sin(u * F32(1.3 / st.unit)) * np.sin(v * F32(2.1 / st.unit))
        stripe = np.where(np.abs(np.abs(v) - half * 0.6) < half * 0.1, F32(r.uniform(-1, 1)), F32(0))
        return [Patch(sd, bevel(sd, 3, 2) + weave * F32(0.4), shaded(tone, stripe + 0.2 * weave, 0.4), 0.05, 1, True)]
    if style == "batten":
        wood = np.array([0.55, 0.78, 1.0], F32) * F32(r.uniform(90, 230))
        grain = noise(r, shape, 160, 3, turn) * 0.6 + noise(r, shape, 300, 11, turn) * 0.6
        return [Patch(sd, bevel(sd, r.uniform(10, 35), 3), shaded(wood, grain, 0.12), 0.03)]
    if style == "foam":
        pores = np.minimum(noise(r, shape, 2.2 * st.ss), 0.5)
        return [Patch(sd, dome(sd, 9, r.uniform(10, 40)) + pores, shaded(tone, pores, r.uniform(0.05, 0.3)), 0.0)]
    high = r.uniform(15, 60)
    body = Patch(sd, bevel(sd, high, r.uniform(1.5, 7)), shaded(tone, noise(r, shape, 90, 1.6, turn), 0.05), 0.4)
    bore = disc(u - F32(length * r.uniform(0.35, 0.65)), v, half * r.uniform(0.2, 0.45))
    return [body, Patch(bore, np.zeros(shape, F32), np.full(3, 12, F32), 0, lift=high)]
