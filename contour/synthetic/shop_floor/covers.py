"""Opaque things over block and table, and what of the outline they hide."""

from __future__ import annotations

import math

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Float32s
from contour.geometry.rings import Contour, Ring
from contour.synthetic.outlines import moved, signed_distance
from contour.synthetic.scene import Scene
from contour.synthetic.shop_floor.masks import depth_in, image_angle, px_mm, share_of
from contour.synthetic.table import blurred, smooth_noise
from contour.synthetic.things import Cover

_RIM_PX = 1.0
"""Nearer to a cover than this an outline is not seen: it ends within the blur of the cover's own rim."""


def lay_covers(scene: Scene, planes: list[Float32s], falling: Float32s) -> None:
    """Lay all covers over the light planes, in their order, in place; `falling` light falls on them."""
    covers = [thing for thing in scene.things if isinstance(thing, Cover)]
    for number, cover in enumerate(covers):
        share = share_of(scene, cover.area, scene.thickness_mm)
        if cover.shadow > 0.0:
            cast = share_of(scene, moved(cover.area, cover.shadow_mm), scene.thickness_mm)
            soft = blurred(cast, 0.35 * math.hypot(*cover.shadow_mm) / px_mm(scene))
            for plane in planes:
                np.multiply(plane, 1.0 - np.float32(cover.shadow) * soft, out=plane)
        body = _body(scene, cover, share, np.random.default_rng([scene.seed, 61, number])) * falling
        factors = cover.colour if len(planes) > 1 else (1.0,)
        for plane, factor in zip(planes, factors, strict=True):
            np.add(plane, share * (body * np.float32(factor) - plane), out=plane)


def _body(scene: Scene, cover: Cover, share: Float32s, rng: np.random.Generator) -> Float32s:
    """Light that a cover returns under light 1, shape (H, W)."""
    shape = share.shape
    body = np.full(shape, cover.level, dtype=np.float32)
    if cover.texture > 0.0:
        grain = 0.5 * smooth_noise(rng, shape, 2.0) + 0.8 * smooth_noise(rng, shape, 40.0)
        body *= 1.0 + np.float32(cover.texture) * grain
    if cover.streaks > 0.0:
        angle = image_angle(scene, cover.area.exterior.mean(axis=0).tolist(), cover.streaks_deg)
        body *= 1.0 + np.float32(cover.streaks) * streaks(rng, shape, angle, 1.5)
    if cover.rounding_mm > 0.0:
        turned = np.minimum(depth_in(share) * np.float32(px_mm(scene) / cover.rounding_mm), 1.0)
        body *= np.float32(0.35) + np.float32(0.75) * np.sqrt(turned * (2.0 - turned))
    return np.maximum(body, 0.0)


def streaks(rng: np.random.Generator, shape: tuple[int, ...], angle: float, width_px: float) -> Float32s:
    """Fine lines of unit spread that run at `angle` (radians, in the picture), shape (H, W), float32."""
    long = math.ceil(math.hypot(*shape)) + 4
    stretched = cv2.resize(
        rng.standard_normal((math.ceil(long / width_px), max(4, long // 160)), dtype=np.float32),
        (long, long),
        interpolation=cv2.INTER_CUBIC,
    )
    middle = ((shape[1] - 1) / 2.0, (shape[0] - 1) / 2.0)
    matrix = cv2.getRotationMatrix2D(((long - 1) / 2.0, (long - 1) / 2.0), -math.degrees(angle), 1.0)
    matrix[0, 2] += middle[0] - (long - 1) / 2.0
    matrix[1, 2] += middle[1] - (long - 1) / 2.0
    return np.asarray(cv2.warpAffine(stretched, matrix, shape[1::-1], borderMode=cv2.BORDER_REFLECT), dtype=np.float32)


def visible(scene: Scene, seen: Contour) -> tuple[Bools, ...]:
    """For each vertex of the rings as seen (pixels) whether nothing lies over it: one array a ring."""
    areas = cover_areas(scene)
    return tuple(_clear_of(ring, areas) for ring in seen.rings)


def cover_areas(scene: Scene) -> list[Contour]:
    """Where covers lie, as seen, pixels."""
    return [
        scene.camera.project_contour(thing.area, scene.thickness_mm, 8.0 * px_mm(scene))
        for thing in scene.things
        if isinstance(thing, Cover)
    ]


def _clear_of(ring: Ring, areas: list[Contour]) -> Bools:
    clear = np.ones(len(ring), dtype=bool)
    for area in areas:
        clear &= signed_distance(area, ring) < -_RIM_PX
    return clear
