"""A block on a table that was taught and is about as light as its walls: seen by what differs from that table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from contour.errors import NoBlockFound
from contour.geometry.arrays import Bools, Bytes, Float32s, median, quantile
from contour.image.opencv import grey
from contour.image.taught_table import TableLook
from contour.relief.relief import Displacement, Relief, relief_of
from contour.walls.cell_scale import probe
from contour.walls.end_profile import true_width
from contour.walls.lightness import wall_light
from contour.walls.see_block import SeenWalls, see_walls

# Of the table's light, and grey levels: what differs by that is not the table. The block is where much of a cell does.
_APART_SHARE, _APART_LEVELS, _MUCH = 0.15, 6.0, 0.4
_SAMPLES = 1e5
# A table as light as this share of the brightest tenth of a block is darker than halfway from its cells to its walls.
_FAR_DARKER, _BRIGHT = 0.35, 0.9
# A lens's usual blur and that of the mask.
_BLUR_PX = 1.2
# Window of the shade by which cells are looked for where the picture shows none: that of cells of a few to 60 px.
_ANY_PITCH_PX = 20.0


@dataclass(frozen=True, eq=False)
class OverTable:
    """A block on a known table. `alike`: whether walls stand out of the table less than out of their cells."""

    alike: bool
    relief: Callable[[], Relief]
    """How the picture stands out of the table."""


def over_known_table(picture: Bytes, look: TableLook, polarity: str, displacement: Displacement) -> OverTable | None:
    """What a picture, grey (H, W) or BGR (H, W, 3), uint8, shows of a block on the table; None where that is far darker
    than the block. Raises NoBlockFound.
    """
    hop = max(1, round(np.sqrt(picture.shape[0] * picture.shape[1] / _SAMPLES)))
    light, taught = (grey(np.ascontiguousarray(one[::hop, ::hop])).astype(np.float32) for one in (picture, look.known))
    sampled = _Sampled(light, taught * np.float32(look.gain), hop)
    if sampled.far_darker:
        return None
    table = np.asarray(cv2.convertScaleAbs(look.known, alpha=look.gain), np.uint8)
    try:
        walls = see_walls(look.picture, wall_light(look.picture), polarity)
        cells, alike = walls.cells, sampled.alike(walls)
    except NoBlockFound:
        # Walls as light as the table hang together with it. What differs from it has cells, or there are none.
        cells = probe(relief_of(picture, table, _ANY_PITCH_PX, displacement, 1.0).apart, "bright")
        alike = True
    return OverTable(
        alike,
        lambda: relief_of(picture, table, cells.pitch_px, displacement, true_width(cells.wall_px, _BLUR_PX)),
    )


@dataclass(frozen=True, eq=False)
class _Sampled:
    """Light of a picture and of the table as it would be now, every `hop`-th pixel both ways, (h, w)."""

    light: Float32s
    table: Float32s
    hop: int

    @cached_property
    def apart(self) -> Bools:
        """What is not the table."""
        return np.asarray(np.abs(self.light - self.table) > _APART_SHARE * self.table + _APART_LEVELS)

    @property
    def far_darker(self) -> bool:
        """Whether the table is so dark, beneath what is not the table, that light walls stand out of it anyhow."""
        if not self.apart.any():
            return True
        return median(self.table[self.apart]) < _FAR_DARKER * quantile(self.light[self.apart], _BRIGHT)

    def alike(self, walls: SeenWalls) -> bool:
        """Whether a block's walls stand out of the table beneath them less than out of their cells."""
        wall = cv2.resize(walls.mask.mask, self.light.shape[::-1], interpolation=cv2.INTER_NEAREST) > 0
        window = max(3, round(walls.cells.pitch_px / self.hop))
        block = cv2.blur(self.apart.astype(np.float32), (window, window)) > _MUCH
        if not (block & wall).any() or not (block & ~wall).any():
            return False
        cell, below = median(self.light[block & ~wall]), median(self.table[block & wall])
        return below > cell if walls.cells.bright else below < cell
