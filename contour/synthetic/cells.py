"""Cell walls as functions of the place: how far a point is from the nearest wall's centre line, and which wall that is.

Honeycomb cells are hexagons of constant foil length whose free walls stand at `expansion_deg` to the ribbon (60 is
regular, above is over-expanded); two of the six walls are glued ribbons and thicker. Irregular cells and foam are
Voronoi cells of displaced sites; a perforated plate is what circles leave over.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from contour.errors import ParameterError
from contour.geometry.arrays import Bytes, Float32s, Float64s, Int32s

CellKind = Literal["honeycomb", "irregular", "foam", "perforated", "solid"]

_ROW = math.sqrt(3.0) / 2.0
_NORMALS = ((1.0, 0.0), (0.5, _ROW), (-0.5, _ROW))
_NEIGHBOURS = ((1, 0), (0, 1), (-1, 1))
INTACT, GONE = 2.0, -2.0


@dataclass(frozen=True)
class CellGeometry:
    """Shape of the cells. Lengths in millimetres; the ribbons run at `ribbon_deg` to the work frame's x axis.

    `pitch_mm` is the distance across flats of the regular cell (centre to centre), or between sites or holes.
    `wall_mm` is the single foil; ribbons have `doubled` times that. A perforated plate's holes are pitch − wall wide.
    """

    kind: CellKind = "honeycomb"
    pitch_mm: float = 9.0
    wall_mm: float = 0.7
    doubled: float = 1.7
    expansion_deg: float = 60.0
    ribbon_deg: float = 0.0
    offset_mm: tuple[float, float] = (0.0, 0.0)
    jitter: float = 0.0
    """Displacement of the sites of irregular cells and foam, in pitches, at most 0.45."""
    warp: float = 0.0
    """Smooth displacement of the lattice, in pitches."""
    warp_length: float = 8.0
    """Wave length of the warp, in pitches."""
    wobble: float = 0.0
    """Displacement from cell to cell, in pitches: foils that were not expanded evenly."""
    broken: float = 0.0
    """Share of walls broken or missing."""
    missing_cells_mm: tuple[tuple[float, float], ...] = ()
    """Cells at these places have lost their walls."""
    square_grid: bool = False
    """Holes of a perforated plate on a square grid instead of a hexagonal one."""
    rim_mm: float = 0.0
    """Holes of a perforated plate stay this far from the outline."""
    skin: float = 0.0
    """Share of cells closed by a skin (closed-cell foam)."""

    def __post_init__(self) -> None:
        if not 0.0 < self.wall_mm < self.pitch_mm:
            raise ParameterError(f"wall_mm {self.wall_mm}: expected above 0 and below pitch_mm {self.pitch_mm}")
        if not 35.0 <= self.expansion_deg <= 84.0:
            raise ParameterError(f"expansion_deg {self.expansion_deg}: expected 35 to 84 (60 is the regular hexagon)")
        if not 0.0 <= self.jitter <= 0.45:
            raise ParameterError(f"jitter {self.jitter}: expected 0 to 0.45 pitches")

    @property
    def cell_area_mm2(self) -> float:
        """Mean area of a cell, mm²."""
        if self.kind == "honeycomb":
            side, angle = self.pitch_mm / math.sqrt(3.0), math.radians(self.expansion_deg)
            return 2.0 * side * math.sin(angle) * side * (1.0 + math.cos(angle))
        return self.pitch_mm**2 * (1.0 if self.square_grid else _ROW)


@dataclass(frozen=True)
class Lattice:
    """Random properties of every cell and wall over an index range, drawn once for a scene.

    `keep` and `tone` have shape (cells, 3): the wall towards neighbours (1, 0), (0, 1), (−1, 1). `shift` (cells, 2).
    """

    first: tuple[int, int]
    counts: tuple[int, int]
    keep: Float32s
    tone: Float32s
    shift: Float32s
    cell: Float32s
    filled: Bytes | None = None
    """For each cell what fills it, 0 = nothing; None where nothing fills any."""

    def index(self, i: Float32s, j: Float32s) -> Int32s:
        """Row of the tables for the cell (i, j)."""
        return ((j - self.first[1]) * self.counts[0] + (i - self.first[0])).astype(np.int32)

    @property
    def any_broken(self) -> bool:
        """Whether some wall is not intact."""
        return bool((self.keep < INTACT).any())


@dataclass(frozen=True)
class WallField:
    """At each point: distance to the wall's centre line and half its width (mm), and that wall's tone (0…, mean 1).

    `cell` is a number 0…1 of the cell the point lies in; `lean` where in the cell (−1…1 along the light).
    """

    distance: Float32s
    half_width: Float32s
    tone: Float32s
    cell: Float32s
    lean: Float32s
    filled: Bytes | None = None
    """What fills the cell that the point lies in, 0 = nothing."""


def lattice_coordinates(geometry: CellGeometry, x_mm: Float64s, y_mm: Float64s, seed: int) -> tuple[Float64s, Float64s]:
    """Work points in the lattice's own frame, millimetres: turned to the ribbon, shifted, smoothly warped."""
    turn = math.radians(geometry.ribbon_deg) - math.pi / 2.0  # the lattice's y axis is the ribbon
    x, y = x_mm - geometry.offset_mm[0], y_mm - geometry.offset_mm[1]
    along = x * math.cos(turn) + y * math.sin(turn)
    across = -x * math.sin(turn) + y * math.cos(turn)
    moved = (along.copy(), across.copy())
    if geometry.warp > 0.0:
        rng = np.random.default_rng([seed, 11])
        for octave in range(6):
            length = geometry.pitch_mm * geometry.warp_length * rng.uniform(0.6, 2.5)
            _add_waves(rng, moved, (along, across), length, geometry.pitch_mm * geometry.warp * (0.5, 0.2)[octave >= 4])
    if geometry.wobble > 0.0:
        rng = np.random.default_rng([seed, 13])
        for _ in range(8):
            length = geometry.pitch_mm * rng.uniform(1.9, 3.6)
            _add_waves(rng, moved, (along, across), length, geometry.pitch_mm * geometry.wobble * 0.5)
    return moved


def _add_waves(
    rng: np.random.Generator,
    moved: tuple[Float64s, Float64s],
    place: tuple[Float64s, Float64s],
    length: float,
    size: float,
) -> None:
    """Displace both coordinates in place by a wave of random direction and phase each."""
    for axis in range(2):
        angle, phase = rng.uniform(0.0, 2.0 * math.pi, 2)
        wave = (place[0] * math.cos(angle) + place[1] * math.sin(angle)) * (2.0 * math.pi / length) + phase
        moved[axis][...] += size * np.sin(wave)


@dataclass(frozen=True)
class WallTones:
    """How walls differ in tone: share of glints, relative spread, and what more walls return that face the light."""

    glints: float = 0.05
    spread: float = 0.22
    sheen: float = 0.0


def draw_lattice(
    geometry: CellGeometry, x: Float64s, y: Float64s, seed: int, tones: WallTones = WallTones()
) -> Lattice:
    """The tables for all cells between the extremes of lattice coordinates x, y (mm)."""
    step_x, step_y = _steps(geometry)
    j0, j1 = math.floor(y.min() / step_y) - 4, math.ceil(y.max() / step_y) + 4
    slant = 0.0 if geometry.square_grid else 0.5
    i0 = math.floor(x.min() / step_x - slant * j1) - 4
    i1 = math.ceil(x.max() / step_x - slant * j0) + 4
    counts = (i1 - i0 + 1, j1 - j0 + 1)
    cells = counts[0] * counts[1]
    rng = np.random.default_rng([seed, 12])
    keep = np.full((cells, 3), INTACT, dtype=np.float32)
    if geometry.broken > 0.0:
        hit = rng.random((cells, 3)) < geometry.broken
        part = rng.uniform(-1.6, 0.7, (cells, 3))
        keep[hit] = np.where(part[hit] < -0.9, GONE, part[hit])
    tone = np.clip(1.0 + tones.spread * rng.standard_normal((cells, 3)), 0.35, 1.7)
    tone[rng.random((cells, 3)) < tones.glints] *= 1.9
    if geometry.kind == "honeycomb":
        normals = np.radians([90.0, 150.0, 210.0]) + math.radians(geometry.ribbon_deg)
        tone *= 1.0 + tones.sheen * np.cos(2.0 * (normals - 1.0))
    shift = (rng.random((cells, 2)) - 0.5) * 2.0 * geometry.jitter
    lattice = Lattice(
        (i0, j0), counts, keep, tone.astype(np.float32), shift.astype(np.float32), rng.random(cells).astype(np.float32)
    )
    _remove_cells(geometry, lattice, seed)
    return lattice


def _remove_cells(geometry: CellGeometry, lattice: Lattice, seed: int) -> None:
    if not geometry.missing_cells_mm or geometry.kind not in ("honeycomb", "irregular", "foam"):
        return
    places = np.array(geometry.missing_cells_mm, dtype=np.float64)
    x, y = lattice_coordinates(geometry, places[:, 0], places[:, 1], seed)
    xc, yc = _canonical(geometry, x.astype(np.float32), y.astype(np.float32))
    i, j, _, _ = _nearest_hex(xc, yc)
    for axis, (di, dj) in enumerate(_NEIGHBOURS):
        lattice.keep[lattice.index(i, j), axis] = GONE
        lattice.keep[lattice.index(i - di, j - dj), axis] = GONE


def wall_field(geometry: CellGeometry, lattice: Lattice, x: Float32s, y: Float32s) -> WallField:
    """The walls around lattice points x, y (mm), arrays of one shape, float32."""
    if geometry.kind == "honeycomb":
        return _hexagons(geometry, lattice, x, y)
    if geometry.kind == "perforated":
        return _holes(geometry, lattice, x, y)
    if geometry.kind == "solid":
        flat = np.ones_like(x)
        return WallField(np.zeros_like(x), np.full_like(x, 1e3), flat, flat * np.float32(0.5), np.zeros_like(x))
    return _voronoi(geometry, lattice, x, y)


def _steps(geometry: CellGeometry) -> tuple[float, float]:
    """Spacing of cells along x and between rows along y, mm."""
    if geometry.kind == "honeycomb":
        side, angle = geometry.pitch_mm / math.sqrt(3.0), math.radians(geometry.expansion_deg)
        return 2.0 * side * math.sin(angle), side * (1.0 + math.cos(angle))
    return geometry.pitch_mm, geometry.pitch_mm * (1.0 if geometry.square_grid else _ROW)


def _canonical(geometry: CellGeometry, x: Float32s, y: Float32s) -> tuple[Float32s, Float32s]:
    """Coordinates in which cells are regular hexagons one apart; straight and slanted walls stretch separately."""
    step_x, step_y = _steps(geometry)
    xc = x * np.float32(1.0 / step_x)
    if geometry.kind != "honeycomb" or abs(geometry.expansion_deg - 60.0) < 1e-6:
        return xc, y * np.float32(_ROW / step_y)
    side = geometry.pitch_mm / math.sqrt(3.0)
    slanted = step_y - side
    shifted = y + np.float32(side / 2.0)
    row = np.floor(shifted * np.float32(1.0 / step_y))
    rest = shifted - row * np.float32(step_y)
    straight = 1.0 / math.sqrt(3.0)
    within = np.where(
        rest < side,
        rest * np.float32(straight / side),
        np.float32(straight) + (rest - np.float32(side)) * np.float32((_ROW - straight) / slanted),
    )
    return xc, row * np.float32(_ROW) + within - np.float32(straight / 2.0)


def _nearest_hex(x: Float32s, y: Float32s) -> tuple[Float32s, Float32s, Float32s, Float32s]:
    """Indices (i, j) of the nearest site i·(1, 0) + j·(½, √3/2), and the offset from it."""
    tall = np.float32(2.0 * _ROW)
    row_a = np.rint(y * np.float32(0.5 / _ROW))
    col_a = np.rint(x)
    ax, ay = x - col_a, y - row_a * tall
    row_b = np.rint(y * np.float32(0.5 / _ROW) - np.float32(0.5))
    col_b = np.rint(x - np.float32(0.5))
    bx, by = x - col_b - np.float32(0.5), y - (row_b * tall + np.float32(_ROW))
    first = ax * ax + ay * ay < bx * bx + by * by
    j = np.where(first, row_a * 2, row_b * 2 + 1)
    i = np.where(first, col_a - row_a, col_b - row_b)
    return i, j, np.where(first, ax, bx), np.where(first, ay, by)


def _hexagons(geometry: CellGeometry, lattice: Lattice, x: Float32s, y: Float32s) -> WallField:
    xc, yc = _canonical(geometry, x, y)
    i, j, dx, dy = _nearest_hex(xc, yc)
    here = lattice.index(i, j)
    step_x, step_y = _steps(geometry)
    side = geometry.pitch_mm / math.sqrt(3.0)
    slant_y = (step_y - side) / (_ROW - 1.0 / math.sqrt(3.0))  # mm per canonical unit across slanted walls
    slanted = 1.0 / math.hypot(0.5 / step_x, _ROW / slant_y)
    broken = lattice.any_broken
    best = np.full_like(x, -1e6)
    distance, half, wall = np.full_like(x, 1e3), np.zeros_like(x), here * np.int32(3)
    for axis, ((nx, ny), (di, dj)) in enumerate(zip(_NORMALS, _NEIGHBOURS, strict=True)):
        across = dx * np.float32(nx) + dy * np.float32(ny)
        width = np.float32(0.5 * geometry.wall_mm * (geometry.doubled if axis == 0 else 1.0))
        gap = (np.float32(0.5) - np.abs(across)) * np.float32(step_x if axis == 0 else slanted)
        owner = np.where(across >= 0, here, here - np.int32(dj * lattice.counts[0] + di)) * np.int32(3) + np.int32(axis)
        into = width - gap
        if broken:
            along = (dx * np.float32(-ny) + dy * np.float32(nx)) * np.float32(2.0 * math.sqrt(3.0))
            into = np.where(along < lattice.keep.ravel()[owner], into, np.float32(-1e3))
        better = into > best
        best = np.where(better, into, best)
        distance, wall = np.where(better, gap, distance), np.where(better, owner, wall)
        half = np.where(better, width, half)
    distance = np.where(best < -500.0, np.float32(1e3), distance)
    return WallField(distance, half, lattice.tone.ravel()[wall], lattice.cell[here], dx - dy, _of(lattice.filled, here))


def _holes(geometry: CellGeometry, lattice: Lattice, x: Float32s, y: Float32s) -> WallField:
    pitch_mm = np.float32(geometry.pitch_mm)
    xc, yc = x / pitch_mm, y / pitch_mm
    if geometry.square_grid:
        i, j = np.rint(xc), np.rint(yc)
        dx, dy = xc - i, yc - j
    else:
        i, j, dx, dy = _nearest_hex(xc, yc)
    here = lattice.index(i, j)
    radius = np.float32(0.5 * (geometry.pitch_mm - geometry.wall_mm))
    outside = np.sqrt(dx * dx + dy * dy) * pitch_mm - radius
    outside = np.where(lattice.keep[here, 0] < INTACT, np.float32(400.0), outside)  # this hole was never drilled
    one = np.ones_like(outside)
    # a half-plane written as a very wide wall: its near face lies where the hole ends
    return WallField(np.float32(500.0) - outside, np.float32(500.0) * one, one, lattice.cell[here], dx - dy)


def _voronoi(geometry: CellGeometry, lattice: Lattice, x: Float32s, y: Float32s) -> WallField:
    pitch_mm = np.float32(geometry.pitch_mm)
    xc, yc = x / pitch_mm, y / pitch_mm
    i, j, dx, dy = _nearest_hex(xc, yc)
    here = lattice.index(i, j)
    reach = 1 if geometry.jitter <= 0.2 else 2
    far = np.float32(1e9)
    near1, near2 = np.full_like(x, far), np.full_like(x, far)
    id1, id2 = here, here
    at = {1: (dx, dy), 2: (dx, dy)}
    for dj in range(-reach, reach + 1):
        for di in range(-reach, reach + 1):
            if abs(di + dj) > reach:
                continue
            there = here + np.int32(dj * lattice.counts[0] + di)
            ox = np.float32(di + 0.5 * dj) + lattice.shift[:, 0][there]
            oy = np.float32(dj * _ROW) + lattice.shift[:, 1][there]
            far2 = (dx - ox) ** 2 + (dy - oy) ** 2
            first = far2 < near1
            second = ~first & (far2 < near2)
            near2 = np.where(first, near1, np.where(second, far2, near2))
            id2 = np.where(first, id1, np.where(second, there, id2))
            at[2] = (
                np.where(first, at[1][0], np.where(second, ox, at[2][0])),
                np.where(first, at[1][1], np.where(second, oy, at[2][1])),
            )
            near1, id1 = np.where(first, far2, near1), np.where(first, there, id1)
            at[1] = (np.where(first, ox, at[1][0]), np.where(first, oy, at[1][1]))
    apart = np.sqrt((at[2][0] - at[1][0]) ** 2 + (at[2][1] - at[1][1]) ** 2)
    distance = (near2 - near1) / (2.0 * np.maximum(apart, np.float32(1e-3))) * pitch_mm
    pair = (id1 + id2) % np.int32(len(lattice.tone))
    keep = lattice.keep[pair, 0]
    distance = np.where(keep < INTACT, np.float32(1e3), distance)
    tone = lattice.tone[pair, 1]
    half = np.float32(0.5 * geometry.wall_mm) * (np.float32(0.6) + np.float32(0.8) * lattice.cell[pair])
    lean = (dx - at[1][0]) - (dy - at[1][1])
    return WallField(distance.astype(np.float32), half, tone, lattice.cell[id1], lean, _of(lattice.filled, id1))


def _of(table: Bytes | None, cell: Int32s) -> Bytes | None:
    return None if table is None else table[cell]


def lattice_centres(geometry: CellGeometry, lattice: Lattice) -> Float64s:
    """Centres of all cells in the tables' order, work millimetres, shape (cells, 2); the warp is left out."""
    columns, rows = np.meshgrid(np.arange(lattice.counts[0]), np.arange(lattice.counts[1]))
    i, j = columns.ravel() + lattice.first[0], rows.ravel() + lattice.first[1]
    step_x, step_y = _steps(geometry)
    x = (i + (0.0 if geometry.square_grid else 0.5) * j) * step_x
    y = j * step_y
    turn = math.radians(geometry.ribbon_deg) - math.pi / 2.0
    return np.column_stack(
        (
            x * math.cos(turn) - y * math.sin(turn) + geometry.offset_mm[0],
            x * math.sin(turn) + y * math.cos(turn) + geometry.offset_mm[1],
        )
    )
