"""The table's light is followed under a block, by a part of the picture's samples."""

from __future__ import annotations

import numpy as np
import pytest

from contour.material.table_surface import difference_from_table


@pytest.mark.parametrize("size", [(120, 160), (700, 900), (1500, 2000)])
@pytest.mark.parametrize("colour", [False, True])
def test_what_lies_on_a_vignetted_table_differs_and_the_table_does_not(size: tuple[int, int], colour: bool) -> None:
    high, wide = size
    y, x = np.mgrid[-1.0 : 1.0 : high * 1j, -1.0 : 1.0 : wide * 1j]
    table = 120.0 + 15.0 * x - 10.0 * y - 30.0 * (x * x + y * y) + np.random.default_rng(1).normal(0.0, 1.0, size)
    block = (np.abs(x) < 0.5) & (np.abs(y) < 0.5)
    picture = np.clip(np.rint(np.where(block, table + 60.0, table)), 0, 255).astype(np.uint8)
    if colour:
        picture = np.stack([picture // 2, picture, picture], axis=2)
    apart, spread = difference_from_table(picture)
    inner, outer = (np.abs(x) < 0.45) & (np.abs(y) < 0.45), (np.abs(x) > 0.55) | (np.abs(y) > 0.55)
    assert abs(float(np.median(apart[inner])) - 60.0) < 2.0
    assert float(np.quantile(apart[outer], 0.999)) < 4.0
    assert spread < 2.0
