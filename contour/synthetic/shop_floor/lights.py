"""Shadows and spots of light where they disturb most: at the block's edge."""

from __future__ import annotations

import numpy as np

from contour.geometry.arrays import Float32s
from contour.synthetic.scene import Scene
from contour.synthetic.shop_floor.masks import image_angle, pixel_of, px_mm, share_of
from contour.synthetic.table import blurred
from contour.synthetic.things import Fade, Flare, Shade


def shaded(scene: Scene, *, on_block: bool) -> Float32s:
    """What shadows leave of the light, shape (H, W): of those that fall on the block as well, or of the others."""
    left = np.ones((scene.camera.height, scene.camera.width), dtype=np.float32)
    for thing in scene.things:
        if isinstance(thing, Shade) and thing.on_block == on_block:
            share = share_of(scene, thing.area, scene.thickness_mm if on_block else 0.0)
            left *= 1.0 - np.float32(thing.depth) * blurred(share, thing.soft_mm / px_mm(scene))
    return left


def add_flares(scene: Scene, planes: list[Float32s], cover: Float32s) -> None:
    """Add the spots of light to the planes, in place; `cover` is the block's share of each pixel."""
    for thing in scene.things:
        if isinstance(thing, Flare):
            spot = _spot(scene, thing) * (1.0 - np.float32(1.0 - thing.on_block) * cover)
            for plane in planes:
                np.add(plane, spot, out=plane)


def faded(scene: Scene) -> Float32s | np.float32:
    """What is left of the walls' light where they fade, as a factor: shape (H, W), or 1."""
    factor: Float32s | np.float32 = np.float32(1.0)
    for thing in scene.things:
        if isinstance(thing, Fade):
            factor = factor * (1.0 - _spot(scene, Flare(thing.at, thing.depth, (thing.size_mm, thing.size_mm))))
    return factor


def _spot(scene: Scene, flare: Flare) -> Float32s:
    (x, y), scale = pixel_of(scene, flare.at), px_mm(scene)
    angle = image_angle(scene, flare.at, flare.angle_deg)
    right = (np.arange(scene.camera.width) - x).astype(np.float32)[None, :]
    down = (np.arange(scene.camera.height) - y).astype(np.float32)[:, None]
    cos, sin = np.float32(np.cos(angle) * scale), np.float32(np.sin(angle) * scale)
    along = (right * cos + down * sin) / np.float32(flare.size_mm[0])
    across = (down * cos - right * sin) / np.float32(flare.size_mm[1])
    return np.asarray(np.float32(flare.level) * np.exp(-0.5 * (along**2 + across**2)), dtype=np.float32)
