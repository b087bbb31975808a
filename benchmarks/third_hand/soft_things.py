"""Things that lie flat or in folds: tape, sheets, cloths and hands."""

from __future__ import annotations

import numpy as np

from benchmarks.third_hand.shapes import bevel, box, capsule, dome
from benchmarks.third_hand.stage import Patch, Spot, Stage
from benchmarks.third_hand.textures import F32, noise, shaded, text_tile, tiled
from contour.geometry.arrays import Float32s


def tape(st: Stage, sp: Spot, style: str) -> list[Patch]:
    """One or two strips: opaque, clear, printed, or masking tape, which is torn and creped."""
    r, out = st.rng, []
    for _ in range(1 + (r.random() < 0.3)):
        half, length = r.uniform(11, 42) * st.unit, sp.reach + r.uniform(30, 330) * st.unit
        u, v = st.frame(sp, r.normal(0, 0.25))
        torn = noise(r, st.x.shape, 5, 5) * F32(r.uniform(0.2, 2.5) if style != "opaque" else 0.2)
        sd = box(u + F32(sp.reach - length / 2) + torn, v, length / 2, half)
        colour: Float32s = st.tone()
        wrinkle = noise(r, st.x.shape, 30, 9, sp.angle + 0.3) * F32(r.uniform(0.1, 0.8))
        if style == "masking":
            base = np.array([r.uniform(110, 170), r.uniform(170, 215), r.uniform(195, 240)], F32)
            colour = shaded(base, noise(r, st.x.shape, 2.5, 14, -sp.angle), 0.05)
        elif style == "printed":
            ink = np.clip(250 - colour, 0, 255) if abs(colour.mean() - 125) > 40 else np.full(3, 245, F32)
            colour = tiled(text_tile(r, colour, ink, 2), u, v, 80 / (2 * half))
        clear = style == "clear"
        colour = np.array([215, 225, 230], F32) if clear else colour
        out.append(
            Patch(
                sd,
                bevel(sd, 1.2, 1.5) + wrinkle,
                colour,
                0.9 if clear else r.uniform(0.05, 0.4),
                r.uniform(0.12, 0.35) if clear else 1.0,
                True,
            )
        )
    return out


def sheet(st: Stage, sp: Spot, style: str) -> list[Patch]:
    """A sheet: paper, a label, foil or plastic film."""
    r = st.rng
    size = {"paper": (70, 220), "label": (25, 70), "foil": (50, 190), "film": (80, 260)}[style]
    a, b = r.uniform(*size, 2) * st.unit
    u, v = st.frame(sp, r.normal(0, 0.5))
    u = u + F32(sp.reach - a)
    shape, soft = st.x.shape, noise(r, st.x.shape, 130 * st.ss)
    ragged = F32(0) if style in ("paper", "label") else noise(r, shape, 30 * st.ss) * F32(r.uniform(1, 9))
    sd = box(u, v, a, b, r.uniform(0, 12)) + ragged
    if style in ("paper", "label"):
        ground = np.full(3, r.uniform(190, 250), F32) if r.random() < 0.7 else st.tone()
        tile = text_tile(r, ground, np.full(3, r.uniform(10, 90)), int(r.integers(2, 9)))
        colour = tiled(tile, u, v, r.uniform(0.8, 2.2)) if r.random() < 0.75 else shaded(ground, soft, 0.03)
        return [Patch(sd, bevel(sd, 1, 1.5) + soft * F32(4), colour, 0.05, 1.0, style == "label", 1.0)]
    crumple = np.abs(noise(r, shape, 40 * st.ss)) + 0.5 * np.abs(noise(r, shape, 17 * st.ss, 28 * st.ss, 0.7))
    if style == "foil":
        level = r.uniform(130, 230)
        return [Patch(sd, crumple * F32(r.uniform(1.5, 7)), shaded(np.full(3, level), soft, 0.15), 1.0, 1.0, True)]
    long = np.abs(noise(r, shape, 220, 26, r.uniform(0.1, 3)))
    folds = crumple * F32(r.uniform(0.5, 2)) + long * F32(r.uniform(0.3, 1.5))
    colour = np.array([225, 225, 220], F32) * F32(r.uniform(0.6, 1))
    return [Patch(sd, folds, colour, r.uniform(0.7, 1.6), r.uniform(0.1, 0.5), True)]


def cloth(st: Stage, sp: Spot, style: str) -> list[Patch]:
    """A cloth or rag with folds, an outline that wanders, and at times stripes or stains."""
    r, shape = st.rng, st.x.shape
    size = r.uniform(70, 210) * st.unit
    u, v = st.frame(sp, r.normal(0, 0.4))
    u = u + F32(sp.reach - size)
    wander = noise(r, shape, 60 * st.ss) * F32(r.uniform(2, 0.12 * size))
    sd = (box(u, v, size, size * r.uniform(0.6, 1.5), size * r.uniform(0.05, 0.5)) + wander) * F32(0.85)
    bend = noise(r, shape, 90 * st.ss) * F32(r.uniform(10, 40))
    turn, wave = r.uniform(0, np.pi), r.uniform(18, 60) * st.unit
    phase = (u * F32(np.cos(turn)) + v * F32(np.sin(turn)) + bend) / F32(wave)
    fold = (0.5 + 0.5 * np.sin(6.28 * phase)) ** 2 * F32(wave * r.uniform(0.12, 0.4))
    fold = fold * np.clip(0.6 + 0.6 * noise(r, shape, 110 * st.ss), 0, 1.5) + noise(r, shape, 14 * st.ss) * F32(0.7)
    colour = shaded(st.tone(), noise(r, shape, 1.7), 0.06 if style == "cloth" else 0.12)
    if r.random() < 0.4:
        colour *= (1 - F32(r.uniform(0.2, 0.6)) * (np.mod(v + bend * 0.2, wave) < 0.25 * wave))[..., None]
    if style == "rag":
        colour *= np.clip(1 - 0.5 * np.maximum(noise(r, shape, 45 * st.ss), 0), 0.3, 1)[..., None]
    return [Patch(sd, fold + dome(sd, 5, 3), colour, 0.0, 1.0, True, 1.0)]


def hand(st: Stage, sp: Spot, style: str) -> list[Patch]:
    """A gloved or bare hand, fingers on the block, with a cuff towards the border."""
    r, k = st.rng, st.rng.uniform(0.8, 1.6) * st.unit
    u, v = st.frame(sp, r.normal(0, 0.3))
    u = (u + F32(sp.reach)) / F32(k)
    v = v / F32(k) * F32(r.choice([-1, 1]))
    sd = np.minimum(capsule(u, v, (78, -22), (110, 0), 32), capsule(u, v, (78, 20), (115, 0), 34))
    for i, tip in enumerate(np.array([16.0, 4.0, 2.0, 14.0]) + r.uniform(0, 7, 4)):
        root = -34 + 23 * i
        finger = capsule(u, v, (tip + 9, root * r.uniform(1.0, 1.35)), (80, root), r.uniform(9, 12))
        blend = np.clip(0.5 + (finger - sd) / 10, 0, 1)
        sd = finger * (1 - blend) + sd * blend - 5 * blend * (1 - blend) * F32(0.5)
    sd = np.minimum(sd, capsule(u, v, (r.uniform(35, 60), r.uniform(62, 80)), (105, 28), 12))
    skin = np.array([r.uniform(90, 150), r.uniform(120, 180), r.uniform(160, 225)], F32) * F32(r.uniform(0.4, 1))
    colour = st.tone() if style == "glove" else skin
    creases = noise(r, st.x.shape, 9 * st.ss) * F32(0.8 if style == "glove" else 0.25)
    cuff = box(u - 330, v, 200, r.uniform(38, 52), 8)
    sleeve = st.tone() if r.random() < 0.7 else colour
    folds = noise(r, st.x.shape, 60, 14, -sp.angle + 1.5) * F32(1.5)
    return [
        Patch(cuff * F32(k), dome(cuff * F32(k), 40 * k, 26 * k) + folds, sleeve, 0.02, lift=4),
        Patch(sd * F32(k), dome(sd * F32(k), 15 * k, 13 * k) + creases, colour, 0.15, lift=3),
    ]
