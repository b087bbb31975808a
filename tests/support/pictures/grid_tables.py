"""A table with a printed grid, and a block on it."""

from __future__ import annotations

from functools import cache

import numpy as np

from contour.synthetic import area_coverage
from tests.support.pictures.small_scenes import block


def grid_table(seed: int = 0, light: float = 1.0, shift: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """A mat with a bright printed grid of 27 px all over and some dirt, at a turn, under noise."""
    table = _grid(shift)
    noise = np.random.default_rng(seed).normal(0, 1.5, table.shape)
    return np.clip(np.rint(light * table + noise), 0, 255).astype(np.uint8)


@cache
def _grid(shift: tuple[float, float]) -> np.ndarray:
    rng = np.random.default_rng(11)
    y, x = np.mgrid[:480, :640].astype(np.float32)
    x, y = x - shift[0], y - shift[1]
    u, v = x * 0.96 - y * 0.28, x * 0.28 + y * 0.96
    near = np.minimum(np.abs(u - np.rint(u / 27) * 27), np.abs(v - np.rint(v / 27) * 27))
    table = 55 + 90 * np.clip(2.0 - near, 0, 1)
    for at, size, level in zip(
        rng.uniform(0, 640, (40, 2)), rng.uniform(3, 9, 40), rng.uniform(-25, 25, 40), strict=True
    ):
        table += level * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / (2 * size**2))
    return table


def with_block(table: np.ndarray) -> np.ndarray:
    """The table with the rendered block on it."""
    rendered = block("rectangle")
    cover = area_coverage(rendered.truth_px.rings, 640, 480)
    return np.rint(table * (1 - cover) + rendered.picture * cover).astype(np.uint8)
