"""Pictures of a block on a shop floor's table, with or without a thing over it, and what is true of them."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.fourth_hand.bodies import lay
from benchmarks.fourth_hand.camera import expose, lamps
from benchmarks.fourth_hand.core import block_shadow, build, lattice, mark_comb, wall_paint
from benchmarks.fourth_hand.drawings import blob, fill
from benchmarks.fourth_hand.outlines import outline
from benchmarks.fourth_hand.specs import INNOCENT, Spec
from benchmarks.fourth_hand.tables import MARKS, soil, table_top
from benchmarks.fourth_hand.textures import blur, paint
from benchmarks.fourth_hand.things import OVER, across, beside, edge_place
from benchmarks.fourth_hand.view import look
from benchmarks.third_hand.scene import Scene

KINDS: tuple[str, ...] = (*OVER, *INNOCENT)


def scene(kind: str, seed: int) -> Scene:
    """A scene of one of `KINDS`, the same for the same seed; ValueError for a kind that is none."""
    if kind not in KINDS:
        raise ValueError(f"{kind!r} is no kind: expected one of {', '.join(KINDS)}")
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    spec = INNOCENT.get(kind, Spec())
    w = int(rng.integers(700, 1501))
    shape = (int(min(w * rng.uniform(0.62, 0.85), 1000)), w)
    cuts = spec.cuts or str(rng.choice(["none", "none", "slot", "notch", "both"]))
    flat = outline(rng, cuts, int(rng.integers(spec.holes[0], spec.holes[1] + 1)), shape)
    view = look(rng, shape, spec)
    pitch = float(np.exp(rng.uniform(np.log(9), np.log(45))))
    rings = [view.place(q) for q in flat]
    comb = fill(shape, rings)
    scale = np.sqrt(cv2.contourArea(rings[0].astype(np.float32)) / cv2.contourArea(flat[0].astype(np.float32)))
    cells = lattice(rng, view, shape, pitch)
    soft = {"hard": 0.05, "soft": 1.5}.get(spec.shadow or "", rng.uniform(0.1, 1.2))
    floor = spec.floor or str(rng.choice(["dark", "dark", "lit"]))
    colour = paint(rng, *((0.03, 0.22) if floor == "dark" else (0.2, 0.55)), 0.3)
    table = table_top(rng, shape, str(rng.choice(spec.table)), colour)
    anchor = edge_place(rng, rings, shape, pitch)
    for style in [rng.choice(spec.marks)] if spec.marks else rng.choice(MARKS, int(rng.choice([0, 0, 1, 2]))):
        table = soil(rng, table, str(style), anchor)
    table = table * (1 - rng.uniform(0.45, 0.85) * block_shadow(comb, view, soft))[..., None]
    base = np.maximum(comb, view.lower(comb, 1))
    far = np.asarray(cv2.distanceTransform((base < 0.02).astype(np.uint8), cv2.DIST_L2, 5), np.float32)
    names = spec.beside or tuple(OVER)
    for name in rng.choice(names, 3 if spec.beside else int(rng.choice([0, 0, 1, 2]))):
        for body in beside(rng, str(name), rings, pitch, far):
            table = lay(table, body, np.zeros_like(comb), view, soft)
    picture = build(rng, table, comb, cells, view, wall_paint(rng, float(colour.mean())))
    if spec.comb:
        picture = mark_comb(rng, picture, comb, anchor, spec.comb)
    hidden = np.zeros(shape, bool)
    for body in across(OVER[kind], rng, rings, pitch, comb) if kind in OVER else []:
        picture = lay(picture, body, comb, view, soft)
        hidden |= body.alpha > 0.45
    if spec.shadow == "foreign":
        cast = fill(shape, [blob(anchor, anchor.at, anchor.unit * 0.35, 0.2)])
        picture = picture * (1 - rng.uniform(0.4, 0.8) * blur(cast, rng.uniform(1, 14)))[..., None]
    inside = comb > 0.5
    walls = (cells[0] * comb > 0.4) & inside & ~hidden
    photograph = expose(rng, picture * lamps(rng, shape), inside)
    return Scene(photograph, tuple(rings), pitch * float(scale), hidden, walls, inside)
