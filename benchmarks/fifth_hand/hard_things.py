"""Compact things: weights, foam, offcuts, clamps, magnets and plugs; x leads away from the block, pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.fifth_hand.outlines import ellipse, rectangle, rounded, stadium
from benchmarks.fifth_hand.parts import Part, bar, contrasting, disc, moved, random_look
from benchmarks.other_hand.fields import Rng


def foam_piece(rng: Rng, size: float) -> list[Part]:
    """A cut piece of foam."""
    look = replace(random_look(rng), texture=str(rng.choice(["porous", "grainy", "mottled"])), gloss=0.0)
    body = rounded(rectangle(size * rng.uniform(0.5, 1.3), size * rng.uniform(0.3, 0.9)), size * 0.06)
    return [Part((body + rng.normal(0, 0.01 * size, body.shape),), look, rng.uniform(5, 22), "bevel")]


def weight(rng: Rng, size: float) -> list[Part]:
    """A round, hexagonal or square weight with a knob or a groove."""
    look, across = random_look(rng), size * rng.uniform(0.4, 0.9)
    form = rng.integers(3)
    outline = ellipse(across, across, [96, 6, 4][form])
    parts = [Part((rounded(outline, across * 0.04),), look, rng.uniform(8, 30), "bevel")]
    if rng.random() < 0.5:
        return [*parts, disc(across * rng.uniform(0.3, 0.5), contrasting(rng, look), 10, "round")]
    groove = outline * 0.7
    return [*parts, Part((groove, groove * 0.92), contrasting(rng, look), 0.0)]


def wood_offcut(rng: Rng, size: float) -> list[Part]:
    """A batten or a block of wood, sawn square or slanting."""
    look = replace(random_look(rng), texture="wood", contrast=rng.uniform(0.05, 0.3), gloss=0.0)
    corners = rectangle(size * rng.uniform(0.6, 2.8), size * rng.uniform(0.2, 0.6))
    corners[1:3, 0] += rng.choice([0, rng.normal(0, 0.2)], 2) * size
    return [Part((corners,), look, rng.uniform(4, 25), "bevel")]


def spring_clamp(rng: Rng, size: float) -> list[Part]:
    """Two jaws and handles crossing at a spring."""
    look, scale = random_look(rng), size * rng.uniform(0.6, 1.0)
    pad = random_look(rng).smooth()
    parts = []
    for side in (-1, 1):
        arm = np.array([[-0.7, 0.06], [-0.3, 0.22], [0.1, 0.14], [0.4, 0.2], [1.1, 0.42]]) * [1, side] * scale
        parts.append(Part((arm,), look, 9, "round", scale * rng.uniform(0.12, 0.2)))
        parts.append(Part((arm[-2:],), pad, 3, "round", scale * 0.2))
        parts.append(disc(scale * 0.22, pad, 3, "bevel", (-0.7 * scale, side * 0.05 * scale)))
    return [*parts, disc(scale * 0.26, contrasting(rng, look), 4), disc(scale * 0.1, look, 1)]


def toggle_clamp(rng: Rng, size: float) -> list[Part]:
    """An arm with a rubber foot, a base plate with bolts and a handle."""
    look, scale = random_look(rng), size * rng.uniform(0.7, 1.1)
    other = contrasting(rng, look)
    base = moved(bar(scale * 0.55, scale * 0.5, look, 3), scale * 0.75)
    bolts = [disc(scale * 0.1, other, 2, "bevel", (scale * x, scale * y)) for x in (0.57, 0.93) for y in (-0.17, 0.17)]
    arm = moved(bar(scale * 1.3, scale * rng.uniform(0.12, 0.2), look, 16), scale * 0.05)
    foot = disc(scale * rng.uniform(0.2, 0.32), random_look(rng).smooth(), 8, "bevel", (-0.55 * scale, 0))
    lever = np.array([[0.7, 0], [1.3, rng.normal(0, 0.2)]]) * scale
    handle = Part((lever,), random_look(rng), 18, "round", scale * 0.16)
    return [base, *bolts, foot, arm, disc(scale * 0.12, other, 4, "bevel", (-0.55 * scale, 0)), handle]


def magnet(rng: Rng, size: float) -> list[Part]:
    """Small round or bar magnets."""
    look, across = random_look(rng), size * rng.uniform(0.15, 0.4)
    if rng.random() < 0.5:
        ring = ellipse(across, across)
        hole = (ring * 0.4,) if rng.random() < 0.4 else ()
        return [Part((ring, *hole), look, across * 0.3, "bevel")]
    return [
        moved(bar(across, across * 0.6, tone, across * 0.3), x)
        for tone, x in ((look, across / 2), (contrasting(rng, look), -across / 2))
    ]


def hole_plug(rng: Rng, size: float) -> list[Part]:
    """A plug that fills and overlaps a hole of this radius."""
    look, across = random_look(rng), size * rng.uniform(2.06, 2.5)
    parts = [Part((ellipse(across, across, int(rng.choice([6, 8, 96]))),), look, rng.uniform(2, 12), "bevel")]
    if rng.random() < 0.7:
        parts.append(disc(across * rng.uniform(0.2, 0.75), contrasting(rng, look), rng.uniform(0, 8)))
    return parts


def stop_block(rng: Rng, size: float) -> list[Part]:
    """A machined block with a slot and a bolt."""
    look, scale = random_look(rng), size * rng.uniform(0.6, 1.1)
    body = rectangle(scale * rng.uniform(0.7, 1.2), scale * rng.uniform(0.4, 0.7))
    slot = stadium(0.4 * scale, 0.14 * scale)
    bolt = Part((ellipse(0.22, 0.22, 6) * scale,), contrasting(rng, look), 5, "bevel")
    return [Part((body,), look, rng.uniform(6, 20), "bevel"), Part((slot,), look.relit(look.light * 0.3), 0.0), bolt]
