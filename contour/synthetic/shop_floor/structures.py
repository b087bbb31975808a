"""Tables that are not even: wood, brushed metal, T-slots, a spoilboard with old cuts, expanded metal, ribs, cork."""

from __future__ import annotations

import math

import cv2
import numpy as np

from contour.geometry.arrays import Float32s
from contour.synthetic.scene import Scene
from contour.synthetic.shop_floor.covers import streaks
from contour.synthetic.shop_floor.masks import image_angle, pixel_of, px_mm
from contour.synthetic.table import smooth_noise
from contour.synthetic.things import Structure


def structured(scene: Scene) -> Float32s | np.float32:
    """The pattern of the table as a factor of its light: shape (H, W), or 1."""
    factor: Float32s | np.float32 = np.float32(1.0)
    for number, thing in enumerate(scene.things):
        if isinstance(thing, Structure):
            rng = np.random.default_rng([scene.seed, 62, number])
            factor = factor * np.maximum(_PATTERNS[thing.kind](scene, thing, rng), np.float32(0.02))
    return factor


def _across(scene: Scene, structure: Structure) -> tuple[Float32s, Float32s, float]:
    """Millimetres along and across the structure's lines for each pixel, and its angle in the picture."""
    scale = px_mm(scene)
    middle = scene.outline.exterior.mean(axis=0).tolist()
    angle = image_angle(scene, middle, structure.angle_deg)
    x0, y0 = pixel_of(scene, (middle[0], middle[1]))
    x = (np.arange(scene.camera.width) - x0).astype(np.float32)[None, :] * np.float32(scale)
    y = (np.arange(scene.camera.height) - y0).astype(np.float32)[:, None] * np.float32(scale)
    cos, sin = np.float32(math.cos(angle)), np.float32(math.sin(angle))
    return x * cos + y * sin, y * cos - x * sin, angle


def _wood(scene: Scene, structure: Structure, rng: np.random.Generator) -> Float32s:
    """Planks of their own tone, each with growth rings that wave along the grain, pores, and a dark joint."""
    along, across, angle = _across(scene, structure)
    shape = along.shape
    wave = smooth_noise(rng, shape, 0.25 * max(shape)) * np.float32(0.22 * structure.scale_mm)
    ring = np.float32(2.0 * math.pi / (structure.scale_mm * rng.uniform(0.05, 0.2)))
    year = 0.5 + 0.5 * np.sin((across + wave) * ring + smooth_noise(rng, shape, 60.0))
    pores = streaks(rng, shape, angle, 1.6)
    place = across / np.float32(structure.scale_mm) + np.float32(rng.uniform())
    tones = rng.normal(0.0, 0.35, 512).astype(np.float32)[np.floor(place).astype(np.int32) % 512]
    joint = np.abs(place - np.rint(place)) * np.float32(structure.scale_mm / px_mm(scene)) < 1.2
    grain = 0.9 * (year**3 - 0.3) + 0.45 * pores + tones
    return np.asarray((1.0 - np.float32(structure.contrast) * grain) * np.where(joint, 0.55, 1.0), dtype=np.float32)


def _brushed(scene: Scene, structure: Structure, rng: np.random.Generator) -> Float32s:
    """Fine lines, and broad bands of sheen across them."""
    _, across, angle = _across(scene, structure)
    fine = 0.7 * streaks(rng, across.shape, angle, 1.2) + 0.5 * streaks(rng, across.shape, angle, 4.0)
    bands = np.sin(across * np.float32(2.0 * math.pi / structure.scale_mm) + np.float32(rng.uniform(0.0, 6.0)))
    return np.asarray(1.0 + np.float32(structure.contrast) * (fine + 0.5 * bands), dtype=np.float32)


def _slots(scene: Scene, structure: Structure, rng: np.random.Generator) -> Float32s:
    """Parallel slots, dark inside, one of their edges bright."""
    _, across, _ = _across(scene, structure)
    wide = structure.scale_mm * rng.uniform(0.12, 0.3)
    place = across / np.float32(structure.scale_mm) + np.float32(rng.uniform())
    off = (place - np.rint(place)) * np.float32(structure.scale_mm)
    per_px = np.float32(1.0 / px_mm(scene))
    slot = np.clip((np.float32(wide / 2.0) - np.abs(off)) * per_px + 0.5, 0.0, 1.0)
    rim = np.exp(-(((off - np.float32(wide / 2.0)) * per_px / 1.5) ** 2))
    dark = np.float32(min(0.9, 2.5 * structure.contrast))
    return np.asarray(1.0 - dark * slot + np.float32(structure.contrast) * rim, dtype=np.float32)


def _old_cuts(scene: Scene, structure: Structure, rng: np.random.Generator) -> Float32s:
    """Cuts of earlier jobs, straight and round, dark with a bright burr; pressed fibre between them."""
    height, width = scene.camera.height, scene.camera.width
    picture = 1.0 + np.float32(0.3 * structure.contrast) * smooth_noise(rng, (height, width), 3.0)
    spacing = structure.scale_mm / px_mm(scene)
    count = round(0.9 * (height + width) / spacing)
    mask = np.zeros((height, width), dtype=np.uint8)
    burr = np.zeros_like(mask)
    base = image_angle(scene, scene.outline.exterior.mean(axis=0).tolist(), structure.angle_deg)
    for _ in range(count):
        middle = rng.uniform((0.0, 0.0), (width, height))
        thick = int(rng.integers(1, 4))
        if rng.random() < 0.7:
            angle = base + float(rng.choice([0.0, math.pi / 2.0])) + float(rng.normal(0.0, 0.04))
            reach = rng.uniform(0.1, 0.6) * width * np.array([math.cos(angle), math.sin(angle)])
            path = np.array([middle - reach, middle + reach])
        else:
            turn = rng.uniform(0.0, 2.0 * math.pi) + np.linspace(0.0, rng.uniform(1.0, 6.0), 60)
            path = middle + rng.uniform(0.03, 0.4) * height * np.column_stack((np.cos(turn), np.sin(turn)))
        cv2.polylines(mask, [np.rint(path * 16).astype(np.int32)], False, 255, thick, cv2.LINE_AA, 4)
        cv2.polylines(burr, [np.rint((path + 0.6 * thick) * 16).astype(np.int32)], False, 255, 1, cv2.LINE_AA, 4)
    lines = mask.astype(np.float32) / np.float32(255.0)
    picture += np.float32(0.6 * structure.contrast) * burr.astype(np.float32) / np.float32(255.0) * (1.0 - lines)
    return np.asarray(picture * (1.0 - np.float32(min(0.85, 2.0 * structure.contrast)) * lines), dtype=np.float32)


def _expanded(scene: Scene, structure: Structure, rng: np.random.Generator) -> Float32s:
    """A mesh of bright strands around rhombs, twice as long as wide: closed cells in even rows, but no comb."""
    along, across, _ = _across(scene, structure)
    turn, start = np.float32(math.pi / structure.scale_mm), np.float32(rng.uniform(0.0, math.pi))
    strand = np.minimum(
        np.abs(np.sin((0.5 * along + across) * turn + start)), np.abs(np.sin((0.5 * along - across) * turn))
    )
    mesh = np.clip((np.float32(0.35) - strand) * np.float32(6.0), 0.0, 1.0)
    return np.asarray(1.0 + np.float32(2.0 * structure.contrast) * (mesh - 0.4), dtype=np.float32)


def _ribbed(scene: Scene, structure: Structure, rng: np.random.Generator) -> Float32s:
    """Round ribs of rubber, lit from one side, with dust in the grooves."""
    _, across, _ = _across(scene, structure)
    place = across * np.float32(2.0 * math.pi / structure.scale_mm)
    dust = np.float32(0.3) * smooth_noise(rng, across.shape, 4.0)
    return np.asarray(1.0 + np.float32(structure.contrast) * (np.sin(place) + dust), dtype=np.float32)


def _cork(scene: Scene, structure: Structure, rng: np.random.Generator) -> Float32s:
    """Pressed grains, light and dark, with dark gaps between some of them."""
    shape = (scene.camera.height, scene.camera.width)
    grain = smooth_noise(rng, shape, structure.scale_mm / px_mm(scene))
    gaps = np.clip(-smooth_noise(rng, shape, 0.5 * structure.scale_mm / px_mm(scene)) - 1.0, 0.0, 2.0)
    return np.asarray(1.0 + np.float32(structure.contrast) * (0.7 * grain - gaps), dtype=np.float32)


_PATTERNS = {
    "wood": _wood,
    "brushed": _brushed,
    "slots": _slots,
    "old-cuts": _old_cuts,
    "expanded": _expanded,
    "ribbed": _ribbed,
    "cork": _cork,
}
