"""Parts of things: a shape with a look, and how it is painted with its shadow; points are x and y, pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from benchmarks.fifth_hand.noise import smooth_noise, turned_axes, turned_noise
from benchmarks.fifth_hand.outlines import ellipse, rectangle, turned
from benchmarks.fifth_hand.raster import blurred, darken, paint, polygon_cover, random_tint, stroke_cover, swept
from benchmarks.fifth_hand.textures import TEXTURES, texture
from benchmarks.other_hand.fields import Field, Rng, Shape
from contour.geometry.arrays import Bools, Float32s, Float64s


@dataclass(frozen=True, eq=False)
class Sun:
    """The way shadows fall, a unit vector, how far for each pixel of height, and how soft and how dark they are."""

    direction: Float64s
    reach: float
    softness: float
    strength: float


@dataclass(frozen=True, eq=False)
class Look:
    """What a part is made of: its light from 0 to 1, its tint, (3,), its texture and how strong that is, how it shines
    and covers, and how strong streaks on it are that do.
    """

    light: float
    tint: Float64s
    texture: str = "plain"
    contrast: float = 0.1
    gloss: float = 0.0
    alpha: float = 1.0
    streaks: float = 0.0

    def relit(self, light: float) -> Look:
        """The same material, lighter or darker."""
        return replace(self, light=float(np.clip(light, 0.0, 1.0)))

    def smooth(self) -> Look:
        """The same material without texture."""
        return replace(self, texture="plain", contrast=0.05)


@dataclass(frozen=True, eq=False)
class Part:
    """Polygons, of which one inside another is a hole, or a path that is `width` wide; how high it lies, and its
    profile: flat, round, bevel or cloth.
    """

    shape: tuple[Float64s, ...]
    look: Look
    height: float = 2.0
    profile: str = "flat"
    width: float | None = None
    angle: float = 0.0

    def placed(self, angle: float, origin: Float64s) -> Part:
        """The part turned by radians and moved into the picture."""
        return replace(
            self, shape=tuple(turned(points, angle) + origin for points in self.shape), angle=self.angle + angle
        )

    def cover(self, shape: Shape, corner: Float64s) -> Float32s:
        """How much of each pixel of a window it is, (H, W) float32; corner: the window's first pixel."""
        moved = [points - corner for points in self.shape]
        if self.width is not None:
            return stroke_cover(shape, moved[0], self.width)
        return polygon_cover(shape, moved)


def random_look(rng: Rng, light: float | None = None) -> Look:
    """Any look from black to white, whatever it is for, or one of this light."""
    level = rng.uniform(0.0, 1.0) if light is None else light
    return Look(
        level,
        random_tint(rng),
        str(rng.choice(list(TEXTURES))),
        rng.uniform(0.02, 0.3),
        rng.choice([0.0, rng.uniform(0, 0.7)]),
    )


def film_look(rng: Rng) -> Look:
    """Clear film with glossy streaks."""
    return Look(
        rng.uniform(0.55, 1.0),
        random_tint(rng, 0.2),
        str(rng.choice(["plain", "creased", "grainy"])),
        0.15,
        0.0,
        rng.uniform(0.08, 0.4),
        rng.uniform(0.25, 0.9),
    )


def contrasting(rng: Rng, look: Look) -> Look:
    """A smooth look that is clearly lighter or darker than another."""
    step = rng.uniform(0.12, 0.5)
    return look.relit(look.light + (step if look.light < 0.5 else -step)).smooth()


def disc(across: float, look: Look, height: float, profile: str = "bevel", at: tuple[float, float] = (0, 0)) -> Part:
    """A round part about a place."""
    return Part((ellipse(across, across) + np.array(at),), look, height, profile)


def bar(length: float, width: float, look: Look, height: float, profile: str = "bevel") -> Part:
    """A straight part along x about the origin."""
    return Part((rectangle(length, width),), look, height, profile)


def moved(part: Part, x: float, y: float = 0.0) -> Part:
    """The part moved along its own axes."""
    return replace(part, shape=tuple(points + np.array([x, y]) for points in part.shape))


def draw_part(rng: Rng, canvas: Float32s, part: Part, sun: Sun, hidden: Bools) -> None:
    """Paint a part and its shadow on the canvas, (H, W, 3), and tell `hidden`, (H, W), where it is, in place."""
    area = _window(part, sun, (hidden.shape[0], hidden.shape[1]))
    if area is None:
        return
    view = canvas[area]
    shape = (view.shape[0], view.shape[1])
    cover = part.cover(shape, np.array([area[1].start, area[0].start]))
    if part.height > 0:
        shadow = swept(cover, sun.direction * part.height * sun.reach)
        dark = sun.strength * (0.35 if part.look.alpha < 0.99 else 1.0)
        darken(view, np.maximum(blurred(shadow, _shadow_blur(part, sun)), 0.6 * blurred(cover, 2.0)), dark)
    diffuse, shine = _shading(rng, cover, part, sun)
    if part.look.alpha < 0.99:
        paint(view, _film_alpha(rng, cover, part), part.look.light * (0.5 + 0.5 * diffuse), part.look.tint)
    else:
        grain = texture(part.look.texture, rng, shape, part.angle) * part.look.contrast
        base = (part.look.light * 0.9 + 0.03) * (1 + grain) + 0.03 * grain
        paint(view, cover, np.clip(base * diffuse + shine, 0.0, 1.25), part.look.tint)
    hidden[area] |= cover > 0.5


def _window(part: Part, sun: Sun, shape: Shape) -> tuple[slice, slice] | None:
    """The rows and columns that a part and its shadow touch, None if they are beyond a picture of this shape."""
    points = np.concatenate(part.shape)
    pad = (part.width or 0) / 2 + part.height * sun.reach + 3 * _shadow_blur(part, sun) + 6
    low = np.maximum(np.floor(points.min(0) - pad), 0).astype(int)
    high = np.minimum(np.ceil(points.max(0) + pad), [shape[1], shape[0]]).astype(int)
    return (slice(low[1], high[1]), slice(low[0], high[0])) if (high - low > 2).all() else None


def _shadow_blur(part: Part, sun: Sun) -> float:
    """How soft a part's shadow is, pixels."""
    return 0.6 + sun.softness * min(part.height, 40.0)


def _relief(rng: Rng, cover: Float32s, part: Part) -> Field:
    """How high the part's surface lies by its profile, (H, W), pixels."""
    shape = (cover.shape[0], cover.shape[1])
    distance = np.asarray(cv2.distanceTransform((cover > 0.5).astype(np.uint8), cv2.DIST_L2, 5), np.float32)
    peak = max(1.0, float(distance.max()))
    if part.profile == "round":
        radius = part.width / 2 if part.width else peak
        share = np.clip(distance / radius, 0, 1)
        return blurred(radius * np.sqrt(1 - (1 - share) ** 2), 0.8)
    if part.profile == "bevel":
        return blurred(np.minimum(distance, np.float32(rng.uniform(1.5, 4))) * np.float32(0.8), 0.7)
    if part.profile == "cloth":
        turn, grain = rng.uniform(0, np.pi), np.clip(peak * rng.uniform(0.12, 0.35), 8, 60)
        folds = turned_noise(rng, shape, turn, grain, rng.uniform(2, 5))
        ridges = turned_noise(rng, shape, turn + rng.normal(0, 0.6), grain, 4)
        deep = np.float32(grain * rng.uniform(0.15, 0.35))
        return (np.maximum(folds, ridges) * deep + np.minimum(distance, 2)).astype(np.float32)
    bend = smooth_noise(rng, shape, max(40.0, peak)) * peak * 0.03
    return (bend + 0.4 * np.minimum(distance, 1)).astype(np.float32)


def _shading(rng: Rng, cover: Float32s, part: Part, sun: Sun) -> tuple[Field, Field]:
    """By what the part's light is multiplied, and its highlights, (H, W) both."""
    height = _relief(rng, cover, part).astype(np.float32)
    right, down = (np.asarray(cv2.Sobel(height, cv2.CV_32F, *way, scale=1 / 8), np.float32) for way in ((1, 0), (0, 1)))
    tilted = np.tanh(right * np.float32(sun.direction[0]) + down * np.float32(sun.direction[1]))
    diffuse = np.clip(0.92 + 0.5 * tilted, 0.3, 1.5)
    shine = np.exp(-(((tilted - 0.35) / 0.16) ** 2)) * part.look.gloss if part.look.gloss else np.zeros_like(tilted)
    return diffuse, shine


def _film_alpha(rng: Rng, cover: Float32s, part: Part) -> Field:
    """How much clear film covers, (H, W) from 0 to 1: a haze, long glossy streaks, bubbles and a bright rim."""
    look, shape = part.look, (cover.shape[0], cover.shape[1])
    along, across = turned_axes(shape, part.angle + rng.normal(0, 0.15))
    across -= across.mean()
    alpha = np.full(shape, look.alpha, np.float32)
    span = max(6.0, float(np.sqrt((cover > 0.5).sum())) * 0.5)
    for _ in range(int(rng.integers(1, 5))):
        middle = rng.normal(0, 0.35) * span + 0.04 * span * smooth_noise(rng, shape, 40, 2)
        fade = 0.5 + 0.5 * np.sin(along / rng.uniform(0.3, 1.5) / span + rng.uniform(0, 6.3))
        alpha += look.streaks * fade * np.exp(-(((across - middle) / (span * rng.uniform(0.02, 0.15))) ** 2))
    alpha += look.streaks * 0.5 * (smooth_noise(rng, shape, rng.uniform(4, 12), 2) > 1.6)
    inner = np.asarray(cv2.erode(cover, np.ones((3, 3), np.uint8)), np.float32)
    alpha += rng.uniform(0.05, 0.5) * (cover - inner)
    alpha += texture(look.texture, rng, shape, part.angle) * look.contrast * look.alpha
    return np.asarray(np.clip(blurred(alpha, 0.6), 0, 1).astype(np.float32) * cover)


def parts_mask(parts: Sequence[Part], shape: Shape) -> Bools:
    """Roughly where parts are, at a quarter of the size of a picture of this shape."""
    mask = np.zeros((shape[0] // 4, shape[1] // 4), np.uint8)
    for part in parts:
        points = [np.clip(np.rint(points / 4), -20000, 20000).astype(np.int32) for points in part.shape]
        if part.width is not None:
            cv2.polylines(mask, points, False, 1, max(1, round(part.width / 4)))
        else:
            cv2.fillPoly(mask, points, 1)
    return mask > 0
