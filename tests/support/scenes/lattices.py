"""Flat lattices and plates with cells of any form, drawn from their truth: closed, cut and mixed borders, one a seed.

Apart from the renderer of cut blocks: cells of square, triangular, hexagonal, over-expanded and flexed form and round
holes, whose border is closed around whole cells, cut through them, or closed and then cut along one line. Light falls
straight down; the floor of cells is the table, a little darker.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.geometry.rings import Contour

Cells = Literal["hexagonal", "square", "triangular", "over-expanded", "flex", "round"]
Border = Literal["closed", "cut", "mixed"]
CELLS: tuple[Cells, ...] = ("hexagonal", "square", "triangular", "over-expanded", "flex", "round")
BORDERS: tuple[Border, ...] = ("closed", "cut", "mixed")

WIDTH, HEIGHT = 900, 700
_FINER = 3
_MARGIN_PX = 6.0
_ROW = np.sqrt(3.0) / 2.0
_PARTLY = 0.05
# Pitches around a block's outline within which all of its cells lie, drawn out ones too.
_BESIDE = 3.5
# Rows that are drawn at once: their arrays stay in the cache.
_BAND = 32

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Lattice:
    """A picture, grey (H, W), uint8, with its true outline in pixels, the kind of its border, and its pitch."""

    picture: NDArray[np.uint8]
    outline: Contour
    cells: Cells
    border: Border
    bright_table: bool
    pitch_px: float
    opened: int = 0
    """Cells of whose inside the border leaves a part, a twentieth at least, and not all."""
    ribbon_deg: float | None = None
    """Direction of the walls that the cells are symmetric about alone, degrees from x, counter-clockwise as seen."""

    @property
    def edge(self) -> str:
        """How its border runs: a cut between cells, or along walls, leaves it closed."""
        if self.border == "cut":
            return "cut"
        return "mixed" if self.border == "mixed" and self.opened else "cells"


def lattice(seed: int, cells: Cells, border: Border) -> Lattice:
    """The lattice of this seed; the same arguments give the same picture."""
    rng = np.random.default_rng([seed, CELLS.index(cells), BORDERS.index(border)])
    pitch = float(np.exp(rng.uniform(np.log(14.0), np.log(60.0))))
    # Round holes leave more material between them than walls are wide.
    wall = pitch * float(rng.uniform(0.2, 0.45) if cells == "round" else rng.uniform(0.06, 0.2))
    wall = max(wall, 1.5)
    # A row and a column, of which all places are made.
    y, x = (((np.arange(size * _FINER) + 0.5) / _FINER - 0.5).astype(np.float32) for size in (HEIGHT, WIDTH))
    y = y[:, None]
    # A hole that a later cut opens is a bay with closed cells: nobody can tell where it was meant to end.
    whole = _box(rng, x, y, pitch, holed=border != "mixed")
    # All but the table lies there.
    part = _around(whole, round(_BESIDE * pitch * _FINER))
    outline, x, y = whole[part], x[part[1]], y[part[0]]
    angle = float(rng.uniform(0, np.pi))
    into_wall, number, centre = _pattern(rng, cells, (x, y), angle, pitch, wall)
    centre = centre[0] - part[1].start / _FINER, centre[1] - part[0].start / _FINER
    body = outline
    if border != "cut" and cells != "round":
        body = _whole_cells(outline, number, centre, wall)
    if border == "mixed":
        body = _cut_along(body, _half_plane(rng, x, y), number)
    if cells == "round" and border != "cut":
        # Only whole holes are drilled; the sheet goes on around them.
        drilled = _at(_depth(outline), centre) > 0.62 * pitch
        into_wall = np.where(drilled[number], into_wall, np.float32(1.0))
    body = _largest(body)
    opened = _opened(number, into_wall < 0, body)
    body, material = (_placed(one, part, whole.shape) for one in (body, body & (into_wall > 0)))
    bright_table = bool(rng.random() < 0.5)
    picture = _rendered(rng, body, material, bright_table)
    ribbon_deg = (90.0 - float(np.degrees(angle))) % 180.0 if cells in ("over-expanded", "flex") else None
    return Lattice(picture, _contour(body), cells, border, bright_table, pitch, opened, ribbon_deg)


def _around(body: NDArray[np.bool_], margin: int) -> tuple[slice, slice]:
    """Rows and columns of a body and so many around it."""
    rows, columns = (np.flatnonzero(body.any(axis=axis)) for axis in (1, 0))
    return (
        slice(max(0, int(rows[0]) - margin), int(rows[-1]) + margin + 1),
        slice(max(0, int(columns[0]) - margin), int(columns[-1]) + margin + 1),
    )


def _placed(body: NDArray[np.bool_], part: tuple[slice, slice], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """A body of which a part of the picture was drawn, in all of it."""
    drawn = np.zeros(shape, np.bool_)
    drawn[part] = body
    return drawn


def _opened(number: NDArray[np.int64], inside: NDArray[np.bool_], body: NDArray[np.bool_]) -> int:
    """How many cells, by their numbers, are partly inside a body."""
    whole, kept = (np.bincount(number[part], minlength=int(number.max()) + 1) for part in (inside, inside & body))
    share = kept / np.maximum(whole, 1)
    return int(np.count_nonzero((share > _PARTLY) & (share < 1.0 - _PARTLY)))


def _box(rng: np.random.Generator, x: Floats, y: Floats, pitch: float, *, holed: bool) -> NDArray[np.bool_]:
    """An L or a rectangle, turned, all of it in view with the cells that it touches."""
    angle = float(rng.uniform(0, np.pi))
    cx, cy = WIDTH / 2 + rng.uniform(-30, 30), HEIGHT / 2 + rng.uniform(-20, 20)
    half = float(rng.uniform(200, 250))
    a, b = half, half * float(rng.uniform(0.6, 0.95))
    tall = a * abs(np.sin(angle)) + b * abs(np.cos(angle))
    a, b = np.array([a, b]) * min(1.0, (HEIGHT / 2 - abs(cy - HEIGHT / 2) - _MARGIN_PX - pitch) / tall)
    dented = rng.random() < 0.4
    # Openings narrower than 2.2 cells are missing cells.
    opened = rng.random() < 0.3 and holed and 0.3 * b > 2.2 * pitch

    def rows(y: Floats) -> NDArray[np.bool_]:
        u = (x - cx) * np.cos(angle) + (y - cy) * np.sin(angle)
        v = -(x - cx) * np.sin(angle) + (y - cy) * np.cos(angle)
        box = (np.abs(u) < a) & (np.abs(v) < b)
        if dented:
            box &= ~((u > 0.1 * a) & (v > 0.0))
        if opened:
            box &= np.hypot(u + 0.45 * a, v + 0.3 * b) > 0.3 * b
        return box

    return np.concatenate([rows(band) for band in _bands(y)])


def _bands(y: Floats) -> list[Floats]:
    return [y[top : top + _BAND] for top in range(0, len(y), _BAND)]


def _pattern(
    rng: np.random.Generator, cells: Cells, place: tuple[Floats, Floats], angle: float, pitch: float, wall: float
) -> tuple[Floats, NDArray[np.int64], tuple[Floats, Floats]]:
    """How far each place lies within a wall (px, negative in cells), its cell's number, and that cell's centre."""
    x, y = place
    shift = rng.uniform(0, pitch), rng.uniform(0, pitch)
    drawn = [_rows(cells, (x, band), angle, shift, pitch) for band in _bands(y)]
    gap, *at = (np.concatenate(rows, dtype=np.float32) for rows in zip(*drawn, strict=True))
    if cells == "triangular":
        a, b, j = at
        i = (a - a.min()) * (b.max() - b.min() + 1.0) + b
    else:
        i, j = at
    into = 0.5 * wall - gap * pitch
    number = ((i - i.min()) * (j.max() - j.min() + 2.0) + j).astype(np.int64)
    index = _ranked(number)
    count = np.maximum(np.bincount(index.ravel()), 1)
    centre_x, centre_y = (
        (np.bincount(index.ravel(), np.broadcast_to(axis, index.shape).ravel()) / count).astype(np.float32)
        for axis in place
    )
    return into, index, (centre_x, centre_y)


def _rows(
    cells: Cells, place: tuple[Floats, Floats], angle: float, shift: tuple[float, float], pitch: float
) -> tuple[Any, ...]:
    """How far each place lies from the middle of its nearest wall, pitches, and in which row and column of cells: of
    triangles in which one of three families of rows.
    """
    x, y = place
    u = x * np.cos(angle) + y * np.sin(angle) + shift[0]
    v = -x * np.sin(angle) + y * np.cos(angle) + shift[1]
    wide = 1.0
    if cells == "flex":
        v = v + 0.18 * pitch * np.sin(2 * np.pi * u / (5.3 * pitch))
    if cells in ("over-expanded", "flex"):
        wide = 1.45 if cells == "over-expanded" else 1.25
    u, v = u / pitch / wide, v / pitch
    if cells == "square":
        i, j = np.rint(u), np.rint(v)
        return 0.5 - np.maximum(np.abs(u - i), np.abs(v - j)), i, j
    if cells == "triangular":
        # Three families of lines, one apart; a triangle is the place between them.
        lines = v / _ROW, (0.5 * v + _ROW * u) / _ROW, (0.5 * v - _ROW * u) / _ROW
        return np.minimum.reduce([np.abs(k - np.rint(k)) for k in lines]) * _ROW, *(np.floor(k) for k in lines)
    i, j, du, dv = _nearest_hex(u, v)
    if cells == "round":
        return 0.5 - np.hypot(du, dv), i, j
    across = [np.abs(du * nx + dv * ny) for nx, ny in ((1.0, 0.0), (0.5, _ROW), (-0.5, _ROW))]
    return 0.5 - np.maximum.reduce(across), i, j


def _ranked(number: NDArray[np.int64]) -> NDArray[np.int64]:
    """Which of all numbers in order each is, as NumPy tells of unique ones by sorting them all."""
    number = number - number.min()
    if number.max() > number.size:
        return np.unique(number, return_inverse=True)[1].reshape(number.shape)
    there = np.zeros(int(number.max()) + 1, np.bool_)
    there[number] = True
    return np.asarray((np.cumsum(there) - 1)[number], np.int64)


def _nearest_hex(u: Floats, v: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    tall = 2.0 * _ROW
    row_a, col_a = np.rint(v / tall), np.rint(u)
    row_b, col_b = np.rint(v / tall - 0.5), np.rint(u - 0.5)
    a, b = (u - col_a, v - row_a * tall), (u - col_b - 0.5, v - row_b * tall - _ROW)
    first = a[0] ** 2 + a[1] ** 2 < b[0] ** 2 + b[1] ** 2
    i = np.where(first, 2 * col_a, 2 * col_b + 1)
    j = np.where(first, 2 * row_a, 2 * row_b + 1)
    return i, j, np.where(first, a[0], b[0]), np.where(first, a[1], b[1])


def _depth(outline: NDArray[np.bool_]) -> Floats:
    """Distance inside an outline, px of the picture; 0 outside."""
    return np.asarray(cv2.distanceTransform(outline.astype(np.uint8), cv2.DIST_L2, 5) / _FINER, np.float32)


def _at(field: NDArray[Any], centre: tuple[Floats, Floats]) -> NDArray[Any]:
    """What a field over the fine picture has at the centres of cells."""
    column, row = (np.rint((place + 0.5) * _FINER - 0.5).astype(int) for place in centre)
    return field[np.clip(row, 0, field.shape[0] - 1), np.clip(column, 0, field.shape[1] - 1)]


def _whole_cells(
    outline: NDArray[np.bool_], number: NDArray[np.int64], centre: tuple[Floats, Floats], wall: float
) -> NDArray[np.bool_]:
    """The cells whose centres lie inside, with the walls around them, and one that these close all around."""
    cells = _at(outline, centre)[number]
    away = cv2.distanceTransform(1 - cells.astype(np.uint8), cv2.DIST_L2, 5) / _FINER
    body = away < 0.5 * wall
    return body | _of_a_cell(~body, number)


def _half_plane(rng: np.random.Generator, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """All on one side of a line that cuts off a part of the block."""
    angle = float(rng.uniform(0, 2 * np.pi))
    away = (x - WIDTH / 2) * np.cos(angle) + (y - HEIGHT / 2) * np.sin(angle)
    return np.asarray(away < rng.uniform(60, 110))


def _cut_along(body: NDArray[np.bool_], kept: NDArray[np.bool_], number: NDArray[np.int64]) -> NDArray[np.bool_]:
    """What is kept of a body, with the bays no larger than a cell that the cut shuts: cells cut open look the same.

    What hangs on by a thread alone falls off.
    """
    body = (body & kept) | _of_a_cell(kept & ~body, number)
    threads = cv2.morphologyEx(body.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2 * _FINER, 2 * _FINER), np.uint8)) > 0
    return np.asarray(body & (cv2.dilate(_largest(threads).astype(np.uint8), np.ones((7, 7), np.uint8)) > 0))


def _of_a_cell(free: NDArray[np.bool_], number: NDArray[np.int64]) -> NDArray[np.bool_]:
    """The pieces of what is free that are no larger than a cell."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(free.astype(np.uint8), connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] <= np.bincount(number.ravel()).max()
    small[0] = False
    return np.asarray(small[labels])


def _largest(body: NDArray[np.bool_]) -> NDArray[np.bool_]:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(body.astype(np.uint8), connectivity=4)
    return np.asarray(labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA])))


def _rendered(
    rng: np.random.Generator, body: NDArray[np.bool_], material: NDArray[np.bool_], bright_table: bool
) -> NDArray[np.uint8]:
    low, high = float(rng.uniform(20, 70)), float(rng.uniform(150, 220))
    table, walls = (high, low) if bright_table else (low, high)
    floor = table * float(rng.uniform(0.7, 1.0))
    fine = np.full(body.shape, table, np.float32)
    # The block's soft shadow.
    shift = (int(rng.uniform(-6, 6) * _FINER), int(rng.uniform(-6, 6) * _FINER))
    shade = cv2.blur(np.roll(body, shift, (0, 1)).astype(np.float32), (16 * _FINER, 16 * _FINER))
    fine *= 1.0 - float(rng.uniform(0.0, 0.25)) * shade
    fine[body] = floor
    fine[material] = walls
    small = cv2.resize(fine, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    seen = cv2.GaussianBlur(small, (0, 0), float(rng.uniform(0.5, 1.1)))
    slope = np.linspace(-1, 1, WIDTH)[None, :] * rng.uniform(-0.1, 0.1) + np.linspace(-1, 1, HEIGHT)[
        :, None
    ] * rng.uniform(-0.1, 0.1)
    noise = rng.normal(0.0, float(rng.uniform(0.5, 3.0)), small.shape)
    return np.asarray(np.clip(np.rint(seen * (1.0 + slope) + noise), 0, 255), np.uint8)


def _contour(body: NDArray[np.bool_]) -> Contour:
    """The outline of a drawn body, in pixels of the picture; openings smaller than a pixel are none."""
    chains, hierarchy = cv2.findContours(body.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    rings = []
    for chain, node in zip(chains, hierarchy[0], strict=True):
        ring = chain[:, 0, :].astype(np.float64)
        if len(ring) < 4 * _FINER:
            continue
        # Pixel centres lie half a fine pixel inside of the body's edge.
        grown = _moved_out(ring, 0.5)
        rings.append((float(cv2.contourArea(chain)), bool(node[3] >= 0), (grown + 0.5) / _FINER - 0.5))
    exterior = max((one for one in rings if not one[1]), key=lambda one: one[0])
    return Contour(exterior[2], tuple(ring for _, hole, ring in rings if hole))


def _moved_out(ring: NDArray[np.float64], by: float) -> NDArray[np.float64]:
    """The chain moved to its free side, which lies at (−dy, dx) of findContours' direction."""
    along = np.roll(ring, -2, axis=0) - np.roll(ring, 2, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    return ring + by * np.stack([-along[:, 1], along[:, 0]], axis=1)
