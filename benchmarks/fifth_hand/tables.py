"""The table under the block, and marks on it, painted on a canvas, (H, W, 3), of a light from 0 to 1."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from benchmarks.fifth_hand.noise import fractal_noise, smooth_noise, turned_axes
from benchmarks.fifth_hand.outlines import ellipse, stadium, turned
from benchmarks.fifth_hand.parts import Look, Part, Sun, draw_part
from benchmarks.fifth_hand.raster import blurred, darken, paint, polygon_cover, random_tint, stroke_cover
from benchmarks.fifth_hand.textures import texture
from benchmarks.other_hand.fields import Rng, Shape
from contour.geometry.arrays import Float32s, Float64s

_GREY = np.ones(3)
_SURFACES = ("plain", "grainy", "mottled", "brushed", "wood", "woven", "speckled", "striped")


def base_table(rng: Rng, shape: Shape, light: float) -> Float32s:
    """A bare table, (H, W, 3) float32."""
    name = str(rng.choice(_SURFACES, p=[0.26, 0.2, 0.1, 0.14, 0.1, 0.08, 0.08, 0.04]))
    grain = texture(name, rng, shape, rng.choice([0, np.pi / 2]) + rng.normal(0, 0.05)) * rng.uniform(0.02, 0.12)
    grain += fractal_noise(rng, shape, rng.uniform(60, 200), 3) * rng.uniform(0.0, 0.06)
    canvas = np.empty((*shape, 3), np.float32)
    tint = random_tint(rng, 0.28).astype(np.float32)
    canvas[:] = np.clip(light * (1 + grain) + 0.04 * grain, 0.0, 1.2)[..., None] * tint
    return canvas


def _line_light(rng: Rng, light: float) -> float:
    """The light of a mark, some way from the table's."""
    step = rng.uniform(0.1, 0.5)
    return float(np.clip(light + (step if light < 0.45 else -step), 0, 1))


def _grid(rng: Rng, canvas: Float32s, light: float) -> None:
    """Cutting-mat lines, every fifth one stronger."""
    shape = (canvas.shape[0], canvas.shape[1])
    along, across = turned_axes(shape, rng.normal(0, 0.2))
    step, alpha = rng.uniform(14, 60), np.zeros(shape, np.float32)
    for axis in (along, across):
        for factor, width, strength in ((1, rng.uniform(0.7, 1.2), 0.45), (5, rng.uniform(1.0, 2.2), 0.9)):
            distance = np.abs((axis / (step * factor) + 0.5) % 1.0 - 0.5) * step * factor
            np.maximum(alpha, np.clip(width / 2 + 0.5 - distance, 0, 1) * strength, out=alpha)
    paint(canvas, alpha, _line_light(rng, light), random_tint(rng))


def _perforation(rng: Rng, canvas: Float32s, light: float) -> None:
    """Rows of round holes."""
    height, width = canvas.shape[:2]
    step = rng.uniform(18, 80)
    across, stagger = step * rng.uniform(0.2, 0.6), rng.choice([0.0, 0.5])
    rows, columns = np.mgrid[-3 : int(height / step) + 4, -3 : int(width / step) + 4]
    centres = np.stack([(columns + stagger * (rows % 2)) * step, rows * step], -1).reshape(-1, 2)
    centres = turned(centres, rng.normal(0, 0.05))
    ring = ellipse(across, across, 28)
    alpha = polygon_cover((height, width), [ring + centre for centre in centres])
    paint(canvas, alpha, light * rng.uniform(0.0, 0.5), _GREY)
    rim = np.clip(alpha - np.roll(alpha, (1, 1), (0, 1)), 0, 1)
    paint(canvas, rim * rng.uniform(0, 0.6), min(1.0, light * 1.6 + 0.1), _GREY)


def _tee_slots(rng: Rng, canvas: Float32s, light: float) -> None:
    """Dark parallel slots with bright edges."""
    _, across = turned_axes((canvas.shape[0], canvas.shape[1]), rng.choice([0, np.pi / 2]) + rng.normal(0, 0.04))
    step, wide = rng.uniform(90, 260), rng.uniform(12, 40)
    distance = np.abs(((across + rng.uniform(0, step)) / step) % 1.0 - 0.5) * step
    paint(canvas, np.clip(wide / 2 + 1.5 - distance, 0, 1), min(1.0, light * 1.4 + 0.05), _GREY)
    paint(canvas, np.clip(wide / 2 - distance, 0, 1), light * rng.uniform(0.05, 0.5), _GREY)


def _stains(rng: Rng, canvas: Float32s, light: float) -> None:
    """Oil: dark or shiny spots with ragged borders and a rim."""
    shape = (canvas.shape[0], canvas.shape[1])
    for _ in range(int(rng.integers(1, 4))):
        along, across = turned_axes(shape, rng.uniform(0, np.pi))
        middle = rng.uniform([along.min(), across.min()], [along.max(), across.max()])
        far = np.hypot(along - middle[0], (across - middle[1]) * rng.uniform(1, 2.5)) / rng.uniform(60, 260)
        field = 1 - far + fractal_noise(rng, shape, rng.uniform(30, 90), 4) * rng.uniform(0.08, 0.3)
        spot = np.clip(field * rng.uniform(3, 20), 0, 1).astype(np.float32)
        rim = np.clip(1 - np.abs(field) * rng.uniform(8, 25), 0, 1)
        darken(canvas, blurred(spot, 1.0), rng.uniform(0.2, 0.75))
        paint(canvas, rim * rng.uniform(0, 0.3), light * rng.uniform(0.3, 1.5), _GREY)


def _dust(rng: Rng, canvas: Float32s, light: float) -> None:
    """Fine specks and clouds of powder."""
    shape = (canvas.shape[0], canvas.shape[1])
    cloud = np.clip(fractal_noise(rng, shape, rng.uniform(50, 150), 4) * 0.4 + 0.2, 0, 1)
    paint(canvas, cloud * rng.uniform(0.1, 0.6), _line_light(rng, light), random_tint(rng, 0.2))
    specks = np.clip(smooth_noise(rng, shape, rng.uniform(1.2, 2.5)) - rng.uniform(1.3, 2.2), 0, 1) * 2
    paint(canvas, np.clip(specks, 0, 1), _line_light(rng, light), _GREY)


def _rubbed_line(rng: Rng, canvas: Float32s, path: Float64s, width: float, light: float) -> None:
    """A line of chalk or pencil that skips over the grain."""
    shape = (canvas.shape[0], canvas.shape[1])
    worn = np.clip(smooth_noise(rng, shape, 1.6) * 0.5 + rng.uniform(0.5, 1.1), 0, 1)
    paint(canvas, stroke_cover(shape, path, width) * worn, light, random_tint(rng, 0.3))


def lines_to_block(rng: Rng, canvas: Float32s, light: float, ring: Float64s, count: int) -> None:
    """So many lines of chalk that run up to the ring, (N, 2), and on under the block."""
    mark = rng.choice([_line_light(rng, light), rng.uniform(0.6, 1.0)])
    for _ in range(count):
        spot = ring[rng.integers(len(ring))]
        aim = turned(np.array([1.0, 0.0]), rng.uniform(0, 2 * np.pi)) * max(canvas.shape) * rng.uniform(0.2, 1)
        bend = np.linspace(-1, 1, 20)[:, None]
        curve = spot + aim * bend + aim[::-1] * (bend**2) * rng.normal(0, 0.1)
        _rubbed_line(rng, canvas, curve, rng.uniform(1.2, 8.0), mark)


def _old_cuts(rng: Rng, canvas: Float32s, light: float) -> None:
    """Many thin scores, straight and bent, light and dark."""
    shape = (canvas.shape[0], canvas.shape[1])
    for _ in range(int(rng.integers(6, 16))):
        start = rng.uniform(0, 1, 2) * shape[::-1]
        aim = turned(np.array([1.0, 0.0]), rng.uniform(0, 2 * np.pi)) * rng.uniform(100, 900)
        bend = np.linspace(0, 1, 20)[:, None]
        path = start + aim * bend + aim[::-1] * bend * (1 - bend) * rng.normal(0, 0.3)
        tone = float(np.clip(light + rng.choice([-0.25, 0.2]), 0, 1))
        paint(canvas, stroke_cover(shape, path, rng.uniform(0.6, 2.5)) * 0.8, tone, _GREY)


def swarf(rng: Rng, canvas: Float32s, light: float, ring: Float64s) -> None:
    """Crumbs and curls of what walls are made of, about the ring, (N, 2)."""
    sun = Sun(turned(np.array([1.0, 0.0]), rng.uniform(0, 6.3)), 0.8, 0.2, 0.5)
    covered = np.zeros(canvas.shape[:2], bool)
    tone = _line_light(rng, light)
    for _ in range(int(rng.integers(25, 70))):
        spot = ring[rng.integers(len(ring))] + rng.normal(0, rng.uniform(10, 90), 2)
        turn = np.linspace(0, rng.uniform(0.5, 5), 12) + rng.uniform(0, 6.3)
        curl = spot + np.stack([np.cos(turn), np.sin(turn)], 1) * rng.uniform(2, 10)
        look = Look(float(np.clip(tone + rng.normal(0, 0.15), 0, 1)), _GREY)
        draw_part(rng, canvas, Part((curl,), look, 1.5, "flat", rng.uniform(1.0, 3.0)), sun, covered)


def _near_slots(rng: Rng, canvas: Float32s, light: float) -> None:
    """Milled short slots and countersinks of a fixture plate."""
    shape = (canvas.shape[0], canvas.shape[1])
    holes = [
        turned(stadium(rng.uniform(20, 120), rng.uniform(8, 22)), rng.choice([0, np.pi / 2]))
        + rng.uniform(0, 1, 2) * shape[::-1]
        for _ in range(int(rng.integers(3, 12)))
    ]
    alpha = polygon_cover(shape, holes)
    paint(canvas, alpha, light * rng.uniform(0.05, 0.6), _GREY)


MARKINGS: dict[str, Callable[[Rng, Float32s, float], None]] = {
    "grid": _grid,
    "perforated": _perforation,
    "slots": _tee_slots,
    "oil": _stains,
    "dust": _dust,
    "cuts": _old_cuts,
    "plate": _near_slots,
}


def block_shadow(canvas: Float32s, block: Float32s, sun: Sun, height: float, *, lit_floor: bool) -> None:
    """Darken the table by the shadow of a block so many pixels high, beside it, in its holes and, unless `lit_floor`,
    under its cells, in place. block: how much of each pixel is block, (H, W).
    """
    move = sun.direction * height * sun.reach
    small = cv2.resize(block, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    steps = [
        cv2.warpAffine(small, np.array([[1, 0, x / 2], [0, 1, y / 2]]), small.shape[::-1])
        for x, y in np.linspace(0, 1, 14)[:, None] * move
    ]
    wide = cv2.resize(np.max(steps, 0), block.shape[::-1], interpolation=cv2.INTER_LINEAR)
    shadow = np.asarray(wide, np.float32)
    open_to_light = 1 - block if lit_floor else 1.0
    darken(canvas, blurred(shadow, 0.5 + sun.softness * height) * open_to_light, sun.strength)
    darken(canvas, blurred(block, 4.0 + 0.1 * height) * open_to_light, 0.3)
