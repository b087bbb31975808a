"""Parts of examples, on other tables, beneath other things, in other light, and as other cameras would see them."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from benchmarks.segmentation.examples import SEAM_PITCHES, Example
from benchmarks.segmentation.patterns import lay, noise, pattern
from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, median, quantile
from contour.image.opencv import grey
from contour.segmentation.network import PITCH_PX

SIZE = 192
_SURE = 0.9
# So many are made of two parts, as of two blocks; and so many of the others of a seam lie about it.
_JOINED, _AT_SEAM = 0.18, 0.4
# So many of those that are to be holed are, of which so many holes are things that lie there, most of them about as
# light as the table; so many of them lie in comb, as places are drawn by that number.
_HOLED, _LAID, _AS_TABLE, _INSIDE, _IN_COMB = 0.75, 0.6, 0.7, 0.5, 0.8
# Of those of two parts, so many have one on the other, and so many a splice between them.
_STACKED, _GLUED = 0.15, 0.35


class Crop(NamedTuple):
    """What the network is shown, and what it is to say of it: shares of a wall's top, comb, a thing, and a seam, each
    (SIZE, SIZE), float32.
    """

    light: Float32s
    wall: Float32s
    comb: Float32s
    thing: Float32s
    seam: Float32s


def crop(one: Example, rng: np.random.Generator, *, holed: bool = False) -> Crop:
    """A part of the example, drawn at random; `holed`: mostly with a hole in the block, or what looks like one."""
    light, (wall, comb, thing, seam) = _joined(one, rng) if rng.random() < _JOINED else _part(one, rng, inside=holed)
    if holed and rng.random() < _HOLED:
        light, (wall, comb, thing, seam) = _like_hole(light, [wall, comb, thing, seam], rng)
    if rng.random() < 0.12:
        light = _lined(light, wall, thing, rng)
    if rng.random() < 0.08:
        light, (wall, comb, thing, seam) = _crushed(light, [wall, comb, thing, seam], rng)
    if rng.random() < 0.3:
        light = _of_other_foil(light, comb, rng)
    if rng.random() < 0.5:
        gone = _cut_out(rng) if rng.random() < 0.4 else np.zeros_like(comb)
        wall, comb, seam = wall * (1.0 - gone), comb * (1.0 - gone), seam * (1.0 - gone)
        light = _on_other_table(light, comb, thing, gone, rng, dark=one.dark)
    if rng.random() < 0.25:
        light = _with_flanks(light, comb * (1.0 - thing), rng)
    if rng.random() < 0.2:
        light = _with_cast_walls(light, wall, 1.0 - np.maximum(comb, thing), rng)
    if rng.random() < 0.1:
        shade = np.float32(rng.uniform(-0.3, 0.5))
        light = light * (1.0 - shade * np.clip(0.5 + _line(rng) / float(rng.uniform(1.0, 10.0)), 0.0, 1.0))
    if rng.random() < 0.35:
        light, thing = _covered(light, comb, thing, rng)
    light = (_seen(light, rng) - np.float32(one.mean)) / np.float32(one.spread)
    light = light * np.float32(math.exp(rng.uniform(-0.4, 0.4))) + np.float32(rng.uniform(-0.5, 0.5))
    if rng.random() < 0.08:
        light = -light
    free = 1.0 - thing
    return Crop(light, wall * free, comb * free, thing, seam * free)


def _part(one: Example, rng: np.random.Generator, *, inside: bool) -> tuple[Float32s, list[Float32s]]:
    """Light of the picture, or of one of its channels, about a place that mostly is near the outline, or within it,
    turned, mirrored and sized at random; and the shares of walls, comb, things and seams there.
    """
    which = rng.random()
    if inside and which < _INSIDE:
        which = _IN_COMB
    places = one.seam[::4, ::4] > 100 if rng.random() < _AT_SEAM else _places(one.comb[::4, ::4], which)
    if not places.any():
        places = _places(one.comb[::4, ::4], which)
    view = _View(float(rng.uniform(0.0, 360.0)), math.exp(rng.uniform(-0.12, 0.12)), rng.random() < 0.5)
    return _seen_by(one, view, _channel(one, rng), _place(places, rng))


class _View(NamedTuple):
    """How a part is turned, degrees, how many times as large it is, and whether it is mirrored."""

    turn: float
    size: float
    mirrored: bool


def _channel(one: Example, rng: np.random.Generator) -> Bytes:
    """Light of the picture, or of one of its channels."""
    if one.picture.ndim == 3 and rng.random() < 0.3:
        return np.ascontiguousarray(one.picture[..., int(rng.integers(3))])
    return grey(one.picture)


def _place(places: Bools, rng: np.random.Generator) -> Float64s:
    """Somewhere about one of these places, of every fourth sample, (2,), x and y."""
    rows, columns = np.nonzero(places)
    number = int(rng.integers(len(rows)))
    return 4.0 * np.array([columns[number], rows[number]]) + rng.uniform(-60.0, 60.0, 2)


def _seen_by(one: Example, view: _View, channel: Bytes, middle: Float64s) -> tuple[Float32s, list[Float32s]]:
    """Light and the shares of walls, comb, things and seams about a place."""
    matrix = cv2.getRotationMatrix2D(middle.tolist(), view.turn, view.size)
    matrix[:, 2] += 0.5 * SIZE - middle
    if view.mirrored:
        matrix = np.diag([-1.0, 1.0]) @ matrix + np.array([[0.0, 0.0, SIZE - 1.0], [0.0, 0.0, 0.0]])
    planes = (one.wall, one.comb, one.thing, one.seam)
    shares = [_moved(plane, matrix, cv2.INTER_LINEAR) / np.float32(255.0) for plane in planes]
    return _moved(channel, matrix, cv2.INTER_CUBIC), shares


def _joined(one: Example, rng: np.random.Generator) -> tuple[Float32s, list[Float32s]]:
    """Two parts of one example as two blocks, alike or turned, that lie against each other or one on the other; or as a
    block with a splice, of which no seam is to be told.
    """
    channel, turn = _channel(one, rng), float(rng.uniform(0.0, 360.0))
    alike = turn + (float(rng.normal(0.0, 2.0)) if rng.random() < 0.6 else float(rng.uniform(0.0, 360.0)))
    size, mirrored = math.exp(rng.uniform(-0.12, 0.12)), rng.random() < 0.5
    larger = size * math.exp(rng.uniform(-0.3, 0.3) * (rng.random() < 0.25))
    within = _places(one.comb[::4, ::4], _IN_COMB)
    first, second = (
        _seen_by(one, view, channel, _place(within, rng))
        for view in (_View(turn, size, mirrored), _View(alike, larger, mirrored))
    )
    off, how = _line(rng), rng.random()
    if how < _STACKED:
        through = np.minimum(first[0], second[0]) if one.dark else np.maximum(first[0], second[0])
        first, second = (np.asarray(through, np.float32), second[1]), (first[0], [*first[1][:3], np.zeros_like(off)])
    glued = how > 1.0 - _GLUED
    gap = (float(rng.uniform(0.2, 1.6 if glued else 1.0)) * (glued or rng.random() < 0.7)) * PITCH_PX
    both = np.minimum(*(cv2.blur(part[1][1], (9, 9)) for part in (first, second))) > 0.3
    apart = np.float32(0.5 * gap * (how >= _STACKED)) * both
    sides = [np.clip(0.5 + away - apart, 0.0, 1.0) for away in (-off, off)]
    wall, comb, thing, seam = (
        sides[0] * one_side + sides[1] * other_side for one_side, other_side in zip(first[1], second[1], strict=True)
    )
    between = 1.0 - sides[0] - sides[1]
    if glued:
        fill = _glue(first[0], rng)
        comb = np.maximum(comb, between)
    else:
        fill = quantile(first[0], rng.uniform(0.0, 0.3) if rng.random() < 0.6 else rng.uniform(0.3, 1.0))
        seam = np.maximum(seam, (np.abs(off) < max(SEAM_PITCHES * PITCH_PX, 0.5 * gap)) & both)
    light = sides[0] * first[0] + sides[1] * second[0] + between * fill
    return np.asarray(light, np.float32), [np.asarray(part, np.float32) for part in (wall, comb, thing, seam)]


def _glue(light: Float32s, rng: np.random.Generator) -> Float32s:
    """Foamed adhesive: as light as floors to lighter than walls, in bubbles."""
    level = quantile(light, rng.uniform(0.1, 1.0)) * float(rng.uniform(0.8, 1.2)) + float(rng.uniform(0.0, 30.0))
    bubbles = noise(rng, SIZE, float(rng.uniform(1.0, 4.0)))
    return np.asarray(level * np.clip(1.0 + np.float32(rng.uniform(0.03, 0.35)) * bubbles, 0.2, 2.0), np.float32)


def _lined(light: Float32s, wall: Float32s, thing: Float32s, rng: np.random.Generator) -> Float32s:
    """On a table with lines, darker or lighter, which show between walls, too: no seams."""
    lines, apart = np.zeros_like(light), float(rng.uniform(20.0, 80.0))
    off, wide = _line(rng), float(rng.uniform(1.0, 8.0))
    for number in range(-int(rng.integers(0, 3)), 1 + int(rng.integers(0, 3))):
        lines = np.maximum(lines, np.clip(0.5 * wide + 0.5 - np.abs(off - number * apart), 0.0, 1.0))
    shade = np.float32(rng.uniform(-0.75, 0.6)) * lines * (1.0 - np.clip(wall, 0.0, 1.0)) * (1.0 - thing)
    return np.asarray(light * (1.0 + shade), np.float32)


def _crushed(light: Float32s, shares: list[Float32s], rng: np.random.Generator) -> tuple[Float32s, list[Float32s]]:
    """With a row of cells that is pressed together or drawn out: no seam, as walls go on through it."""
    off, wide = _line(rng), float(rng.uniform(0.5, 1.5)) * PITCH_PX
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float32)
    rough = 1.0 + 0.5 * noise(rng, SIZE, float(rng.uniform(4.0, 16.0)))
    row = np.exp(-((off / wide) ** 2))
    push = np.asarray(rng.uniform(-0.5, 0.5) * off * row * rough, np.float32)
    across_y, across_x = np.gradient(off)
    aside = np.float32(rng.uniform(0.0, 0.2) * PITCH_PX) * row
    to_x = (x + push * across_x + aside * noise(rng, SIZE, 6.0)).astype(np.float32)
    to_y = (y + push * across_y + aside * noise(rng, SIZE, 6.0)).astype(np.float32)
    light, *shares = (
        np.asarray(cv2.remap(plane, to_x, to_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT), np.float32)
        for plane in (light, *shares)
    )
    shade = 1.0 + np.float32(rng.uniform(-0.4, 0.3)) * row * shares[1]
    return np.asarray(light * shade, np.float32), shares


def _line(rng: np.random.Generator) -> Float32s:
    """How far each sample lies from a line through the part, straight or not quite, to one side of it, (SIZE, SIZE)."""
    turn, bend = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.0, 12.0) * (rng.random() < 0.3)
    y, x = np.mgrid[:SIZE, :SIZE] - 0.5 * SIZE
    along, off = x * math.cos(turn) + y * math.sin(turn), y * math.cos(turn) - x * math.sin(turn)
    wave = bend * np.sin(along / rng.uniform(20.0, 60.0) + rng.uniform(0.0, 6.0))
    return np.asarray(off + wave - rng.uniform(-0.3, 0.3) * SIZE, np.float32)


def _places(comb: Bytes | Float32s, which: float) -> Bools:
    """Seven of ten times the outline, else comb, or all else."""
    if which < 0.7:
        return cv2.morphologyEx(comb, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8)) > 100
    return comb > 100 if which < 0.85 else comb < 100


def _moved(plane: Bytes, matrix: np.ndarray[tuple[int, ...], np.dtype[np.float64]], how: int) -> Float32s:
    moved = cv2.warpAffine(plane, matrix, (SIZE, SIZE), flags=how, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(moved, np.float32)


def _of_other_foil(light: Float32s, comb: Float32s, rng: np.random.Generator) -> Float32s:
    """With walls that stand out less, or more here than there."""
    within = light[comb > _SURE]
    if len(within) < 50:
        return light
    middle = np.float32(np.mean(within))
    strength = 1.0 + np.float32(rng.uniform(0.0, 0.5)) * noise(rng, SIZE, float(rng.uniform(6.0, 40.0)))
    strength = np.float32(rng.uniform(0.35, 1.2)) * np.clip(strength, 0.3, 1.7)
    return np.asarray(light + comb * (strength - 1.0) * (light - middle), np.float32)


def _cut_out(rng: np.random.Generator) -> Float32s:
    """A hole or a notch, if it lies in comb: a disc or something with corners, some cells wide."""
    middle, mask = rng.uniform(0.2 * SIZE, 0.8 * SIZE, 2), np.zeros((SIZE, SIZE), np.uint8)
    if rng.random() < 0.5:
        axes = rng.uniform(18.0, 60.0, 2).astype(int) * 8
        cv2.ellipse(mask, (middle * 8).astype(int).tolist(), axes.tolist(), 0.0, 0.0, 360.0, 255, -1, cv2.LINE_AA, 3)
    else:
        sides = [float(rng.uniform(16.0 if rng.random() < 0.5 else 35.0, 120.0)), float(rng.uniform(35.0, 120.0))]
        corners = cv2.boxPoints((middle.tolist(), sides, float(rng.uniform(0.0, 180.0))))
        lay(mask, corners, 255)
    return _share(mask)


def _like_hole(light: Float32s, shares: list[Float32s], rng: np.random.Generator) -> tuple[Float32s, list[Float32s]]:
    """With a hole that shows the table, in shade at its rim, or with a thing in its place: as light, with another
    surface, a rim, a knob, a shadow on the block.
    """
    wall, comb, thing, seam = shares
    inside = cv2.erode((comb > _SURE).astype(np.uint8), np.ones((9, 9), np.uint8))[::4, ::4] > 0
    if not inside.any():
        return light, shares
    mask, across = _hole_or_body(_place(inside, rng), rng)
    out = (1.0 - comb) * (1.0 - thing) > _SURE
    within = light[comb > _SURE]
    level = median(light[out]) if np.count_nonzero(out) > 50 else quantile(within, rng.uniform(0.05, 0.95))
    surface = _surface(rng, 60.0)
    table = np.float32(level) * (1.0 + np.float32(rng.uniform(0.0, 0.25)) * surface)
    if rng.random() > _LAID:
        depth = cv2.distanceTransform((mask > 0.5).astype(np.uint8), cv2.DIST_L2, 5)
        shade = np.float32(rng.uniform(0.0, 0.7)) * np.exp(-depth / float(rng.uniform(2.0, 20.0)))
        away = cv2.warpAffine(
            mask, _aside(float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(0.0, 14.0))), (SIZE,) * 2
        )
        cast = cv2.GaussianBlur(1.0 - away, (0, 0), float(rng.uniform(0.5, 4.0))) * np.float32(rng.uniform(0.0, 0.6))
        body = table * (1.0 - shade) * (1.0 - cast) * np.float32(rng.uniform(0.6, 1.05))
        kept = 1.0 - mask
        shares = [wall * kept, comb * kept, thing, seam * kept]
    else:
        light, body = _thing_body(light, table, mask, across, rng)
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
    return _share(mask), _slope(rng)


def _even_corners(middle: Float64s, radius: float, count: int, turn: float) -> Float64s:
    """The corners of an even polygon, (count, 2); of many, of a disc."""
    turns = np.arange(count) * 2.0 * math.pi / count + turn
    return middle + radius * np.column_stack((np.cos(turns), np.sin(turns)))


def _surface(rng: np.random.Generator, coarsest: float) -> Float32s:
    """What a surface differs from even light by: patterns, or grains so many pixels wide at most."""
    return pattern(rng, SIZE) if rng.random() < 0.6 else noise(rng, SIZE, float(rng.uniform(1.0, coarsest)))


def _thing_body(
    light: Float32s, table: Float32s, mask: Float32s, across: Float32s, rng: np.random.Generator
) -> tuple[Float32s, Float32s]:
    """The light around a thing that lies there, which may be in its shadow, and that of its body."""
    level = float(table.mean()) * math.exp(rng.uniform(-0.25, 0.25))
    if rng.random() > _AS_TABLE:
        level = float(rng.uniform(10.0, 245.0))
    surface = _surface(rng, 40.0)
    body = np.float32(level) * (1.0 + np.float32(rng.uniform(0.0, 0.3)) * surface)
    body = body * (1.0 + np.float32(rng.uniform(-0.5, 0.5) * (rng.random() < 0.6)) * across)
    depth = cv2.distanceTransform((mask > 0.5).astype(np.uint8), cv2.DIST_L2, 5)
    lamp = 1.0 + np.float32(rng.uniform(0.0, 1.0)) * _slope(rng)
    for _ in range(int(rng.integers(0, 4))):  # rims, grooves, a bevel
        place, wide = float(rng.uniform(0.0, 12.0)), float(rng.uniform(0.5, 3.0))
        ring = np.exp(-(((depth - place) / wide) ** 2))
        body = body + np.float32(rng.uniform(-0.5, 0.7) * max(level, 40.0)) * ring * lamp
    if rng.random() < 0.5:  # a knob, a socket, a head with corners
        y, x = np.nonzero(mask > 0.5)
        middle = np.array([x.mean(), y.mean()]) if len(x) else np.full(2, 0.5 * SIZE)
        radius, corners = float(rng.uniform(0.15, 0.7)) * float(depth.max()), int(rng.choice([6, 6, 40, 40, 4]))
        knob = np.zeros((SIZE, SIZE), np.uint8)
        lay(knob, _even_corners(middle, radius, corners, float(rng.uniform(0.0, 6.0))), 255)
        head = _share(knob)
        cast = cv2.GaussianBlur(np.roll(head, tuple(rng.integers(-5, 6, 2).tolist()), (0, 1)), (0, 0), 1.5)
        body = body * (1.0 - np.float32(rng.uniform(0.0, 0.6)) * cast)
        body = body * (1.0 - head) + head * np.float32(level * rng.uniform(0.6, 1.5))
        edge = np.abs(cv2.GaussianBlur(head, (0, 0), 1.0) - head)
        body = body + np.float32(rng.uniform(-1.0, 1.0) * level) * edge * lamp
    if rng.random() < 0.65:
        far = float(rng.uniform(0.0, 12.0))
        cast = cv2.warpAffine(mask, _aside(float(rng.uniform(0.0, 2.0 * math.pi)), far), (SIZE, SIZE))
        light = light * (1.0 - np.float32(rng.uniform(0.1, 0.8)) * cv2.GaussianBlur(cast, (0, 0), 0.5 + 0.4 * far))
    return np.asarray(light, np.float32), np.asarray(body, np.float32)


def _on_other_table(
    light: Float32s, comb: Float32s, thing: Float32s, gone: Float32s, rng: np.random.Generator, *, dark: bool
) -> Float32s:
    """With another table, mostly about as light as walls, mostly in the shade that the block casts on its own; in what
    is gone of the block in shade beside its rim.
    """
    out, within = (1.0 - comb) * (1.0 - thing), light[comb > _SURE]
    walls, floors = 160.0, 60.0
    if len(within) > 50:
        walls, floors = (quantile(within, share) for share in ((0.05, 0.8) if dark else (0.95, 0.1)))
    level = rng.uniform(0.5, 1.1) * max(floors, 60.0) if dark else rng.uniform(0.55 * walls, 1.2 * walls)
    if not dark and rng.random() < 0.3:
        level = rng.uniform(floors, max(1.2 * walls, floors + 1.0))
    table = np.float32(level) * (1.0 + np.float32(rng.uniform(0.03, 0.4)) * pattern(rng, SIZE))
    rim = np.exp(-cv2.distanceTransform((gone > 0.5).astype(np.uint8), cv2.DIST_L2, 5) / float(rng.uniform(2.0, 12.0)))
    table = table * np.where(gone > 0.0, 1.0 - np.float32(rng.uniform(0.1, 0.6)) * rim, 1.0)
    there = out * (1.0 - gone)
    own = light[there > _SURE]
    if len(own) > 50 and rng.random() < 0.7:
        shade = cv2.GaussianBlur(light * there, (0, 0), 3.0) / np.maximum(cv2.GaussianBlur(there, (0, 0), 3.0), 1e-3)
        usual = median(own)
        shade = np.where(gone > 0.0, np.float32(usual), shade)
        table = table * np.clip(shade / max(usual, 1.0), 0.35, 1.1)
    return np.asarray(light * (1.0 - out) + np.clip(table, 0.0, 255.0) * out, np.float32)


def _with_flanks(light: Float32s, comb: Float32s, rng: np.random.Generator) -> Float32s:
    """As seen from aside: beyond the block's edge the walls that end there, down to the table, as deep as a cell."""
    turn, shade = float(rng.uniform(0.0, 2.0 * math.pi)), np.float32(rng.uniform(0.4, 1.0))
    within = light * comb
    flank, seen = within, comb
    for deep in range(1, round(float(rng.uniform(0.15, 1.1)) * PITCH_PX)):
        down = _aside(turn, deep)
        lower, there = (cv2.warpAffine(plane, down, (SIZE, SIZE)) for plane in (within, comb))
        more = np.maximum(there - seen, 0.0)
        flank, seen = flank + shade * lower * more / np.maximum(there, 1e-3), np.maximum(seen, there)
    return np.asarray(light * (1.0 - seen) + flank, np.float32)


def _with_cast_walls(light: Float32s, wall: Float32s, table: Float32s, rng: np.random.Generator) -> Float32s:
    """With what walls near the edge cast on the table, up to some cells away: shadows, or light, as foil does."""
    turn, first = float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(0.0, 1.5)) * (rng.random() < 0.5)
    far = first + math.exp(rng.uniform(math.log(0.05), math.log(3.0)))
    cast = np.zeros_like(wall)
    for away in range(round(first * PITCH_PX), round(far * PITCH_PX) + 1):
        cast = np.maximum(cast, cv2.warpAffine(wall, _aside(turn, away), (SIZE, SIZE), borderMode=cv2.BORDER_REFLECT))
    cast = cv2.GaussianBlur(cast, (0, 0), float(rng.uniform(0.3, 3.0)))
    return np.asarray(light * (1.0 - np.float32(rng.uniform(-0.4, 0.7)) * cast * table), np.float32)


def _aside(turn: float, far: float) -> Float64s:
    """What moves a plane so far in that direction, for cv2.warpAffine."""
    return np.array([[1.0, 0.0, far * math.cos(turn)], [0.0, 1.0, far * math.sin(turn)]])


def _covered(light: Float32s, comb: Float32s, thing: Float32s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """Beneath something, mostly about the outline, half of them with a shadow; a few are clear, as some tapes are."""
    edge = _places(comb[::4, ::4] * np.float32(255.0), 0.0)
    about = edge.any() and rng.random() < 0.6
    middle = _place(edge, rng) if about else rng.uniform(0.0, SIZE, 2)
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
    dense = over * np.float32(1.0 if rng.random() < 0.85 else rng.uniform(0.4, 0.8))
    return np.asarray(light * (1.0 - dense) + body * dense, np.float32), np.maximum(thing, over)


def _strip(middle: Float64s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """A strip, and how far to one of its sides a place lies, −1…1."""
    size = float(rng.uniform(20.0, 200.0)), float(rng.uniform(8.0, 50.0))
    mask = np.zeros((SIZE, SIZE), np.uint8)
    lay(mask, cv2.boxPoints((middle.tolist(), size, float(rng.uniform(0.0, 180.0)))), 255)
    return _share(mask), _slope(rng)


def _cornered(middle: Float64s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    mask = np.zeros((SIZE, SIZE), np.uint8)
    lay(mask, middle + rng.uniform(-50.0, 50.0, (6, 2)), 255)
    return _share(mask), _slope(rng)


def _disc(middle: Float64s, rng: np.random.Generator) -> tuple[Float32s, Float32s]:
    """A disc, mostly not round, as weights are, and how far from its middle a place lies."""
    axes = rng.uniform(8.0, 60.0, 2)
    axes[1] = axes[0] if rng.random() < 0.5 else axes[1]
    mask = np.zeros((SIZE, SIZE), np.uint8)
    turn = float(rng.uniform(0.0, 180.0))
    cv2.ellipse(
        mask, (middle * 8).astype(int).tolist(), (axes * 8).astype(int).tolist(), turn, 0, 360, 255, -1, cv2.LINE_AA, 3
    )
    y, x = np.mgrid[:SIZE, :SIZE]
    away = np.hypot(x - middle[0], y - middle[1]) / axes.max()
    return _share(mask), np.clip(away - rng.uniform(0.0, 0.5), -1.0, 1.0).astype(np.float32)


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


def _share(mask: Bytes) -> Float32s:
    return mask.astype(np.float32) / np.float32(255.0)


def _slope(rng: np.random.Generator) -> Float32s:
    """What falls evenly over the part, −1…1."""
    return np.clip(_line(rng) / np.float32(0.5 * SIZE), -1.0, 1.0)


_THINGS = (_strip, _cornered, _disc, _rod, _rod)


def _seen(light: Float32s, rng: np.random.Generator) -> Float32s:
    """In uneven light, moved, out of focus, brightened, blown out and noisy."""
    if rng.random() < 0.3:
        lamp = np.clip(noise(rng, SIZE, float(rng.uniform(40.0, 200.0))), -2.0, 2.0)
        light = light * (1.0 + np.float32(rng.uniform(0.05, 0.4)) * lamp)
    if rng.random() < 0.15:
        far = int(rng.integers(3, 8))
        line = np.pad(np.ones((1, far), np.float32), far)
        turn = cv2.getRotationMatrix2D((1.5 * far, float(far)), float(rng.uniform(0.0, 180.0)), 1.0)
        smear = cv2.warpAffine(line, turn, line.shape[::-1])
        light = np.asarray(cv2.filter2D(light, -1, smear / smear.sum()), np.float32)
    if rng.random() < 0.4:
        light = np.asarray(cv2.GaussianBlur(light, (0, 0), float(rng.uniform(0.3, 1.3))), np.float32)
    light = np.clip(light, 0.0, 255.0)
    if rng.random() < 0.3:
        light = 255.0 * (light / np.float32(255.0)) ** np.float32(math.exp(rng.uniform(-0.8, 0.8)))
    if rng.random() < 0.15:
        light = np.minimum(light * np.float32(rng.uniform(1.0, 2.2)), 255.0)
    if rng.random() < 0.5:
        light = light + np.float32(math.exp(rng.uniform(0.0, 2.8))) * rng.standard_normal(light.shape, np.float32)
    if rng.random() < 0.1:
        light = light + np.float32(rng.uniform(1.0, 6.0)) * rng.standard_normal((SIZE, 1), np.float32)
    if rng.random() < 0.15:
        coded = cv2.imencode(
            ".jpg", np.clip(light, 0.0, 255.0).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(20, 80))]
        )
        light = cv2.imdecode(coded[1], cv2.IMREAD_GRAYSCALE)
    return np.asarray(light, np.float32)
