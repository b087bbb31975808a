"""How far a part of an edge stands out of what goes on from both its sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contour.edge.flanks import out_of_flanks
from tests.support.pictures.outline_scenes import PITCH, along, rectangle, witnesses

BLOCK = rectangle(700.0, 500.0)
STOPS = (250.0, 450.0)
CLEAR = witnesses(BLOCK, seed=1, gaps=(STOPS,))


@pytest.mark.parametrize("out", [-20.0, 0.0, 12.0])
def test_it_is_the_distance_from_the_line_of_the_edge(out: float) -> None:
    points, normal = along(BLOCK, np.array([300.0, 350.0, 400.0]))
    found = out_of_flanks(CLEAR, STOPS, points + out * normal, PITCH)
    assert found is not None
    assert found == pytest.approx([out] * 3, abs=0.05 * PITCH)


def test_what_lies_on_a_line_that_two_broken_walls_turn_is_not_in_line() -> None:
    broken = np.isin(CLEAR.position, np.sort(CLEAR.position[CLEAR.position < STOPS[0]])[-3::2])
    _, normal = along(BLOCK, CLEAR.position)
    clear = replace(CLEAR, points=CLEAR.points - 0.8 * PITCH * broken[:, None] * normal)
    points, normal = along(BLOCK, np.array([300.0, 350.0, 400.0]))
    # So far inside runs the line of least squares through the eight nearest.
    found = out_of_flanks(clear, STOPS, points - np.array([[21.4], [28.1], [34.8]]) * normal, PITCH)
    assert found is not None
    assert (found < -0.5 * PITCH).all()


def test_around_a_corner_what_lies_inside_of_both_edges_does_not_stand_out() -> None:
    stops = (620.0, 780.0)
    clear = witnesses(BLOCK, seed=3, gaps=(stops,))
    corner = BLOCK[1]
    inwards = (BLOCK.mean(axis=0) - corner) / np.hypot(*(BLOCK.mean(axis=0) - corner))
    beyond, _ = along(BLOCK, np.array([600.0]))
    found = out_of_flanks(clear, stops, np.array([corner, corner + 30 * inwards, 2 * corner - beyond[0]]), PITCH)
    assert found is not None
    assert found[0] == pytest.approx(0.0, abs=0.06 * PITCH)
    assert found[1] < -0.4 * PITCH
    assert found[2] == pytest.approx(100.0, abs=0.1 * PITCH)


def test_where_one_side_shows_too_little_nobody_knows() -> None:
    bare = witnesses(BLOCK, seed=4, gaps=((0.0, 250.0), STOPS, (2250.0, 2400.0)))
    assert out_of_flanks(bare, STOPS, BLOCK[:1], PITCH) is None
