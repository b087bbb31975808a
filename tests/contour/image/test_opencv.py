"""What stands in for slower calls of OpenCV tells the same, to the pixel."""

from __future__ import annotations

from collections.abc import Iterator

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.geometry.arrays import median
from contour.image.opencv import deep, median_where, pieces_and_areas, pieces_and_boxes, pieces_and_middles, within
from contour.image.pixel_grid import whole_averaged


def masks() -> Iterator[NDArray[np.uint8]]:
    """Specks, pieces, most of the picture in one piece, nothing, and all of it."""
    rng = np.random.default_rng(3)
    noise = cv2.GaussianBlur(rng.random((90, 130)).astype(np.float32), (0, 0), 2.0)
    for share in (0.02, 0.3, 0.6, 0.98):
        yield (noise < np.quantile(noise, share)).astype(np.uint8)
    yield (rng.random((90, 130)) < 0.01).astype(np.uint8)
    yield np.zeros((20, 30), np.uint8)
    yield np.ones((20, 30), np.uint8)


@pytest.mark.parametrize("neighbours", [3, 5])
def test_discs_reach_as_far_as_distances_do(neighbours: int) -> None:
    for mask in masks():
        for radius in (0.4, 1.5, 2.84, 4.3, 7.7, 12.0):
            away = cv2.distanceTransform(1 - mask, cv2.DIST_L2, neighbours)
            assert (within(mask, radius, neighbours) == (away <= radius)).all()
            room = cv2.distanceTransform(mask, cv2.DIST_L2, neighbours)
            assert (deep(mask > 0, radius, neighbours) == (room > radius)).all()


@pytest.mark.parametrize("connectivity", [4, 8])
@pytest.mark.parametrize("others", [0, 8192])
def test_pieces_are_those_of_opencv(monkeypatch: pytest.MonkeyPatch, connectivity: int, others: int) -> None:
    monkeypatch.setattr("contour.image.opencv._MOST_OTHERS", others)
    for mask in masks():
        _, labels, stats, middles = cv2.connectedComponentsWithStats(mask * 255, connectivity=connectivity)
        pieces, boxes = pieces_and_boxes(mask * np.uint8(255), connectivity)
        assert (pieces == labels).all()
        assert (boxes[1:] == stats[1:]).all()
        same = pieces_and_middles(mask * np.uint8(255), connectivity)
        assert all((one[1:] == other[1:]).all() for one, other in zip(same[1:], (stats, middles), strict=True))
        assert (pieces_and_areas(mask, connectivity)[1][1:] == stats[1:, cv2.CC_STAT_AREA]).all()


def test_the_median_by_counts_is_that_of_the_pixels() -> None:
    rng = np.random.default_rng(5)
    for count in (1, 2, 7, 400):
        where = np.zeros(600, np.bool_)
        where[rng.choice(600, count, replace=False)] = True
        picture = rng.integers(0, 256, (20, 30)).astype(np.uint8)
        assert median_where(picture, where.reshape(20, 30)) == median(picture.ravel()[where])


@pytest.mark.parametrize("step", [3, 5])
def test_means_round_alike_whichever_way_they_are_had(step: int) -> None:
    # Every sum that the pixels of a sample can have.
    sums = np.arange(step * step * 255 + 1)[:, None]
    pixels = (sums // (step * step) + (np.arange(step * step) < sums % (step * step))).astype(np.uint8)
    picture = np.ascontiguousarray(pixels.reshape(-1, step, step).transpose(1, 0, 2).reshape(step, -1))
    plain = cv2.resize(picture, (len(sums), 1), interpolation=cv2.INTER_AREA)
    assert (whole_averaged(picture, step) == plain).all()
