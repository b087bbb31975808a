"""A table in shadow is told from what lies over it and is as dark."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from contour.relief.shadow import in_shadow

SIZE, PITCH = 400, 24.0
SHADOW = np.s_[100:300, 120:320]
WELL_WITHIN = np.s_[120:280, 140:300]


def grain(contrast: float) -> NDArray[np.float32]:
    """A table of 120 grey levels with grain along x."""
    noise = np.random.default_rng(1).normal(size=(SIZE, SIZE)).astype(np.float32)
    soft = cv2.GaussianBlur(noise, (0, 0), sigmaX=12.0, sigmaY=2.0)
    return np.asarray(120.0 + contrast * soft / soft.std(), np.float32)


def told(table: NDArray[np.float32], light: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Where it is told of a picture with the sensor's noise and its hot pixels, which the taught one has, too."""
    rng = np.random.default_rng(2)
    hot = 60.0 * (rng.random((SIZE, SIZE)) < 0.002)
    now, then = (
        np.rint(np.clip(one + hot + rng.normal(0.0, noise, one.shape), 0.0, 255.0)).astype(np.float32)
        for one, noise in ((light, 1.5), (table, 0.7))
    )
    shade = cv2.GaussianBlur(now, (0, 0), 4.0) / cv2.GaussianBlur(then, (0, 0), 4.0)
    return in_shadow(now, then, np.asarray(shade, np.float32), PITCH)


@pytest.mark.parametrize("dark", [0.8, 0.4])
def test_a_shadow_is_told_by_the_tables_pattern_in_it(dark: float) -> None:
    table = grain(8.0)
    light = table.copy()
    light[SHADOW] *= dark
    seen = told(table, light)
    assert seen[WELL_WITHIN].mean() > 0.95
    seen[90:310, 110:330] = False
    assert not seen.any()


def test_what_lies_over_the_table_is_none_however_dark() -> None:
    light = grain(8.0)
    light[SHADOW] = 50.0
    assert not told(grain(8.0), light)[WELL_WITHIN].any()


def test_where_the_table_has_no_pattern_nothing_is_told() -> None:
    light = grain(0.0)
    light[SHADOW] *= 0.5
    assert not told(grain(0.0), light).any()
