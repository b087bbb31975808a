"""Seeing through noise: how much of it there is, what it makes of a mask, and of colours."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.walls.lightness import wall_light
from contour.walls.wall_mask import wall_mask, without_specks

# Of the noise of single pixels, what the mask's light blur (3 × 3 binomial) leaves: (6 / 16) of its deviation.
LEFT = 0.375


def walls(pitch: int, wide: int = 2) -> np.ndarray:
    """Where a square grid of walls lies in the middle of a table, shape (480, 640), bool."""
    grid = np.zeros((480, 640), np.bool_)
    for first in range(wide):
        grid[120 + first : 362 : pitch, 160:482] = True
        grid[120:362, 160 + first : 482 : pitch] = True
    return grid


def noisy(grid: np.ndarray, contrast: float, noise: float) -> np.ndarray:
    rng = np.random.default_rng(8)
    light = cv2.GaussianBlur(40.0 + contrast * grid, (0, 0), 0.6) + rng.normal(0.0, noise, grid.shape)
    return np.clip(np.rint(light), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("pitch", [7, 9, 15, 24, 50])
def test_noise_is_told_within_a_fifth_whatever_the_pitch(pitch: int) -> None:
    seen = wall_mask(noisy(walls(pitch), 80.0, 5.0), pitch, bright=True)
    assert seen.noise == pytest.approx(5.0 * LEFT, rel=0.2)


def test_noise_on_the_table_is_not_in_the_mask_of_faint_fine_walls() -> None:
    grid = walls(9)
    seen = without_specks(wall_mask(noisy(grid, 45.0, 4.0), 9.0, bright=True, contrast=20.0), 9.0, 3.0)
    table = cv2.dilate(grid.astype(np.uint8), np.ones((15, 15), np.uint8)) == 0
    assert np.count_nonzero(seen.mask[table]) < 5e-3 * np.count_nonzero(table)
    assert np.count_nonzero(seen.mask[grid]) > 0.97 * np.count_nonzero(grid)


def test_a_stub_of_wall_that_stands_alone_stays_in_the_mask() -> None:
    grid = walls(9)
    grid[200:206, 500:502] = True
    seen = without_specks(wall_mask(noisy(grid, 45.0, 3.0), 9.0, bright=True, contrast=20.0), 9.0, 3.0)
    assert seen.mask[201:205, 500:502].all()


def test_colour_is_found_where_lightness_has_no_more_than_its_noise() -> None:
    grid = walls(9)[:, :, None]
    rng = np.random.default_rng(3)
    picture = np.where(grid, (90.0, 110.0, 150.0), (190.0, 110.0, 110.0)) + rng.normal(0.0, 6.0, (480, 640, 3))
    encoded = cv2.imencode(".jpg", np.clip(picture, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 95])[1]
    light = wall_light(np.asarray(cv2.imdecode(encoded, cv2.IMREAD_COLOR), np.uint8)).astype(np.float64)
    inside = light[120:362, 160:482], grid[120:362, 160:482, 0]
    assert abs(inside[0][inside[1]].mean() - inside[0][~inside[1]].mean()) > 20.0
