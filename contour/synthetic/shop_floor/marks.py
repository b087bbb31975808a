"""Ink on walls and table, and walls that a polished table mirrors."""

from __future__ import annotations

import cv2
import numpy as np

from contour.geometry.arrays import Bytes, Float32s
from contour.synthetic.coverage import area_coverage
from contour.synthetic.scene import Scene
from contour.synthetic.shop_floor.masks import px_mm, share_of, share_of_any
from contour.synthetic.table import blurred
from contour.synthetic.things import Filling, Ink, Mirror


def ink_tops(scene: Scene, cover: Float32s, light: Float32s) -> None:
    """Write on the wall tops: change their light (premultiplied by the cover) in place."""
    for thing in scene.things:
        if isinstance(thing, Ink):
            share = np.float32(thing.strength) * share_of_any(scene, thing.strokes, scene.thickness_mm)
            light += share * (np.float32(thing.level) * cover - light)


def tints(scene: Scene, filled: Bytes | None) -> list[Float32s | np.float32]:
    """Colour factors of the block's light, blue, green, red: its material's, but where it is filled or written on."""
    fillings = [thing for thing in scene.things if isinstance(thing, Filling)]
    inks = [
        (np.float32(thing.strength) * share_of_any(scene, thing.strokes, scene.thickness_mm), thing.colour)
        for thing in scene.things
        if isinstance(thing, Ink)
    ]
    factors: list[Float32s | np.float32] = []
    for channel, material in enumerate(scene.material.colour):
        factor: Float32s | np.float32 = np.float32(material)
        if filled is not None:
            factor = np.array([material, *(one.colour[channel] for one in fillings)], dtype=np.float32)[filled]
        for share, colour in inks:
            factor = factor + share * (np.float32(colour[channel]) - factor)
        factors.append(factor)
    return factors


def inked_table(scene: Scene) -> Float32s | np.float32:
    """What ink beside the block makes of the table's light, as a factor: shape (H, W), or 1."""
    inks = [thing for thing in scene.things if isinstance(thing, Ink) and thing.on_table]
    if not inks:
        return np.float32(1.0)
    beside = 1.0 - share_of(scene, scene.outline, 0.0)
    factor = np.ones_like(beside)
    for ink in inks:
        change = np.float32(ink.strength * (ink.level / max(scene.table.level, 1e-3) - 1.0))
        factor *= 1.0 + change * beside * share_of_any(scene, ink.strokes, 0.0)
    return factor


def mirrored(scene: Scene, walls: Float32s) -> Float32s | np.float32:
    """Light of walls that the table mirrors beyond the block's edge, before the block hides it: (H, W), or 0.

    A place outside shows the walls as far inside the edge as it lies outside.
    """
    mirror = next((thing for thing in scene.things if isinstance(thing, Mirror)), None)
    if mirror is None:
        return np.float32(0.0)
    seen = scene.camera.project_contour(scene.outline, scene.thickness_mm)
    inside = area_coverage(seen.rings, scene.camera.width, scene.camera.height)
    out = cv2.distanceTransform((inside < 0.5).astype(np.uint8), cv2.DIST_L2, 5)
    depth = cv2.distanceTransform((inside >= 0.5).astype(np.uint8), cv2.DIST_L2, 5)
    smooth = cv2.GaussianBlur(out - depth, (0, 0), max(1.5, 0.1 * scene.cells.pitch_mm / px_mm(scene)))
    right, down = cv2.Sobel(smooth, cv2.CV_32F, 1, 0, scale=0.125), cv2.Sobel(smooth, cv2.CV_32F, 0, 1, scale=0.125)
    length = np.maximum(np.hypot(right, down), np.float32(1e-3))
    y, x = np.indices(out.shape, dtype=np.float32)
    back = np.float32(2.0) * out / length
    image = cv2.remap(walls, x - back * right, y - back * down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
    reach = mirror.reach_mm / px_mm(scene)
    fading = np.float32(mirror.strength) * np.exp(-out / np.float32(reach)) * (out > 0.0)
    return np.asarray(blurred(np.asarray(image, dtype=np.float32), mirror.blur_px) * fading, dtype=np.float32)
