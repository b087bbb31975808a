"""Things: where they lie, how they stand out, and how they are laid into the picture."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.other_hand.fields import Field, Rng, Shape
from benchmarks.sixth_hand.drawings import resample
from benchmarks.sixth_hand.fields import any_of, blend, noise, smoothstep, soften
from benchmarks.sixth_hand.forms import COMPACT, Pose, any_form, silhouette
from benchmarks.sixth_hand.marks import random_level
from benchmarks.sixth_hand.materials import any_material, swatch
from benchmarks.sixth_hand.stage import Stage, fallen
from contour.geometry.arrays import Float32s, Float64s


@dataclass(frozen=True)
class Thing:
    """What a kind asks of a thing; what is None or empty is left to chance."""

    forms: tuple[str, ...] = ()
    materials: tuple[str, ...] = ()
    reliefs: tuple[str, ...] = ("flat", "thin", "thick", "thick", "round")
    places: tuple[str, ...] = ("edge", "edge", "edge", "corner", "hollow", "inside")
    light: str | None = None  # black, white, table or walls
    clear: float = 0  # the chance that it is seen through
    count: tuple[int, int] = (1, 2)  # the last not reached
    size: tuple[float, float] | None = None  # in pitches


def put_over(stage: Stage, wish: Thing, rng: Rng) -> None:
    """Lay as many things as are asked for over the block, where they hide enough of it and not too much, in place."""
    level = _level(stage, wish.light, rng)
    material = any_of(rng, wish.materials) if wish.materials else any_material(rng)
    if wish.light == "table":
        material = stage.table_material
    block = stage.solid > 0.5
    for _ in range(int(rng.integers(*wish.count))):
        for _ in range(8):
            place = any_of(rng, wish.places)
            forms = COMPACT if place == "inside" else wish.forms
            form = any_of(rng, forms) if forms else any_form(rng)
            pose = _pose(stage, place, _size(stage, wish, rng), rng)
            alpha = silhouette(form, stage.shape, pose, rng)
            body = alpha > 0.5
            covered = int((body & block).sum())
            least = 60 if wish.size else 0.008 * block.sum()
            fits = max(least, 0.7 * stage.pitch**2) < covered < 0.55 * block.sum()
            if fits and not (body[0].any() and body.mean() > 0.6):
                _lay(stage, alpha, wish, pose.angle, level, material, rng)
                stage.hidden |= body
                break
        if rng.random() < 0.5:
            level = _level(stage, wish.light, rng)


def put_beside(stage: Stage, wish: Thing, rng: Rng) -> None:
    """Lay as many things as are asked for on the table near where the block is to be raised, in place."""
    outer = np.zeros(stage.shape, np.uint8)
    cv2.fillPoly(outer, [np.round(stage.rings[0]).astype(np.int32)], 1)
    away = np.asarray(cv2.distanceTransform(1 - outer, cv2.DIST_L2, 5), np.float32)
    for _ in range(int(rng.integers(*wish.count))):
        for _ in range(6):
            found = _beside_form(stage, wish, away, rng)
            if found is not None:
                material = any_of(rng, wish.materials) if wish.materials else any_material(rng)
                _lay(stage, found[0], wish, found[1], _level(stage, wish.light, rng), material, rng)
                break


def _beside_form(stage: Stage, wish: Thing, away: Float32s, rng: Rng) -> tuple[Float32s, float] | None:
    """How much of each pixel is a thing, (H, W), that lies 0.3 to 3 pitches off the block, and its angle; None if it
    found no room. away: how far pixels lie from the block, (H, W), pixels.
    """
    gap = stage.pitch * float(rng.choice([rng.uniform(0.3, 0.8), rng.uniform(0.3, 3)]))
    ring = resample(stage.rings[0], 4)
    index = int(rng.integers(len(ring)))
    angle = _outward(ring, index)
    out = np.array([np.cos(angle), np.sin(angle)])
    size = _size(stage, wish, rng)
    turn = rng.choice([0, np.pi / 2, rng.normal(0, 0.7)])
    pose = Pose(ring[index] + out * (gap + size), angle + turn, size, float(np.hypot(*stage.shape)))
    form = any_of(rng, wish.forms) if wish.forms else any_form(rng)
    seed = int(rng.integers(2**31))
    for _ in range(7):
        alpha = silhouette(form, stage.shape, pose, np.random.default_rng(seed))
        body = alpha > 0.02
        if not body.any():
            return None
        short = gap - float(away[body].min())
        if short <= 0:
            return alpha, pose.angle
        pose = pose.moved(out * max(short, stage.pitch * 0.7))
    return None


def _outward(ring: Float64s, index: int) -> float:
    """The way outward at a point of a resampled ring that turns from x to y, radians."""
    along = ring[(index + 2) % len(ring)] - ring[index - 2]
    normal = np.array([along[1], -along[0]])
    return float(np.arctan2(normal[1], normal[0]))


def _corner_index(ring: Float64s, rng: Rng, *, hollow: bool) -> int:
    """The index of a corner of a resampled ring, of one that points inward if it is to be hollow."""
    before, after = ring - np.roll(ring, 3, axis=0), np.roll(ring, -3, axis=0) - ring
    bend = np.arctan2(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1))
    sharp = np.flatnonzero(-bend > 0.5 if hollow else bend > 0.5)
    return int(rng.choice(sharp)) if len(sharp) else int(rng.integers(len(ring)))


def _pose(stage: Stage, place: str, size: float, rng: Rng) -> Pose:
    """Where a thing of a size, pixels, lies at a place: edge, corner, hollow, hole or inside."""
    far = float(np.hypot(*stage.shape)) * 1.2
    if place == "inside":
        room = np.asarray(cv2.distanceTransform((stage.solid > 0.5).astype(np.uint8), cv2.DIST_L2, 3), np.float32)
        spots = np.argwhere(room > min(size, 0.6 * room.max()))
        y, x = spots[int(rng.integers(len(spots)))]
        return Pose(np.array([x, y], float), rng.uniform(0, 6.3), min(size, 0.8 * float(room[y, x])), far)
    ring = stage.rings[0]
    in_hole = place == "hole" or (place == "hollow" and rng.random() < 0.6)
    if in_hole and len(stage.rings) > 1:
        ring = stage.rings[int(rng.integers(1, len(stage.rings)))]
    ring = resample(ring, 4)
    index = int(rng.integers(len(ring)))
    if place in ("corner", "hollow") and not in_hole:
        index = _corner_index(ring, rng, hollow=place == "hollow")
    angle = _outward(ring, index)
    out = np.array([np.cos(angle), np.sin(angle)])
    return Pose(ring[index] + out * size * rng.uniform(-1.3, 0.25), angle + rng.normal(0, 0.45), size, far)


def _size(stage: Stage, wish: Thing, rng: Rng) -> float:
    """A thing's size, pixels: from half a cell to about half the block."""
    if wish.size:
        return float(stage.pitch * rng.uniform(*wish.size))
    half = 0.36 * float(np.sqrt(stage.solid.sum()))
    if rng.random() < 0.4:
        return float(rng.uniform(0.3, 1) * max(half, 40))
    return float(np.exp(rng.uniform(np.log(max(1.3 * stage.pitch, 20)), np.log(max(half, 40)))))


def _level(stage: Stage, light: str | None, rng: Rng) -> float:
    """The light of a thing's material that a kind asks for."""
    levels = {
        "black": rng.uniform(0.015, 0.09),
        "white": rng.uniform(0.85, 1.1),
        "table": stage.table_level,
        "walls": stage.look.top,
    }
    return float(levels.get(light or "", random_level(rng)))


def _heights(alpha: Float32s, relief: str, rng: Rng) -> Float32s:
    """How high a thing's surface lies, (H, W) float32, pixels."""
    depth = np.asarray(cv2.distanceTransform((alpha > 0.5).astype(np.uint8), cv2.DIST_L2, 3), np.float32)
    widest = float(depth.max()) + 1
    if relief == "round":
        height: Field = np.sqrt(np.maximum(0, 1 - (1 - np.minimum(1, depth / widest)) ** 2)) * widest
    else:
        reach = min(widest, rng.uniform(1.5, 3) if relief == "thin" else rng.uniform(2, 14))
        height = reach * smoothstep(depth, 0, reach) * (0.3 if relief == "thin" else 0.8)
    return np.asarray(soften(height.astype(np.float32), 0.8), np.float32)


def _shading(alpha: Float32s, relief: str, sun: Float64s, rng: Rng) -> tuple[Float32s, Float32s]:
    """By what a thing's light is multiplied, and its highlights, (H, W) float32 both."""
    if relief == "flat":
        return np.ones_like(alpha), np.zeros_like(alpha)
    height = _heights(alpha, relief, rng)
    ways = ((1, 0), (0, 1))
    slope_x, slope_y = (np.asarray(cv2.Sobel(height, cv2.CV_32F, *way, ksize=3), np.float32) / 8 for way in ways)
    toward_light = slope_x * sun[0] + slope_y * sun[1]
    steep = np.sqrt(1 + slope_x**2 + slope_y**2)
    lit = np.clip(1 + rng.uniform(0.4, 1.1) * toward_light / steep, 0.12, 1.7)
    shine = np.exp(-((toward_light - 0.5) ** 2 + (slope_x * sun[1] - slope_y * sun[0]) ** 2) / rng.uniform(0.01, 0.08))
    shine = shine * rng.choice([0, 0, rng.uniform(0.1, 0.6)]) * (alpha > 0.5)
    return lit.astype(np.float32), shine.astype(np.float32)


def _opacity(shape: Shape, rng: Rng) -> Float32s:
    """How much clear film covers, (H, W) float32 from 0 to 1: little, but for streaks of glare."""
    streaks = smoothstep(noise(shape, (rng.uniform(60, 300), rng.uniform(4, 30)), rng), 0.5, 2)
    cover = np.clip(rng.uniform(0.08, 0.4) + rng.uniform(0.2, 0.7) * streaks, 0, 0.95)
    return np.asarray(cover, np.float32)


def _lay(stage: Stage, alpha: Float32s, wish: Thing, angle: float, level: float, material: str, rng: Rng) -> None:
    """Lay one thing, alpha of each pixel, (H, W), into the picture, in place: its shadow and its body."""
    relief = any_of(rng, wish.reliefs)
    clear = rng.random() < wish.clear
    span = float(np.sqrt(alpha.sum()))
    tall = {"flat": 0.0, "thin": rng.uniform(1, 4)}.get(relief, rng.uniform(0.05, 0.3) * min(span, 200))
    if tall > 0:
        shade = fallen(alpha, stage, tall) * (1 - alpha) * (0.3 if clear else 1)
        stage.picture *= (1 - max(0.25, stage.darkness) * shade)[..., None]
    body: Field = swatch(material, stage.shape, angle + rng.choice([0, 0, np.pi / 2]), level, rng)
    gain, shine = _shading(alpha, relief, stage.sun, rng)
    body = body * gain[..., None] + shine[..., None]
    if clear:
        under: Field = stage.picture * rng.uniform(0.75, 1.05)
        if rng.random() < 0.6:
            under = soften(under, rng.uniform(0.5, 2.5))
        blend(under, body, _opacity(stage.shape, rng))
        edge = np.clip(alpha - soften(alpha, 1.5), 0, 1) * rng.choice([-0.5, 0.8])
        body = under * (1 + edge)[..., None]
    blend(stage.picture, np.clip(body, 0, 1.4), alpha)
