"""Parts of examples, on other tables, beneath other things, in other light, and as other cameras would see them."""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from benchmarks.segmentation.examples import SEAM_PITCHES, Example
from benchmarks.segmentation.patterns import lay, lay_disc, noise, pattern
from benchmarks.segmentation.planes import SIZE, SURE, aside, depth, line, place, places, share
from benchmarks.segmentation.things import covered, like_hole
from contour.geometry.arrays import Bytes, Float32s, Float64s, median, quantile
from contour.image.opencv import grey

# So many are made of two parts, as of two blocks; and so many of the others of a seam lie about it.
_JOINED, _AT_SEAM = 0.25, 0.4
# So many of those that are to be holed are; so many of them lie in comb, as places are drawn by that number.
_HOLED, _INSIDE, _IN_COMB = 0.75, 0.5, 0.8
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
        light, (wall, comb, thing, seam) = like_hole(light, [wall, comb, thing, seam], rng)
    if rng.random() < 0.12:
        light = _lined(light, wall, thing, rng)
    if rng.random() < 0.08:
        light, (wall, comb, thing, seam) = _crushed(light, [wall, comb, thing, seam], one.pitch_px, rng)
    if rng.random() < 0.3:
        light = _of_other_foil(light, comb, rng)
    if rng.random() < 0.5:
        gone = _cut_out(rng) if rng.random() < 0.55 else np.zeros_like(comb)
        wall, comb, seam = wall * (1.0 - gone), comb * (1.0 - gone), seam * (1.0 - gone)
        light = _on_other_table(light, comb, thing, gone, rng, dark=one.dark)
    if rng.random() < 0.25:
        light = _with_flanks(light, comb * (1.0 - thing), one.pitch_px, rng)
    if rng.random() < 0.35:
        light = _shaded_by_block(light, comb, thing, rng)
    if rng.random() < 0.2:
        light = _with_cast_walls(light, wall, 1.0 - np.maximum(comb, thing), one.pitch_px, rng)
    if rng.random() < 0.1:
        shade = np.float32(rng.uniform(-0.3, 0.5))
        light = light * (1.0 - shade * np.clip(0.5 + line(rng) / float(rng.uniform(1.0, 10.0)), 0.0, 1.0))
    if rng.random() < 0.35:
        light, thing = covered(light, comb, thing, rng)
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
    about = one.seam[::4, ::4] > 100 if rng.random() < _AT_SEAM else places(one.comb[::4, ::4], which)
    if not about.any():
        about = places(one.comb[::4, ::4], which)
    view = _View(float(rng.uniform(0.0, 360.0)), math.exp(rng.uniform(-0.12, 0.12)), rng.random() < 0.5)
    return _seen_by(one, view, _channel(one, rng), place(about, rng))


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
    within = places(one.comb[::4, ::4], _IN_COMB)
    first, second = (
        _seen_by(one, view, channel, place(within, rng))
        for view in (_View(turn, size, mirrored), _View(alike, larger, mirrored))
    )
    off, how = line(rng), rng.random()
    if how < _STACKED:
        through = np.minimum(first[0], second[0]) if one.dark else np.maximum(first[0], second[0])
        first, second = (np.asarray(through, np.float32), second[1]), (first[0], [*first[1][:3], np.zeros_like(off)])
    glued = how > 1.0 - _GLUED
    gap = (float(rng.uniform(0.2, 1.6 if glued else 1.0)) * (glued or rng.random() < 0.7)) * one.pitch_px
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
        seam = np.maximum(seam, (np.abs(off) < max(SEAM_PITCHES * one.pitch_px, 0.5 * gap)) & both)
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
    off, wide = line(rng), float(rng.uniform(1.0, 8.0))
    for number in range(-int(rng.integers(0, 3)), 1 + int(rng.integers(0, 3))):
        lines = np.maximum(lines, np.clip(0.5 * wide + 0.5 - np.abs(off - number * apart), 0.0, 1.0))
    shade = np.float32(rng.uniform(-0.75, 0.6)) * lines * (1.0 - np.clip(wall, 0.0, 1.0)) * (1.0 - thing)
    return np.asarray(light * (1.0 + shade), np.float32)


def _crushed(
    light: Float32s, shares: list[Float32s], pitch_px: float, rng: np.random.Generator
) -> tuple[Float32s, list[Float32s]]:
    """With a row of cells that is pressed together or drawn out: no seam, as walls go on through it."""
    off, wide = line(rng), float(rng.uniform(0.5, 1.5)) * pitch_px
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float32)
    rough = 1.0 + 0.5 * noise(rng, SIZE, float(rng.uniform(4.0, 16.0)))
    row = np.exp(-((off / wide) ** 2))
    push = np.asarray(rng.uniform(-0.5, 0.5) * off * row * rough, np.float32)
    across_y, across_x = np.gradient(off)
    aside = np.float32(rng.uniform(0.0, 0.2) * pitch_px) * row
    to_x = (x + push * across_x + aside * noise(rng, SIZE, 6.0)).astype(np.float32)
    to_y = (y + push * across_y + aside * noise(rng, SIZE, 6.0)).astype(np.float32)
    light, *shares = (
        np.asarray(cv2.remap(plane, to_x, to_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT), np.float32)
        for plane in (light, *shares)
    )
    shade = 1.0 + np.float32(rng.uniform(-0.4, 0.3)) * row * shares[1]
    return np.asarray(light * shade, np.float32), shares


def _moved(plane: Bytes, matrix: np.ndarray[tuple[int, ...], np.dtype[np.float64]], how: int) -> Float32s:
    moved = cv2.warpAffine(plane, matrix, (SIZE, SIZE), flags=how, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(moved, np.float32)


def _of_other_foil(light: Float32s, comb: Float32s, rng: np.random.Generator) -> Float32s:
    """With walls that stand out less, or more here than there."""
    within = light[comb > SURE]
    if len(within) < 50:
        return light
    middle = np.float32(np.mean(within))
    strength = 1.0 + np.float32(rng.uniform(0.0, 0.5)) * noise(rng, SIZE, float(rng.uniform(6.0, 40.0)))
    strength = np.float32(rng.uniform(0.35, 1.2)) * np.clip(strength, 0.3, 1.7)
    return np.asarray(light + comb * (strength - 1.0) * (light - middle), np.float32)


def _cut_out(rng: np.random.Generator) -> Float32s:
    """Holes, notches or slots, where they lie in comb: discs, wedges, and what has corners, sharp or round."""
    mask = np.zeros((SIZE, SIZE), np.uint8)
    for _ in range(1 if rng.random() < 0.6 else 3):
        middle = rng.uniform(0.1 * SIZE, 0.9 * SIZE, 2)
        how = rng.random()
        if how < 0.35:
            axes = rng.uniform(12.0, 60.0, 2)
            axes[1] = axes[0] if rng.random() < 0.6 else axes[1]
            lay_disc(mask, middle, axes, 0.0, 255)
        elif how < 0.5:
            turns = float(rng.uniform(0.0, 6.3)) + np.array([0.0, 0.3, -0.3]) * float(rng.uniform(0.4, 2.0))
            far = np.array([0.0, 1.0, 1.0]) * float(rng.uniform(40.0, 140.0))
            lay(mask, middle + far[:, None] * np.column_stack((np.cos(turns), np.sin(turns))), 255)
        else:
            sides = [float(rng.uniform(16.0 if rng.random() < 0.7 else 35.0, 120.0)), float(rng.uniform(35.0, 250.0))]
            one = np.zeros_like(mask)
            lay(one, cv2.boxPoints((middle.tolist(), sides, float(rng.uniform(0.0, 180.0)))), 255)
            if rng.random() < 0.5:
                round_px = 2 * int(rng.uniform(0.1, 0.5) * min(sides)) + 1
                one = cv2.morphologyEx(
                    one, cv2.MORPH_OPEN, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (round_px,) * 2)
                )
            mask = np.maximum(mask, one)
    return share(mask)


def _shaded_by_block(light: Float32s, comb: Float32s, thing: Float32s, rng: np.random.Generator) -> Float32s:
    """With the shadow, or two, that a block of that height casts on the table beside it and in its holes."""
    table = (1.0 - comb) * (1.0 - thing)
    for _ in range(1 if rng.random() < 0.7 else 2):
        turn, left = float(rng.uniform(0.0, 2.0 * math.pi)), math.exp(rng.uniform(math.log(3.0), math.log(80.0)))
        shade, step = comb, 1.0
        while left > 0.0:
            shade = np.maximum(shade, cv2.warpAffine(shade, aside(turn, min(step, left)), (SIZE, SIZE)))
            left, step = left - step, 2.0 * step
        shade = cv2.GaussianBlur(shade, (0, 0), math.exp(rng.uniform(math.log(0.4), math.log(6.0))))
        light = light * (1.0 - np.float32(rng.uniform(0.1, 0.85)) * shade * table)
    return np.asarray(light, np.float32)


def _on_other_table(
    light: Float32s, comb: Float32s, thing: Float32s, gone: Float32s, rng: np.random.Generator, *, dark: bool
) -> Float32s:
    """With another table, mostly about as light as walls, mostly in the shade that the block casts on its own; in what
    is gone of the block in shade beside its rim.
    """
    out, within = (1.0 - comb) * (1.0 - thing), light[comb > SURE]
    walls, floors = 160.0, 60.0
    if len(within) > 50:
        walls, floors = (quantile(within, share) for share in ((0.05, 0.8) if dark else (0.95, 0.1)))
    level = rng.uniform(0.5, 1.1) * max(floors, 60.0) if dark else rng.uniform(0.55 * walls, 1.2 * walls)
    if not dark and rng.random() < 0.3:
        level = rng.uniform(floors, max(1.2 * walls, floors + 1.0))
    elif not dark and rng.random() < 0.3:
        level = rng.uniform(0.2, 1.3) * floors
    table = np.float32(level) * (1.0 + np.float32(rng.uniform(0.03, 0.4)) * pattern(rng, SIZE))
    rim = np.exp(-depth(gone) / float(rng.uniform(2.0, 12.0)))
    table = table * np.where(gone > 0.0, 1.0 - np.float32(rng.uniform(0.1, 0.6)) * rim, 1.0)
    there = out * (1.0 - gone)
    own = light[there > SURE]
    if len(own) > 50 and rng.random() < 0.7:
        shade = cv2.GaussianBlur(light * there, (0, 0), 3.0) / np.maximum(cv2.GaussianBlur(there, (0, 0), 3.0), 1e-3)
        usual = median(own)
        shade = np.where(gone > 0.0, np.float32(usual), shade)
        table = table * np.clip(shade / max(usual, 1.0), 0.35, 1.1)
    return np.asarray(light * (1.0 - out) + np.clip(table, 0.0, 255.0) * out, np.float32)


def _with_flanks(light: Float32s, comb: Float32s, pitch_px: float, rng: np.random.Generator) -> Float32s:
    """As seen from aside: beyond the block's edge the walls that end there, down to the table, as deep as a cell."""
    turn, shade = float(rng.uniform(0.0, 2.0 * math.pi)), np.float32(rng.uniform(0.4, 1.0))
    within = light * comb
    flank, seen = within, comb
    for deep in range(1, round(float(rng.uniform(0.15, 1.1)) * pitch_px)):
        down = aside(turn, deep)
        lower, there = (cv2.warpAffine(plane, down, (SIZE, SIZE)) for plane in (within, comb))
        more = np.maximum(there - seen, 0.0)
        flank, seen = flank + shade * lower * more / np.maximum(there, 1e-3), np.maximum(seen, there)
    return np.asarray(light * (1.0 - seen) + flank, np.float32)


def _with_cast_walls(
    light: Float32s, wall: Float32s, table: Float32s, pitch_px: float, rng: np.random.Generator
) -> Float32s:
    """With what walls near the edge cast on the table, up to some cells away: shadows, or light, as foil does."""
    turn, first = float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(0.0, 1.5)) * (rng.random() < 0.5)
    far = first + math.exp(rng.uniform(math.log(0.05), math.log(3.0)))
    cast = np.zeros_like(wall)
    for away in range(round(first * pitch_px), round(far * pitch_px) + 1):
        cast = np.maximum(cast, cv2.warpAffine(wall, aside(turn, away), (SIZE, SIZE), borderMode=cv2.BORDER_REFLECT))
    cast = cv2.GaussianBlur(cast, (0, 0), float(rng.uniform(0.3, 3.0)))
    return np.asarray(light * (1.0 - np.float32(rng.uniform(-0.4, 0.7)) * cast * table), np.float32)


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
