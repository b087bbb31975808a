"""Pictures of a block on a cutting machine's table, with or without things over it, and what is true of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.fifth_hand.camera import expose, light_field, metered
from benchmarks.fifth_hand.core import CombStyle, Lattice, draw_comb, lattice, near_block
from benchmarks.fifth_hand.noise import smooth_noise
from benchmarks.fifth_hand.outlines import block_rings, dense, projected, tilt
from benchmarks.fifth_hand.parts import Part, Sun, draw_part
from benchmarks.fifth_hand.placing import things_beside, things_over
from benchmarks.fifth_hand.plans import PLANS, Plan
from benchmarks.fifth_hand.raster import paint, polygon_cover, random_tint, stroke_cover
from benchmarks.fifth_hand.tables import MARKINGS, base_table, block_shadow, lines_to_block, swarf
from benchmarks.other_hand.fields import Rng, Shape
from benchmarks.third_hand.scene import Scene
from contour.geometry.arrays import Bools, Float32s, Float64s

KINDS: tuple[str, ...] = tuple(PLANS)
_BROWN = np.array([0.55, 0.98, 1.47])


def scene(kind: str, seed: int) -> Scene:
    """A scene of one of `KINDS`, the same for the same seed; ValueError for a kind that is none."""
    if kind not in KINDS:
        raise ValueError(f"{kind!r} is no kind: expected one of {', '.join(KINDS)}")
    plan = PLANS[kind]
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    width = int(rng.integers(700, 1501))
    shape = (int(width * rng.uniform(0.66, 0.85)), width)
    size = (shape[1], shape[0])
    matrix = tilt(rng, size)
    rings = tuple(projected(ring, matrix) for ring in block_rings(rng, size, plan.wish))
    block = polygon_cover(shape, rings)
    inside = block > 0.5
    table_light = float(rng.uniform(*(plan.table_light or (0.02, 0.98)))) ** (1.0 if plan.table_light else 1.4)
    style, sun = _comb_style(rng, plan, table_light), _sun(rng, plan)
    canvas = _table(rng, plan, shape, table_light, dense(rings[0]))
    block_shadow(canvas, block, sun, rng.uniform(8, 40), lit_floor=style.through > 0.6)
    beside = plan.near_things or int(rng.integers(0, 4)) * int(rng.random() < 0.4)
    low_sun = replace(sun, reach=min(sun.reach, 1.0))
    apart = things_beside(rng, beside, rings, inside, near=plan.near_things > 0)
    _draw_all(rng, canvas, apart, low_sun)
    net = lattice(rng, style, size, matrix)
    tops = draw_comb(rng, canvas, block, net, style, _eye(rng, plan, size))
    if plan.filled or rng.random() < 0.06:
        _fill_cells(rng, canvas, net, block, tops, plan.filled or 0.01)
    if plan.ink or rng.random() < 0.06:
        _draw_ink(rng, canvas, tops, rings[0])
    hidden = _draw_all(rng, canvas, things_over(rng, plan, rings, inside, table_light), low_sun)
    glare = plan.glare or rng.choice([0.0, rng.uniform(0, 0.6)])
    canvas *= light_field(rng, shape, glare)[..., None]
    canvas *= np.float32(metered(rng, canvas, inside))
    picture = expose(rng, canvas, rng.uniform(*plan.noise), colour=rng.random() < 0.5)
    return Scene(picture, rings, style.pitch, hidden, (tops > 0.45) & ~hidden & inside, inside)


def _comb_style(rng: Rng, plan: Plan, table_light: float) -> CombStyle:
    """How the block looks on a table of this light."""
    low, high = plan.pitch
    pitch = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    wall = float(np.clip(pitch * rng.uniform(0.05, 0.14), 1.0, 4.5))
    dark = rng.random() < plan.dark_walls and table_light > 0.3
    light, through = rng.uniform(0.35, 1.0), rng.choice([rng.uniform(0, 0.15), rng.uniform(0.1, 0.45)])
    if dark:
        light, through = rng.uniform(0.05, 0.45) * table_light, rng.uniform(0.65, 1.0)
    floor = through * table_light
    if not dark and light < floor + 0.25:
        light, through = min(1.0, floor + 0.3), through * 0.6
    tint = _BROWN if rng.random() < plan.aramid else random_tint(rng, 0.15)
    return CombStyle(
        pitch,
        wall,
        rng.uniform(*plan.doubled),
        rng.uniform(*plan.jitter),
        rng.uniform(*plan.stretch),
        rng.choice([0, np.pi / 6, rng.uniform(0, np.pi)]),
        light,
        light * rng.uniform(0.2, 0.75),
        through,
        rng.uniform(*plan.depth),
        tint,
        rng.uniform(0.03, 0.3),
        plan.crushed,
    )


def _sun(rng: Rng, plan: Plan) -> Sun:
    """The main light."""
    turn = rng.uniform(0, 2 * np.pi)
    return Sun(
        np.array([np.cos(turn), np.sin(turn)]),
        rng.uniform(*plan.sun_reach),
        rng.uniform(*plan.sun_soft),
        rng.uniform(*plan.sun_strength),
    )


def _table(rng: Rng, plan: Plan, shape: Shape, light: float, ring: Float64s) -> Float32s:
    """The table, (H, W, 3) float32, with what is drawn or lies on it about the ring, (N, 2)."""
    canvas = base_table(rng, shape, light)
    extra = tuple(rng.choice(list(MARKINGS), 1)) if not plan.markings and rng.random() < 0.3 else ()
    for name in (*plan.markings, *extra):
        MARKINGS[str(name)](rng, canvas, light)
    chalk = plan.chalk or int(rng.integers(1, 4)) * int(rng.random() < 0.12)
    if chalk:
        lines_to_block(rng, canvas, light, ring, chalk)
    if plan.swarf or rng.random() < 0.1:
        swarf(rng, canvas, light, ring)
    return canvas


def _fill_cells(rng: Rng, canvas: Float32s, net: Lattice, block: Float32s, tops: Float32s, share: float) -> None:
    """Fill cells of the block with paste, in patches and a share of them singly, in place."""
    inside = net.cells[near_block(net.cells.mean(1), block, 1)]
    shape = (block.shape[0], block.shape[1])
    patch = smooth_noise(rng, shape, 90)
    spot = np.clip(np.rint(inside.mean(1)), 0, np.array(shape[::-1]) - 1).astype(int)
    chosen = (patch[spot[:, 1], spot[:, 0]] > 1.3) | (rng.random(len(inside)) < share * rng.uniform(0.1, 1))
    light, tint = rng.uniform(0.0, 1.0), random_tint(rng)
    for shade in (0.85, 1.0, 1.15):
        some = chosen & (rng.random(len(inside)) < 0.5)
        if some.any():
            grain = 1 + 0.08 * smooth_noise(rng, shape, 3)
            paint(canvas, polygon_cover(shape, list(inside[some])) * block * (1 - tops), light * shade * grain, tint)


def _draw_ink(rng: Rng, canvas: Float32s, tops: Float32s, ring: Float64s) -> None:
    """Write with a marker on the tops of walls, in place."""
    light, tint = rng.uniform(0, 0.5), random_tint(rng, 0.9)
    low, high = ring.min(0), ring.max(0)
    for _ in range(int(rng.integers(2, 8))):
        path = rng.uniform(low, high) + np.cumsum(rng.normal(0, 30, (6, 2)) + rng.normal(0, 40, 2), 0)
        stroke = stroke_cover((tops.shape[0], tops.shape[1]), path, rng.uniform(4, 22))
        paint(canvas, stroke * tops * rng.uniform(0.5, 0.95), light, tint)


def _draw_all(rng: Rng, canvas: Float32s, parts: list[Part], sun: Sun) -> Bools:
    """Where parts are, (H, W); paints them on the canvas, (H, W, 3), in place."""
    hidden = np.zeros(canvas.shape[:2], bool)
    for part in parts:
        draw_part(rng, canvas, part, sun, hidden)
    return hidden


def _eye(rng: Rng, plan: Plan, size: tuple[int, int]) -> Float64s:
    """The point below the camera, pixels, in a picture of this width and height."""
    frame = np.array(size, float)
    if plan.eye_far:
        turn = rng.uniform(0, 2 * np.pi)
        return frame * (0.5 + np.array([np.cos(turn), np.sin(turn)]) * rng.uniform(0.5, 0.9))
    return frame * rng.uniform(0.25, 0.75, 2)
