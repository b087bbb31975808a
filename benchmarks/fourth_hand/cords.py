"""Cables, strings and hoses, zip ties and lashing straps."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.fourth_hand.bodies import Body
from benchmarks.fourth_hand.drawings import Place, box, fill, ribbon, run
from benchmarks.fourth_hand.textures import coat, local, mix, paint, weave
from benchmarks.other_hand.fields import Shape
from contour.geometry.arrays import Float32s, Float64s


def cord(p: Place, style: str) -> list[Body]:
    """Cables, strings, wires or hoses across the edge, singly or as a bundle."""
    low, high, count, sway = {
        "thin": (2.0, 5.0, 3, 0.3),
        "thick": (8.0, 26.0, 2, 0.2),
        "string": (1.6, 3.5, 2, 0.4),
        "wires": (1.6, 4.0, 7, 0.12),
        "twisted": (5.0, 14.0, 1, 0.2),
        "spiral": (8.0, 20.0, 1, 0.25),
        "ribbed": (18.0, 60.0, 1, 0.15),
    }[style]
    out = []
    middle = run(
        p,
        p.unit * p.rng.uniform(0.2, 1.4),
        p.unit * p.rng.uniform(0.15, 1.4),
        p.unit * sway * p.rng.random(),
        p.rng.uniform(0.6, 2.5),
    )
    for number in range(int(p.rng.integers(1, count + 1)) if style != "wires" else int(p.rng.integers(3, count))):
        width = p.rng.uniform(low, high)
        path = middle + (p.rng.normal(0, width * 1.5, 2) if number else 0.0)
        path = path + np.cumsum(p.rng.normal(0, 0.03 * width, path.shape), 0) * (number > 0)
        along = np.cumsum(np.r_[0, np.linalg.norm(np.diff(path, axis=0), axis=1)])
        tone, bump = np.ones((1, 1), np.float32), None
        alpha = fill(p.shape, [path], width)
        if style in ("twisted", "spiral", "ribbed", "string"):
            phase = _phase(p.shape, path, along, width)
            pitch = width * {"twisted": 1.6, "spiral": 0.7, "ribbed": p.rng.uniform(0.15, 0.4), "string": 1.8}[style]
            wave = np.sin(phase * np.float32(2 * np.pi / max(pitch, 3.0)))
            bump, tone = wave * np.float32(0.1 * width), 1 + 0.3 * wave
        out.append(
            Body(
                alpha,
                coat(p.shape, paint(p.rng, colour=0.9), tone),
                width / 2,
                bump,
                p.rng.uniform(0, 0.8),
                1.0,
                p.rng.uniform(0.4, 1.6) * width,
            )
        )
    return out


def _phase(shape: Shape, path: Float64s, along: Float64s, width: float) -> Float32s:
    """The length run along a path, pixels, of those about it, (H, W) float32."""
    out = np.zeros(shape, np.float32)
    points = np.round(path * 16).astype(np.int32)
    dense = np.linspace(0, len(path) - 1, 1200)
    x, y = np.interp(dense, range(len(path)), points[:, 0]), np.interp(dense, range(len(path)), points[:, 1])
    run_length = np.interp(dense, range(len(path)), along)
    for k in range(len(dense) - 1):
        cv2.line(
            out, (int(x[k]), int(y[k])), (int(x[k + 1]), int(y[k + 1])), float(run_length[k]), int(width) + 3, 8, 4
        )
    return out


def zip_tie(p: Place) -> list[Body]:
    """Zip ties with a head and a ribbed tongue."""
    out = []
    for _ in range(int(p.rng.integers(1, 4))):
        width = p.rng.uniform(3.0, 9.0)
        path = run(
            p, p.unit * p.rng.uniform(0.1, 0.3), p.unit * p.rng.uniform(0.1, 0.5), p.unit * 0.12 * p.rng.random()
        )
        half = np.interp(np.arange(160), [0, 145, 159], [width / 2, width / 2, width / 4])
        head = path[1] - path[0]
        head = head / np.linalg.norm(head)
        shapes = np.maximum(
            fill(p.shape, [ribbon(path, half)]), fill(p.shape, [box(path[0], head, width * 2, width * 1.9)])
        )
        u, _v = local(p.shape, path[0], head)
        ribs = 0.4 * np.sin(u * np.float32(2 * np.pi / 3.3))
        out.append(
            Body(shapes, coat(p.shape, paint(p.rng, colour=0.7), 1 + 0.2 * ribs), 1.8, ribs, 0.4, 1.0, width * 0.8)
        )
    return out


def strap(p: Place) -> list[Body]:
    """A woven lashing strap across the edge, with stitched stripes and at times a buckle."""
    width = p.unit * p.rng.uniform(0.04, 0.12)
    path = run(p, p.unit * p.rng.uniform(0.3, 1.5), p.unit * p.rng.uniform(0.3, 1.5), width * p.rng.random(), 0.7)
    alpha = fill(p.shape, [ribbon(path, width / 2)])
    u, v = local(p.shape, p.at, (path[81] - path[80]) / np.linalg.norm(path[81] - path[80]))
    cloth = weave(u, v, max(3.0, width / 12))
    base = coat(p.shape, paint(p.rng, colour=0.9), 1 + 0.18 * cloth)
    stripe = (np.abs(np.abs(v) - width * 0.3) < width * 0.05).astype(np.float32)
    out = [Body(alpha, mix(base, stripe * 0.8, paint(p.rng)), 1.5, 0.3 * cloth, 0.05, 1.0, p.rng.uniform(1, 6), 2.0)]
    if p.rng.random() < 0.4:
        way = path[100] - path[99]
        outer = box(path[int(p.rng.integers(50, 110))], way / np.linalg.norm(way), width * 1.2, width * 1.5, 0.2)
        out.append(
            Body(fill(p.shape, [outer]), coat(p.shape, paint(p.rng, 0.2, 0.7, 0.1)), width * 0.15, None, 0.8, lift=5.0)
        )
    return out
