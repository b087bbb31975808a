"""Neighbours all around, and no dents: what cells have and letters do not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.walls.lattice_order import lattice_order, solidity


def honeycomb(pitch: float, count: int) -> NDArray[np.float64]:
    """Centres of a honeycomb's cells, count by count."""
    row, column = np.mgrid[:count, :count].reshape(2, -1)
    return np.column_stack(((column + 0.5 * (row % 2)) * pitch, row * pitch * np.sqrt(3) / 2))


def shares(picture: NDArray[np.uint8]) -> float:
    _, labels, stats, _ = cv2.connectedComponentsWithStats(picture, connectivity=4, ltype=cv2.CV_32S)
    return solidity(np.asarray(labels, np.int32), np.arange(1, len(stats)), np.asarray(stats, np.int32))


def test_a_honeycombs_inner_cells_have_neighbours_all_around() -> None:
    places = honeycomb(20.0, 12)
    inner = ((places > 30.0) & (places < places.max(axis=0) - 30.0)).all(axis=1)
    assert lattice_order(places, 20.0) > np.mean(inner)


def test_things_strewn_at_random_have_no_order() -> None:
    places = np.random.default_rng(3).uniform(0.0, 240.0, (100, 2))
    assert lattice_order(places, 15.0) < 0.15  # patches that fill a third of their place


def test_order_does_not_depend_on_how_many_pieces_the_comb_lies_in() -> None:
    one = honeycomb(20.0, 8)
    assert lattice_order(np.concatenate((one, one + 500.0)), 20.0) == pytest.approx(lattice_order(one, 20.0), abs=0.1)


def test_hexagons_are_solid_and_letters_are_not() -> None:
    picture = np.zeros((300, 300), np.uint8)
    for x, y in honeycomb(40.0, 6) + 40.0:
        cv2.circle(picture, (round(x), round(y)), 15, 255, -1)
    letters = np.zeros((300, 600), np.uint8)
    cv2.putText(letters, "CEKSFLTX", (10, 100), cv2.FONT_HERSHEY_DUPLEX, 2.0, 255, 8)
    assert shares(picture) > 0.93
    assert shares(letters) < 0.85


def test_a_single_pixel_is_solid() -> None:
    picture = np.zeros((9, 9), np.uint8)
    picture[4, 4] = 255
    assert shares(picture) == pytest.approx(1.0)
