"""Long things: sleeves, hoses, cables, strings and zip ties; x leads away from the block, pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.fifth_hand.outlines import ellipse, rectangle
from benchmarks.fifth_hand.parts import Part, bar, contrasting, disc, random_look
from benchmarks.other_hand.fields import Rng
from contour.geometry.arrays import Float64s


def _wander(rng: Rng, length: float, curl: float) -> Float64s:
    """A smooth path, (80, 2), that starts over the block and leads away."""
    count = 80
    turn = np.cumsum(np.convolve(rng.normal(0, curl, count + 14), np.ones(15) / 15, "valid"))
    turn = turn - turn[count // 4]
    path = np.cumsum(np.stack([np.cos(turn), np.sin(turn)], 1) * length / count, 0)
    return np.asarray(path - path[count // 4])


def sleeve(rng: Rng, size: float) -> list[Part]:
    """A tube or sleeve lying down, with open ends."""
    look, width = random_look(rng), size * rng.uniform(0.2, 0.5)
    length = size * rng.uniform(0.7, 1.8)
    mouth = Part((ellipse(width * 0.3, width * 0.94) + np.array([-length / 2, 0]),), contrasting(rng, look), 0.0)
    bore = Part(
        (ellipse(width * 0.2, width * 0.7) + np.array([-length / 2, 0]),), look.relit(look.light * 0.25).smooth(), 0.0
    )
    return [bar(length, width, look, width * 0.6, "round"), mouth, bore]


def hose(rng: Rng, size: float) -> list[Part]:
    """A thick hose, smooth or ribbed, that leads off the table."""
    look, width = random_look(rng), size * rng.uniform(0.18, 0.45)
    path = _wander(rng, size * rng.uniform(4, 10), 0.12)
    parts = [Part((path,), look, width * 0.7, "round", width)]
    if rng.random() < 0.5:
        steps = np.gradient(path, axis=0)
        across = np.stack([-steps[:, 1], steps[:, 0]], 1) / np.hypot(*steps.T)[:, None] * width * 0.45
        rib = contrasting(rng, look)
        parts += [
            Part((np.stack([p - a, p + a]),), rib, 0.0, "flat", max(1.0, width * 0.06))
            for p, a in zip(path[::2], across[::2], strict=True)
        ]
    return parts


def cable_loop(rng: Rng, size: float) -> list[Part]:
    """One or more loops of cable with a loose end."""
    look, width = replace(random_look(rng), texture="plain"), size * rng.uniform(0.025, 0.11)
    turns = rng.uniform(1.1, 3.2)
    turn = np.linspace(0, 2 * np.pi * turns, int(60 * turns))
    radius = size * rng.uniform(0.3, 0.6) * (1 + 0.08 * np.sin(turn * rng.uniform(0.3, 1.4) + rng.uniform(0, 6)))
    loop = np.stack([np.cos(turn) * radius, np.sin(turn) * radius * rng.uniform(0.6, 1)], 1)
    tail = _wander(rng, size * rng.uniform(1, 4), 0.1)[20:] + loop[-1]
    tail[:, 0] += width
    return [Part((np.concatenate([loop, tail]),), look, width * 0.8, "round", width)]


def string(rng: Rng, size: float) -> list[Part]:
    """Thin strings or wires."""
    look, width = random_look(rng).smooth(), rng.uniform(2.0, 5.0)
    return [
        Part((_wander(rng, size * rng.uniform(1.5, 6), rng.uniform(0.1, 0.4)),), look, width * 0.6, "round", width)
        for _ in range(int(rng.integers(1, 4)))
    ]


def vacuum_cup(rng: Rng, size: float) -> list[Part]:
    """A suction cup seen from above: rings, bellows, a fitting and a hose."""
    look, across = random_look(rng), size * rng.uniform(0.4, 0.8)
    parts = [disc(across, look, 8)]
    for share in np.linspace(0.85, 0.5, int(rng.integers(1, 4))):
        ring = ellipse(across * share, across * share)
        parts.append(Part((ring, ring * 0.93), contrasting(rng, look), 0.0))
    parts.append(disc(across * 0.36, contrasting(rng, look), 14))
    path = _wander(rng, size * rng.uniform(3, 7), 0.1)[20:]
    tube = Part((path,), random_look(rng).smooth(), across * 0.15, "round", across * rng.uniform(0.12, 0.25))
    return [*parts, tube] if rng.random() < 0.7 else parts


def zip_tie(rng: Rng, size: float) -> list[Part]:
    """A cable tie with its head."""
    look, width = random_look(rng).smooth(), rng.uniform(4, 10)
    path = _wander(rng, size * rng.uniform(1.2, 3), 0.12)
    head = rectangle(width * 1.8, width * 1.9) + path[-1]
    return [Part((path,), look, 2.5, "round", width), Part((head,), look, 4, "bevel")]
