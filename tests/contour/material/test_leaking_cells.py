"""A broken wall opens a border cell; a cut opens many, and a bay between whole cells is none."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.geometry.arrays import Bytes
from contour.material.leaking_cells import leaking_cells

PITCH, WALL = 40, 4


def grid(columns: int, rows: int) -> Bytes:
    """Square cells with a margin of two of them, 1 on walls."""
    picture = np.zeros(((rows + 4) * PITCH, (columns + 4) * PITCH), np.uint8)
    for row in range(2, rows + 2):
        for column in range(2, columns + 2):
            cell(picture, column, row)
    return picture


def cell(picture: Bytes, column: int, row: int) -> None:
    x, y = column * PITCH, row * PITCH
    cv2.rectangle(picture, (x, y), (x + PITCH, y + PITCH), 1, WALL)


def torn(picture: Bytes, column: int) -> Bytes:
    """With a gap of a third of a pitch in the topmost wall of a column."""
    x, y = (column + 2) * PITCH + PITCH // 2, 2 * PITCH
    torn = picture.copy()
    torn[y - WALL : y + WALL, x - PITCH // 6 : x + PITCH // 6] = 0
    return torn


@pytest.mark.parametrize("broken", [0, 1, 2])
def test_cells_that_broken_walls_open_are_cells(broken: int) -> None:
    picture = grid(6, 4)
    for column in range(broken):
        picture = torn(picture, 2 * column + 1)
    found = leaking_cells(picture, PITCH, WALL)
    for column in range(6):
        assert found[2 * PITCH + PITCH // 2, (column + 2) * PITCH + PITCH // 2] == (column in range(1, 2 * broken, 2))


def test_open_cells_side_by_side_were_cut_open() -> None:
    picture = grid(6, 4)
    for column in (2, 3, 4):
        picture = torn(picture, column)
    assert not leaking_cells(picture, PITCH, WALL).any()


def test_a_bay_between_whole_cells_is_no_cell() -> None:
    # Where no wall ends at the mouth, it is as narrow as where one is broken.
    x, y = 5 * PITCH + PITCH // 2, 2 * PITCH
    notch = [[-9, -4], [9, -4], [9, 8], [18, 14], [18, 36], [-18, 36], [-18, 14], [-9, 8]]
    bay = np.add(notch, [x, y])
    picture = grid(6, 4)
    cv2.rectangle(picture, (x - PITCH, y), (x + PITCH, y + PITCH), 1, -1)
    cv2.fillPoly(picture, [bay.astype(np.int32)], 0)
    assert not leaking_cells(picture, PITCH, WALL).any()
