"""The table under the block: texture, vacuum holes and grooves, scratches, shadow, and chips that lie about."""

from __future__ import annotations

import math

import cv2
import numpy as np

from contour.geometry.arrays import Float32s, Float64s
from contour.geometry.rings import Contour
from contour.image.pixel_grid import pixels_of
from contour.synthetic.coverage import area_coverage
from contour.synthetic.outlines import moved, signed_distance
from contour.synthetic.scene import Scene


def table_light(scene: Scene) -> Float32s:
    """Light the table returns under light 1 with the block on it, shape (H, W), float32."""
    picture = bare_table(scene)
    _shade(scene, picture)
    _chips(scene, picture)
    return np.maximum(picture, 0.0, out=picture)


def bare_table(scene: Scene) -> Float32s:
    """Light the empty table returns under light 1, shape (H, W), float32."""
    camera, table = scene.camera, scene.table
    rng = np.random.default_rng([scene.seed, 31])
    picture = np.full((camera.height, camera.width), table.level, dtype=np.float32)
    if table.texture > 0.0:
        for size, weight in ((1, 0.6), (6, 0.5), (60, 0.6)):
            picture += np.float32(table.texture * weight) * smooth_noise(rng, picture.shape, size)
    if table.perforation_pitch_mm > 0.0 or table.groove_pitch_mm > 0.0:
        _machined(scene, picture)
    for _ in range(table.scratches):
        _scratch(rng, picture, table.level)
    return picture


def table_glare(scene: Scene) -> Float32s:
    """Light of a lamp that the table mirrors broadly; cells hide it. Shape (H, W), float32."""
    camera, light = scene.camera, scene.light
    x = (np.arange(camera.width) / camera.width - light.glare_at[0]).astype(np.float32)
    y = ((np.arange(camera.height) - light.glare_at[1] * camera.height) / camera.width).astype(np.float32)
    spot = np.float32(light.glare) * np.exp(-(x[None, :] ** 2 + 1.8 * y[:, None] ** 2) / np.float32(0.03))
    return np.asarray(spot * (1.0 - _under_block(scene)), dtype=np.float32)


def _under_block(scene: Scene) -> Float32s:
    """How far each pixel's place on the table lies under the block, 0…1: open cells at the cut let light in."""
    camera = scene.camera
    foot = camera.project_contour(scene.outline, 0.0)
    x, y = scene.outline.exterior[0].tolist()
    inside = area_coverage(foot.rings, camera.width, camera.height)
    return blurred(inside, 0.45 * scene.cells.pitch_mm / camera.mm_per_px((x, y), 0.0))


def smooth_noise(rng: np.random.Generator, shape: tuple[int, ...], size: float) -> Float32s:
    """Noise of unit spread whose grains are about `size` pixels, shape (H, W), float32."""
    small = (max(3, math.ceil(shape[0] / size) + 2), max(3, math.ceil(shape[1] / size) + 2))
    grains = rng.standard_normal(small, dtype=np.float32)
    if size <= 1:
        return grains[: shape[0], : shape[1]]
    enlarged = cv2.resize(grains, (round(small[1] * size), round(small[0] * size)), interpolation=cv2.INTER_CUBIC)
    return np.asarray(enlarged[: shape[0], : shape[1]] * np.float32(1.3), dtype=np.float32)


def _machined(scene: Scene, picture: Float32s) -> None:
    """Darken the holes and grooves of a vacuum table, at z = 0."""
    camera, table = scene.camera, scene.table
    step = 16
    columns, rows = math.ceil(camera.width / step), math.ceil(camera.height / step)
    u = pixels_of(np.arange(-1, columns + 1), step)
    v = pixels_of(np.arange(-1, rows + 1), step)
    work = camera.back_project(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2), 0.0)
    nodes = work.reshape(rows + 2, columns + 2, 2).astype(np.float32)
    fine = cv2.resize(nodes, ((columns + 2) * step, (rows + 2) * step), interpolation=cv2.INTER_LINEAR)
    fine = fine[step : step + camera.height, step : step + camera.width]
    per_mm = 1.0 / camera.mm_per_px((float(work[:, 0].mean()), float(work[:, 1].mean())), 0.0)
    if table.perforation_pitch_mm > 0.0:
        pitch_mm = np.float32(table.perforation_pitch_mm)
        off = fine / pitch_mm
        off -= np.rint(off)
        outside = np.sqrt(off[..., 0] ** 2 + off[..., 1] ** 2) * pitch_mm - np.float32(table.perforation_mm / 2.0)
        hole = np.clip(np.float32(0.5) - outside * np.float32(per_mm), 0.0, 1.0)
        picture += hole * (np.float32(table.perforation_level) - picture)
    if table.groove_pitch_mm > 0.0:
        pitch_mm = np.float32(table.groove_pitch_mm)
        off = fine / pitch_mm
        near = np.abs(off - np.rint(off)).min(axis=-1) * pitch_mm
        groove = np.clip(np.float32(0.5) - (near - np.float32(1.5)) * np.float32(per_mm), 0.0, 1.0)
        picture *= 1.0 - np.float32(0.55) * groove


def _scratch(rng: np.random.Generator, picture: Float32s, level: float) -> None:
    height, width = picture.shape
    start = rng.uniform((0, 0), (width, height))
    angle, length, bend = rng.uniform(0, 2 * math.pi), rng.uniform(0.05, 0.4) * width, rng.uniform(-0.3, 0.3)
    share = np.linspace(0.0, 1.0, 12)
    points = (
        start
        + np.column_stack((np.cos(angle + bend * share), np.sin(angle + bend * share))) * (share * length)[:, None]
    )
    mask = np.zeros((height, width), dtype=np.uint8)
    cv2.polylines(mask, [np.rint(points * 16).astype(np.int32)], False, 255, 1, cv2.LINE_AA, 4)
    picture += mask.astype(np.float32) * np.float32(level * rng.uniform(-0.25, 0.7) / 255.0)


def cell_floor(scene: Scene) -> float:
    """Share of light that reaches the table at the bottom of a cell: less the deeper and narrower it is."""
    return 0.3 + 0.7 * math.exp(-scene.thickness_mm / (1.3 * scene.cells.pitch_mm))


def _shade(scene: Scene, picture: Float32s) -> None:
    """Shadow beside the block, and the darkness at the bottom of its cells."""
    camera = scene.camera
    under = _under_block(scene)
    if scene.light.shadow > 0.0 and scene.thickness_mm > 0.0:
        angle = math.radians(scene.light.direction_deg)
        away = (-0.45 * scene.thickness_mm * math.cos(angle), -0.45 * scene.thickness_mm * math.sin(angle))
        cast = camera.project_contour(moved(scene.outline, away), 0.0)
        dark = area_coverage(cast.rings, camera.width, camera.height)
        x, y = scene.outline.exterior[0].tolist()
        soft = 0.3 * scene.thickness_mm / camera.mm_per_px((x, y), 0.0)
        picture *= 1.0 - np.float32(scene.light.shadow) * np.maximum(blurred(dark, soft), under)
    picture *= 1.0 - np.float32(1.0 - cell_floor(scene)) * under


def blurred(raster: Float32s, sigma: float) -> Float32s:
    """Gaussian blur; wide ones are done on a smaller raster."""
    if sigma < 0.2:
        return raster
    shrink = int(max(1, sigma // 4))
    if shrink == 1:
        return np.asarray(cv2.GaussianBlur(raster, (0, 0), sigma), dtype=np.float32)
    height, width = raster.shape
    small = cv2.resize(raster, (max(1, width // shrink), max(1, height // shrink)), interpolation=cv2.INTER_AREA)
    small = cv2.GaussianBlur(small, (0, 0), sigma / shrink)
    return np.asarray(cv2.resize(small, (width, height), interpolation=cv2.INTER_LINEAR), dtype=np.float32)


def _chips(scene: Scene, picture: Float32s) -> None:
    """Curled foil chips and crumbs on the table, at a distance from the block."""
    camera, clutter = scene.camera, scene.clutter
    rng = np.random.default_rng([scene.seed, 32])
    scale = camera.mm_per_px((float(scene.outline.exterior[0, 0]), float(scene.outline.exterior[0, 1])), 0.0)
    keep_off = clutter.debris_clearance_mm + 0.9 * scene.cells.pitch_mm
    for _ in range(clutter.debris):
        place = rng.uniform((0.0, 0.0), (camera.width, camera.height))
        length = rng.uniform(0.2, 1.2) * scene.cells.pitch_mm / scale
        turn = rng.uniform(0, 2 * math.pi) + np.cumsum(rng.normal(0.0, 0.5, 7))
        path = place + np.cumsum(np.column_stack((np.cos(turn), np.sin(turn))) * (length / 7), axis=0)
        level = float(scene.material.top * rng.uniform(0.4, 1.1))
        thickness = int(rng.integers(1, 3))
        if _clearance(scene, path) < keep_off:
            continue
        _stroke(picture, path, level, thickness)


def _clearance(scene: Scene, path: Float64s) -> float:
    points = scene.camera.back_project(path, scene.thickness_mm)
    coarse = Contour(scene.outline.exterior[:: max(1, len(scene.outline.exterior) // 120)], ())
    return float(-signed_distance(coarse, points).max())


def _stroke(picture: Float32s, path: Float64s, level: float, thickness: int) -> None:
    height, width = picture.shape
    x0, y0 = np.floor(path.min(axis=0)).astype(int) - 3
    x1, y1 = np.ceil(path.max(axis=0)).astype(int) + 4
    x0, y0, x1, y1 = max(0, x0), max(0, y0), min(width, x1), min(height, y1)
    if x0 >= x1 or y0 >= y1:
        return
    mask = np.zeros((y1 - y0, x1 - x0), dtype=np.uint8)
    cv2.polylines(mask, [np.rint((path - [x0, y0]) * 16).astype(np.int32)], False, 255, thickness, cv2.LINE_AA, 4)
    window = picture[y0:y1, x0:x1]
    window += mask.astype(np.float32) / np.float32(255.0) * (np.float32(level) - window)
