"""A straight cut is told by what touches its line at every cell; rows of closed cells are none."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from contour.geometry.arrays import Float64s
from contour.geometry.rings import Contour
from contour.material.closed_cells import Apart, MaterialEdge
from contour.tracing.cut_lines import straight_cuts
from contour.tracing.touched_edges import touched_cuts

PITCH = 60.0


def material(deep_px: Float64s, bow_px: float = 0.0) -> MaterialEdge:
    """A block along whose upper edge lie openings so deep, one a pitch; that edge is bent by so much at its middle."""
    width = round(PITCH * len(deep_px))
    x = np.arange(width)
    place = x / PITCH % 1.0
    top = 100.0 + bow_px * (2.0 * x / width - 1.0) ** 2
    top += np.where((place > 0.2) & (place < 0.8), np.repeat(deep_px, round(PITCH)), 0.0)
    region = np.zeros((500, width + 100), np.uint8)
    region[:400, 50:-50] = np.arange(400)[:, None] >= np.rint(top)[None]
    border, _ = cv2.findContours(region, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    rings = tuple(ring[:, 0].astype(np.float64) for ring in border)
    return MaterialEdge(Contour(rings[0]), 1.0, rings, Apart(region, region, region, 5.0))


def test_openings_that_differ_were_cut_open_and_alike_ones_were_not() -> None:
    deep = np.array([12.0, 20.0, 33.0, 15.0, 28.0, 40.0, 18.0, 25.0])
    (cut,) = touched_cuts(material(deep), PITCH)
    assert np.allclose(cut[0, :, 1], 100.0, atol=1.0)
    assert abs(cut[0, 1, 0] - cut[0, 0, 0]) > 7.9 * PITCH
    assert touched_cuts(material(np.full(8, 20.0)), PITCH) == []
    assert len(touched_cuts(material(np.full(8, 20.0)), PITCH, alike=True)) == 1


def test_openings_that_grow_steadily_were_cut_open_and_those_that_only_vary_were_not() -> None:
    growing = np.array([25.0, 26.0, 27.0, 28.0, 29.0, 30.0, 31.0, 32.0])
    assert len(touched_cuts(material(growing), PITCH)) == 1
    assert touched_cuts(material(np.roll(growing, 3)[[0, 4, 1, 5, 2, 6, 3, 7]]), PITCH) == []


def walled(*thick_px: float) -> MaterialEdge:
    """A block with openings that are alike, and behind what touches its upper edge cells, so far behind it."""
    block = material(np.full(len(thick_px) + 1, 28.0))
    difference = np.full_like(block.apart.region, 9)
    for number, wall in enumerate(thick_px):
        x, y = round(PITCH * (number + 1)) + 50, round(100.0 + wall)
        difference[y : y + 30, x - 6 : x + 6] = 0
    return replace(block, apart=replace(block.apart, difference=difference, level=np.full_like(difference, 5)))


def test_walls_of_different_thickness_were_cut_and_as_thick_ones_were_not() -> None:
    assert len(touched_cuts(walled(10.0, 8.5, 7.0, 5.5, 4.0), PITCH)) == 1
    assert touched_cuts(walled(8.0, 8.0, 8.0, 8.0, 8.0), PITCH) == []


def test_the_last_wall_of_a_row_looks_thicker_at_a_corner() -> None:
    assert touched_cuts(walled(8.0, 8.0, 8.0, 8.0, 20.0), PITCH) == []


def test_an_edge_of_cells_floors_was_cut_where_no_wall_runs_along_it() -> None:
    block = material(np.zeros(8))
    across, along = np.zeros_like(block.apart.region), np.zeros_like(block.apart.region)
    across[100:400, 50 :: round(PITCH)] = 255
    across[100:400, 51 :: round(PITCH)] = 255
    along[100:106, 50:-50] = 255
    (cut,) = (
        cut
        for cut in touched_cuts(block, PITCH, walls=across, wall_px=5.0)
        if np.allclose(cut[0, :, 1], 100.0, atol=1.0)
    )
    assert abs(cut[0, 1, 0] - cut[0, 0, 0]) > 7.9 * PITCH
    edges = touched_cuts(block, PITCH, walls=along | across, wall_px=5.0)
    assert not any(np.allclose(cut[0, :, 1], 100.0, atol=1.0) for cut in edges)
    assert touched_cuts(block, PITCH) == []


def test_a_cut_runs_along_the_hull_that_its_few_ends_lie_on() -> None:
    """Three ends at one end of the edge, half a pixel off, point beside its other end."""
    block = material(np.array([12.0, 20.0, 33.0, 15.0, 28.0, 40.0, 18.0, 25.0]))
    ends = np.array([[60.0, 100.0], [110.0, 101.0], [170.0, 102.0]])
    up = np.tile([0.0, -1.0], (3, 1))
    (cut,) = straight_cuts(block, ends, up, PITCH, open_px=2.0 * PITCH)
    assert np.allclose(cut[0, :, 1], 100.0, atol=1.0)
    assert abs(cut[0, 1, 0] - cut[0, 0, 0]) > 7.9 * PITCH


def test_two_openings_tell_that_a_sheet_was_cut() -> None:
    two = np.array([0.0, 20.0, 20.0, 0.0, 0.0])
    assert len(touched_cuts(material(two), PITCH, alike=True)) == 1
    assert touched_cuts(material(two), PITCH) == []


def test_a_row_of_closed_cells_that_a_lens_bends_is_none() -> None:
    assert touched_cuts(material(np.full(12, 20.0), bow_px=3.5), PITCH) == []
