"""The picture while it is made, and the pieces of things that are laid into it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from benchmarks.other_hand.fields import Field, Rng
from benchmarks.third_hand.textures import F32
from contour.geometry.arrays import Float32s, Float64s


class Spot(NamedTuple):
    """Where a thing lies: a point of the edge, pixels, the angle outward, radians, and how far inward it reaches,
    pixels.
    """

    x: float
    y: float
    angle: float
    reach: float


class Patch(NamedTuple):
    """A piece of a thing: signed distance, (H, W) pixels, negative within; relief, (H, W) pixels; colour, (3,) or (H,
    W, 3), BGR to 255; how it shines and covers, from 0 to 1; whether it follows the ground, and how high it lies over
    it, pixels.
    """

    sd: Float32s
    relief: Field
    colour: Field
    gloss: float = 0.1
    opacity: float = 1.0
    drape: bool = False
    lift: float = 0.0


@dataclass(eq=False)
class Stage:
    """The picture while it is made, at `ss` times the size: (H, W) float32 and, `albedo`, (H, W, 3), BGR to 255.

    x, y: places in pixels of the picture, as are rings, heights (`relief`, `ground`) and `depth`, the block's. unit:
    what things are measured in, pixels. The rest is from 0 to 1.
    """

    rng: Rng
    width: int
    height: int
    ss: float
    x: Float32s
    y: Float32s
    unit: float
    depth: float
    albedo: Float32s
    rings: list[Float64s] = field(default_factory=list)
    table_tone: float = 100.0
    wall_tone: float = 200.0

    def __post_init__(self) -> None:
        shape = self.x.shape
        self.comb, self.wall, self.ground = (np.zeros(shape, F32) for _ in range(3))
        self.relief, self.gloss, self.hidden = (np.zeros(shape, F32) for _ in range(3))

    def frame(self, spot: Spot, turn: float = 0.0) -> tuple[Float32s, Float32s]:
        """How far pixels lie from the spot along its angle, turned by radians, and across it, pixels, (H, W)."""
        c, s = F32(np.cos(spot.angle + turn)), F32(np.sin(spot.angle + turn))
        dx, dy = self.x - F32(spot.x), self.y - F32(spot.y)
        return dx * c + dy * s, dy * c - dx * s

    def tone(self) -> Float32s:
        """A thing's colour, (3,) float32: black, the table's, the walls', white, grey or coloured."""
        r = self.rng
        level = r.choice([r.uniform(12, 40), self.table_tone, self.wall_tone, r.uniform(215, 250), r.uniform(50, 190)])
        tint = r.uniform(0.25, 1.15, 3) if r.random() < 0.4 else r.uniform(0.94, 1.05, 3)
        return np.asarray(np.clip(level * tint, 5, 252), F32)
