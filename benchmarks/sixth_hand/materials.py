"""What tables and things are made of: tones, (H, W) from about 0 to 1, their grain along x, and colours."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from benchmarks.other_hand.fields import Field, Rng, Shape, axes
from benchmarks.sixth_hand.fields import any_of, fractal, noise, smoothstep
from contour.geometry.arrays import Float32s


def _plain(shape: Shape, rng: Rng) -> Field:
    """Nearly even."""
    return 0.5 + rng.uniform(0, 0.04) * fractal(shape, 60, rng) + rng.uniform(0, 0.04) * noise(shape, 1, rng)


def _gradient(shape: Shape, rng: Rng) -> Field:
    """From dark to light along a direction."""
    x, y = axes(shape)
    ramp = x / shape[1] * rng.uniform(-1, 1) + y / shape[0] * rng.uniform(-1, 1)
    return np.asarray(0.5 + ramp - ramp.mean() + 0.02 * noise(shape, 2, rng))


def _brushed(shape: Shape, rng: Rng) -> Field:
    """Fine scratches along x under broad sheen."""
    lines = noise(shape, (rng.uniform(40, 200), rng.uniform(1, 2.5)), rng)
    return 0.5 + rng.uniform(0.05, 0.15) * lines + rng.uniform(0, 0.1) * noise(shape, 150, rng)


def _woven(shape: Shape, rng: Rng) -> Field:
    """Plain weave of two threads."""
    x, y = axes(shape)
    thread = rng.uniform(3, 11)
    warp, weft = np.sin(np.pi * x / thread), np.sin(np.pi * y / thread)
    over = warp * weft > 0
    relief = np.where(over, np.abs(warp), np.abs(weft))
    return np.asarray(0.25 + 0.45 * relief + 0.1 * over + 0.06 * noise(shape, thread, rng))


def _stripes(shape: Shape, rng: Rng) -> Field:
    """Printed stripes, straight or slanting."""
    x, y = axes(shape)
    width, slope = rng.uniform(6, 50), rng.choice([0, 1, rng.uniform(-2, 2)])
    wave = np.sin(2 * np.pi * (x * slope + y) / width / np.hypot(1, slope))
    return np.asarray(0.5 + 0.4 * np.clip(wave * width / 4 + rng.uniform(-2, 2), -1, 1) + 0.03 * noise(shape, 2, rng))


def _text(shape: Shape, rng: Rng) -> Field:
    """Lines of print."""
    page = np.full(shape, 217, np.uint8)
    size = rng.uniform(0.4, 2.2)
    step = max(14, int(30 * size * rng.uniform(1, 2)))
    letters = np.array(list("ABCDEFGHKMNPRSTUXYZ0123456789abcdefghikmnoprstu  --/."))
    for row in range(step, shape[0] + step, step):
        line = "".join(rng.choice(letters, int(shape[1] / (16 * size)) + 2))
        cv2.putText(
            page,
            line,
            (int(rng.integers(-30, 10)), row),
            cv2.FONT_HERSHEY_SIMPLEX,
            size,
            25,
            max(1, int(size * rng.uniform(1, 3.5))),
            cv2.LINE_AA,
        )
    return page.astype(np.float32) / 255 + 0.02 * noise(shape, 2, rng)


def _glossy(shape: Shape, rng: Rng) -> Field:
    """Dark or even body with window-like highlights."""
    shine = smoothstep(noise(shape, (rng.uniform(60, 300), rng.uniform(10, 60)), rng), 0.8, rng.uniform(1.0, 2.0))
    return 0.35 + 0.7 * shine + 0.1 * noise(shape, 80, rng)


def _foam(shape: Shape, rng: Rng) -> Field:
    """Pores and grain."""
    pores = noise(shape, rng.uniform(1.5, 7), rng)
    return np.asarray(
        0.6 - 0.3 * smoothstep(pores, 0.4, 1.4) + 0.06 * noise(shape, 1.5, rng) + 0.05 * noise(shape, 90, rng)
    )


def _cloth(shape: Shape, rng: Rng) -> Field:
    """Folds, ridged and bent."""
    long, short = rng.uniform(80, 260), rng.uniform(18, 70)
    ridges = 1 - np.abs(noise(shape, (long, short), rng)) + 0.4 * noise(shape, short / 2, rng)
    return np.asarray(0.42 + 0.2 * ridges + 0.03 * noise(shape, 1.5, rng))


def _fur(shape: Shape, rng: Rng) -> Field:
    """Short hairs that lie about one way."""
    hairs = noise(shape, (rng.uniform(8, 25), rng.uniform(1.3, 2.2)), rng)
    return 0.5 + 0.17 * hairs + 0.14 * noise(shape, 40, rng)


def _perforated(shape: Shape, rng: Rng) -> Field:
    """Sheet with round or square holes."""
    x, y = axes(shape)
    step = rng.uniform(9, 45)
    row = np.floor(y / step)
    u = (x + (row % 2) * step / 2 * rng.integers(2)) % step - step / 2
    v = y % step - step / 2
    reach = np.hypot(u, v) if rng.random() < 0.7 else np.maximum(np.abs(u), np.abs(v))
    radius = step * rng.uniform(0.18, 0.4)
    return 0.75 * smoothstep(reach, radius - 0.8, radius + 0.8) + 0.04 * noise(shape, 30, rng)


def _mesh(shape: Shape, rng: Rng) -> Field:
    """Wires crossing over dark."""
    x, y = axes(shape)
    step = rng.uniform(7, 35)
    wire = np.maximum(np.cos(2 * np.pi * x / step), np.cos(2 * np.pi * y / step))
    return 0.05 + 0.85 * smoothstep(wire, rng.uniform(0.4, 0.75), 0.95) + 0.04 * noise(shape, 3, rng)


def _wood(shape: Shape, rng: Rng) -> Field:
    """Year rings stretched along x, with knots."""
    _, y = axes(shape)
    bend = noise(shape, (rng.uniform(150, 400), rng.uniform(40, 120)), rng)
    rings = np.sin(y / rng.uniform(3, 14) + bend * rng.uniform(2, 6))
    return np.asarray(0.5 + 0.16 * rings + 0.08 * noise(shape, (60, 1.5), rng) + 0.1 * bend)


def _corrugated(shape: Shape, rng: Rng) -> Field:
    """Round ribs across x."""
    x, _ = axes(shape)
    rib = np.abs(np.sin(np.pi * x / rng.uniform(6, 30)))
    return np.asarray(0.15 + 0.6 * rib ** rng.uniform(0.5, 2) + 0.04 * noise(shape, 2, rng))


def _nearest(shape: Shape, step: float, jitter: float, rng: Rng) -> Float32s:
    """How far it is to the nearest middle of a hexagonal lattice that jitters, in its steps, (H, W) float32."""
    seeds = np.full(shape, 255, np.uint8)
    rows, columns = int(shape[0] / step / 0.866) + 2, int(shape[1] / step) + 2
    j, i = np.mgrid[0:rows, 0:columns]
    x = (i + 0.5 * (j % 2) + rng.normal(0, jitter, i.shape)) * step
    y = (j * 0.866 + rng.normal(0, jitter, i.shape)) * step
    inside = (x >= 0) & (y >= 0) & (x < shape[1] - 1) & (y < shape[0] - 1)
    seeds[y[inside].astype(int), x[inside].astype(int)] = 0
    return np.asarray(cv2.distanceTransform(seeds, cv2.DIST_L2, 5), np.float32) / np.float32(step)


def _comblike(shape: Shape, rng: Rng) -> Field:
    """Another honeycomb-like texture: light ridges round dark cells."""
    reach = _nearest(shape, rng.uniform(9, 42), float(rng.choice([0, 0.04, 0.12])), rng)
    return 0.12 + 0.75 * smoothstep(reach, rng.uniform(0.36, 0.45), 0.54) + 0.03 * noise(shape, 2, rng)


def _bubble(shape: Shape, rng: Rng) -> Field:
    """Bubble wrap: domes with a lit and a dark side and a glint."""
    reach = _nearest(shape, rng.uniform(14, 50), 0.02, rng)
    dome = np.sqrt(np.maximum(0, 0.19 - reach * reach))
    slope = cv2.Sobel(dome, cv2.CV_32F, 1, 1, ksize=3) + cv2.Sobel(dome, cv2.CV_32F, 1, 0, ksize=3)
    return np.asarray(0.45 + 1.2 * np.clip(slope, -0.3, 0.5) + 0.3 * smoothstep(-np.abs(reach - 0.42), -0.05, 0))


def _crumpled(shape: Shape, rng: Rng) -> Field:
    """Crumpled foil: facets of very different light."""
    size = rng.uniform(12, 60)
    facet = np.abs(noise(shape, size, rng)) - np.abs(noise(shape, size * 1.7, rng))
    return 0.5 + 0.3 * facet + 0.2 * noise(shape, size / 3, rng)


def _grid(shape: Shape, rng: Rng) -> Field:
    """Ruled lines, fine and coarse."""
    x, y = axes(shape)
    step, line = rng.uniform(18, 70), rng.uniform(0.7, 2)
    fine = np.minimum(np.abs(x % step - step / 2), np.abs(y % step - step / 2))
    coarse = np.minimum(np.abs(x % (5 * step) - step / 2), np.abs(y % (5 * step) - step / 2))
    return np.asarray(0.35 + 0.25 * (fine < line) + 0.3 * (coarse < 1.4 * line) + 0.02 * noise(shape, 2, rng))


def _channels(shape: Shape, rng: Rng) -> Field:
    """T-slots: dark grooves with light lips, along x."""
    _, y = axes(shape)
    step, groove = rng.uniform(70, 240), rng.uniform(6, 26)
    off = np.abs(y % step - step / 2)
    dark, lip = smoothstep(-off, -groove - 1, -groove + 1), smoothstep(-np.abs(off - groove - 2), -3, 0)
    return np.asarray(0.6 - 0.5 * dark + 0.2 * lip + 0.07 * noise(shape, (90, 1.5), rng))


def _speckled(shape: Shape, rng: Rng) -> Field:
    """Dust, swarf and blots."""
    specks = smoothstep(noise(shape, rng.uniform(1.5, 5), rng), rng.uniform(1.3, 2), 2.6)
    return np.asarray(0.4 + rng.choice([-0.4, 0.5]) * specks + rng.uniform(0, 0.08) * fractal(shape, 120, rng))


MATERIALS: dict[str, Callable[[Shape, Rng], Field]] = {
    "plain": _plain,
    "gradient": _gradient,
    "brushed": _brushed,
    "woven": _woven,
    "stripes": _stripes,
    "text": _text,
    "glossy": _glossy,
    "foam": _foam,
    "cloth": _cloth,
    "fur": _fur,
    "perforated": _perforated,
    "mesh": _mesh,
    "wood": _wood,
    "corrugated": _corrugated,
    "comblike": _comblike,
    "bubble": _bubble,
    "crumpled": _crumpled,
    "grid": _grid,
    "channels": _channels,
    "speckled": _speckled,
}


def swatch(name: str, shape: Shape, angle: float, level: float, rng: Rng, vivid: float = 1) -> Float32s:
    """A material all over the picture, (H, W, 3) float32, its grain turned by radians, its mean about `level`; `vivid`:
    how strong its colours may be.
    """
    dark, light = _colours(rng, level, rng.uniform(0.08, 0.8), vivid * float(rng.choice([0, 0.15, 0.5, 1])))
    tone = _tones(name, shape, angle, rng)[..., None]
    return np.clip(dark + (light - dark) * tone, 0.005, 1.3)


def _colours(rng: Rng, level: float, contrast: float, colourful: float) -> tuple[Float32s, Float32s]:
    """The dark and the light colour, (3,) float32, of a material whose mean light is `level`."""
    tint = 1 + colourful * rng.uniform(-0.6, 0.6, 3)
    other = tint if rng.random() < 0.7 else 1 + colourful * rng.uniform(-0.6, 0.6, 3)
    low, high = level * (1 - contrast), min(1.15, level * (1 + contrast) + 0.12 * contrast)
    return (low * tint).astype(np.float32), (high * other).astype(np.float32)


def _tones(name: str, shape: Shape, angle: float, rng: Rng) -> Float32s:
    """Tones of a material, (H, W) float32, its grain turned by radians."""
    side = int(np.ceil(np.hypot(*shape))) + 2
    tone = np.broadcast_to(MATERIALS[name]((side, side), rng), (side, side)).astype(np.float32)
    matrix = np.asarray(cv2.getRotationMatrix2D((side / 2, side / 2), -np.degrees(angle), 1), np.float64)
    matrix[:, 2] += np.array((shape[1] / 2 - side / 2, shape[0] / 2 - side / 2))
    turned = cv2.warpAffine(tone, matrix, shape[::-1], flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(turned, np.float32)


def any_material(rng: Rng) -> str:
    """One of `MATERIALS`."""
    return any_of(rng, tuple(MATERIALS))
