"""The block as a body: its shade, the flanks of walls down in cells, and walls' tops."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from benchmarks.other_hand.canvas import Canvas
from benchmarks.other_hand.core import Core, Walls, crushed
from benchmarks.other_hand.drawings import depth, share, sixteenths
from benchmarks.other_hand.fields import Field, Rng, blurred, shifted, smoothstep, spread
from benchmarks.other_hand.layout import Layout
from benchmarks.other_hand.outlines import across, direction
from contour.geometry.arrays import Bytes, Float32s, Float64s, Indices, Int32s

# Tops' light in a drawing of bytes: so much at most.
_MOST = 2.5


class View(NamedTuple):
    """Where the camera is, (2,), and by how much larger than a wall's foot its top is seen."""

    place: Float64s
    nearer: float


def view(rng: Rng, where: Layout, core: Core, kind: str) -> View:
    """A camera over the block, mostly not over its middle, and beside it where the table mirrors."""
    off = rng.standard_normal(2) * rng.choice([0.04, 0.18, 0.45], p=[0.4, 0.45, 0.15])
    if kind == "mirror" and rng.random() < 0.7:
        off = direction(rng.uniform(0.0, 7.0)) * rng.uniform(0.5, 0.9)
    return View(where.middle + off * where.size, core.height / (rng.uniform(1.1, 3.0) * max(where.shape)))


def paint_shade(canvas: Canvas, where: Layout, core: Core, seen: View, kind: str) -> None:
    """Dim the table in cells, close to the block, and on the side away from the lamp."""
    rng, scale = canvas.rng, 1.0 / (1.0 + seen.nearer)
    matrix = np.column_stack([np.eye(2) * scale, seen.place * (1.0 - scale)])
    foot = share(np.asarray(cv2.warpAffine(where.comb, matrix, canvas.shape[::-1]), np.uint8))
    least, most = {"light_table": (0.06, 0.75), "wood": (0.05, 0.7), "brushed": (0.05, 0.7)}.get(kind, (0.02, 0.55))
    shade = 1.0 - blurred(foot, 0.25 * min(core.height, 2.0 * where.pitch)) * (1.0 - spread(rng, least, most))
    away = min(core.height * spread(rng, 0.15, 1.2), 0.06 * canvas.shape[1]) * rng.uniform(0.2, 1.0)
    fallen = blurred(shifted(foot, -away * direction(canvas.lamp)), rng.uniform(2.0, 12.0))
    shade *= 1.0 - rng.uniform(0.0, 0.6) * fallen * (1.0 - 0.6 * foot)
    canvas.dim(np.clip(shade * (1.0 + 0.25 * foot * canvas.noise(1.1 * where.pitch)), 0.0, 2.0))


def paint_flanks(canvas: Canvas, where: Layout, core: Core, walls: Walls, seen: View, deepest: float) -> None:
    """Walls' sides as seen past their tops; what lies deeper than 1 is mirrored by the table, to the deepest."""
    nearest = _nearest(canvas, walls, seen, deepest)
    rows, columns = np.nonzero(nearest >= 0)
    number = nearest[rows, columns]
    deep, along = _hit(np.column_stack([columns, rows]).astype(np.float32), number, walls, seen)
    deep = np.clip(deep, 0.0, deepest)
    mirrored, deep = deep > 1.0, np.minimum(deep, 2.0 - deep)
    light = _falling(canvas, where, core, walls, seen, number, deep)
    streaks = canvas.rng.standard_normal((997, 14), np.float32) + 0.3 * canvas.rng.standard_normal((997, 1), np.float32)
    strength = canvas.rng.uniform(0.05, 0.3) if core.metal else canvas.rng.uniform(0.02, 0.1)
    streaked = streaks[(walls.number[number] * 7) % 997, (14.0 * along).astype(np.intp)]
    light = np.clip(light * np.clip(1.0 + strength * streaked, 0.2, 3.0), 0.004, 1.3)
    light = np.where(mirrored, light * canvas.rng.uniform(0.35, 0.85), light)
    canvas.picture[rows, columns] = light[:, None] * (core.colour if canvas.coloured else 1.0)


def _nearest(canvas: Canvas, walls: Walls, seen: View, deepest: float) -> Int32s:
    """The wall whose flank is seen at each pixel, else -1, (H, W)."""
    order = np.argsort(-np.linalg.norm(walls.middles - seen.place, axis=1))
    feet = seen.place + (walls.ends[:, ::-1] - seen.place) / (1.0 + seen.nearer * deepest)
    flanks, drawn = sixteenths(np.concatenate([walls.ends, feet], axis=1)), np.full(canvas.shape, -1, np.int32)
    for number in order.tolist():
        cv2.fillConvexPoly(drawn, flanks[number], number, cv2.LINE_8, 4)
    return drawn


def _hit(points: Float32s, number: Int32s, walls: Walls, seen: View) -> tuple[Float32s, Float32s]:
    """Where lines of sight through points, (K, 2), meet their walls: how deep, from 0 at the top to 1, and how far
    along, from 0 to below 1.
    """
    start, end = (walls.ends - seen.place).astype(np.float32).transpose(1, 0, 2)
    side = end - start
    ray, side_there = points - seen.place.astype(np.float32), side[number]
    reach = start[:, 0] * side[:, 1] - start[:, 1] * side[:, 0]
    slant = ray[:, 0] * side_there[:, 1] - ray[:, 1] * side_there[:, 0]
    times = reach[number] / np.where(np.abs(slant) < 1e-3, np.float32(1e-3), slant)
    along = ((times[:, None] * ray - start[number]) * side_there).sum(axis=1) / (side**2).sum(axis=1)[number]
    return np.asarray((times - 1.0) / np.float32(seen.nearer), np.float32), np.clip(along, 0.0, 0.999)


def _falling(
    canvas: Canvas, where: Layout, core: Core, walls: Walls, seen: View, number: Int32s, deep: Field
) -> Float32s:
    """Light of flanks at pixels, (K,): of one to three lamps, and from above."""
    rng, metal = canvas.rng, core.metal
    normals = across(walls.along)
    normals /= np.linalg.norm(normals, axis=1)[:, None] + 1e-9
    normals *= np.where((normals * (seen.place - walls.middles)).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]
    light = rng.uniform(0.1, 0.5) * np.exp(-deep * core.height / (rng.uniform(0.35, 1.5) * where.pitch))
    for lamp in range(rng.integers(1, 4)):
        azimuth = canvas.lamp + rng.uniform(-2.5, 2.5) * (lamp > 0)
        facing = np.maximum(normals @ direction(azimuth), 0.0) ** (rng.uniform(1.0, 3.0) if metal else 1.0)
        lit = 0.9 * where.pitch / (spread(rng, 0.15, 1.2) * core.height)
        light += rng.uniform(0.15, 1.2) * facing.astype(np.float32)[number] * smoothstep(1.4 - deep / lit)
    sheen = rng.uniform(0.15, 0.6) if metal else rng.uniform(0.05, 0.2)
    own = np.exp(_own(rng, walls.number) * sheen).astype(np.float32)
    return np.asarray(core.light * rng.uniform(0.25, 0.95 if metal else 0.6) * light * own[number], np.float32)


def _own(rng: Rng, number: Indices) -> Float64s:
    """A normal draw for each wall, the same for all parts of one."""
    return rng.standard_normal(int(number.max()) + 1)[number]


def paint_tops(canvas: Canvas, where: Layout, core: Core, walls: Walls) -> None:
    """Walls' tops with nodes, bond lines and burrs, and tell the canvas of them."""
    fine = 3 if math.prod(canvas.shape) < 2.2e6 and where.pitch < 40.0 else 2
    small = cv2.resize(_drawn_tops(canvas, where, core, walls, fine), canvas.shape[::-1], interpolation=cv2.INTER_AREA)
    cover, rng = share(np.asarray(small[..., 0], np.uint8)), canvas.rng
    light = small[..., 1] * np.float32(_MOST / 255.0) / np.maximum(cover, 1e-3)
    # What is thinner than a pixel would be lost in it.
    light *= core.light * min(2.4, max(1.0, (1.0 / core.wall) ** rng.uniform(0.5, 0.9)))
    light *= canvas.mottled((3.0, 0.12 if core.metal else 0.05), (6.0 * where.pitch, 0.05))
    if core.metal and rng.random() < 0.6:
        light = np.where(canvas.noise(2.5) > rng.uniform(1.9, 2.6), light * rng.uniform(1.2, 1.8), light)
    canvas.tops = cover
    canvas.paint(cover, light, core.colour)


def _drawn_tops(canvas: Canvas, where: Layout, core: Core, walls: Walls, fine: int) -> Bytes:
    """Tops at so many times the picture's size: cover and light of it, (fine·H, fine·W, 2)."""
    rng, along = canvas.rng, walls.along
    lengths = np.linalg.norm(along, axis=1)[:, None] + 1e-9
    wide, light = _widths_and_lights(canvas, where, core, walls)
    longer = np.where(walls.cut, -0.5 / fine, 0.3 * wide[:, None])[..., None] * (along / lengths)[:, None]
    ends = ((walls.ends + longer * np.array([-1.0, 1.0])[:, None] + 0.5) * fine) - 0.5
    # OpenCV paints a polygon's border too, a pixel in all.
    half = 0.5 * np.maximum(wide * fine - 1.0, 0.0)[:, None] * np.clip(rng.normal(1.0, 0.12, (len(wide), 2)), 0.5, 1.6)
    aside = (across(along) / lengths)[:, None] * half[..., None]
    corners = sixteenths(np.concatenate([ends + aside, (ends - aside)[:, ::-1]], axis=1))
    cover = np.minimum(wide * fine, 1.0)
    levels = np.column_stack([255.0 * cover, np.clip(255.0 / _MOST * light * cover, 0.0, 255.0)]).astype(int).tolist()
    drawn = np.zeros((fine * canvas.shape[0], fine * canvas.shape[1], 2), np.uint8)
    for polygon, level in zip(corners, levels, strict=True):
        cv2.fillConvexPoly(drawn, polygon, level, cv2.LINE_8, 4)
    points = sixteenths(ends)
    if core.double > 3.2 and core.metal:
        for wall in np.flatnonzero(walls.double).tolist():
            bond = levels[wall][0], 0.45 * levels[wall][1]
            cv2.polylines(drawn, [points[wall]], False, bond, max(1, int(0.15 * core.double * fine)), cv2.LINE_8, 4)
    if not core.metal or core.wall > 2.0:
        radius = core.wall * (0.55 if core.metal else rng.uniform(0.6, 1.1))
        x, y = np.clip(np.round(walls.ends).astype(int), 0, np.array(canvas.shape[::-1]) - 1).transpose(2, 0, 1)
        for wall, end in np.argwhere(~walls.cut & (depth(where.comb)[y, x] > radius + 1.0)).tolist():
            cv2.circle(drawn, points[wall, end].tolist(), int(12.8 * radius * fine), levels[wall], -1, cv2.LINE_8, 4)
    for burr in sixteenths((walls.burrs + 0.5) * fine - 0.5):
        level, thick = (255.0, 255.0 / _MOST * rng.uniform(0.6, 1.4)), round(core.wall * fine * rng.uniform(0.5, 1.0))
        cv2.polylines(drawn, [burr], False, level, max(1, thick), cv2.LINE_8, 4)
    return drawn


def _widths_and_lights(canvas: Canvas, where: Layout, core: Core, walls: Walls) -> tuple[Float64s, Float64s]:
    """Of walls' tops, each (N,), by cell wall and direction, and by how much they are crushed."""
    rng, along = canvas.rng, walls.along
    vary = rng.uniform(0.08, 0.3) if core.metal else rng.uniform(0.03, 0.12)
    light = np.clip(1.0 + vary * _own(rng, walls.number), 0.35, 1.8)
    turn = np.cos(2.0 * (np.arctan2(along[:, 1], along[:, 0]) - canvas.lamp))
    light = np.clip(light * (1.0 + rng.uniform(0.0, 0.25) * turn), 0.25, 2.0)
    wide = np.where(walls.double, core.double, core.wall) * np.clip(1.0 + 0.1 * _own(rng, walls.number), 0.6, 1.5)
    for dent in where.dents:
        bent = crushed(walls.middles, dent)
        wide *= 1.0 + bent * np.abs(rng.standard_normal(len(wide))) * rng.uniform(0.3, 1.6)
        light *= np.clip(1.0 - bent * rng.uniform(-0.3, 0.7, len(wide)), 0.15, 2.0)
    return wide, light
