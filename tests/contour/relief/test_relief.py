"""What differs from a known table, and where walls end whose tops are as light as it is."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from contour.relief.relief import Displacement, Relief, relief_of
from contour.relief.relief_ends import relief_ends

NONE = Displacement(0.0, np.zeros(2))
SIZE, PITCH, WIDTH = 160, 24.0, 3.0


def stripes() -> NDArray[np.uint8]:
    """A table with stripes ten pixels wide."""
    return np.tile(np.where(np.arange(SIZE) // 10 % 2, 150, 90).astype(np.uint8), (SIZE, 1))


def test_a_displacement_is_found_from_points_and_what_lies_below_them() -> None:
    points = np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 80.0], [100.0, 80.0]])
    found = Displacement.of(points, points - 0.02 * (points - [30.0, 50.0]))
    assert found.share == pytest.approx(0.02)
    assert found.middle == pytest.approx([30.0, 50.0])
    assert Displacement.of(points, points).at(points) == pytest.approx(np.zeros((4, 2)))


def test_a_table_in_a_soft_shade_differs_from_itself_by_next_to_nothing_and_a_wall_of_either_sign_does() -> None:
    shade = np.linspace(1.0, 0.5, SIZE)[:, None]
    picture = np.rint(stripes() * shade)
    picture[:, 60:63] += 40
    picture[:, 100:103] -= 30
    seen = relief_of(picture.astype(np.uint8), stripes(), PITCH, NONE, WIDTH)
    assert np.median(seen.apart[:, 20:50]) < 25
    assert np.median(seen.apart[:, 61]) > 80 < np.median(seen.apart[:, 101])
    assert seen.signed[0][80, 61] == pytest.approx(40, abs=5)
    assert seen.signed[0][80, 101] == pytest.approx(-30, abs=5)
    assert seen.lit[2, 40] == pytest.approx(120, abs=3)


def test_a_thing_lighter_than_the_table_is_no_shade_of_it() -> None:
    picture = stripes()
    picture[40:120, 40:120] = 240
    assert relief_of(picture, stripes(), PITCH, NONE, WIDTH).apart[60:100, 60:100].min() > 100


def test_a_channel_at_full_scale_says_nothing() -> None:
    """A shadow takes it down by less than the others."""
    table = np.stack([np.full((SIZE, SIZE), level, np.uint8) for level in (100, 120, 255)], axis=-1)
    picture = table.copy()
    picture[:, 80:] = (50, 60, 200)
    seen = relief_of(picture, table, PITCH, NONE, WIDTH)
    assert len(seen.signed) == 2
    assert seen.apart[:, 110:].max() < 25


def strip(end: float, top: float, side: float, below: tuple[float, float]) -> NDArray[np.float32]:
    """A wall along x that ends at `end`, in row 80, and the side that it sweeps as it goes down, on nothing."""
    y, x = np.mgrid[0:SIZE, 0:SIZE].astype(np.float64)

    def cover(part: float) -> NDArray[np.float64]:
        across = np.clip(0.5 * WIDTH + 0.5 - np.abs(y - 80.0 - part * below[1]), 0.0, 1.0)
        return np.clip(end + 0.5 - x + part * below[0], 0.0, 1.0) * across

    on_top = cover(0.0)
    swept = np.maximum.reduce([cover(part) for part in np.linspace(0.0, 1.0, 21)])
    return (top * on_top + side * (swept - on_top)).astype(np.float32)


@pytest.mark.parametrize("top", [60.0, 12.0, -25.0])
@pytest.mark.parametrize("middle", [(-220.0, -320.0), (380.0, -320.0)])
def test_an_end_is_that_of_the_top_whether_it_or_the_side_is_seen(top: float, middle: tuple[float, float]) -> None:
    """Sides displaced by four pixels inwards and by six outwards, eight across, with what is seen of them 40 darker."""
    displacement = Displacement(0.02, np.array(middle))
    tip = np.array([[80.0, 80.0]])
    below = displacement.at(tip)[0]
    light = strip(80.3, top, -40.0, (float(below[0]), float(below[1])))
    relief = Relief(np.zeros((SIZE, SIZE), np.uint8), (light,), np.zeros((SIZE, SIZE), np.uint8), displacement, 6.0)
    seen_at = np.array([[80.0 + max(below[0], 0.0), 80.0 + 0.5 * below[1]]])
    out = np.array([[1.0, 0.0]])
    found = relief_ends(relief, seen_at, out, out, pitch_px=PITCH, blur_px=0.6)
    assert found.point[0, 0] == pytest.approx(80.3, abs=0.7)
    assert found.told[0] > 0.8
    assert found.sigma[0] < 1.0


def test_what_differs_from_the_table_by_little_is_told_to_be_low() -> None:
    """Grain that shows through a shade ends as a wall does, and may be as long."""
    tip, out = np.array([[80.0, 80.0]]), np.array([[1.0, 0.0]])
    heights = []
    for part in (1.0, 0.1):
        light = part * strip(80.3, 60.0, -40.0, (0.0, 0.0))
        relief = Relief(np.zeros((SIZE, SIZE), np.uint8), (light,), np.zeros((SIZE, SIZE), np.uint8), NONE, WIDTH)
        heights.append(relief_ends(relief, tip, out, out, pitch_px=PITCH, blur_px=0.6).height[0])
    assert heights[0] == pytest.approx(60.0, rel=0.2)
    assert heights[1] == pytest.approx(0.1 * heights[0], rel=0.01)
