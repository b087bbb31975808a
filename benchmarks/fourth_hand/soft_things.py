"""Things that bend: tapes, cloths, sheets and gloves."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from benchmarks.fourth_hand.bodies import Body
from benchmarks.fourth_hand.drawings import Place, blob, box, fill, ribbon, run
from benchmarks.fourth_hand.textures import clouds, coat, local, mix, paint, text_tile, tiled, weave
from benchmarks.other_hand.outlines import across
from contour.geometry.arrays import Float32s


def tape(p: Place, style: str) -> list[Body]:
    """One to three strips of tape across the edge."""
    out = []
    width = p.unit * p.rng.uniform(0.03, 0.13)
    base = paint(p.rng)
    for _ in range(1 if p.rng.random() < 0.6 else int(p.rng.integers(2, 4))):
        path = run(p, p.unit * p.rng.uniform(0.08, 0.35), p.unit * p.rng.uniform(0.1, 0.45), width * 0.12)
        alpha = fill(p.shape, [ribbon(path, width / 2, 0.0 if style == "foil" else width * 0.05, p.rng)])
        u, v = local(p.shape, path[0], (path[-1] - path[0]) / np.linalg.norm(path[-1] - path[0]))
        wrinkle = clouds(p.rng, p.shape, width * 0.5) * 0.5
        body = Body(alpha, coat(p.shape, base, 1 + 0.06 * clouds(p.rng, p.shape, 60)), 1.0, wrinkle, 0.3, 1.0, 1.0, 2.5)
        if style == "clear":
            body.opacity = np.float32(p.rng.uniform(0.1, 0.3)) + 0.12 * np.abs(wrinkle)
            body.albedo = coat(p.shape, paint(p.rng, 0.5, 0.95, 0.2))
            body.gloss = p.rng.uniform(0.35, 0.9)
        elif style == "printed":
            ink = tiled(text_tile(p.rng, 1), u, v + width * 0.35, width / 52)
            if p.rng.random() < 0.4:
                ink = (np.mod(u + v, width) < width / 2).astype(np.float32)
            body.albedo = mix(body.albedo, np.asarray(cv2.GaussianBlur(ink, (0, 0), 0.7), np.float32), paint(p.rng))
        elif style == "masking":
            body.albedo = coat(p.shape, np.array([0.45, 0.68, 0.8], np.float32) * p.rng.uniform(0.6, 1.1))
            body.bump = wrinkle + 0.5 * np.sin(u * np.float32(2.1) + 2 * clouds(p.rng, p.shape, 9))
            body.gloss, body.opacity = 0.05, p.rng.uniform(0.85, 1.0)
        elif style == "foil":
            body.albedo, body.gloss = coat(p.shape, paint(p.rng, 0.4, 0.8, 0.05)), 1.0
            body.bump = clouds(p.rng, p.shape, width * 0.3, 3) * 1.5
        out.append(body)
        p = replace(p, at=p.at + p.heading(3.1) * width)
    return out


def cloth(p: Place, style: str) -> list[Body]:
    """A rag over the edge: folds, weave, stripes or checks, dirty marks."""
    size = p.unit * p.rng.uniform(0.15, 0.42)
    centre = p.at + p.inward * size * p.rng.uniform(-0.5, 0.4) * (not p.apart) - p.inward * size * 1.5 * p.apart
    outline = blob(p, centre, size, 0.16, p.rng.uniform(0.75, 1.35))
    if p.rng.random() < 0.45:
        edge = box(centre, p.heading(3.1), size * 2, size * p.rng.uniform(1.1, 2), 0.08)
        outline = edge + p.rng.normal(0, size * 0.02, edge.shape)
    u, v = local(p.shape, centre, p.heading(3.1))
    warp = clouds(p.rng, p.shape, size * 0.6) * size * 0.12
    thread = p.rng.uniform(3.0, 5.5)
    fabric = weave(u + warp, v - warp, thread)
    base = coat(p.shape, paint(p.rng), 1 + 0.12 * fabric + 0.1 * clouds(p.rng, p.shape, 50))
    if style == "printed":
        gap = p.rng.uniform(0.06, 0.25) * size + 5
        lines = (np.mod(u + warp, gap) < gap * p.rng.uniform(0.15, 0.5)).astype(np.float32)
        if p.rng.random() < 0.5:
            lines = 0.5 * lines + 0.5 * (np.mod(v - warp, gap) < gap * 0.4)
        base = mix(base, lines * 0.85, paint(p.rng))
    dirt = np.clip(clouds(p.rng, p.shape, size * 0.5, 3) - 0.35, 0, 1) * p.rng.choice([0, 1.2])
    bump = _folds(p, size * p.rng.uniform(0.18, 0.5), p.rng.uniform(3, 9)) + 0.3 * fabric
    return [
        Body(
            fill(p.shape, [outline]), mix(base, dirt, np.full(3, 0.06)), 4.0, bump, 0.03, 1.0, p.rng.uniform(2, 7), 7.0
        )
    ]


def sheet(p: Place, style: str) -> list[Body]:
    """A flat sheet over the edge: paper, a label, foil, or film that is clear, tinted or has bubbles."""
    size = p.unit * (p.rng.uniform(0.08, 0.2) if style == "label" else p.rng.uniform(0.25, 0.75))
    ratio = p.rng.uniform(0.45, 1.0)
    way = p.heading(3.1)
    centre = p.at + p.inward * size * p.rng.uniform(-0.4, 0.3) * (not p.apart) - p.inward * size * 0.8 * p.apart
    outline = box(centre, way, size, size * ratio, p.rng.choice([0.005, 0.03, 0.12]))
    if style in ("film", "tinted", "foil") and p.rng.random() < 0.6:
        outline = blob(p, centre, size * 0.5, 0.13)
    u, v = local(p.shape, centre, way)
    body = Body(fill(p.shape, [outline]), coat(p.shape, paint(p.rng, 0.3, 0.85, 0.25)), 0.8, None, 0.05, 1.0, 2.5, 2.5)
    ridge = (1 - np.abs(clouds(p.rng, p.shape, size * 0.3, 3))) ** 6
    if style in ("paper", "label"):
        ink = tiled(text_tile(p.rng, 5), u, v, size / p.rng.uniform(250, 700))
        inside = (np.abs(u) < size * 0.42) & (np.abs(v) < size * ratio * 0.4)
        body.albedo = mix(body.albedo, ink * inside * p.rng.choice([0, 0.9], p=[0.25, 0.75]), paint(p.rng, 0.03, 0.4))
        wave = clouds(p.rng, p.shape, size * 0.6) * p.rng.uniform(0, 9)
        body.bump = wave + 2 * (np.abs(v) < 1.2) * (p.rng.random() < 0.3)
    elif style == "foil":
        body.albedo, body.gloss = coat(p.shape, paint(p.rng, 0.35, 0.75, 0.05)), 0.9
        body.bump = clouds(p.rng, p.shape, size * 0.12, 4) * p.rng.uniform(2, 7)
    else:
        body.gloss = p.rng.uniform(0.3, 1.0)
        body.bump = ridge * p.rng.uniform(2, 6) + clouds(p.rng, p.shape, size * 0.4) * 3
        body.opacity = p.rng.uniform(0.05, 0.25) + 0.25 * ridge
        if style == "tinted":
            body.albedo = coat(p.shape, paint(p.rng, 0.05, 0.8, 1.0))
            body.opacity = p.rng.uniform(0.35, 0.75) + 0.15 * ridge
        if style == "bubble":
            step = p.rng.uniform(11, 26)
            row = np.floor(v / step)
            far = np.hypot(np.mod(u + row * step / 2, step) - step / 2, np.mod(v, step) - step / 2)
            far /= np.float32(step * 0.44)
            body.bump = np.sqrt(np.clip(1 - far**2, 0, 1)) * np.float32(step * 0.22)
    return [body]


def glove(p: Place, arm_length: float) -> list[Body]:
    """A glove or a hand with spread fingers and a cuff, or one at the end of a sleeved arm of so many of its sizes."""
    size = p.unit * p.rng.uniform(0.11, 0.2)
    way = p.heading(0.7)
    side = across(way)
    palm = p.at - way * size * p.rng.uniform(-0.3, 0.6)
    alpha = fill(p.shape, [box(palm, way, size * 1.05, size * 0.95, 0.35)])
    for k, (reach, turn) in enumerate(((0.95, -0.3), (1.15, -0.1), (1.1, 0.08), (0.9, 0.28), (0.75, 1.0))):
        angle = turn + p.rng.normal(0, 0.07)
        ray = way * np.cos(angle) + side * np.sin(angle)
        root = palm + way * size * (0.35 if k < 4 else -0.2) + side * size * (-0.36 + 0.24 * k if k < 4 else 0.4)
        knuckle = root + ray * size * reach * 0.5
        tip = knuckle + (ray + side * p.rng.normal(0, 0.2)) * size * reach * 0.45
        alpha = np.maximum(alpha, fill(p.shape, [np.array([root, knuckle, tip])], size * 0.23))
    arm = palm - way * size * p.rng.uniform(0.6, 1.0) * arm_length
    cuff = fill(p.shape, [ribbon(np.linspace(palm - way * size * 0.3, arm, 160), np.linspace(0.42, 0.55, 160) * size)])
    u, v = local(p.shape, palm, way)
    knit = weave(u, v, max(3.0, size / 22))
    skin = coat(p.shape, paint(p.rng, 0.05, 0.9, 0.6), 1 + 0.15 * knit)
    dip = np.clip(u / (size * 0.1) + p.rng.uniform(-3, 3), 0, 1) * (p.rng.random() < 0.5)
    bump = _folds(p, size * 0.4, 2.0) + 0.3 * knit
    return [
        Body(cuff, coat(p.shape, paint(p.rng)), size * 0.3, _folds(p, size * 0.5, 2.5), 0.02, 1.0, 8.0),
        Body(alpha, mix(skin, dip, paint(p.rng)), size * 0.12, bump, 0.15, 1.0, 5.0),
    ]


def _folds(p: Place, size: float, strength: float) -> Float32s:
    """The relief of cloth folds, bent ridges so many pixels apart, pixels high, (H, W) float32."""
    _, v = local(p.shape, p.at, p.heading(3.1))
    bend = clouds(p.rng, p.shape, size * 2.2) * size
    ridge = 1 - np.abs(np.sin((v + bend) * np.float32(np.pi / size)))
    high = ridge**2 * (0.5 + 0.5 * clouds(p.rng, p.shape, size * 1.4))
    return np.asarray(strength * (high + clouds(p.rng, p.shape, size * 0.8)), np.float32)
