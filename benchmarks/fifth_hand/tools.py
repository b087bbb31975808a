"""Hand tools: pens, brushes, gauges, rulers, spanners and knives; x leads away from the block, pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.fifth_hand.outlines import ellipse, rectangle, rounded, stadium, turned
from benchmarks.fifth_hand.parts import Part, bar, contrasting, disc, moved, random_look
from benchmarks.other_hand.fields import Rng


def pen(rng: Rng, size: float) -> list[Part]:
    """A pen or marker with tip, cap and clip."""
    look, width = random_look(rng), size * rng.uniform(0.07, 0.18)
    length = width * rng.uniform(8, 13)
    other = contrasting(rng, look)
    tip = np.array([[-length / 2 - width * 1.4, 0], [-length / 2, -width / 2], [-length / 2, width / 2]])
    cap = moved(bar(length * 0.35, width * 1.1, other, width * 0.5, "round"), length * 0.33)
    clip = moved(bar(length * 0.25, width * 0.18, look.smooth(), 1.0), length * 0.35, width * 0.1)
    return [Part((tip,), other, width * 0.4, "round"), bar(length, width, look, width * 0.6, "round"), cap, clip]


def brush(rng: Rng, size: float) -> list[Part]:
    """A brush: bristles over the block, a ferrule and a handle."""
    look, width = random_look(rng), size * rng.uniform(0.25, 0.55)
    long = size * rng.uniform(0.3, 0.6)
    y = np.linspace(-0.5, 0.5, 40)
    tips = np.stack([-long - rng.uniform(0, 0.2, 40) * long, y * width * 1.2], 1)
    hair = np.concatenate([tips, [[0, width / 2], [0, -width / 2]]])
    bristles = Part((hair,), replace(random_look(rng), texture="brushed", contrast=0.35), 6)
    ferrule = moved(bar(size * 0.16, width, contrasting(rng, look), 7), size * 0.06)
    handle = np.array(
        [[0.12, -0.45], [0.3, -0.3], [0.6, -0.17], [1.5, -0.22], [1.5, 0.22], [0.6, 0.17], [0.3, 0.3], [0.12, 0.45]]
    ) * [size, width]
    return [bristles, Part((rounded(handle, size * 0.1),), look, 9, "round"), ferrule]


def gauge(rng: Rng, size: float) -> list[Part]:
    """A dial gauge: rim, face, ticks, hand and a stem."""
    look, across = random_look(rng), size * rng.uniform(0.45, 0.85)
    face, ink = contrasting(rng, look), contrasting(rng, contrasting(rng, look))
    parts = [
        moved(bar(across * 1.1, across * 0.16, look, 8, "round"), across * 0.9),
        disc(across, look, 12),
        disc(across * 0.82, face, 0.0, "flat"),
    ]
    tick = rectangle(0.06 * across, 1.6) + np.array([0.35 * across, 0])
    ticks = tuple(turned(tick, turn) for turn in np.linspace(0, 2 * np.pi, 24, endpoint=False))
    parts.append(Part(ticks, ink, 0.0))
    hand = turned(np.array([[-0.06, 0.0], [0.3, 0.0]]) * across, rng.uniform(0, 6.3))
    return [*parts, Part((hand,), ink, 1.0, "flat", 2.0), disc(across * 0.08, ink, 1.0)]


def ruler(rng: Rng, size: float) -> list[Part]:
    """A steel or plastic rule with marks."""
    look, width = random_look(rng), size * rng.uniform(0.15, 0.32)
    length, step = size * rng.uniform(2, 5), rng.uniform(4, 9)
    ink = contrasting(rng, look)
    parts = [bar(length, width, look, 1.5)]
    marks = []
    for index, x in enumerate(np.arange(-length / 2 + 6, length / 2 - 4, step)):
        deep = width * (0.5 if index % 10 == 0 else 0.38 if index % 5 == 0 else 0.25)
        marks.append(rectangle(1.5, deep) + np.array([x, -width / 2 + 1 + deep / 2]))
    return [*parts, Part(tuple(marks), ink, 0.0)]


def spanner(rng: Rng, size: float) -> list[Part]:
    """An open-ended or ring spanner."""
    look, scale = random_look(rng), size * rng.uniform(0.8, 1.4)
    head = ellipse(0.5, 0.5) * scale
    jaw = turned(rectangle(0.34, 0.2), rng.normal(0, 0.25)) * scale - [0.22 * scale, 0]
    inner = ellipse(0.26, 0.26, 6) * scale if rng.random() < 0.5 else jaw
    start = Part((head, inner), look, 4, "bevel")
    shaft = moved(bar(scale * 1.5, scale * rng.uniform(0.15, 0.24), look, 4), scale * 0.96)
    end = moved(Part((ellipse(0.44, 0.44) * scale, ellipse(0.22, 0.22, 6) * scale), look, 4, "bevel"), scale * 1.75)
    return [start, shaft, end]


def knife(rng: Rng, size: float) -> list[Part]:
    """A knife with a bevelled blade over the block."""
    look, scale = random_look(rng), size * rng.uniform(0.7, 1.2)
    steel = replace(random_look(rng), texture="brushed", contrast=0.1)
    wide = rng.uniform(0.12, 0.22) * scale
    back = [[-0.6 * scale, -wide / 2], [0.3 * scale, -wide / 2]]
    blade = np.array([[-0.9 * scale, wide / 2], *back, [0.3 * scale, wide / 2]])
    edge = np.array([[-0.9 * scale, wide / 2], [0.3 * scale, wide / 2], [0.3 * scale, wide * 0.25]])
    grip = Part((stadium(1.1 * scale, wide * 1.5) + np.array([0.8 * scale, 0]),), look, 8, "round")
    return [Part((blade,), steel, 3), Part((edge,), contrasting(rng, steel), 0.0), grip]
