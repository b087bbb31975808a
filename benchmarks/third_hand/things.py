"""All things that lie over a block or beside it, by name, and how they are laid there."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import cv2
import numpy as np

from benchmarks.third_hand.hard_things import clamp, puck, tool
from benchmarks.third_hand.long_things import bar, line_thing, zip_tie
from benchmarks.third_hand.soft_things import cloth, hand, sheet, tape
from benchmarks.third_hand.stage import Patch, Spot, Stage
from benchmarks.third_hand.textures import F32
from contour.geometry.arrays import Float32s

Builder = Callable[[Stage, Spot], list[Patch]]
THINGS: dict[str, Builder] = {
    "tape": partial(tape, style="opaque"),
    "clear_tape": partial(tape, style="clear"),
    "printed_tape": partial(tape, style="printed"),
    "masking_tape": partial(tape, style="masking"),
    "paper": partial(sheet, style="paper"),
    "label": partial(sheet, style="label"),
    "foil": partial(sheet, style="foil"),
    "film": partial(sheet, style="film"),
    "cloth": partial(cloth, style="cloth"),
    "rag": partial(cloth, style="rag"),
    "glove": partial(hand, style="glove"),
    "hand": partial(hand, style="bare"),
    "hose": partial(line_thing, style="hose"),
    "cable": partial(line_thing, style="cable"),
    "wire": partial(line_thing, style="wire"),
    "cable_bundle": partial(line_thing, style="bundle"),
    "sleeve": partial(line_thing, style="sleeve"),
    "zip_tie": zip_tie,
    "ruler": partial(bar, style="ruler"),
    "strap": partial(bar, style="strap"),
    "batten": partial(bar, style="batten"),
    "foam": partial(bar, style="foam"),
    "stop_block": partial(bar, style="stop"),
    "weight": partial(puck, style="weight"),
    "magnet": partial(puck, style="magnet"),
    "vacuum_cup": partial(puck, style="cup"),
    "clamp": partial(clamp, style="screw"),
    "toggle_clamp": partial(clamp, style="toggle"),
    "spanner": partial(tool, style="spanner"),
    "knife": partial(tool, style="knife"),
    "pen": partial(tool, style="pen"),
}


def place(st: Stage, name: str, *, over: bool) -> None:
    """Lay a thing over the stage's block, or beside it if there is a place where it keeps clear, in place."""
    near = cv2.dilate((st.comb > 0).astype(np.uint8), np.ones((13, 13), np.uint8))
    for tries in range(6):
        st.unit = st.width / 1000 * float(np.exp(st.rng.uniform(-0.35, 0.5)))
        spot = _spot(st, over=over)
        if not over:
            gap = spot.reach * 0.3 + 10 + (25 * tries + st.rng.uniform(0, 50)) * st.unit
            spot = Spot(spot.x + gap * np.cos(spot.angle), spot.y + gap * np.sin(spot.angle), spot.angle, 0.0)
        patches = THINGS[name](st, spot)
        body = np.max([patch.sd < 0 for patch in patches], 0)
        share = float((body * st.comb).sum() / st.comb.sum())
        if (over and 0.004 < share < 0.35) or (not over and not near[body].any()) or (over and tries == 5):
            for patch in patches:
                _lay(st, patch, over=over)
            return


def _spot(st: Stage, *, over: bool) -> Spot:
    """A place of the edge, at a corner or at a hole too where the thing lies over it."""
    r, inner = st.rng, len(st.rings) > 1 and over and st.rng.random() < 0.3
    ring = st.rings[int(r.integers(1, len(st.rings)))] if inner else st.rings[0]
    way = np.concatenate([[0], np.cumsum(np.hypot(*(np.roll(ring, -1, 0) - ring).T))])
    closed, at = np.concatenate([ring, ring[:1]]), r.random() * way[-1]
    p, a, b = (np.array([np.interp((at + d) % way[-1], way, closed[:, k]) for k in (0, 1)]) for d in (0.0, -6.0, 6.0))
    tangent = (b - a) / max(1e-6, float(np.hypot(*(b - a))))
    angle = float(np.arctan2(-tangent[0], tangent[1]))
    if inner:
        angle = float(np.arctan2(*(p - st.rings[0].mean(0))[::-1]))
    return Spot(float(p[0]), float(p[1]), angle + r.normal(0, 0.45), r.uniform(0.02, 0.22) * st.width)


def _lay(st: Stage, patch: Patch, *, over: bool) -> None:
    """Put one piece of a thing into the stage's fields."""
    cover = np.clip(F32(0.5) - patch.sd * F32(st.ss), 0, 1)
    base: Float32s | np.float32 = F32(st.depth if over else 0)
    if patch.drape:
        small = cv2.GaussianBlur(cv2.resize(st.ground, None, fx=0.25, fy=0.25), (0, 0), 2.2 * st.ss)
        base = np.asarray(cv2.resize(small, cover.shape[::-1]), F32)
    colour = np.asarray(patch.colour, F32)
    amount = cover * F32(patch.opacity)
    st.albedo = st.albedo + (colour - st.albedo) * amount[..., None]
    st.relief = st.relief + (patch.relief - st.relief) * cover
    st.gloss = st.gloss + (F32(patch.gloss) - st.gloss) * cover
    if patch.opacity == 1:
        st.ground = np.where(cover > 0.5, np.maximum(st.ground, base + patch.relief + F32(patch.lift)), st.ground)
    if over:
        st.hidden = np.maximum(st.hidden, cover)
