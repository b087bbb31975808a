"""The light of the table, and which flat parts of a picture are as light as the table around them."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from contour.geometry.arrays import Bools, Bytes, Float32s, Float64s, Indices, Int32s, median, quantiles
from contour.image.channels import planes

_LEVEL_PITCHES, _SHARE_KNOWN = 10.0, 0.02
# Apart from the table around by so many grey levels, and so many of its spreads.
_APART, _APART_SPREADS = 4.0, 1.0
# Of the table's light: below that nothing is a shadow.
_DEEPEST_SHADE = 0.2
_ROUNDS, _FEW_SAMPLES = 4, 5.0


@dataclass(frozen=True, eq=False)
class TableLight:
    """Which samples lie on flat parts that are the table, `parts` (h, w), how far the picture is `off` its light, that
    light, `level`, (channels, h, w), and its `spread` in each channel.
    """

    parts: Bools
    off: Float32s
    level: Float32s
    spread: Float64s

    @property
    def lighter(self) -> Bools:
        """Where the picture is lighter than the table in some channel."""
        return np.asarray(np.any(self.off > (_APART + _APART_SPREADS * self.spread)[:, None, None], axis=0))

    @property
    def shade(self) -> Bools:
        """Where it is darker in all channels, as a shadow makes a table."""
        return np.asarray(np.all(self.off < 0, axis=0)) & self._not_too_dark

    @property
    def alike(self) -> Bools:
        """Where it is as light as the table, or as a shadow makes it."""
        return ~self.lighter & self._not_too_dark

    @property
    def _not_too_dark(self) -> Bools:
        return np.asarray(np.all(self.off > (_DEEPEST_SHADE - 1.0) * self.level, axis=0))


def table_light(small: Bytes, parts: Int32s, area: Indices, samples: float) -> TableLight:
    """Told from numbered flat parts of a picture, (h, w) or (h, w, 3), whose cells are so many samples wide; `area`: of
    each part, outside the block.
    """
    main = int(np.argmax(area)) if area.any() else 0
    table_parts = np.zeros(len(area), np.bool_)
    table_parts[main] = main > 0
    flat = np.flatnonzero(parts)
    numbers = parts.ravel().take(flat).astype(np.intp)
    sizes = np.maximum(np.bincount(numbers, minlength=len(area)), 1)
    channels, light = (
        np.stack(planes(one)).astype(np.float32) for one in (small, np.asarray(cv2.blur(small, (3, 3)), np.uint8))
    )
    # Plates of a table lie side by side under one lamp: those told from the first tell what the next ones look like.
    for _ in range(_ROUNDS):
        level, spread = _table_level(channels, table_parts.take(parts), samples)
        off = light - level
        known, table_parts = table_parts, _table_parts(off, spread, (flat, numbers, sizes), main)
        if (known == table_parts).all() or area[table_parts & ~known].sum() < _FEW_SAMPLES * samples**2:
            break
    return TableLight(table_parts.take(parts), off, level, spread)


def _table_level(channels: Float32s, main: Bools, samples: float) -> tuple[Float32s, Float64s]:
    """The light of the table around each sample, (channels, h, w), and its spread in each channel."""
    size = 2 * round(0.5 * _LEVEL_PITCHES * samples) + 1
    share = cv2.blur(main.astype(np.float32), (size, size))
    unknown = ~(share > _SHARE_KNOWN)
    np.maximum(share, 1e-3, out=share)
    level = np.empty_like(channels)
    spread = np.zeros(len(channels))
    for k, plane in enumerate(channels):
        some = (slice(None, None, 3), slice(None, None, 3))
        here = plane[some][main[some]]
        lowest, highest = quantiles(here, (0.02, 0.98)).tolist() if len(here) else (0.0, 0.0)
        local = np.divide(cv2.blur(plane * main, (size, size)), share, out=level[k])
        if len(here):
            spread[k] = 1.4826 * median(np.abs(here - local[some][main[some]]))
        # Far from any of it, in a hole, the table may be as light as it is anywhere, and a little more so.
        local[unknown] = np.clip(plane[unknown], lowest - spread[k], highest + spread[k])
    return level, spread


def _table_parts(off: Float32s, spread: Float64s, parts: tuple[Indices, Indices, Indices], main: int) -> Bools:
    """Which flat parts are as light as the table around them; `off`: the picture less that light, `parts`: the samples
    that are flat, the number of each one's part, and how many there are of each.
    """
    flat, numbers, sizes = parts
    table = np.ones(len(sizes), np.bool_)
    for k, plane in enumerate(off):
        mean = np.bincount(numbers, weights=plane.ravel().take(flat), minlength=len(sizes)) / sizes
        table &= np.abs(mean) < _APART + _APART_SPREADS * spread[k]
    table[0] = False
    table[main] = main > 0
    return table
