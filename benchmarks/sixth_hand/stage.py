"""The picture while it is made: the table, the block that is raised on it, and how shadows fall."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.other_hand.fields import Field, Rng, Shape
from benchmarks.sixth_hand.core import Lattice, Look, lattice, paint_comb, random_look
from benchmarks.sixth_hand.drawings import coverage
from benchmarks.sixth_hand.fields import any_of, fractal, noise, shift, smoothstep, soften, sweep, toward
from benchmarks.sixth_hand.marks import blot, outline_spots, random_level, rule_lines, stain
from benchmarks.sixth_hand.materials import swatch
from benchmarks.sixth_hand.outlines import block_rings
from contour.geometry.arrays import Bools, Float32s, Float64s

_TABLES = (
    *("plain", "gradient", "brushed", "wood", "speckled", "foam", "plain", "brushed", "channels", "grid", "woven"),
    *("perforated", "text", "corrugated"),
)


@dataclass(eq=False)
class Stage:
    """The picture, (H, W, 3) BGR to about 1, and what stands in it; pixels where not said otherwise.

    `rings` are of the block's top, `solid` how much of each pixel is block, (H, W) from 0 to 1, and `hidden` where
    things lie over it, (H, W).
    """

    picture: Float32s
    rings: list[Float64s]
    pitch: float
    solid: Float32s
    sun: Float64s  # the way in which shadows fall, a unit vector
    reach: float  # of the block's shadow
    softness: float  # of shadows
    darkness: float  # the share of light that a shadow takes
    hidden: Bools
    cells: Lattice
    look: Look
    table_level: float
    table_material: str

    @property
    def shape(self) -> Shape:
        """The picture's height and width."""
        return self.solid.shape[0], self.solid.shape[1]


@dataclass(frozen=True)
class Wish:
    """What a kind asks of the stage; what is None is left to chance."""

    feature: str | None = None  # of the outline: slots, notches, teeth or holes
    table: str | None = None
    hole_light: str | None = None  # black or lit
    hard: bool = False  # shadows are
    pitch: tuple[float, float] = (9, 45)
    crushed: bool = False
    filled: bool = False
    ink: bool = False
    stains: bool = False
    lines: bool = False


def set_stage(wish: Wish, rng: Rng) -> Stage:
    """A stage with a table, and with a block that is not yet raised on it."""
    width = int(rng.integers(700, 1501))
    shape = (int(width * rng.uniform(0.6, 0.85)), width)
    pitch = float(np.exp(rng.uniform(np.log(wish.pitch[0]), np.log(wish.pitch[1]))))
    rings = _perspective(block_rings(shape, pitch, wish.feature, rng), shape, rng)
    solid = coverage(shape, rings, 5)
    heading = rng.uniform(0, 6.3)
    sun = np.array([np.cos(heading), np.sin(heading)])
    level, look = random_level(rng), random_look(rng)
    material = wish.table or any_of(rng, _TABLES)
    picture = swatch(material, shape, rng.uniform(0, 3.14), level, rng, 0.35)
    picture *= (1 + rng.uniform(0, 0.06) * fractal(shape, 200, rng))[..., None]
    if wish.stains:
        stain(picture, outline_spots(rings, int(rng.integers(2, 9)), rng), 6 * pitch, rng)
    if wish.lines:
        rule_lines(picture, outline_spots(rings, int(rng.integers(3, 16)), rng), pitch, rng)
    crushed = None
    if wish.crushed:
        spots = outline_spots(rings, int(rng.integers(1, 5)), rng)
        crushed = np.max([blot(shape, spot, rng.uniform(2, 7) * pitch, rng) for spot in spots], axis=0)
    cells = lattice(shape, np.array([rings[0].min(axis=0), rings[0].max(axis=0)]), pitch, rng, crushed)
    hard = wish.hard or rng.random() < 0.4
    reach = pitch * rng.uniform(0.5, 4)
    softness = rng.uniform(0.3, 1.2) if hard else reach * rng.uniform(0.2, 0.6)
    darkness = rng.uniform(0.6, 0.95) if hard else rng.uniform(0.15, 0.7)
    hidden = np.zeros(shape, bool)
    return Stage(picture, rings, pitch, solid, sun, reach, softness, darkness, hidden, cells, look, level, material)


def _perspective(rings: list[Float64s], shape: Shape, rng: Rng) -> list[Float64s]:
    """The rings seen slightly aslant."""
    lean = rng.normal(0, 0.02, 2) / max(shape)
    middle = np.array([shape[1], shape[0]]) / 2
    return [middle + (ring - middle) / (1 + (ring - middle) @ lean)[:, None] for ring in rings]


def raise_block(stage: Stage, wish: Wish, rng: Rng) -> None:
    """Set the block on the stage's table, in place: its shadow, its flanks and its face."""
    shape, picture, solid = stage.shape, stage.picture, stage.solid
    size = np.array([shape[1], shape[0]])
    foot = size * (0.5 + rng.normal(0, 0.25, 2))
    deep = 1 - rng.choice([0.004, rng.uniform(0.005, 0.06)])
    through = picture.copy()
    bottom = toward(solid, foot, deep)
    cast = soften(sweep(bottom, stage.sun * stage.reach), stage.softness)
    holes = coverage(shape, stage.rings[1:]) if len(stage.rings) > 1 else np.zeros(shape, np.float32)
    if wish.hole_light == "lit" and not wish.hard:
        cast = cast * (1 - holes * rng.uniform(0.7, 1))
    picture *= (1 - stage.darkness * cast)[..., None]
    glooms = {"black": rng.uniform(0.9, 1), "lit": -rng.uniform(0, 0.3)}
    gloom = glooms.get(wish.hole_light or "", float(rng.choice([0, 0.3, 0.9])))
    picture *= (1 - gloom * holes)[..., None]
    _flank(stage, foot, deep, rng)
    face = paint_comb(stage.cells, stage.look, stage.pitch, foot, deep, stage.sun, through, rng)
    centres = stage.cells.centres
    if wish.filled:
        _fill_cells(face, stage.cells, rng)
    if wish.ink:
        lines = centres[rng.integers(len(centres), size=int(rng.integers(2, 9)))]
        rule_lines(face, lines, stage.pitch, rng)
        stain(face, centres[rng.integers(len(centres), size=2)], 4 * stage.pitch, rng)
    away = np.asarray(cv2.distanceTransform((solid > 0.5).astype(np.uint8), cv2.DIST_L2, 3), np.float32)
    rim = smoothstep(away, 0, stage.pitch * 0.9)
    open_rim = (1 - rim) * (1 - stage.cells.tops) * rng.uniform(0, 0.6)
    picture += (face - picture) * (solid * (1 - open_rim))[..., None]


def _flank(stage: Stage, foot: Float64s, deep: float, rng: Rng) -> None:
    """Paint the flanks that show around the block, in place; `foot` and `deep` as for `paint_comb`."""
    solid, look = stage.solid, stage.look
    swept = solid
    for step in range(1, 7):
        swept = np.maximum(swept, toward(solid, foot, deep ** (step / 6)))
    ribs = 0.6 + 0.4 * noise(stage.shape, max(2.0, stage.pitch / 3), rng)
    tone = (look.side * rng.uniform(0.3, 1.3) * np.clip(ribs, 0.1, 1.6))[..., None] * look.tint
    stage.picture += (tone - stage.picture) * np.clip(swept - solid, 0, 1)[..., None]


def _fill_cells(face: Field, cells: Lattice, rng: Rng) -> None:
    """Fill some cells of the block's face, (H, W, 3), and a patch of them with resin or foam, in place."""
    centres = cells.centres
    heart = centres[int(rng.integers(len(centres)))]
    near = np.hypot(*(centres - heart).T) < rng.uniform(2, 7) * np.sqrt(np.ptp(centres) * 4)
    chosen = (rng.random(len(centres)) < rng.uniform(0.02, 0.15)) | (near & (rng.random(len(centres)) < 0.85))
    full = np.concatenate([[False], chosen])[cells.owner].astype(np.float32)
    tone = random_level(rng) * (1 + 0.12 * noise((full.shape[0], full.shape[1]), 3, rng))
    face += (tone[..., None] - face) * soften(full, 0.7)[..., None] * rng.uniform(0.7, 1)


def fallen(alpha: Float32s, stage: Stage, height: float) -> Field:
    """The shadow of a thing so many pixels over the block, (H, W) from 0 to 1: near it on the block, farther off on the
    table. alpha: how much of each pixel is the thing, (H, W).
    """
    near = sweep(alpha, stage.sun * height)
    far = shift(near, stage.sun * stage.reach)
    top = soften(stage.solid, 0.8)
    return soften(near * top + np.maximum(far, near * 0.3) * (1 - top), max(0.6, stage.softness * 0.6))
