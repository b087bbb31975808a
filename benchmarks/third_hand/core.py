"""The block: its cells, their colours, what is written on it, and how it stands on the table."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from benchmarks.other_hand.drawings import share
from benchmarks.third_hand.camera import Lamp
from benchmarks.third_hand.outlines import covered
from benchmarks.third_hand.plans import Plan
from benchmarks.third_hand.stage import Stage
from benchmarks.third_hand.textures import F32, noise
from contour.geometry.arrays import Float32s, Float64s


class Cells(NamedTuple):
    """How much of each pixel is wall, from 0 to 1; where in its cell it lies, x and y of the picture in pitches; and a
    number of the cell's own, from 0 to 1; all (H, W) float32, at the stage's size.
    """

    wall: Float32s
    x: Float32s
    y: Float32s
    number: Float32s


def lattice(st: Stage, pitch: float, plan: Plan, warp: Float64s) -> Cells:
    """Cells over all of the stage, of this pitch, pixels, in its middle; `warp`: by what share it grows a pixel."""
    r, shape = st.rng, st.x.shape
    x, y = st.x - F32(st.width / 2), st.y - F32(st.height / 2)
    den = (F32(warp[0]) * x + F32(warp[1]) * y + 1) * F32(pitch)
    turn = r.uniform(0, np.pi)
    c, s = F32(np.cos(turn)), F32(np.sin(turn))
    stretch = r.uniform(*plan.stretch) ** r.choice([-1, 1])
    wander = F32(r.uniform(*plan.wander))
    grain = pitch * st.ss
    sway = [wander * noise(r, shape, grain) + F32(0.35) * noise(r, shape, grain * 12) for _ in (0, 1)]
    if plan.on_block == "crush":
        where = np.clip(noise(r, shape, 90 * st.ss) * 2 - 1.2, 0, 1) * F32(0.4)
        sway = [q + where * noise(r, shape, grain * 0.5) for q in sway]
    p = (x * c + y * s) / den * F32(stretch) + sway[0]
    q = (y * c - x * s) / den / F32(stretch) + sway[1]
    root = F32(np.sqrt(3))
    p1, q1 = np.mod(p, 1) - F32(0.5), np.mod(q, root) - root / 2
    p2, q2 = np.mod(p - F32(0.5), 1) - F32(0.5), np.mod(q - root / 2, root) - root / 2
    first = p1 * p1 + q1 * q1 < p2 * p2 + q2 * q2
    lx, ly = np.where(first, p1, p2), np.where(first, q1, q2)
    tilt = np.abs(lx) * F32(0.5) + np.abs(ly) * root / 2
    away = (F32(0.5) - np.maximum(np.abs(lx), tilt)) * F32(pitch)
    thick = max(1.1, pitch * r.uniform(0.045, 0.13))
    half = np.where(np.abs(lx) > tilt, F32(thick * r.uniform(1.0, 2.0) / 2), F32(thick / 2))
    cover = np.clip((half - away) * F32(st.ss) + F32(0.5), 0, 1)
    cell = np.mod(np.sin(np.rint((p - lx) * 2) * F32(12.99) + np.rint((q - ly) * 2) * F32(78.2)) * F32(4375.5), 1)
    return Cells(cover, np.asarray(lx * c - ly * s, F32), np.asarray(lx * s + ly * c, F32), cell)


def colours_of(st: Stage, stuff: str | None, cells: Cells, lamp: Lamp) -> Float32s:
    """Colours of the block all over the stage, (H, W, 3) float32, BGR to 255: tops of walls, and cells with their lit
    side and the table dimly below. Sets the stage's tone of walls.
    """
    r, (wall, lx, ly, cell) = st.rng, cells
    top, floor = r.uniform(150, 240), r.uniform(12, 75)
    tint = np.ones(3, F32)
    if stuff == "dark":
        top, floor = r.uniform(20, 70), r.uniform(95, 190)
    elif stuff == "aramid":
        tint = np.array([r.uniform(0.35, 0.6), r.uniform(0.65, 0.85), 1.0], F32)
        top, floor = r.uniform(120, 230), r.uniform(20, 80)
    st.wall_tone = float(top)
    side = -(lx * F32(np.cos(lamp.azimuth)) + ly * F32(np.sin(lamp.azimuth)))
    lit = 1 + F32(r.uniform(0.2, 1.6)) * side + F32(r.uniform(0.05, 0.5)) * (cell - F32(0.5))
    through = F32(r.choice([0.0, r.uniform(0.05, 0.4)]))
    base = np.clip(floor * lit, 2, 255)[..., None] * tint * (1 - through) + through * st.albedo
    sheen = F32(top) * (1 + F32(0.08) * noise(r, wall.shape, 4 * st.ss) + F32(0.07) * noise(r, wall.shape, 140 * st.ss))
    return np.asarray(base + (sheen[..., None] * tint - base) * wall[..., None], F32)


def ink_block(st: Stage) -> None:
    """Write with a marker on the stage's block, in place."""
    r, shape = st.rng, st.x.shape
    canvas = np.zeros(shape, np.uint8)
    for _ in range(int(r.integers(1, 5))):
        at = r.choice(st.rings[0]) * 0.6 + st.rings[0].mean(0) * 0.4
        at = at + np.cumsum(r.normal(0, 14, (int(r.integers(3, 25)), 2)), 0)
        cv2.polylines(canvas, [np.rint(at * st.ss).astype(np.int32)], False, 255, int(r.integers(3, 16)), cv2.LINE_AA)
    colour = np.array([[25, 25, 25], [160, 50, 30], [30, 30, 190]][int(r.integers(3))], F32)
    amount = (share(canvas) * st.comb * (F32(0.45) + F32(0.45) * st.wall))[..., None]
    st.albedo = st.albedo + (colour - st.albedo) * amount


def put_block(st: Stage, colours: Float32s, plan: Plan) -> None:
    """Set the block on the stage's table, in place: darkened holes, flanks towards one side, then the top."""
    r = st.rng
    whole = covered(st.rings[:1], st.x.shape, st.ss)
    dim = r.uniform(*plan.hole_light)
    st.albedo *= (1 - F32(1 - dim) * np.clip(whole - st.comb, 0, 1))[..., None]
    lean = st.depth * r.uniform(*plan.parallax)
    turn, steps = r.uniform(0, 2 * np.pi), int(max(2, min(18, lean * st.ss)))
    shade, tint = r.uniform(0.3, 0.75), colours.mean((0, 1)) / colours.mean()
    flank, seen_any = np.zeros_like(st.comb), np.zeros_like(st.comb)
    front = F32(0.25) * st.comb + F32(0.75) * st.comb * st.wall
    for far in np.linspace(1, 0, steps, endpoint=False) * lean if lean > 1 else ():
        move = np.array([[1, 0, far * st.ss * np.cos(turn)], [0, 1, far * st.ss * np.sin(turn)]], F32)
        seen, stripes = (cv2.warpAffine(m, move, st.x.shape[::-1]) for m in (st.comb, front))
        flank += stripes * F32(1 - 0.45 * far / lean) - flank * seen
        np.maximum(seen_any, seen, out=seen_any)
    side = (flank * F32(st.wall_tone * shade))[..., None] * tint.astype(F32)
    st.albedo = st.albedo * (1 - seen_any)[..., None] + side
    st.albedo = st.albedo + (colours - st.albedo) * st.comb[..., None]
    st.ground = st.ground * (1 - st.comb) + F32(st.depth) * st.comb
