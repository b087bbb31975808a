"""Where blocks lie in a picture, and what befell them: pixels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import shapely

from benchmarks.other_hand.drawings import within
from benchmarks.other_hand.fields import Rng, Shape, spread
from benchmarks.other_hand.outlines import across, around, direction, half_plane, inscribed, outline, rotated
from contour.geometry.arrays import Bytes, Float64s


class Place(NamedTuple):
    """A point of an outline and the unit vectors about along and out of it, each (2,)."""

    point: Float64s
    along: Float64s
    outward: Float64s


class Dent(NamedTuple):
    """Where cells are crushed: how far about its place, by how much of a pitch, and how far they are pushed in."""

    place: Place
    radius: float
    strength: float
    push: float


@dataclass(frozen=True, eq=False)
class Layout:
    """Blocks, each its exterior and then its holes, (N, 2) float64; offcuts; and a seam's unit normal and offset."""

    shape: Shape
    pitch: float
    blocks: tuple[tuple[Float64s, ...], ...]
    offcuts: tuple[Float64s, ...] = ()
    seam: tuple[Float64s, float] | None = None
    dents: tuple[Dent, ...] = ()

    @cached_property
    def rings(self) -> tuple[Float64s, ...]:
        """Exteriors and holes of all blocks."""
        return tuple(ring for block in self.blocks for ring in block)

    @cached_property
    def pieces(self) -> tuple[Bytes, ...]:
        """255 where each block, and then each offcut, lies, (H, W) each."""
        return tuple(within(self.shape, piece) for piece in (*self.blocks, *([offcut] for offcut in self.offcuts)))

    @cached_property
    def block(self) -> Bytes:
        """255 where a block lies, (H, W)."""
        return _united(self.pieces[: len(self.blocks)])

    @cached_property
    def comb(self) -> Bytes:
        """255 where a block or an offcut lies, (H, W)."""
        return _united(self.pieces)

    @cached_property
    def middle(self) -> Float64s:
        """The middle of all blocks' vertices, (2,)."""
        return np.asarray(np.vstack([block[0] for block in self.blocks]).mean(axis=0))

    @cached_property
    def size(self) -> float:
        """The longer side of the box about all blocks."""
        return float(np.ptp(np.vstack(self.rings), axis=0).max())

    def edge(self, rng: Rng, lean: float = 0.0) -> Place:
        """A place on the first block's exterior, all as likely, its directions turned by about so many radians."""
        ring = self.blocks[0][0]
        sides = np.roll(ring, -1, axis=0) - ring
        lengths = np.hypot(*sides.T)
        number = int(rng.choice(len(ring), p=lengths / lengths.sum()))
        along, point = sides[number] / lengths[number], ring[number] + sides[number] * rng.random()
        x, y = np.round(point + 3.0 * across(along)).astype(int).tolist()
        outward = rotated(-across(along) if self.block[y, x] else across(along), lean * rng.standard_normal())
        return Place(point, across(outward), outward)


def _united(drawn: Sequence[Bytes]) -> Bytes:
    return np.asarray(np.bitwise_or.reduce(drawn), np.uint8)


def layout(rng: Rng, kind: str) -> Layout:
    """Blocks of ten cells across at least, as a kind of picture has them."""
    shape = _shape(rng)
    exteriors, away, most = _exteriors(rng, shape, pair=kind == "pair")
    pitch = spread(rng, 12.0, most) if rng.random() < 0.8 else rng.uniform(12.0, most)
    if kind == "pair":
        gap = away * pitch * spread(rng, 0.04, 0.5)
        return Layout(shape, pitch, ((exteriors[0],), (exteriors[1] + gap,)))
    bare = Layout(shape, pitch, ((exteriors[0], *_hole(rng, exteriors[0], pitch)),))
    if kind == "offcut":
        return replace(bare, offcuts=_offcuts(rng, bare))
    if kind == "splice":
        radius, middle = inscribed(exteriors[0])
        normal = direction(rng.uniform(0.0, 7.0))
        return replace(bare, seam=(normal, float((middle + rng.uniform(-0.6, 0.6, 2) * radius) @ normal)))
    return replace(bare, dents=_dents(rng, bare)) if kind == "crushed" else bare


def _shape(rng: Rng) -> Shape:
    width = int(1000.0 + 1000.0 * rng.random() ** 1.6)
    height = round(width / float(rng.choice([4 / 3, 5 / 4, 1.0, 3 / 2, 16 / 10])))
    return max(height, 1000 if width < 1600 and rng.random() < 0.2 else 800), width


def _exteriors(rng: Rng, shape: Shape, *, pair: bool) -> tuple[list[Float64s], Float64s, float]:
    """One block or both of a pair, the way from the first to the second, and the largest pitch they are fit for."""
    while True:
        rings, away = [outline(rng, convex=pair)], np.zeros(2)
        if pair:
            rings, away = _halves(rng, rings[0])
        rings = _fitted(rng, rings, np.array(shape[::-1], np.float64))
        most = min(60.0, *(2.0 * inscribed(ring)[0] / 10.3 for ring in rings))
        if most >= 13.0:
            return rings, away, most


def _halves(rng: Rng, ring: Float64s) -> tuple[list[Float64s], Float64s]:
    """Both parts of a cut ring, mostly moved along it, one of another width; and the way from one to the other."""
    normal = direction(rng.uniform(0.0, 7.0))
    along, reach = across(normal), ring @ normal
    cut = float(reach.min() + np.ptp(reach) * rng.uniform(0.35, 0.65))
    sides = (half_plane(normal, cut), half_plane(-normal, -cut))
    first, second = (shapely.get_coordinates(shapely.Polygon(ring) & side)[:-1] for side in sides)
    if rng.random() < 0.6:
        second = second + np.outer((second - second.mean(axis=0)) @ along, along) * rng.uniform(-0.35, 0.15)
    return [first, second + along * rng.uniform(-0.25, 0.25) * (rng.random() < 0.7)], normal


def _fitted(rng: Rng, rings: list[Float64s], room: Float64s) -> list[Float64s]:
    """The rings laid in the picture, a twentieth of it away from its border."""
    points = np.vstack(rings)
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    scale = float(((0.88 * room - 4.0) / size).min()) * rng.uniform(0.68, 1.0)
    free = np.maximum(0.5 * (room - size * scale) - 0.055 * room - 3.0, 0.0)
    middle = 0.5 * room + rng.uniform(-1.0, 1.0, 2) * free
    return [(ring - low - 0.5 * size) * scale + middle for ring in rings]


def _hole(rng: Rng, exterior: Float64s, pitch: float) -> list[Float64s]:
    radius, middle = inscribed(exterior)
    size = rng.uniform(0.2, 0.5) * radius
    if rng.random() > 0.18 or size < 2.2 * pitch:
        return []
    ring = outline(rng, convex=True)
    return [ring / np.hypot(*ring.T).max() * size + middle + rng.uniform(-0.2, 0.2, 2) * radius]


def _offcuts(rng: Rng, bare: Layout) -> tuple[Float64s, ...]:
    """One to three pieces of a few cells beside the block."""
    offcuts: list[Float64s] = []
    while not offcuts or (len(offcuts) < 3 and rng.random() < 0.4):
        ring = _offcut(rng, bare)
        drawn, area = within(bare.shape, [ring]) > 0, shapely.Polygon(ring).area
        if np.count_nonzero(drawn & (bare.block == 0)) == np.count_nonzero(drawn) > 0.8 * area > 1.6 * bare.pitch**2:
            offcuts.append(ring)
    return tuple(offcuts)


def _offcut(rng: Rng, bare: Layout) -> Float64s:
    edge, count = bare.edge(rng), int(rng.integers(3, 8))
    angles = (np.arange(count) + rng.uniform(-0.3, 0.3, count)) * 2.0 * math.pi / count
    if rng.random() < 0.3:
        angles = np.sort(rng.uniform(0.0, 2.0 * math.pi, count))
    ring = rotated(around(angles, rng.uniform(1.2, 3.2) * bare.pitch, rng.uniform(0.45, 1.0)), rng.uniform(0.0, 7.0))
    gap = bare.pitch * spread(rng, 0.08, 2.5)
    return ring + edge.point + edge.outward * (gap - float((ring @ edge.outward).min()))


def _dents(rng: Rng, bare: Layout) -> tuple[Dent, ...]:
    dents = []
    for _ in range(rng.integers(1, 5)):
        edge = bare.edge(rng)
        inner = edge._replace(point=edge.point - edge.outward * bare.pitch * rng.random())
        radius = bare.pitch * rng.uniform(1.5, 5.0)
        dents.append(Dent(inner, radius, rng.uniform(0.12, 0.4), rng.uniform(0.0, 0.8)))
    return tuple(dents)
