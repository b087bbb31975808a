"""Samples and the pixels that they cover, centres and means."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.image.pixel_grid import averaged, enlarged, pixels_of, samples_of, whole_averaged

PICTURE = 4 * np.arange(5 * 7, dtype=np.uint8).reshape(5, 7)


def test_a_samples_centre_lies_amid_its_pixels() -> None:
    assert pixels_of(np.array([[0, 0], [1, 2]]), 4).tolist() == [[1.5, 1.5], [5.5, 9.5]]
    assert samples_of(np.array([[1.5, 1.5], [5.5, 9.5]]), 4).tolist() == [[0.0, 0.0], [1.0, 2.0]]


def test_with_a_step_of_one_samples_are_pixels() -> None:
    assert pixels_of(np.array([3.25, 7.0]), 1).tolist() == [3.25, 7.0]
    assert whole_averaged(PICTURE, 1) is PICTURE


def test_a_sample_is_the_mean_of_its_pixels_and_the_last_ones_are_filled_up() -> None:
    filled, replicated = averaged(PICTURE, 2), averaged(PICTURE, 2, cv2.BORDER_REPLICATE)
    assert filled.shape == (3, 4)
    assert filled[0, 0] == np.mean(PICTURE[:2, :2])
    assert filled[2, 3] == PICTURE[4, 6] // 4
    assert replicated[2, 3] == PICTURE[4, 6]


def test_pixels_that_fill_no_sample_are_left_off() -> None:
    small = whole_averaged(PICTURE, 2)
    assert small.shape == (2, 3)
    assert np.array_equal(small, averaged(PICTURE, 2)[:2, :3])


@pytest.mark.parametrize("kind", [np.uint8, np.bool_])
def test_each_pixel_takes_its_samples_value(kind: type) -> None:
    grid = np.array([[0, 1], [1, 0]]).astype(kind)
    large = enlarged(grid, 3, (5, 4))
    assert large.shape == (5, 4)
    y, x = np.indices(large.shape)
    assert np.array_equal(large, grid[y // 3, x // 3])
