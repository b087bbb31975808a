"""What fills cells up to the cut ends flush with the edge; what lies over it does not."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.edge.cut_material import cut_borders, joined
from contour.edge.table_look import TableLook
from contour.geometry.ring_lengths import RingLengths
from contour.geometry.rings import densified
from contour.walls.wall_evidence import EdgePoints
from tests.support.pictures.hand_looks import HEIGHT, WIDTH, look
from tests.support.pictures.outline_scenes import PITCH, along, circle, distances, rectangle, witnesses

TABLE, FILL = 40, 150
BLOCK = rectangle(700.0, 500.0)
GAP = (250.0, 450.0)


def thing(begin: float, end: float, out: float = 0.0) -> NDArray[np.float64]:
    """What lies along the block's edge between two arc lengths, three pitches deep, up to so many pitches beyond."""
    points, normal = along(BLOCK, np.array([begin, end]))
    inner, outer = points - 3.0 * PITCH * normal, points + out * PITCH * normal
    return np.array([inner[0], inner[1], outer[1], outer[0]])


def picture(area: NDArray[np.float64], level: int = FILL, colour: bool = False) -> NDArray[np.uint8]:
    """The thing alone on the table, its border to a fraction of a pixel."""
    large = np.full((HEIGHT, WIDTH), TABLE, np.uint8)
    cv2.fillPoly(large, [np.rint(area * 16).astype(np.int32)], level, cv2.LINE_AA, 4)
    soft = np.asarray(cv2.GaussianBlur(large, (0, 0), 0.8), np.uint8)
    if not colour:
        return soft
    return np.dstack([np.full_like(soft, TABLE), np.full_like(soft, TABLE), soft])


def found(
    area: NDArray[np.float64],
    image: NDArray[np.uint8],
    there: TableLook,
    gap: tuple[float, float] = GAP,
) -> EdgePoints:
    clear = replace(witnesses(BLOCK, seed=1, gaps=(gap,)), coarse=densified(BLOCK, 5.0))
    return joined(cut_borders(image, clear, BLOCK, area[:2], there))


@pytest.mark.parametrize("colour", [False, True])
def test_its_end_is_the_edge_to_the_pixel(colour: bool) -> None:
    area = thing(*GAP)
    one = found(area, picture(area, colour=colour), look(BLOCK, area))
    assert len(one.points) > 20
    assert distances(one.points, BLOCK).mean() < 0.7
    on_edge = along(BLOCK, one.position)[0]
    assert np.hypot(*(one.points - on_edge).T).max() < 1.5 * PITCH
    assert ((one.position > GAP[0] - PITCH) & (one.position < GAP[1] + PITCH)).all()
    outward = along(BLOCK, np.array([350.0]))[1][0]
    assert (one.normal @ outward > 0.9).mean() > 0.8


def test_what_ends_flush_around_a_corner_is_cut_too() -> None:
    gap = (620.0, 780.0)
    points, normal = along(BLOCK, np.array(gap))
    area = np.array([points[0], BLOCK[1], points[1], points[1] - 80.0 * normal[1]])
    one = found(area, picture(area), look(BLOCK, area), gap)
    assert distances(one.points, BLOCK).mean() < 0.05 * PITCH


def test_what_ends_on_a_curve_that_goes_on_along_it_is_cut_too() -> None:
    """Over so many cells the curve leaves the lines on both sides."""
    round_block, gap = circle(15.0 * PITCH), (100.0, 340.0)
    points, normal = along(round_block, np.linspace(*gap, 30))
    area = np.vstack([points, (points - 3.0 * PITCH * normal)[::-1]])
    clear = replace(witnesses(round_block, seed=1, gaps=(gap,)), coarse=densified(round_block, 5.0))
    one = joined(cut_borders(picture(area), clear, round_block, area[[0, 29]], look(round_block, area)))
    assert len(one.points) > 20
    assert distances(one.points, round_block).mean() < 0.05 * PITCH


def test_a_label_over_a_small_round_block_is_none() -> None:
    """It ends inside of the lines of the edge on both sides, which meet far out; but not on either of them."""
    round_block = circle(5.0 * PITCH)
    (point,), (normal,) = along(round_block, np.array([200.0]))
    side = np.array([-normal[1], normal[0]]) * 2.6 * PITCH
    inner, outer = point - 1.5 * PITCH * normal, point + 0.8 * PITCH * normal
    label = np.array([inner - side, inner + side, outer + side, outer - side])
    gap = (200.0 - 3.0 * PITCH, 200.0 + 3.0 * PITCH)
    clear = replace(witnesses(round_block, seed=1, gaps=(gap,)), coarse=densified(round_block, 5.0))
    assert cut_borders(picture(label), clear, round_block, label[:2], look(round_block, label)) == []


@pytest.mark.parametrize("out", [0.4, 1.0, 3.0])
def test_what_sticks_out_is_none(out: float) -> None:
    area = thing(*GAP, out)
    assert not len(found(area, picture(area), look(BLOCK, area)).points)


def test_what_is_darker_than_the_table_is_none_where_it_ends_as_softly_as_a_shadow() -> None:
    area = thing(*GAP)
    dark, cut = look(BLOCK, area, lighter=False), picture(area, 10)
    assert len(found(area, cut, dark).points)
    assert not len(found(area, np.asarray(cv2.GaussianBlur(cut, (0, 0), 0.3 * PITCH), np.uint8), dark).points)


def test_nor_is_what_the_table_does_not_follow() -> None:
    area, other = thing(*GAP), thing(*GAP, 3.0)
    there = look(BLOCK, area)
    hidden = TableLook(**{**vars(there), "table": there.table & ~look(BLOCK, other).foreign})
    assert len(found(area, picture(area), there).points)
    assert not len(found(area, picture(area), hidden).points)


def test_nor_is_a_border_that_nothing_shows() -> None:
    area = thing(*GAP)
    assert not len(found(area, picture(area, TABLE + 3), look(BLOCK, area)).points)


@pytest.mark.parametrize(("share", "cut"), [(0.25, True), (0.4, False)])
def test_an_outline_through_what_lies_along_a_third_of_the_edge_tells_nothing(share: float, cut: bool) -> None:
    """It goes on smoothly around a hand, too."""
    round_block = circle(15.0 * PITCH)
    gap = (100.0, 100.0 + share * 30.0 * np.pi * PITCH)
    points, normal = along(round_block, np.linspace(*gap, 60))
    area = np.vstack([points, (points - 3.0 * PITCH * normal)[::-1]])
    clear = replace(witnesses(round_block, seed=1, gaps=(gap,)), coarse=densified(round_block, 5.0))
    hidden = np.hypot(*(round_block[:, None] - points[1:-1]).transpose(2, 0, 1)).min(axis=1) < 2.0 * PITCH
    args = picture(area), clear, round_block[~hidden], area[[0, 59]], look(round_block, area)
    assert not cut_borders(*args)
    assert bool(cut_borders(*args, lambda _: round_block)) == cut


@pytest.mark.parametrize("round_block", [True, False])
def test_a_corner_on_a_curved_edge_is_a_things_and_between_straight_ones_the_blocks_own(round_block: bool) -> None:
    """The outline goes on smoothly from both."""
    middle, radius, half = np.array([700.0, 500.0]), 8.0 * PITCH, np.radians(30.0)
    turn = np.linspace(half, 2.0 * np.pi - half, 300)
    arc = middle + radius * np.column_stack([np.cos(turn), np.sin(turn)])
    corner = middle + np.array([radius / np.cos(half), 0.0])
    ends = arc[[-1, 0]]
    far = ends + 2.0 * (ends - corner)
    outline = np.vstack([[corner], arc if round_block else far[::-1]])
    block = circle(radius) if round_block else outline
    gap = RingLengths.of(block).feet(ends).tolist()
    area = np.array([ends[0], corner, ends[1], *(0.75 * ends[::-1] + 0.25 * middle)])
    gaps = ((gap[0], 1e9), (0.0, gap[1]))
    clear = replace(witnesses(block, seed=1, gaps=gaps), coarse=densified(block, 5.0))
    args = picture(area), clear, outline[1:], area[[3, 4]], look(block, area)
    assert bool(cut_borders(*args, lambda _: outline)) == (not round_block)
