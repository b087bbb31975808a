"""A picture in the making: light that is painted on, dimmed and covered."""

from __future__ import annotations

import numpy as np

from benchmarks.other_hand.fields import Field, Rng, Shape, blurred, noise, shifted, tint
from benchmarks.other_hand.outlines import direction
from contour.geometry.arrays import Bytes, Float32s

WHITE = tint(1.0, 1.0, 1.0)


class Canvas:
    """Light, (H, W, 1) grey or (H, W, 3) BGR, 1 about white; shares of tops of walls, (H, W); and what is hidden."""

    def __init__(self, rng: Rng, table: Field, colour: Float32s, *, coloured: bool) -> None:
        self.rng = rng
        self.shape: Shape = (table.shape[0], table.shape[1])
        self.lamp = rng.uniform(0.0, 2.0 * np.pi)
        self.picture: Float32s = np.asarray(table[..., None] * (colour if coloured else np.ones(1)), np.float32)
        self.tops: Float32s = np.zeros(self.shape, np.float32)
        self.hidden = np.zeros(self.shape, bool)

    @property
    def coloured(self) -> bool:
        """Whether it has colours."""
        return len(self.picture[0, 0]) == 3

    def blank(self) -> Bytes:
        """An empty drawing of the picture's size."""
        return np.zeros(self.shape, np.uint8)

    def noise(self, size: float) -> Float32s:
        """Smooth noise of the picture's size with such grains."""
        return noise(self.rng, self.shape, size)

    def mottled(self, *grains: tuple[float, float]) -> Float32s:
        """1 with noise of so many grains, each by its size and its strength."""
        return np.asarray(1.0 + sum(strength * self.noise(size) for size, strength in grains), np.float32)

    def paint(self, cover: Field, light: Field | float, colour: Float32s = WHITE) -> None:
        """Lay light, a number or (H, W), over what is there, where and as far as the cover, (H, W), is 1."""
        laid = np.atleast_2d(np.asarray(light, np.float32))[..., None]
        laid = laid * colour if self.coloured else laid
        self.picture += np.asarray(cover, np.float32)[..., None] * (laid - self.picture)

    def dim(self, factor: Field) -> None:
        """Multiply the light by a factor, (H, W)."""
        self.picture *= np.asarray(factor, np.float32)[..., None]

    def shade(self, cover: Field, height: float, dark: float) -> None:
        """Dim what lies beside a thing of that height in pixels, on the side away from the lamp."""
        fallen = blurred(shifted(cover, -height * direction(self.lamp)), max(1.5, 0.6 * height))
        self.dim(1.0 - dark * fallen * (1.0 - cover))

    def cover(self, cover: Field, light: Field | float, colour: Float32s, height: float, dark: float = 0.45) -> None:
        """Lay a thing over the block, with its shadow."""
        self.shade(cover, height, dark)
        self.paint(cover, np.clip(light, 0.01, 1.5), colour)
        self.hidden |= cover > 0.3
