"""Compact things: weights, magnets, vacuum cups, clamps and hand tools."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.third_hand.long_things import line_thing
from benchmarks.third_hand.shapes import bevel, box, capsule, disc, dome
from benchmarks.third_hand.stage import Patch, Spot, Stage
from benchmarks.third_hand.textures import F32, noise, shaded


def puck(st: Stage, sp: Spot, style: str) -> list[Patch]:
    """Compact things: a weight (round or square, with a knob), a magnet, or a vacuum cup with its tube."""
    r = st.rng
    size = r.uniform(*{"weight": (30, 95), "magnet": (14, 42), "cup": (24, 70)}[style]) * st.unit
    u, v = st.frame(sp, r.normal(0, 0.5))
    u = u + F32(sp.reach - size)
    round_ = r.random() < 0.6 or style == "cup"
    sd = disc(u, v, size) if round_ else box(u, v, size, size * r.uniform(0.45, 1.3), size * r.uniform(0.02, 0.2))
    high = size * r.uniform(0.25, 0.8)
    brushed = noise(r, st.x.shape, 70, 2, r.uniform(0.1, 3))
    tone = st.tone()
    out = [Patch(sd, bevel(sd, high, r.uniform(2, 0.25 * size)), shaded(tone, brushed, 0.04), r.uniform(0.1, 0.9))]
    if style == "cup":
        ring = F32(size * 0.06) * np.cos(sd * F32(18 / size))
        out = [Patch(sd, dome(sd, size * 0.8, high * 0.5) + ring, tone * F32(0.8), 0.3)]
    inner = disc(u, v, size * r.uniform(0.18, 0.45))
    if style == "magnet" and r.random() < 0.5:
        out.append(Patch(inner, np.zeros_like(u), tone * F32(0.25), 0, lift=high))
    elif style != "magnet":
        out.append(Patch(inner, dome(inner, size * 0.2, size * 0.3), st.tone(), 0.7, lift=high * 0.6))
    if style == "cup":
        back = sp.reach - size
        centre = Spot(sp.x - back * np.cos(sp.angle), sp.y - back * np.sin(sp.angle), sp.angle, 0.0)
        out += line_thing(st, centre, "tube")
    return out


def clamp(st: Stage, sp: Spot, style: str) -> list[Patch]:
    """A clamp: an arm from outside with a screw or a rubber tip, its foot or its handle beyond the edge."""
    r, k = st.rng, st.rng.uniform(0.7, 1.7) * st.unit
    u, v = st.frame(sp, r.normal(0, 0.25))
    u = u + F32(sp.reach)
    tip, half, out = r.uniform(12, 26) * k, r.uniform(9, 22) * k, sp.reach + r.uniform(30, 150) * k
    metal, paint, high, toggle = np.full(3, r.uniform(60, 215), F32), st.tone(), r.uniform(14, 34), style == "toggle"
    taper = v * (1 + F32(r.uniform(0, 0.35)) * np.clip(1 - u / F32(out), 0, 1))
    arm = box(u - F32(out / 2 + tip * 0.4), taper, out / 2, half, half * 0.4)
    pad, screw = disc(u - F32(tip), v, tip), disc(u - F32(tip), v, tip * r.uniform(0.4, 0.7))
    foot = box(u - F32(out + 20 * k), v, r.uniform(22, 50) * k, r.uniform(24, 55) * k, 5 * k)
    parts = [
        Patch(pad, bevel(pad, 8, 4), np.full(3, r.uniform(15, 60), F32) if toggle else metal, 0.2),
        Patch(foot, bevel(foot, high, 3), metal if toggle else paint, 0.4),
        Patch(arm, bevel(arm, high, half * r.uniform(0.15, 0.7)), metal if toggle else paint, 0.6, lift=8),
        Patch(screw, dome(screw, tip * 0.3, 14), metal * F32(0.8), 0.9, lift=high + 4),
    ]
    if toggle:
        way, swing = r.uniform(60, 150) * k, r.normal(0, 0.5)
        grip = capsule(u, v, (out, 0), (out + way * np.cos(swing), way * np.sin(swing)), r.uniform(7, 14) * k)
        parts.append(Patch(grip, dome(grip, 9 * k, 16 * k), paint, 0.5, lift=high))
    elif r.random() < 0.5:
        tee = capsule(u, v, (tip - 30 * k, 20 * k), (tip + 30 * k, -20 * k), 3.5 * k)
        parts.append(Patch(tee, dome(tee, 3.5 * k), metal, 0.9, lift=high + 22))
    return parts


def tool(st: Stage, sp: Spot, style: str) -> list[Patch]:
    """A hand tool: a spanner, knife or pen, either end first."""
    r, k = st.rng, st.rng.uniform(0.7, 1.5) * st.unit
    u, v = st.frame(sp, r.normal(0, 0.6))
    u = (u + F32(sp.reach)) / F32(k)
    v, length = v / F32(k), r.uniform(150, 330)
    steel, tone = np.full(3, r.uniform(70, 220), F32), st.tone()
    if style == "spanner":
        head, jaw = r.uniform(20, 32), r.uniform(8, 14)
        mouth = np.maximum(disc(u - F32(head), v, head), -box(u, v, head * 1.1, jaw, 3))
        eye = np.maximum(disc(u - F32(length), v, head * 0.8), -disc(u - F32(length), v, head * 0.45))
        shank = box(u - F32(length / 2 + head * 0.6), v, length / 2 - head * 0.7, head * 0.38, 4)
        sd = np.minimum(np.minimum(mouth, eye), shank) * F32(k)
        return [Patch(sd, bevel(sd, 9, r.uniform(2, 5)), steel, 0.9)]
    if style == "knife":
        blade = np.maximum(box(u - 45, v, 45, 10), (v * 0.8 - u * 0.6) - 2) * F32(k)
        grip = box(u - F32(80 + length / 2), v, length / 2, r.uniform(13, 20), 9) * F32(k)
        ribs = np.sin(u * F32(0.7)) * (np.abs(u - 110) < 22)
        edge = Patch(blade, bevel(blade, 2, 5), steel, 1.2, lift=3)
        return [edge, Patch(grip, dome(grip, 8 * k, 11) + ribs, tone, 0.4)]
    r0 = r.uniform(5, 9)
    sd = np.where(u < 22, np.abs(v) - u * F32(r0 / 22), box(u - F32(length / 2), v, length / 2, r0, 3)) * F32(k)
    sd = np.where(u < 0, cv2.magnitude(u, v) * F32(k), sd)
    colour = np.where(((u > 22) & (u < length * 0.72))[..., None], tone, st.tone() * F32(0.8))
    return [Patch(sd, dome(sd, r0 * k, r0 * 1.6 * k), colour.astype(F32), 0.8)]
