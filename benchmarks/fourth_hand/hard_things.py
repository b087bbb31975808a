"""Stiff things: boards, hand tools, weights and clamps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.fourth_hand.bodies import Body
from benchmarks.fourth_hand.drawings import Place, box, disc, fill, ribbon, run
from benchmarks.fourth_hand.textures import clouds, coat, grain, local, mix, paint
from benchmarks.other_hand.fields import Field
from benchmarks.other_hand.outlines import across
from contour.geometry.arrays import Float32s


def board(p: Place, style: str) -> list[Body]:
    """A stiff board or bar over the edge: wood, a batten, foam, a plate, rubber, a stop block."""
    length, width, lift = {
        "wood": (0.6, 0.4, 10.0),
        "batten": (0.9, 0.07, 14.0),
        "foam": (0.4, 0.22, 18.0),
        "plate": (0.45, 0.3, 4.0),
        "rubber": (0.45, 0.3, 4.0),
        "stop": (0.16, 0.1, 16.0),
    }[style]
    length, width = p.unit * length * p.rng.uniform(0.6, 1.5), p.unit * width * p.rng.uniform(0.6, 1.5)
    way = p.heading(1.2 if width < length / 3 else 3.1)
    centre = (
        p.at
        - p.inward * width * (0.7 if p.apart else p.rng.uniform(-0.4, 0.3))
        + way * length * p.rng.uniform(-0.3, 0.3)
    )
    u, v = local(p.shape, centre, way)
    rings = [box(centre, way, length, width, p.rng.choice([0.01, 0.06, 0.2]))]
    bump: Float32s | None = None
    gloss = 0.1
    if style in ("wood", "batten"):
        fibre = grain(p.rng, u, v + 0.1 * clouds(p.rng, p.shape, 90) * width, p.rng.uniform(1, 2.5))
        wood = np.array([0.35, 0.55, 0.72], np.float32) * p.rng.uniform(0.4, 1.25)
        albedo = coat(p.shape, wood, 1 + 0.14 * fibre + 0.08 * clouds(p.rng, p.shape, 80))
    elif style == "foam":
        pores = clouds(p.rng, p.shape, p.rng.uniform(3, 8), 2)
        albedo, bump = coat(p.shape, paint(p.rng), 1 - 0.35 * np.clip(pores, 0, 1)), pores * 0.8
    elif style == "rubber":
        bump = 0.8 * np.sign(np.sin(v * np.float32(2 * np.pi / p.rng.uniform(6, 16))))
        albedo = coat(p.shape, paint(p.rng, 0.03, 0.2), 1 + 0.1 * clouds(p.rng, p.shape, 6))
    else:
        albedo = coat(p.shape, paint(p.rng, 0.1, 0.85), 1 + 0.07 * grain(p.rng, u, v, 1.2))
        gloss = 0.6
        if p.rng.random() < 0.6:
            holes = [centre + way * length * s for s in (-0.3, 0.3)]
            albedo = mix(albedo, fill(p.shape, [disc(q, width * 0.1) for q in holes]), np.full(3, 0.03))
    return [Body(fill(p.shape, rings), albedo, p.rng.uniform(1.5, 4), bump, gloss, 1.0, lift * p.rng.uniform(0.5, 1.6))]


def stick(p: Place, style: str) -> list[Body]:
    """A long tool over the edge: a ruler, spanner, knife, pen or screwdriver."""
    length = p.unit * p.rng.uniform(0.25, 0.7)
    way = p.heading(1.1)
    centre = p.at + way * length * p.rng.uniform(-0.3, 0.3)
    width = max(5.0, length * {"ruler": 0.09, "spanner": 0.07, "knife": 0.1, "pen": 0.055, "driver": 0.05}[style])
    u, v = local(p.shape, centre, way)
    a, b = centre - way * length / 2, centre + way * length / 2
    metal = coat(p.shape, paint(p.rng, 0.25, 0.8, 0.05), 1 + 0.08 * grain(p.rng, u, v, 1.0))
    if style == "ruler":
        tick = (np.mod(u, 6) < 1.5) & (v > width * np.where(np.mod(u, 30) < 6, 0.1, 0.28))
        albedo = mix(coat(p.shape, paint(p.rng)), tick.astype(np.float32), paint(p.rng))
        return [Body(fill(p.shape, [box(centre, way, length, width, 0.05)]), albedo, 1.2, None, 0.4, 1.0, 2.0)]
    if style == "spanner":
        turn = float(np.arctan2(way[1], way[0]))
        rings = [box(centre, way, length * 0.9, width, 0.2)]
        alpha = np.maximum(fill(p.shape, rings), fill(p.shape, [disc(b, width * 1.3), disc(b, width * 0.7, 6, turn)]))
        jaw = fill(p.shape, [disc(a, width * 1.5)]) * (
            1 - fill(p.shape, [box(a - way * width, way, width * 2.2, width * 1.2)])
        )
        keep = 1 - fill(p.shape, [box(a - way * width, way, width * 2.2, width * 1.2), disc(b, width * 0.7, 6, turn)])
        return [Body(np.maximum(alpha * keep, jaw), metal, width * 0.3, None, 0.9, 1.0, 4.0)]
    grip = fill(p.shape, [ribbon(np.linspace(a, centre, 160), width / 2 * (1 + 0.12 * np.sin(np.arange(160) / 20)))])
    tail = {
        "knife": [np.array([centre + way * -2, b])],
        "pen": [np.array([centre, b])],
        "driver": [np.array([centre, b])],
    }
    blade = fill(p.shape, tail[style], width * {"knife": 0.7, "pen": 0.9, "driver": 0.35}[style])
    handle = coat(p.shape, paint(p.rng, colour=0.9), 1 + 0.1 * np.sign(np.sin(u / 3)) * (p.rng.random() < 0.5))
    second = handle if style == "pen" else metal
    return [
        Body(blade, second, width * (0.1 if style == "knife" else 0.35), None, 0.8, 1.0, 3.0),
        Body(grip, handle, width * 0.5, None, 0.4, 1.0, 5.0),
    ]


def lump(p: Place, style: str) -> list[Body]:
    """A compact thing on the edge: a weight, magnet or vacuum cup."""
    radius = p.unit * p.rng.uniform(0.035, 0.11)
    centre = p.at - p.inward * (radius * p.rng.uniform(-0.7, 0.5) if not p.apart else radius * 1.4)
    u, v = local(p.shape, centre, p.heading(3.1))
    far = np.hypot(u, v) / np.float32(radius)
    sides = int(p.rng.choice([4, 6, 8])) if style == "weight" and p.rng.random() < 0.4 else 72
    alpha = fill(p.shape, [disc(centre, radius, sides, p.rng.uniform(0, 3))])
    tone = 1 + 0.06 * np.sin(far * 40) + 0.05 * clouds(p.rng, p.shape, 12)
    albedo = coat(p.shape, paint(p.rng, colour=0.5), tone)
    bump: Field = np.zeros(p.shape, np.float32)
    if style == "cup":
        bump = (np.abs(np.mod(far * p.rng.uniform(2, 4), 1) - 0.5) * radius * 0.3).astype(np.float32)
    if style == "weight":
        bump = np.float32(radius * 0.35) * np.clip(3 - 8 * far, 0, 1)
    out = [Body(alpha, albedo, radius * p.rng.uniform(0.1, 0.4), bump, p.rng.uniform(0.05, 0.8), 1.0, radius * 0.4)]
    if style == "cup":
        stem = run(replace(p, at=centre), p.unit * 1.2, 1.0, p.unit * 0.1)
        out.append(
            Body(fill(p.shape, [stem], radius * 0.4), coat(p.shape, paint(p.rng)), radius * 0.2, None, 0.5, 1.0, 12.0)
        )
    if style == "magnet" and p.rng.random() < 0.7:
        other = fill(p.shape, [box(centre + p.heading(3.1) * radius * 1.4, p.heading(), radius * 1.6, radius * 0.9)])
        out.append(Body(other, coat(p.shape, paint(p.rng, 0.2, 0.8)), 2.0, None, 0.7, 1.0, radius * 0.3))
    return out


def clamp(p: Place, style: str) -> list[Body]:
    """A strap clamp with its bolt on the edge, or a toggle clamp with arm, pad and handle."""
    length, width = p.unit * p.rng.uniform(0.2, 0.45), p.unit * p.rng.uniform(0.035, 0.08)
    way = p.heading(0.6)
    nose = p.at + way * length * p.rng.uniform(0.12, 0.5)
    tail = nose - way * length
    u, v = local(p.shape, nose, way)
    iron = coat(p.shape, paint(p.rng, 0.08, 0.75, 0.4), 1 + 0.1 * grain(p.rng, u, v, 1.3))
    if style == "strap":
        bolt = nose - way * length * p.rng.uniform(0.45, 0.65)
        slot = fill(p.shape, [box(bolt, way, length * 0.35, width * 0.35, 0.5)])
        nut = coat(p.shape, paint(p.rng, 0.2, 0.8, 0.05))
        return [
            Body(
                fill(p.shape, [box((nose + tail) / 2, way, length, width, 0.12)]),
                mix(iron, slot, np.full(3, 0.03)),
                3.0,
                None,
                0.6,
                1.0,
                8.0,
            ),
            Body(fill(p.shape, [disc(bolt, width * 0.55)]), nut, 2.0, None, 0.8, 1.0, 4.0),
            Body(fill(p.shape, [disc(bolt, width * 0.38, 6, p.rng.uniform(0, 1))]), nut, 3.0, None, 0.9, 1.0, 8.0),
        ]
    side = across(way)
    base = fill(p.shape, [box(tail - way * width, way, width * 3.2, width * 2.6, 0.1)])
    lever = np.array([tail, tail - way * length * 0.5 + side * length * p.rng.uniform(-0.4, 0.4)])
    return [
        Body(base, iron, 2.0, None, 0.6, 1.0, 3.0),
        Body(fill(p.shape, [np.array([tail, nose])], width * 0.55), iron, width * 0.15, None, 0.8, 1.0, 14.0),
        Body(fill(p.shape, [disc(nose, width * 0.75)]), coat(p.shape, paint(p.rng)), width * 0.3, None, 0.3, 1.0, 5.0),
        Body(fill(p.shape, [lever], width), coat(p.shape, paint(p.rng, colour=1.0)), width * 0.5, None, 0.5, 1.0, 16.0),
    ]
