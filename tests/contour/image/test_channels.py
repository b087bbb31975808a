"""What is told of pixels over their channels is what numpy tells along a last axis."""

from __future__ import annotations

import numpy as np
import pytest

from contour.image.channels import largest, mean, planes

GREY = np.arange(256, dtype=np.uint8).reshape(16, 16)
COLOUR = np.random.default_rng(1).integers(0, 256, (40, 30, 3)).astype(np.uint8)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16])
def test_the_largest_of_the_channels(dtype: type[np.integer]) -> None:
    assert np.array_equal(largest(COLOUR.astype(dtype)), COLOUR.astype(dtype).max(axis=2))


def test_the_mean_of_the_channels_is_rounded_down() -> None:
    assert np.array_equal(mean(COLOUR), COLOUR.mean(axis=2).astype(np.uint8))


def test_a_grey_picture_is_its_own_only_channel() -> None:
    assert planes(GREY) == [GREY]
    assert largest(GREY) is GREY
    assert mean(GREY) is GREY
