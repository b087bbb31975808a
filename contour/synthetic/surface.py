"""The block's top plane as the camera sees it: how much of each pixel is wall, and how bright that wall is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s
from contour.geometry.rings import Contour
from contour.image.pixel_grid import pixels_of, samples_of
from contour.synthetic.cells import (
    Lattice,
    WallField,
    WallTones,
    draw_lattice,
    lattice_centres,
    lattice_coordinates,
    wall_field,
)
from contour.synthetic.coverage import area_coverage
from contour.synthetic.outlines import signed_distance
from contour.synthetic.scene import Scene
from contour.synthetic.shop_floor.cells_changed import filled_cells, fillings, pressed
from contour.synthetic.things import Crush, Slip


@dataclass(frozen=True)
class Surface:
    """A piece's top plane over the window of the picture that starts at pixel (left, top).

    `cover` is the share of each pixel that is material, `light` the light it returns (premultiplied by the share),
    both shape (H, W), float32. `filled` says what fills the cell there, 0 = nothing, shape (H, W); None: no cell is.
    """

    left: int
    top: int
    cover: Float32s
    light: Float32s
    filled: Bytes | None = None

    def rows(self, part: slice) -> Surface:
        """Some rows of it, the same memory."""
        filled = None if self.filled is None else self.filled[part]
        return Surface(self.left, self.top + part.start, self.cover[part], self.light[part], filled)


def surface(scene: Scene, outline: Contour, seed: int) -> Surface | None:
    """The top plane of one piece of core; None if it lies outside the picture."""
    camera, ss = scene.camera, scene.sensor.supersample
    seen = camera.project_contour(outline, scene.thickness_mm)
    low = np.floor(seen.exterior.min(axis=0)).astype(int) - 1
    high = np.ceil(seen.exterior.max(axis=0)).astype(int) + 2
    left, top = max(0, int(low[0])), max(0, int(low[1]))
    right, bottom = min(camera.width, int(high[0])), min(camera.height, int(high[1]))
    if left >= right or top >= bottom:
        return None
    width, height = (right - left) * ss, (bottom - top) * ss
    rings = [(ring - [left - 0.5, top - 0.5]) * ss - 0.5 for ring in seen.rings]
    inside = area_coverage(rings, width, height)
    light = np.empty_like(inside)
    filled = np.zeros(inside.shape, dtype=np.uint8) if outline is scene.outline and fillings(scene) else None
    _fill(scene, outline, seed, Surface(left, top, inside, light, filled))
    size = (right - left, bottom - top)
    if filled is not None:
        filled = filled[::ss, ::ss]
    return Surface(left, top, _shrunk(inside, size), _shrunk(light, size), filled)


def _shrunk(raster: Float32s, size: tuple[int, int]) -> Float32s:
    if raster.shape == (size[1], size[0]):
        return raster
    return np.asarray(cv2.resize(raster, size, interpolation=cv2.INTER_AREA), dtype=np.float32)


def _fill(scene: Scene, outline: Contour, seed: int, fine_px: Surface) -> None:
    """Turn the cover (share inside the outline) into the share of material, and write the rest beside it, by bands.

    `fine_px` is the surface on finer pixels, `supersample` to each of the picture's.
    """
    camera, ss, cells = scene.camera, scene.sensor.supersample, scene.cells
    scale = camera.mm_per_px(_middle(outline), scene.thickness_mm) / ss
    bent = cells.wobble > 0.0 or any(isinstance(thing, Crush | Slip) for thing in scene.things)
    finest = 8.0 if bent else 2.0
    step = int(np.clip(cells.pitch_mm / scale / finest, 4, 32))
    height, width = fine_px.cover.shape
    rows, columns = math.ceil(height / step), math.ceil(width / step)
    u = pixels_of(np.arange(-1, columns + 1), step)
    v = pixels_of(np.arange(-1, rows + 1), step)
    grid = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    work = camera.back_project(samples_of(grid, ss) + np.array([fine_px.left, fine_px.top]), scene.thickness_mm)
    if scene.things and outline is scene.outline:
        work = pressed(scene, outline, work)
    x, y = lattice_coordinates(cells, work[:, 0], work[:, 1], seed)
    material = scene.material
    tones = WallTones(material.glints, material.spread, material.sheen)
    lattice = draw_lattice(cells, x, y, seed, tones)
    _close_rim(scene, outline, lattice)
    if outline is scene.outline:
        lattice = replace(lattice, filled=filled_cells(scene, cells, lattice))
    nodes = np.stack((x, y), axis=-1).reshape(rows + 2, columns + 2, 2).astype(np.float32)
    band = max(1, 96 // step)
    for first in range(0, rows, band):
        last = min(rows, first + band)
        wide = ((columns + 2) * step, (last - first + 2) * step)
        fine = cv2.resize(nodes[first : last + 2], wide, interpolation=cv2.INTER_LINEAR)
        stop = min(height, last * step)
        part = slice(first * step, stop)
        fine = fine[step : step + stop - first * step, step : step + width]
        _paint(scene, lattice, np.asarray(fine, np.float32), scale, fine_px.rows(part))


def _paint(scene: Scene, lattice: Lattice, places: Float32s, scale: float, part: Surface) -> None:
    """The part's cover by walls at lattice places (H, W, 2), and the light they return, in place."""
    material, cells, cover, light = scene.material, scene.cells, part.cover, part.light
    x, y = np.ascontiguousarray(places[..., 0]), np.ascontiguousarray(places[..., 1])
    field = wall_field(cells, lattice, x, y)
    per_mm = np.float32(1.0 / scale)
    near = np.clip((field.half_width - field.distance) * per_mm + np.float32(0.5), 0.0, 1.0)
    far = np.clip((-field.half_width - field.distance) * per_mm + np.float32(0.5), 0.0, 1.0)
    wall = near - far
    top = np.float32(material.top)
    if field.filled is not None and part.filled is not None:
        part.filled[...] = field.filled
        _pour(scene, field, wall, cover, light)
        return
    if cells.skin <= 0.0:
        cover *= wall
        np.multiply(cover, field.tone * top, out=light)
        return
    closed = (field.cell < cells.skin).astype(np.float32)
    bulge = np.clip(0.75 + 0.6 * field.lean + 0.5 * (field.cell * 7.0 % 1.0 - 0.5), 0.2, 1.8).astype(np.float32)
    skin = closed * (1.0 - wall)
    inside = cover.copy()
    cover *= wall + skin
    np.multiply(inside, wall * field.tone * top + skin * bulge * np.float32(material.skin), out=light)


def _pour(scene: Scene, field: WallField, wall: Float32s, cover: Float32s, light: Float32s) -> None:
    """`cover` by walls and by what fills cells up to the cut, and the light of both, in place."""
    numbers, found = field.filled, fillings(scene)
    levels = np.array([0.0, *(filling.level for filling in found)], dtype=np.float32)[numbers]
    shown = np.array([1.0, *(filling.walls for filling in found)], dtype=np.float32)[numbers]
    full = (levels > 0.0).astype(np.float32)
    levels *= 1.0 + 0.12 * field.lean  # it sinks a little towards one side
    inside = cover.copy()
    cover *= np.maximum(wall, full)
    seen = wall * np.where(full > 0.0, shown, np.float32(1.0))
    np.multiply(inside, seen * field.tone * np.float32(scene.material.top) + full * (1.0 - seen) * levels, out=light)


def _close_rim(scene: Scene, outline: Contour, lattice: Lattice) -> None:
    """Leave out a perforated plate's holes that would come nearer to the outline than its rim."""
    cells = scene.cells
    if cells.kind != "perforated" or cells.rim_mm <= 0.0:
        return
    radius = 0.5 * (cells.pitch_mm - cells.wall_mm)
    depth = signed_distance(outline, lattice_centres(cells, lattice))
    lattice.keep[depth < cells.rim_mm + radius, 0] = -2.0


def _middle(outline: Contour) -> tuple[float, float]:
    x, y = ((outline.exterior.min(axis=0) + outline.exterior.max(axis=0)) / 2.0).tolist()
    return (x, y)
