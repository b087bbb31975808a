"""Tables, and what is drawn or spilt on them: (H, W, 3) float32, BGR from 0 to 1."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.fourth_hand.drawings import Place, blob, fill
from benchmarks.fourth_hand.textures import clouds, coat, grain, local, mix, paint
from benchmarks.other_hand.fields import Rng, Shape
from contour.geometry.arrays import Bools, Float32s

TABLES = ("plain", "painted", "wood", "brushed", "tslot", "perforated", "rubber", "paper", "mat")
MARKS = ("stain", "chalk", "cuts", "swarf", "oil")


def table_top(rng: Rng, shape: Shape, style: str, colour: Float32s) -> Float32s:
    """A table of one of `TABLES` and of a colour, (3,)."""
    way = np.array([np.cos(a := rng.choice([0, np.pi / 2]) + rng.normal(0, 0.15)), np.sin(a)])
    u, v = local(shape, rng.uniform(0, 700, 2), way)
    rough = clouds(rng, shape, 120, 3) * 0.09 + rng.normal(0, 0.03, shape).astype(np.float32)
    line: Bools | None = None
    if style in ("wood", "brushed"):
        wood = style == "wood"
        rough += grain(rng, u, v + 12 * clouds(rng, shape, 300), 2.5 if wood else 0.9) * (0.18 if wood else 0.1)
        if wood:
            colour = colour.mean() * np.array([0.7, 1.0, 1.25], np.float32)
            line = np.mod(v, rng.uniform(110, 400)) < 2.5
    elif style == "tslot":
        gap = rng.uniform(110, 260)
        line = np.mod(v, gap) < gap * rng.uniform(0.08, 0.2)
    elif style == "perforated":
        gap = rng.uniform(26, 80)
        line = np.hypot(np.mod(u, gap) - gap / 2, np.mod(v, gap) - gap / 2) < gap * rng.uniform(0.12, 0.3)
    elif style == "rubber":
        gap = rng.uniform(6, 18)
        rough += 0.2 * np.sin(v * np.float32(2 * np.pi / gap))
    elif style == "painted":
        rough -= 0.35 * np.clip(clouds(rng, shape, 30, 3) - 0.55, 0, 1)
    base = coat(shape, colour, 1 + rough)
    if style == "mat":
        gap = rng.uniform(30, 90)
        grid = np.minimum(np.abs(np.mod(u, gap) - gap / 2), np.abs(np.mod(v, gap) - gap / 2))
        return mix(base, np.clip(1.3 - grid, 0, 1) * rng.uniform(0.2, 0.6), paint(rng, 0.2, 0.6))
    if line is not None:
        return mix(base, cv2.GaussianBlur(line.astype(np.float32), (0, 0), 0.8) * 0.9, colour * rng.uniform(0.1, 0.6))
    return base


def soil(rng: Rng, table: Float32s, style: str, place: Place) -> Float32s:
    """The table with one of `MARKS` on it, which run up to the block about the place."""
    shape = place.shape
    if style in ("stain", "oil"):
        for _ in range(int(rng.integers(2, 6))):
            at = place.at + rng.normal(0, place.unit * 0.3, 2)
            ring = blob(place, at, place.unit * rng.uniform(0.05, 0.3), 0.13)
            spot = np.asarray(cv2.GaussianBlur(fill(shape, [ring]), (0, 0), rng.uniform(0.8, 5)), np.float32)
            rim = np.abs(spot - cv2.GaussianBlur(spot, (0, 0), 6))
            amount = spot * rng.uniform(0.3, 0.8) + rim * 0.5
            table = mix(table, amount, paint(rng, 0.02, 0.1 if style == "oil" else 0.5, 0.25))
            if style == "oil":
                sheen = np.clip(clouds(rng, shape, 60) - 0.3, 0, 1) * spot
                table = table + sheen[..., None] * rng.uniform(0.02, 0.25)
        return table
    count = int({"chalk": 2, "cuts": 8, "swarf": 130}[style] * rng.uniform(0.5, 1.5)) + 1
    for _ in range(3):
        lines = []
        for _ in range(count):
            at = place.at + rng.normal(0, place.unit * 0.5, 2)
            half = (rng.uniform(2, 9) if style == "swarf" else place.unit * rng.uniform(0.03, 0.5)) * place.heading(3.1)
            lines.append(at + np.linspace(-1, 1, 8)[:, None] * half + np.cumsum(rng.normal(0, 0.5, (8, 2)), 0))
        ink = fill(shape, lines, rng.uniform(2, 5) if style == "chalk" else rng.uniform(0.7, 1.6))
        if style == "chalk":
            ink *= np.clip(0.7 + clouds(rng, shape, 3), 0, 1)
        level = (0.5, 0.8) if style == "chalk" else (0.02, 0.6)
        table = mix(table, ink * rng.uniform(0.2, 0.8), paint(rng, *level, 0.2))
    return table
