"""An open cell through which a taught table shows in the block's shade is no thing, and a thing as small is one."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from contour.edge.open_cells import without_open_cells
from contour.edge.table_look import TableLook
from contour.relief.relief import Displacement, Relief

SIZE, STEP, PITCH = 60, 2, 12.0
NONE = Displacement(0.0, np.zeros(2))


def look(half: int) -> TableLook:
    """Table to the left, comb to the right, and between them what is foreign, so many samples to each side."""
    table = np.zeros((SIZE, SIZE), np.bool_)
    table[:, :25] = True
    foreign = np.zeros_like(table)
    foreign[30 - half : 31 + half, 26 : 27 + 2 * half] = True
    none, away = np.zeros_like(table), np.zeros((SIZE, SIZE), np.float32)
    return TableLook(table, foreign, foreign, STEP, PITCH, none, none, away, np.zeros((SIZE, SIZE), np.uint8))


def relief(border: int, middle: int) -> Relief:
    """How a thing's border with the table and its middle differ from it, among noise of 20."""
    apart: NDArray[np.uint8] = np.full((STEP * SIZE, STEP * SIZE), 20, np.uint8)
    apart[:, 24 * STEP : 26 * STEP] = border
    apart[:, 26 * STEP :] = middle
    return Relief(apart, (), apart, NONE, 3.0)


@pytest.mark.parametrize(
    ("half", "border", "middle", "told"),
    [(2, 22, 25, False), (2, 80, 25, True), (2, 22, 80, True), (8, 22, 25, True)],
)
def test_what_is_foreign_is_a_thing_by_its_size_its_border_or_its_light(
    half: int, border: int, middle: int, told: bool
) -> None:
    seen = without_open_cells(look(half), relief(border, middle))
    assert seen.foreign.any() == told
    assert seen.things.any() == told
