"""Where walls on a known table reach an outline, and where it leads over the table."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.errors import NoBlockFound
from contour.relief.reach import Reach, reach
from contour.relief.relief import Displacement, Relief
from contour.tracing.evidence_check import check_reached

PITCH = 24
FIRST, LAST = 100, 460


def walls(table: int = 30, lost: slice = slice(0), beyond: int = 0) -> Relief:
    """Upright walls half a pitch apart in a square block, none of them in some rows and columns, on a table that looks
    somewhat otherwise around the same.
    """
    apart = np.full((560, 560), table, np.uint8)
    for x in range(FIRST, LAST + 1, PITCH // 2):
        apart[FIRST : LAST + 1, x - 1 : x + 2] = 150
        apart[x - 1 : x + 2, FIRST : LAST + 1] = 150
    apart[LAST - PITCH : LAST + 2, lost] = table
    apart[LAST - PITCH :, lost] += np.uint8(beyond)
    return Relief(apart, (), apart, Displacement(0.0, np.zeros(2)), 3.0)


def looked_at(relief: Relief, ring: NDArray[np.int64] | None = None) -> Reach:
    square = np.array([[FIRST, FIRST], [LAST, FIRST], [LAST, LAST], [FIRST, LAST]])
    return reach(relief, (square if ring is None else ring).astype(np.float64), PITCH)


def test_walls_reach_a_true_outline_all_along_also_one_that_the_lens_bends() -> None:
    assert len(looked_at(walls()).gaps(1.0 * PITCH)) == 0
    turned = Relief(cv2.rotate(walls().apart, cv2.ROTATE_180), (), walls().lit, walls().displacement, 3.0)
    assert len(looked_at(turned).gaps(1.0 * PITCH)) == 0


def test_an_outline_over_a_known_table_that_no_wall_reaches_is_refused_with_its_place() -> None:
    seen = looked_at(walls(lost=slice(200, 280)))
    ((first, last),) = seen.gaps(2.0 * PITCH)
    assert last - first == pytest.approx(80, abs=PITCH)
    with pytest.raises(NoBlockFound, match=r"near \(2[34]\d, 460\) px, where no wall reaches it"):
        check_reached([seen], 2.0 * PITCH)
    check_reached([seen], 5.0 * PITCH)


def test_where_the_table_looks_otherwise_nothing_is_said_of_it() -> None:
    """In glare, or under what lies there."""
    check_reached([looked_at(walls(lost=slice(200, 280), beyond=90))], 2.0 * PITCH)


def test_an_outline_that_no_wall_reaches_anywhere_is_one_gap() -> None:
    far = np.array([[40, 40], [520, 40], [520, 520], [40, 520]])
    assert looked_at(walls(), far).gaps(2.0 * PITCH).tolist() == [[0.0, 1920.0]]
