"""What has patches side by side, and is no honeycomb."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.acceptance.acceptance import View, judge
from contour.acceptance.findings import Limits, Refusal
from contour.acceptance.trace_check import CheckedTrace
from contour.errors import NoBlockFound
from contour.polygon.polygon import cutting_polygon
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from contour.walls.comb_likeness import (
    MOSTLY_SQUARES,
    Comb,
    apart,
    filled_shares,
    lattice_order,
    surely_comb,
    unlike_comb,
)
from tests.support.pictures.small_scenes import block


@pytest.mark.parametrize(
    "comb",
    [
        Comb(24.0, 3.0, True, 300, 0.6, 0.6),
        Comb(8.0, 3.4, True, 900, 0.2, 0.2),  # fine cells look wide-walled
        Comb(37.0, 17.0, True, 60, 0.21, 0.25),  # foam
        Comb(23.0, 7.6, True, 150, 0.3, 0.25),  # a perforated plate
        Comb(149.0, 6.0, True, 6, 0.4, 0.8),  # few cells, each large
        Comb(17.0, 6.2, False, 300, 0.5, 0.5),  # dark walls under blur
        Comb(30.0, 7.8, True, 118, 0.3, 0.3, order=0.38, solid=0.82),  # foam
        Comb(31.0, 4.3, True, 37, 0.12, 0.18, order=0.22, solid=0.95),  # half of its walls broken
        Comb(34.0, 20.0, True, 140, 0.7, 0.9, order=0.9, solid=0.96, apart=1.0),  # a lattice of wide webs
    ],
)
def test_combs_foams_and_plates_may_be_blocks(comb: Comb) -> None:
    assert unlike_comb(comb, 0.7) is None


def test_a_lattice_of_wide_webs_shows_the_table() -> None:
    comb = Comb(34.0, 20.0, True, 140, 0.7, 0.9, order=0.9, solid=0.96, apart=1.0)
    assert unlike_comb(comb, 0.7, shown=True) is None
    assert unlike_comb(comb, 0.7, shown=False) is not None, "dots on a sheet"


def test_blur_makes_walls_look_wider_and_is_taken_off() -> None:
    comb = Comb(20.0, 9.5, False, 300, 0.5, 0.6)
    assert unlike_comb(comb, 3.3) is None
    assert unlike_comb(comb, 0.7) is not None


@pytest.mark.parametrize(
    "comb",
    [
        Comb(86.0, 35.6, False, 42, 1.0, 1.0),  # a chessboard
        Comb(80.0, 29.0, True, 33, 0.9, 0.9, order=0.88, solid=0.97, apart=0.03),  # another
        Comb(38.0, 16.3, True, 169, 0.73, 0.75),  # lines of text
        Comb(41.0, 12.8, False, 10, 0.2, 0.37),  # a square code
        Comb(42.0, 10.6, True, 75, 0.22, 0.24, order=0.02, solid=0.77),  # bold letters
        Comb(46.0, 3.7, True, 46, 0.22, 0.33, order=0.09, solid=0.97),  # squares of a board that lie apart
    ],
)
def test_boards_prints_and_codes_are_none(comb: Comb) -> None:
    assert unlike_comb(comb, 1.9) is not None


def bold_print() -> NDArray[np.uint8]:
    """A sheet full of bold letters whose paper leaves walls as thin as a comb's."""
    picture = np.full((960, 1280), 40, np.uint8)
    cv2.rectangle(picture, (180, 120), (1080, 820), 205, -1)
    letters = np.random.default_rng(5).integers(33, 126, (12, 22))
    for row, line in enumerate(letters):
        words = "".join(chr(letter) for letter in line)
        cv2.putText(picture, words, (215, 165 + 54 * row), cv2.FONT_HERSHEY_DUPLEX, 1.6, 30, 8, cv2.LINE_AA)
    return picture


def test_letters_are_no_cells_although_thin_walls_part_them() -> None:
    try:
        found = trace(bold_print(), TraceSettings())
    except NoBlockFound:
        return
    assert found.comb is not None
    hidden = [stretch for stretch in found.evidence or () if stretch.state == "covered"]
    unlike = unlike_comb(found.comb, 0.7, cut=found.edge == "cut")
    assert unlike is not None or hidden, "the sheet's margin is neither cells nor table"


def test_three_small_blocks_are_found_though_they_fill_little_of_the_picture() -> None:
    comb = Comb(22.9, 4.4, True, 63, 0.11, 0.16, order=0.35, solid=0.95)
    assert surely_comb(comb)
    assert not surely_comb(replace(comb, solid=0.8))  # letters
    assert not surely_comb(replace(comb, order=0.05))  # nuts on a table
    assert not surely_comb(replace(comb, count=9))


@pytest.mark.parametrize("side", [25, 40])
def test_a_chessboard_on_the_table_is_no_block(side: int) -> None:
    picture = np.full((720, 960), 60, np.uint8)
    squares = (np.indices((600 // side, 800 // side)).sum(axis=0) % 2 * 180 + 25).astype(np.uint8)
    picture[60:660, 80:880] = np.kron(squares, np.ones((side, side), np.uint8))
    try:
        found = trace(cv2.GaussianBlur(picture, (0, 0), 0.8), TraceSettings())
    except NoBlockFound:
        return
    polygon = cutting_polygon(found.contour, None, height_mm=0.0, tolerance_mm=0.1)
    findings = judge(polygon, View((960, 720)), Limits(), traced=CheckedTrace(found))
    assert findings[0].refusal == Refusal.NO_BLOCK_FOUND


def test_a_block_looks_like_one() -> None:
    found = trace(block("rectangle", "shop").picture, TraceSettings())
    assert found.comb is not None
    assert unlike_comb(found.comb, 0.7) is None


def honeycomb(pitch: float, count: int) -> NDArray[np.float64]:
    """Centres of a honeycomb's cells, count by count."""
    row, column = np.mgrid[:count, :count].reshape(2, -1)
    return np.column_stack(((column + 0.5 * (row % 2)) * pitch, row * pitch * np.sqrt(3) / 2))


def shares(picture: NDArray[np.uint8]) -> tuple[float, float]:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(picture, connectivity=4, ltype=cv2.CV_32S)
    return filled_shares(np.asarray(labels, np.int32), np.arange(1, len(stats)), np.asarray(stats, np.int32))


def test_a_honeycombs_inner_cells_have_neighbours_all_around() -> None:
    places = honeycomb(20.0, 12)
    inner = ((places > 30.0) & (places < places.max(axis=0) - 30.0)).all(axis=1)
    assert lattice_order(places, 20.0)[0] > np.mean(inner)


def test_triangles_have_neighbours_all_around_whatever_their_pitch_looks_like() -> None:
    # Triangles with their points up, and between them such with their points down, a third of the height higher.
    up = np.array([(30.0 * (column + row / 2), 26.0 * row) for row in range(12) for column in range(12)])
    places = np.concatenate((up, np.add(up, [15.0, 8.66])))
    for pitch in (13.0, 21.0, 30.0):
        assert lattice_order(places, pitch)[0] > 0.6


@pytest.mark.parametrize("stretch", [0.4, 0.6, 2.0])
def test_stretched_cells_have_neighbours_opposite_each_other(stretch: float) -> None:
    places = honeycomb(20.0, 14) * [1.0, stretch]
    inner = ((places > 30.0) & (places < places.max(axis=0) - 30.0)).all(axis=1)
    assert lattice_order(places, 20.0 * np.sqrt(stretch))[0] > 0.8 * np.mean(inner)


def test_squares_are_told_from_hexagons_also_where_they_lie_aslant_and_not_quite_even() -> None:
    rng = np.random.default_rng(5)
    turn = np.exp(0.3j)
    row, column = np.mgrid[:12, :12].reshape(2, -1)
    aslant = (column + 1j * row) * 20.0 * turn
    squares = np.column_stack((aslant.real, aslant.imag)) + rng.normal(0.0, 0.4, (144, 2))
    assert lattice_order(squares, 20.0)[2] > MOSTLY_SQUARES
    assert lattice_order(honeycomb(20.0, 12), 20.0)[2] < 0.5 * MOSTLY_SQUARES


def test_hexagons_stay_apart_and_a_boards_squares_do_not() -> None:
    board = (np.indices((12, 12)).sum(axis=0) % 2).astype(np.uint8)
    for picture, least, most in ((drawn(6), 0.95, 1.0), (np.kron(board, np.ones((25, 25), np.uint8)), 0.0, 0.1)):
        labels = np.asarray(cv2.connectedComponents(picture, connectivity=4, ltype=cv2.CV_32S)[1], np.int32)
        assert least <= apart(labels, np.arange(1, int(labels.max()) + 1), 10.0) <= most


def test_things_strewn_at_random_have_no_order() -> None:
    places = np.random.default_rng(3).uniform(0.0, 240.0, (100, 2))
    assert lattice_order(places, 15.0)[0] < 0.15  # patches that fill a third of their place


def test_order_does_not_depend_on_how_many_pieces_the_comb_lies_in() -> None:
    one = honeycomb(20.0, 8)
    two = np.concatenate((one, one + 500.0))
    assert lattice_order(two, 20.0)[0] == pytest.approx(lattice_order(one, 20.0)[0], abs=0.1)


def test_discs_are_solid_and_letters_are_not() -> None:
    letters = np.zeros((300, 600), np.uint8)
    cv2.putText(letters, "CEKSFLTX", (10, 100), cv2.FONT_HERSHEY_DUPLEX, 2.0, 255, 8)
    assert shares(drawn(120))[0] > 0.93
    assert shares(letters)[0] < 0.85


def test_discs_fill_the_circle_around_them_and_hexagons_do_not() -> None:
    assert shares(drawn(120))[1] > 0.92
    assert shares(drawn(6))[1] < 0.85
    assert shares(drawn(4))[1] < 0.72


def drawn(corners: int) -> NDArray[np.uint8]:
    """Polygons where a honeycomb's cells are."""
    picture = np.zeros((300, 300), np.uint8)
    angle = np.arange(corners) * 2.0 * np.pi / corners
    for place in honeycomb(40.0, 6) + 40.0:
        ring = np.round(place + 15.0 * np.column_stack((np.cos(angle), np.sin(angle))))
        cv2.fillPoly(picture, [ring.astype(np.int32)], (255,))
    return picture


def test_a_single_pixel_is_solid() -> None:
    picture = np.zeros((9, 9), np.uint8)
    picture[4, 4] = 255
    assert shares(picture)[0] == pytest.approx(1.0)
