"""What cores are made of, and their walls: a lattice of hexagons, warped, cut by outlines, torn where it is cut."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from benchmarks.other_hand.fields import Rng, spread, tint
from benchmarks.other_hand.layout import Dent, Layout
from benchmarks.other_hand.outlines import across, around, direction, half_plane, rotated
from contour.geometry.arrays import Bools, Float32s, Float64s, Indices


@dataclass(frozen=True, eq=False)
class Core:
    """Aluminium or aramid: widths of single and double walls and the block's height in pixels, light and colour."""

    metal: bool
    wall: float
    double: float
    height: float
    light: float
    colour: Float32s


class Walls(NamedTuple):
    """Walls' ends, (N, 2, 2), which walls are double, which ends are cut, (N, 2), and which cell wall each is part of;
    burrs, (K, 2, 2); and the corners of cells, (M, 6, 2).
    """

    ends: Float64s
    double: Bools
    cut: Bools
    number: Indices
    burrs: Float64s
    cells: Float64s

    @property
    def middles(self) -> Float64s:
        """Halfway between each wall's ends, (N, 2)."""
        return np.asarray(self.ends.mean(axis=1))

    @property
    def along(self) -> Float64s:
        """The way from each wall's first end to its second, (N, 2)."""
        return np.asarray(self.ends[:, 1] - self.ends[:, 0])


class _Form(NamedTuple):
    """How a lattice is turned, stretched, waved and jittered."""

    turn: float
    stretch: Float64s
    waves: tuple[tuple[Float64s, float, Float64s], ...]
    jitter: float


def core(rng: Rng, pitch: float) -> Core:
    """A core of a kind, for cells of that pitch."""
    height = pitch * spread(rng, 0.9, 6.0)
    if rng.random() < 0.62:
        wall = max(0.4, pitch * spread(rng, 0.014, 0.055))
        colour = tint(*(1.0 + rng.uniform(-0.03, 0.03, 3)))
        return Core(True, wall, wall * rng.uniform(1.5, 2.0), height, rng.uniform(0.7, 1.0), colour)
    wall = pitch * spread(rng, 0.05, 0.12)
    colour = tint(*rng.uniform((0.35, 0.75, 1.1), (0.6, 0.9, 1.3)))
    return Core(False, wall, wall * rng.uniform(1.1, 1.6), height, rng.uniform(0.48, 0.85), colour)


def walls(rng: Rng, where: Layout, of: Core) -> Walls:
    """The walls of all blocks and offcuts, cells in one lattice but at a seam and from block to block."""
    torn = rng.uniform(0.0, (0.08, 0.15))
    pieces = [_piece(rng, where, of, region, form, torn) for region, form in _regions(rng, where, of)]
    firsts = np.cumsum([0, *(int(piece.number.max(initial=0)) + 1 for piece in pieces)])
    pieces = [piece._replace(number=piece.number + first) for piece, first in zip(pieces, firsts, strict=False)]
    return Walls(*(np.concatenate(parts) for parts in zip(*pieces, strict=True)))


def _regions(rng: Rng, where: Layout, of: Core) -> list[tuple[shapely.Geometry, _Form]]:
    first = _form(rng, where.pitch, of)
    blocks = [shapely.Polygon(block[0], block[1:]) for block in where.blocks]
    if where.seam is not None:
        normal, offset = where.seam
        turn = rng.choice([0.0, 0.0, 0.0, rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), rng.uniform(0.0, 3.0)])
        sides = blocks[0] & half_plane(normal, offset), blocks[0] & half_plane(-normal, -offset)
        return list(zip(sides, (first, first._replace(turn=first.turn + float(turn))), strict=True))
    others = [_form(rng, where.pitch, of) if rng.random() < 0.6 else first for _ in blocks[1:]]
    offcuts = [(shapely.Polygon(ring), _form(rng, where.pitch, of)) for ring in where.offcuts]
    return [*zip(blocks, (first, *others), strict=True), *offcuts]


def _form(rng: Rng, pitch: float, of: Core) -> _Form:
    waves, length = [], rng.uniform(12.0, 50.0) * pitch
    for _ in range(3):
        wave = direction(rng.uniform(0.0, 7.0)) * 2.0 * math.pi / (length * rng.uniform(0.7, 2.0))
        strain = rng.uniform(0.0, 0.035 if of.metal else 0.025)
        swing = direction(rng.uniform(0.0, 7.0)) * strain / np.linalg.norm(wave)
        waves.append((wave, rng.uniform(0.0, 7.0), swing))
    longer = 1.0 + rng.uniform(-0.09, 0.09) * (1.0 if rng.random() < 0.75 else 0.2)
    shear, lean = rng.uniform((-0.05, -0.03), (0.05, 0.03)).tolist()
    stretch = np.array([[longer, shear], [0.0, 1.0 / longer]]) @ np.array([[1.0, 0.0], [lean, 1.0]])
    return _Form(rng.uniform(0.0, math.pi), stretch, tuple(waves), rng.uniform(0.004, 0.035 if of.metal else 0.02))


def _piece(rng: Rng, where: Layout, of: Core, region: shapely.Geometry, form: _Form, torn: Float64s) -> Walls:
    ends, double, cells = _lattice(rng, where, shapely.bounds(region).reshape(2, 2), form)
    number = np.arange(len(ends))
    if where.pitch > 22.0:
        ends, double, number = _bowed(rng, ends, 0.03 if of.metal else 0.015), np.tile(double, 2), np.tile(number, 2)
    ends, source, cut = _clipped(ends, region)
    short = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) < 0.12 * where.pitch
    kept = ~(cut.any(axis=1) & short & (rng.random(len(ends)) < 0.5))
    ends, source, cut = ends[kept], source[kept], cut[kept]
    burrs = _tear(rng, ends, cut, where.pitch, torn)
    return Walls(ends, double[source], cut, number[source], burrs, cells)


def _lattice(rng: Rng, where: Layout, box: Float64s, form: _Form) -> tuple[Float64s, Bools, Float64s]:
    """Walls over a box, which of them are double, and cells' corners."""
    (low, high), pitch = box, where.pitch
    radius, reach = pitch / math.sqrt(3.0), 0.5 * float(np.linalg.norm(high - low)) + 2.0 * pitch
    rows, columns = int(reach / (1.5 * radius)) + 4, int(reach / pitch) + 4
    column, row = np.mgrid[-columns - rows // 2 : columns + rows // 2 + 1, -rows : rows + 1]
    middles = np.stack([(column + 0.5 * row) * pitch, 1.5 * row * radius], axis=-1)
    nodes = middles[:, :, None] + np.array([[0.0, radius], [0.0, -radius]])
    nodes = rotated(nodes @ form.stretch.T, form.turn) + rng.uniform(-0.5, 0.5, 2) * pitch + 0.5 * (low + high)
    still = nodes
    for wave, phase, swing in form.waves:
        nodes = nodes + np.sin(still @ wave + phase)[..., None] * swing
    nodes = nodes + rng.standard_normal(nodes.shape) * form.jitter * pitch
    for dent in where.dents:
        strewn = rng.standard_normal(nodes.shape) * dent.strength - dent.place.outward * dent.push
        nodes = nodes + crushed(nodes, dent)[..., None] * strewn * pitch
    upper, lower = nodes[:, :, 0], nodes[:, :, 1]
    others = lower[1:-1, 1:-1], lower[:-2, 1:-1], lower[:-2, 2:]
    ends = np.concatenate([np.stack([upper[1:-1, :-2], other], axis=2).reshape(-1, 2, 2) for other in others])
    double = np.arange(len(ends)) >= 2 * len(ends) // 3
    ring = upper[1:-1, 1:-1], lower[1:-1, 2:], upper[2:, :-2], lower[1:-1, 1:-1], upper[1:-1, :-2], lower[:-2, 2:]
    cells = np.stack(ring, axis=2).reshape(-1, 6, 2)
    near = _within(ends, low - 1.5 * pitch, high + 1.5 * pitch)
    return ends[near], double[near], cells[_within(cells, low - pitch, high + pitch)]


def _within(points: Float64s, low: Float64s, high: Float64s) -> Bools:
    return np.asarray(((points > low) & (points < high)).all(axis=(1, 2)))


def crushed(points: Float64s, dent: Dent) -> Float64s:
    """How much points, (..., 2), are crushed in a dent, from 0 to 1."""
    away = np.linalg.norm(points - dent.place.point, axis=-1) / dent.radius
    return np.asarray(np.exp(-1.5 * away**2))


def _bowed(rng: Rng, ends: Float64s, most: float) -> Float64s:
    """Each wall in two halves: all first ones, then all second ones."""
    along = ends[:, 1] - ends[:, 0]
    bow = rng.standard_normal((len(ends), 1)) * rng.uniform(0.15 * most, most)
    middles = ends.mean(axis=1) + across(along) * bow
    return np.concatenate([np.stack([ends[:, 0], middles], axis=1), np.stack([middles, ends[:, 1]], axis=1)])


def _clipped(ends: Float64s, region: shapely.Geometry) -> tuple[Float64s, Indices, Bools]:
    """Parts of walls within the region, which wall each is of, and which of its ends, (N, 2), lie on the rim."""
    lines = np.asarray(shapely.linestrings(ends), object)
    shapely.prepare(region)
    whole = shapely.contains_properly(region, lines)
    crossing = np.flatnonzero(shapely.intersects(region, lines) & ~whole)
    parts, of = shapely.get_parts(shapely.intersection(lines[crossing], region), return_index=True)
    true = shapely.get_type_id(parts) == shapely.GeometryType.LINESTRING
    inner, source = shapely.get_coordinates(parts[true]).reshape(-1, 2, 2), crossing[of[true]]
    cut = np.abs(inner - ends[source]).max(axis=2) > 1e-6
    uncut = np.zeros((np.count_nonzero(whole), 2), bool)
    return np.concatenate([ends[whole], inner]), np.append(np.flatnonzero(whole), source), np.concatenate([uncut, cut])


def _tear(rng: Rng, ends: Float64s, cut: Bools, pitch: float, torn: Float64s) -> Float64s:
    """Tear cut ends back or bend them aside, in place; and burrs, (K, 2, 2), that stand out there."""
    burrs = []
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    along = (ends[:, 1] - ends[:, 0]) / np.maximum(lengths, 1e-6)[:, None]
    for end, inward in ((0, along), (1, -along)):
        nicked = np.flatnonzero(cut[:, end] & (rng.random(len(ends)) < torn[0]))
        back = np.minimum(rng.uniform(0.03, 0.25, len(nicked)) * pitch, 0.6 * lengths[nicked])
        ends[nicked, end] += inward[nicked] * back[:, None]
        burred = ends[cut[:, end] & (rng.random(len(ends)) < torn[1]), end]
        far = np.minimum(rng.uniform(0.04, 0.14, len(burred)) * pitch, 3.0)
        tips = burred + around(rng.uniform(0.0, 2.0 * math.pi, len(burred)), far)
        burrs.append(np.stack([burred, tips], axis=1))
        bent = np.flatnonzero(cut[:, end] & (rng.random(len(ends)) < 0.25))
        ends[bent, end] += across(along[bent]) * rng.standard_normal((len(bent), 1)) * min(0.02 * pitch, 0.7)
    return np.concatenate(burrs)
