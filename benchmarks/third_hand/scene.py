"""Pictures of a block on a cutting table, with or without a thing over it, and what is true of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from benchmarks.other_hand.fields import Rng
from benchmarks.third_hand.camera import lamps_of, light, photograph
from benchmarks.third_hand.core import colours_of, ink_block, lattice, put_block
from benchmarks.third_hand.outlines import covered, exterior, with_holes
from benchmarks.third_hand.plans import OPEN_KINDS, Plan
from benchmarks.third_hand.stage import Stage
from benchmarks.third_hand.tables import TABLES, mark_table, table_of
from benchmarks.third_hand.textures import F32
from benchmarks.third_hand.things import THINGS, place
from contour.geometry.arrays import Bools, Bytes, Float64s

KINDS: tuple[str, ...] = (*OPEN_KINDS, *(f"over_{name}" for name in THINGS))


@dataclass(frozen=True, eq=False)
class Scene:
    """A picture, (H, W) grey or (H, W, 3) BGR, 700 to 1500 pixels wide, and what is true of it.

    `rings` are the block's exterior and then its holes, each (N, 2) in pixels, x before y, of its top; `pitch_px` is
    its cells'. The rest is (H, W): where a thing lies over the block, and goes on beside it (`hidden`), where walls'
    tops are seen (`walls`), and what lies within the block, holes not, under things too (`comb`).
    """

    picture: Bytes
    rings: tuple[Float64s, ...]
    pitch_px: float
    hidden: Bools
    walls: Bools
    comb: Bools


def scene(kind: str, seed: int) -> Scene:
    """A scene of one of `KINDS`, the same for the same seed; ValueError for a kind that is none."""
    if kind not in KINDS:
        raise ValueError(f"{kind!r} is no kind: expected one of {', '.join(KINDS)}")
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    plan = _plan_of(kind, rng)
    w = int(rng.integers(700, 1501))
    h = int(w * rng.uniform(0.64, 0.85))
    st = _stage(rng, plan, w, h)
    st.rings = with_holes(rng, exterior(rng, w, h, plan), w, h, plan)
    st.comb = covered(st.rings, st.x.shape, st.ss)
    pitch, warp = float(np.exp(rng.uniform(np.log(9), np.log(45)))), rng.normal(0, 0.03, 2) / w
    st.albedo = table_of(st, str(rng.choice(TABLES)))
    for mark in plan.marks:
        mark_table(st, mark)
    lamps = lamps_of(rng, plan.light)
    cells = lattice(st, pitch, plan, warp)
    st.wall = cells.wall
    put_block(st, colours_of(st, plan.stuff, cells, lamps[0]), plan)
    if plan.on_block == "ink":
        ink_block(st)
    for _ in range(int(rng.integers(*plan.count)) if plan.beside else 0):
        place(st, str(rng.choice(plan.beside)), over=False)
    if kind.startswith("over_"):
        place(st, kind.removeprefix("over_"), over=True)
    picture = photograph(st, light(st, lamps), plan)
    hidden, comb, wall = (cv2.resize(m, (w, h), interpolation=cv2.INTER_AREA) for m in (st.hidden, st.comb, st.wall))
    mid = st.rings[0].mean(0) - [w / 2, h / 2]
    walls = (wall > 0.5) & (comb > 0.5) & (hidden <= 0.5)
    return Scene(picture, tuple(st.rings), pitch * float(1 + warp @ mid) ** 1.5, hidden > 0.5, walls, comb > 0.5)


def _plan_of(kind: str, rng: Rng) -> Plan:
    """The kind's plan, with choices at random for what it leaves open."""
    plan = OPEN_KINDS.get(kind, Plan())
    light = str(rng.choice(["hard", "two", "soft"]))
    stuff = str(rng.choice(["bright", "bright", "bright", "bright", "dark", "aramid"]))
    plan = replace(plan, light=plan.light or light, stuff=plan.stuff or stuff)
    if rng.random() < 0.4:
        mark = str(rng.choice(["stain", "oil", "dust", "chalk", "cut", "swarf"]))
        plan = replace(plan, marks=plan.marks or (mark,))
    if rng.random() < 0.35:
        plan = replace(plan, beside=plan.beside or tuple(THINGS))
    return plan


def _stage(rng: Rng, plan: Plan, w: int, h: int) -> Stage:
    """An empty stage without a table yet, for a picture of this width and height."""
    ss = float(np.clip(1500 / w, 1.2, 1.6))
    wide, high = round(w * ss), round(h * ss)
    x, y = np.meshgrid((np.arange(wide) + 0.5) * w / wide - 0.5, (np.arange(high) + 0.5) * h / high - 0.5)
    unit = w / 1000
    depth = rng.uniform(*plan.depth) * unit
    st = Stage(rng, w, h, ss, x.astype(F32), y.astype(F32), unit, float(depth), np.zeros((1, 1, 3), F32))
    tone = rng.choice([rng.uniform(18, 60), rng.uniform(60, 150), rng.uniform(150, 225)])
    st.table_tone = float(rng.uniform(*plan.tone) if plan.tone is not None else tone)
    return st
