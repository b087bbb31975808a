"""Things that lie over comb, and in it where a hole could be."""

from __future__ import annotations

import math

import cv2
import numpy as np

from benchmarks.segmentation.patterns import lay, lay_disc, noise, pattern
from benchmarks.segmentation.planes import (
    SIZE,
    SURE,
    along_and_off,
    aside,
    depth,
    place,
    places,
    share,
    slope,
    surface,
    table_light,
)
from contour.geometry.arrays import Float32s, Float64s, quantile

# Of holes so many are things that lie there, most of them about as light as the table.
_LAID, _AS_TABLE = 0.6, 0.7


def like_hole(light: Float32s, shares: list[Float32s], rng: np.random.Generator) -> tuple[Float32s, list[Float32s]]:
    """With a hole that shows the table, in shade at its rim, or with a thing in its place: as light, with another
    surface, a rim, a knob, a shadow on the block.
    """
    wall, comb, thing, seam = shares
    inside = cv2.erode((comb > SURE).astype(np.uint8), np.ones((9, 9), np.uint8))[::4, ::4] > 0
    if not inside.any():
        return light, shares
    mask, across = _hole_or_body(place(inside, rng), rng)
    level = table_light(light, comb, thing)
    if level is None:
        level = quantile(light[comb > SURE], rng.uniform(0.05, 0.95))
    grain = surface(rng, 60.0)
    table = np.float32(level) * (1.0 + np.float32(rng.uniform(0.0, 0.25)) * grain)
    if rng.random() > _LAID:
        shade = np.float32(rng.uniform(0.0, 0.7)) * np.exp(-depth(mask) / float(rng.uniform(2.0, 20.0)))
        away = cv2.warpAffine(
            mask, aside(float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(0.0, 14.0))), (SIZE,) * 2
        )
        cast = cv2.GaussianBlur(1.0 - away, (0, 0), float(rng.uniform(0.5, 4.0))) * np.float32(rng.uniform(0.0, 0.6))
        body = table * (1.0 - shade) * (1.0 - cast) * np.float32(rng.uniform(0.6, 1.05))
        kept = 1.0 - mask
        shares = [wall * kept, comb * kept, thing, seam * kept]
    else:
        light, body = _thing_body(light, float(table.mean()), mask, across, rng)
        shares = [wall, comb, np.maximum(thing, mask), seam]
    return np.asarray(light * (1.0 - mask) + np.clip(body, 0.0, 255.0) * mask, np.float32), shares


def _hole_or_body(middle: Float64s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """The shape of a hole or a thing about a place, and how far across it a place lies, -1...1."""
    if rng.random() < 0.3:
        return _disc(middle, rng)
    mask = np.zeros((SIZE, SIZE), np.uint8)
    most = 150.0 if rng.random() < 0.5 else 450.0
    if most > SIZE:  # its rim runs through the part, its middle need not
        turn = float(rng.uniform(0.0, 2.0 * math.pi))
        middle = middle + float(rng.uniform(0.0, 0.4 * most)) * np.array([math.cos(turn), math.sin(turn)])
    if rng.random() < 0.6:
        sides = np.exp(rng.uniform(math.log(30.0), math.log(most), 2))
        lay(mask, cv2.boxPoints((middle.tolist(), sides.tolist(), float(rng.uniform(0.0, 180.0)))), 255)
        if rng.random() < 0.4:
            soft = cv2.GaussianBlur(mask, (0, 0), float(rng.uniform(2.0, 8.0)))
            mask = np.clip((soft.astype(np.float32) - 127.0) * 8.0 + 127.0, 0.0, 255.0).astype(np.uint8)
    else:
        count, turn = int(rng.choice([5, 6, 8, 60])), float(rng.uniform(0.0, 6.0))
        lay(mask, _even_corners(middle, float(rng.uniform(20.0, 0.5 * most)), count, turn), 255)
    return share(mask), slope(rng)


def _even_corners(middle: Float64s, radius: float, count: int, turn: float) -> Float64s:
    """The corners of an even polygon, (count, 2); of many, of a disc."""
    turns = np.arange(count) * 2.0 * math.pi / count + turn
    return middle + radius * np.column_stack((np.cos(turns), np.sin(turns)))


def _thing_body(
    light: Float32s, table: float, mask: Float32s, across: Float32s, rng: np.random.Generator
) -> tuple[Float32s, Float32s]:
    """The light around a thing that lies on such a table, which may be in its shadow, and that of its body."""
    level = table * math.exp(rng.uniform(-0.25, 0.25))
    if rng.random() > _AS_TABLE:
        level = float(rng.uniform(10.0, 245.0))
    grain = surface(rng, 40.0)
    body = np.float32(level) * (1.0 + np.float32(rng.uniform(0.0, 0.3)) * grain)
    body = body * (1.0 + np.float32(rng.uniform(-0.5, 0.5) * (rng.random() < 0.6)) * across)
    deep = depth(mask)
    lamp = 1.0 + np.float32(rng.uniform(0.0, 1.0)) * slope(rng)
    for _ in range(int(rng.integers(0, 4))):  # rims, grooves, a bevel
        rim, wide = float(rng.uniform(0.0, 12.0)), float(rng.uniform(0.5, 3.0))
        ring = np.exp(-(((deep - rim) / wide) ** 2))
        body = body + np.float32(rng.uniform(-0.5, 0.7) * max(level, 40.0)) * ring * lamp
    if rng.random() < 0.5:  # a knob, a socket, a head with corners
        y, x = np.nonzero(mask > 0.5)
        middle = np.array([x.mean(), y.mean()]) if len(x) else np.full(2, 0.5 * SIZE)
        radius, corners = float(rng.uniform(0.15, 0.7)) * float(deep.max()), int(rng.choice([6, 6, 40, 40, 4]))
        knob = np.zeros((SIZE, SIZE), np.uint8)
        lay(knob, _even_corners(middle, radius, corners, float(rng.uniform(0.0, 6.0))), 255)
        head = share(knob)
        cast = cv2.GaussianBlur(np.roll(head, tuple(rng.integers(-5, 6, 2).tolist()), (0, 1)), (0, 0), 1.5)
        body = body * (1.0 - np.float32(rng.uniform(0.0, 0.6)) * cast)
        body = body * (1.0 - head) + head * np.float32(level * rng.uniform(0.6, 1.5))
        edge = np.abs(cv2.GaussianBlur(head, (0, 0), 1.0) - head)
        body = body + np.float32(rng.uniform(-1.0, 1.0) * level) * edge * lamp
    if rng.random() < 0.65:
        far = float(rng.uniform(0.0, 12.0))
        cast = cv2.warpAffine(mask, aside(float(rng.uniform(0.0, 2.0 * math.pi)), far), (SIZE, SIZE))
        light = light * (1.0 - np.float32(rng.uniform(0.1, 0.8)) * cv2.GaussianBlur(cast, (0, 0), 0.5 + 0.4 * far))
    return np.asarray(light, np.float32), np.asarray(body, np.float32)


def covered(light: Float32s, comb: Float32s, thing: Float32s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """Beneath something, mostly about the outline, half of them with a shadow; a few are clear, as some tapes are."""
    edge = places(comb[::4, ::4] * np.float32(255.0), 0.0)
    about = edge.any() and rng.random() < 0.6
    middle = place(edge, rng) if about else rng.uniform(0.0, SIZE, 2)
    over, across = _THINGS[int(rng.integers(len(_THINGS)))](middle, rng)
    if rng.random() < 0.5:
        away = tuple(rng.integers(-5, 6, 2).tolist())
        cast = np.roll(cv2.GaussianBlur(over, (0, 0), float(rng.uniform(1.0, 5.0))), away, (0, 1))
        light = light * (1.0 - np.float32(rng.uniform(0.1, 0.6)) * cast)
    printed = rng.uniform(0.0, 0.25 if rng.random() < 0.7 else 0.8) * (rng.random() < 0.8)
    body = np.float32(rng.uniform(15.0, 240.0)) * (1.0 + np.float32(printed) * pattern(rng, SIZE))
    body = body * (1.0 + np.float32(rng.uniform(-0.6, 0.6)) * across)
    if rng.random() < 0.3:
        body = body + np.float32(rng.uniform(20.0, 160.0)) * np.exp(
            -((across / np.float32(rng.uniform(0.1, 0.6))) ** 2)
        )
    if rng.random() < 0.35:
        light, body = _thing_body(light, _about_as_table(light, comb, thing, rng), over, across, rng)
    elif rng.random() < 0.3:
        body = body * np.float32(_about_as_table(light, comb, thing, rng) / max(float(body.mean()), 1.0))
    if rng.random() < 0.3:
        body = body * (1.0 + np.float32(rng.uniform(0.05, 0.4)) * noise(rng, SIZE, float(rng.uniform(10.0, 60.0))))
    dense = over * np.float32(1.0 if rng.random() < 0.85 else rng.uniform(0.4, 0.8))
    return np.asarray(light * (1.0 - dense) + body * dense, np.float32), np.maximum(thing, over)


def _about_as_table(light: Float32s, comb: Float32s, thing: Float32s, rng: np.random.Generator) -> float:
    """About as light as the table in the part, if it shows one."""
    table = table_light(light, comb, thing)
    return (float(rng.uniform(10.0, 230.0)) if table is None else table) * math.exp(rng.uniform(-0.25, 0.25))


def _sheet(middle: Float64s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """A sheet, a cloth or a sleeve that goes on beyond the part: one border, or two as of a strap, or a corner."""

    def border() -> Float32s:
        off = along_and_off(middle, float(rng.uniform(0.0, 2.0 * math.pi)))[0]
        if wavy:
            off = off + np.float32(rng.uniform(1.0, 12.0)) * noise(rng, SIZE, float(rng.uniform(15.0, 80.0)))
        return np.asarray(off, np.float32)

    wavy, how = rng.random() < 0.5, rng.random()
    off = border()
    if how < 0.3:
        wide = np.float32(math.exp(rng.uniform(math.log(30.0), math.log(200.0))))
        off = np.minimum(off, wide - off)
    elif how < 0.55:
        off = np.minimum(off, border())
    over = np.clip(off + 0.5, 0.0, 1.0).astype(np.float32)
    return over, np.clip(off / np.float32(rng.uniform(10.0, 120.0)), -1.0, 1.0).astype(np.float32)


def _clamp(middle: Float64s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """An arm with a foot, a screw, a plate."""
    over, across = _strip(middle, rng)
    for _ in range(int(rng.integers(1, 4))):
        more, slant = (_disc if rng.random() < 0.5 else _strip)(middle + rng.uniform(-25.0, 25.0, 2), rng)
        over, across = np.maximum(over, more), np.where(more > over, slant, across)
    return over, across


def _strip(middle: Float64s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """A strip, and how far to one of its sides a place lies, −1…1."""
    size = float(rng.uniform(20.0, 200.0)), float(rng.uniform(8.0, 50.0))
    mask = np.zeros((SIZE, SIZE), np.uint8)
    lay(mask, cv2.boxPoints((middle.tolist(), size, float(rng.uniform(0.0, 180.0)))), 255)
    return share(mask), slope(rng)


def _cornered(middle: Float64s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    mask = np.zeros((SIZE, SIZE), np.uint8)
    lay(mask, middle + rng.uniform(-50.0, 50.0, (6, 2)), 255)
    return share(mask), slope(rng)


def _disc(middle: Float64s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """A disc, mostly not round, as weights are, and how far from its middle a place lies."""
    axes = rng.uniform(8.0, 60.0, 2)
    axes[1] = axes[0] if rng.random() < 0.5 else axes[1]
    mask = np.zeros((SIZE, SIZE), np.uint8)
    turn = float(rng.uniform(0.0, 180.0))
    lay_disc(mask, middle, axes, turn, 255)
    y, x = np.mgrid[:SIZE, :SIZE]
    away = np.hypot(x - middle[0], y - middle[1]) / axes.max()
    return share(mask), np.clip(away - rng.uniform(0.0, 0.5), -1.0, 1.0).astype(np.float32)


def _rod(middle: Float64s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """A cable, a finger or a tool: as wide all along, bent or straight, and how far from its middle a place lies."""
    wide = math.exp(rng.uniform(math.log(2.0), math.log(50.0)))
    turn, bend = rng.uniform(0.0, 2.0 * math.pi), rng.normal(0.0, 0.012) * (rng.random() < 0.7)
    steps = np.arange(0.0, float(rng.uniform(30.0, 300.0)), 2.0)
    turns = turn + bend * steps + rng.uniform(0.0, 0.6) * np.sin(steps / rng.uniform(15.0, 60.0))
    path = 2.0 * np.cumsum(np.column_stack((np.cos(turns), np.sin(turns))), axis=0)
    path += middle - path[int(rng.integers(len(path)))]
    line = np.full((SIZE, SIZE), 255, np.uint8)
    cv2.polylines(line, [np.rint(path * 8).astype(np.int32)], False, 0, 1, cv2.LINE_8, 3)
    off = np.minimum(cv2.distanceTransform(line, cv2.DIST_L2, 5), np.float32(SIZE))
    over = np.clip(0.5 * wide - off + 0.5, 0.0, 1.0).astype(np.float32)
    return over, np.clip(2.0 * off / np.float32(wide), 0.0, 1.0).astype(np.float32)


_THINGS = (_strip, _cornered, _disc, _rod, _rod, _sheet, _sheet, _clamp)
