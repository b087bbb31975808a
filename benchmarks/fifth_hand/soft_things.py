"""Flat things: tapes, labels, cloths, films, papers, gloves and straps; x leads away from the block, pixels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.fifth_hand.outlines import ellipse, rectangle, rounded, turned
from benchmarks.fifth_hand.parts import Look, Part, film_look, random_look
from benchmarks.fifth_hand.raster import random_tint
from benchmarks.other_hand.fields import Rng
from contour.geometry.arrays import Float64s


def _torn(rng: Rng, length: float, width: float, tear: float) -> Float64s:
    """A strip along x, its short ends torn by some pixels."""
    count = max(4, int(width / 3))
    y = np.linspace(-width / 2, width / 2, count)
    right = np.stack([length / 2 + rng.normal(0, tear, count), y], 1)
    left = np.stack([-length / 2 + rng.normal(0, tear, count), y[::-1]], 1)
    return np.concatenate([right, left])


def _ragged(rng: Rng, width: float, height: float, rough: float) -> Float64s:
    """An irregular ring."""
    turn = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    waves = (rng.normal(0, rough / k) * np.cos(k * turn + rng.uniform(0, 6.3)) for k in range(2, 9))
    wave = sum(waves, np.zeros_like(turn))
    power = rng.uniform(0.15, 0.9)
    circle = np.stack(
        [
            np.sign(np.cos(turn)) * np.abs(np.cos(turn)) ** power * width / 2,
            np.sign(np.sin(turn)) * np.abs(np.sin(turn)) ** power * height / 2,
        ],
        1,
    )
    return circle * (1 + wave)[:, None]


def _sheet(rng: Rng, size: float, look: Look) -> list[Part]:
    """A rectangular sheet, at times with a corner folded over."""
    width, tall = size * rng.uniform(0.8, 2.2), size * rng.uniform(0.5, 1.5)
    corners = rectangle(width, tall) + rng.uniform(-0.03, 0.03, (4, 2)) * size
    if rng.random() > 0.35:
        return [Part((corners,), look, 1.5)]
    fold = rng.uniform(0.12, 0.4) * min(width, tall)
    tip, first, second = corners[0], corners[0] + [fold, 0], corners[0] + [0, fold * rng.uniform(0.6, 1)]
    body = np.concatenate([[first], corners[1:], [second]])
    flap = np.stack([first, first + second - tip, second])
    back = look.relit(look.light * rng.uniform(0.7, 1.3)).smooth()
    return [Part((body,), look, 1.5), Part((flap,), back, 3.5)]


def label(rng: Rng, size: float) -> list[Part]:
    """A printed label, at times with a bar code."""
    look = replace(random_look(rng), texture="printed", contrast=rng.uniform(0.1, 0.5))
    width, tall = size * rng.uniform(0.5, 1.3), size * rng.uniform(0.25, 0.7)
    parts = [Part((rounded(rectangle(width, tall), rng.choice([0, 0.1 * tall])),), look, 1.0)]
    ink = look.relit(look.light - 0.5 if look.light > 0.5 else look.light + 0.5).smooth()
    if rng.random() < 0.6:
        starts = np.cumsum(rng.uniform(2.6, 6.0, 40))
        starts = starts[starts < width * 0.4]
        bars = tuple(rectangle(rng.uniform(0.8, 2.5), tall * 0.4) + np.array([x - width * 0.42, 0]) for x in starts)
        paper = look.smooth()
        parts.append(Part((rectangle(width * 0.5, tall * 0.5) + np.array([-width * 0.21, 0]),), paper, 0.0))
        parts.append(Part(bars, ink, 0.0))
    return parts


def sticker(rng: Rng, size: float) -> list[Part]:
    """A round or oval sticker, at times with a ring or a dot."""
    look, across = random_look(rng), size * rng.uniform(0.25, 0.7)
    shape = ellipse(across, across * rng.choice([1.0, rng.uniform(0.6, 1)]))
    parts = [Part((shape,), look, 0.8)]
    if rng.random() < 0.7:
        inner = shape * rng.uniform(0.55, 0.85)
        ring = (inner, inner * 0.85) if rng.random() < 0.6 else (inner,)
        parts.append(Part(ring, random_look(rng).smooth(), 0.0))
    return parts


def clear_tape(rng: Rng, size: float) -> list[Part]:
    """Clear adhesive tape with glossy streaks."""
    length, width = size * rng.uniform(1.2, 3.5), size * rng.uniform(0.2, 0.6)
    return [Part((_torn(rng, length, width, rng.choice([0.3, 1.5])),), film_look(rng), 0.6)]


def masking_tape(rng: Rng, size: float) -> list[Part]:
    """Crepe tape, torn by hand, in one or two pieces across each other."""
    look = replace(random_look(rng), texture=str(rng.choice(["grainy", "striped", "creased", "printed", "plain"])))
    parts = []
    for turn in [0.0, rng.uniform(0.3, 1.6)][: int(rng.integers(1, 3))]:
        strip = _torn(rng, size * rng.uniform(1.0, 3.0), size * rng.uniform(0.15, 0.5), rng.uniform(0.5, 4))
        parts.append(Part((turned(strip, turn),), look, 0.8, angle=turn))
    return parts


def film_sheet(rng: Rng, size: float) -> list[Part]:
    """A sheet of clear film or a piece of bag."""
    shape = _ragged(rng, size * rng.uniform(1.2, 2.4), size * rng.uniform(0.8, 1.8), 0.04)
    return [Part((shape,), replace(film_look(rng), texture="creased", contrast=rng.uniform(0.2, 1.2)), 1.5, "cloth")]


def foil(rng: Rng, size: float) -> list[Part]:
    """Crumpled metal foil."""
    look = replace(random_look(rng), texture="creased", gloss=rng.uniform(0.1, 0.7), contrast=rng.uniform(0.1, 0.5))
    return [Part((_ragged(rng, size * rng.uniform(0.8, 1.8), size * rng.uniform(0.6, 1.3), 0.05),), look, 3.0, "cloth")]


def rag(rng: Rng, size: float, light: float | None = None) -> list[Part]:
    """A cloth thrown down, with folds; of any light, or of this one."""
    look = random_look(rng, light)
    look = replace(look, texture=str(rng.choice(["woven", "grainy", "mottled", "striped", "plain"])), gloss=0.0)
    shape = _ragged(rng, size * rng.uniform(1.0, 2.2), size * rng.uniform(0.8, 1.7), rng.uniform(0.02, 0.07))
    return [Part((shape,), look, rng.uniform(2, 8), "cloth")]


def paper(rng: Rng, size: float, light: float | None = None) -> list[Part]:
    """A sheet of paper, blank or printed; of any light, or of this one."""
    look = random_look(rng, light)
    return _sheet(rng, size, replace(look, texture=str(rng.choice(["plain", "printed", "grainy"])), gloss=0.0))


def metal_offcut(rng: Rng, size: float) -> list[Part]:
    """An offcut of sheet metal, at times with a drilled hole."""
    look = replace(random_look(rng), texture=str(rng.choice(["brushed", "plain", "mottled", "grainy"])))
    count = int(rng.integers(3, 7))
    turn = np.sort(np.linspace(0, 2 * np.pi, count, endpoint=False) + rng.uniform(0, 0.9, count))
    shape = np.stack([np.cos(turn), np.sin(turn)], 1) * size * [rng.uniform(0.5, 1.1), rng.uniform(0.35, 0.8)]
    across = size * 0.1 * rng.uniform(0.5, 1)
    hole = ellipse(across, across) + rng.normal(0, 0.13, 2) * size
    return [Part((shape, hole) if rng.integers(0, 2) else (shape,), look, rng.uniform(1, 4), "bevel")]


def glove(rng: Rng, size: float) -> list[Part]:
    """A work glove: fingers, a thumb, a palm and a cuff that leads away."""
    look = random_look(rng)
    scale = size * rng.uniform(0.6, 1.0)
    parts, height = [], rng.uniform(4, 10)
    for index in range(4):
        base = np.array([-0.3, (index - 1.5) * 0.26]) * scale
        tip = base + turned(np.array([-rng.uniform(0.5, 0.85), 0.0]), (1.5 - index) * 0.13 + rng.normal(0, 0.1)) * scale
        parts.append(Part((np.stack([base, tip]),), look, height, "round", 0.24 * scale))
    side = rng.choice([-1, 1])
    thumb = np.array([[0.2, side * 0.35], [-0.1, side * 0.75], [-0.25, side * 0.85]]) * scale
    parts.append(Part((thumb,), look, height, "round", 0.25 * scale))
    palm = rounded(rectangle(1.0 * scale, 1.04 * scale), 0.3 * scale) + np.array([0.15 * scale, 0])
    parts.append(Part((palm,), look, height, "cloth"))
    cuff = rectangle(rng.uniform(0.3, 1.6) * scale, rng.uniform(0.85, 1.05) * scale)
    cuff = cuff - [cuff[:, 0].min() - 0.55 * scale, 0]
    return [*parts, Part((cuff,), (look, random_look(rng))[int(rng.integers(2))], height, "cloth")]


def strap(rng: Rng, size: float) -> list[Part]:
    """A long webbing strap with seams."""
    look, width = random_look(rng), size * rng.uniform(0.12, 0.35)
    length, bend = size * rng.uniform(3, 9), rng.normal(0, 0.06)
    x = np.linspace(-length * 0.3, length * 0.7, 40)
    y = bend * x**2 / length
    band = np.concatenate([np.stack([x, y - width / 2], 1), np.stack([x, y + width / 2], 1)[::-1]])
    seam = look.relit(look.light + rng.choice([-0.25, 0.25])).smooth()
    lines = [
        Part((np.stack([x, y + side * width * 0.38], 1),), seam, 0.0, "flat", max(1.0, width * 0.05))
        for side in (-1, 1)
    ]
    return [Part((band,), replace(look, texture=str(rng.choice(["woven", "striped", "plain"]))), 2.5), *lines]


def light_box(rng: Rng, size: float, light: float | None = None) -> list[Part]:
    """A box or a lit panel, at times with a thin frame; of any light, or of this one."""
    look = replace(random_look(rng, light), texture="plain", gloss=0.0)
    width, tall = size * rng.uniform(0.7, 1.5), size * rng.uniform(0.6, 1.2)
    body = rounded(rectangle(width, tall), rng.choice([0, 0.08 * tall]))
    parts = [Part((body,), look, rng.uniform(4, 20), "bevel")]
    if rng.random() < 0.6:
        parts.append(Part((body * 0.86,), look.relit(look.light + rng.normal(0, 0.08)), 0.0))
    return parts


def tag(rng: Rng, size: float) -> list[Part]:
    """A small card with a string."""
    look = Look(rng.random(), random_tint(rng), "grainy", 0.05)
    card = rounded(rectangle(size * 0.7, size * 0.4), size * 0.05)
    string = np.cumsum(rng.normal(0, 0.12, (14, 2)) * size + np.array([0.08 * size, 0]), 0) + np.array([0.3 * size, 0])
    return [Part((card,), look, 1.0), Part((string,), random_look(rng).smooth(), 1.0, "round", 2.0)]
