"""Outline of a block made of whole cells: a printed or moulded honeycomb whose border cells are closed."""

from __future__ import annotations

import math

import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour, Ring, densified
from contour.synthetic.cells import CellGeometry, draw_lattice, lattice_centres, lattice_coordinates
from contour.synthetic.outlines import signed_distance

_SIDES = ((1, 0), (0, 1), (-1, 1), (-1, 0), (0, -1), (1, -1))
"""Neighbour behind each side, counter-clockwise; a side runs from its own corner to the next."""


def closed_border(geometry: CellGeometry, outline: Contour, seed: int) -> Contour:
    """The outer faces of the walls around all cells whose centres lie inside `outline`, work millimetres.

    `seed` is the scene's: the warp bends the border as it bends the cells (leave a wobble 0, it is drawn coarsely).
    Raises ParameterError for other cells than a honeycomb, and where no cell fits.
    """
    if geometry.kind != "honeycomb":
        raise ParameterError(f"cells {geometry.kind!r}: expected 'honeycomb', whose cells have a closed form")
    box = np.concatenate([outline.exterior, outline.exterior + geometry.pitch_mm, outline.exterior - geometry.pitch_mm])
    x, y = lattice_coordinates(geometry, box[:, 0], box[:, 1], seed)
    lattice = draw_lattice(geometry, x, y, seed)
    centres = to_work(geometry, _unturned(geometry, lattice_centres(geometry, lattice)), seed)
    inside = signed_distance(outline, centres) > 0.0
    place = {
        (lattice.first[0] + int(k) % lattice.counts[0], lattice.first[1] + int(k) // lattice.counts[0])
        for k in np.flatnonzero(inside)
    }
    rings = [_faces(geometry, chain) for chain in _chains(place)]
    if not rings:
        raise ParameterError(f"outline: no cell of pitch {geometry.pitch_mm} mm fits inside")
    moved = [
        to_work(geometry, densified(ring, geometry.pitch_mm / 8.0 if geometry.warp > 0.0 else 1e9), seed)
        for ring in rings
    ]
    moved.sort(key=lambda ring: -abs(_area(ring)))
    return Contour(moved[0], tuple(ring for ring in moved[1:] if _area(ring) < 0.0))


def to_work(geometry: CellGeometry, points: Float64s, seed: int) -> Float64s:
    """Work points whose lattice coordinates these are (fixed-point inverse of `lattice_coordinates`), shape (N, 2)."""
    turn = math.radians(geometry.ribbon_deg) - math.pi / 2.0
    back = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    found = points @ back + np.array(geometry.offset_mm)
    for _ in range(40):
        miss = points - np.column_stack(lattice_coordinates(geometry, found[:, 0], found[:, 1], seed))
        found = found + miss @ back
        if float(np.abs(miss).max(initial=0.0)) < 1e-7:
            break
    return np.asarray(found, dtype=np.float64)


def _unturned(geometry: CellGeometry, work: Float64s) -> Float64s:
    """Lattice coordinates of points given without the warp."""
    turn = math.radians(geometry.ribbon_deg) - math.pi / 2.0
    forth = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    return np.asarray((work - np.array(geometry.offset_mm)) @ forth, dtype=np.float64)


def _chains(place: set[tuple[int, int]]) -> list[list[tuple[int, int, int]]]:
    """Closed chains of (i, j, side) along the border of a set of cells, the cells to the left."""
    border = {(i, j, side) for i, j in place for side, (di, dj) in enumerate(_SIDES) if (i + di, j + dj) not in place}
    chains = []
    while border:
        start = min(border)
        chain, edge = [], start
        while True:
            chain.append(edge)
            border.discard(edge)
            edge = _following(place, edge)
            if edge == start:
                break
        chains.append(chain)
    return chains


def _following(place: set[tuple[int, int]], edge: tuple[int, int, int]) -> tuple[int, int, int]:
    """The border side after this one: the same cell's next side, or the one of the cell behind that."""
    i, j, side = edge
    turned = (side + 1) % 6
    di, dj = _SIDES[turned]
    if (i + di, j + dj) not in place:
        return (i, j, turned)
    return (i + di, j + dj, (side - 1) % 6)


def _faces(geometry: CellGeometry, chain: list[tuple[int, int, int]]) -> Ring:
    """The outer faces of the walls along a chain, lattice millimetres: each side moved out by half its wall."""
    side, angle = geometry.pitch_mm / math.sqrt(3.0), math.radians(geometry.expansion_deg)
    wide, tall = side * math.sin(angle), side * (0.5 + math.cos(angle))
    corners = np.array(
        [(wide, -side / 2), (wide, side / 2), (0.0, tall), (-wide, side / 2), (-wide, -side / 2), (0.0, -tall)]
    )
    step = (2.0 * wide, side * (1.0 + math.cos(angle)))
    starts, directions = [], []
    for i, j, which in chain:
        centre = np.array([(i + 0.5 * j) * step[0], j * step[1]])
        a, b = corners[which] + centre, corners[(which + 1) % 6] + centre
        along = (b - a) / np.linalg.norm(b - a)
        half = 0.5 * geometry.wall_mm * (geometry.doubled if which in (0, 3) else 1.0)
        starts.append(a + half * np.array([along[1], -along[0]]))
        directions.append(along)
    p, d = np.array(starts), np.array(directions)
    q, e = np.roll(p, 1, axis=0), np.roll(d, 1, axis=0)
    cross = e[:, 0] * d[:, 1] - e[:, 1] * d[:, 0]
    share = ((p - q)[:, 0] * d[:, 1] - (p - q)[:, 1] * d[:, 0]) / cross
    return np.asarray(q + e * share[:, None], dtype=np.float64)


def _area(ring: Ring) -> float:
    x, y = ring[:, 0], ring[:, 1]
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
