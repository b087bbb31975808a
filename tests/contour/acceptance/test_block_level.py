"""Levels that only the block has are told from those that only the table has; what both have is told of neither."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from contour.acceptance.block_level import exclusive_levels

SIDE = 60


def halves(left: NDArray[np.uint8], right: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], ...]:
    """A picture of two halves, and the masks of the left one (block) and the right one (table)."""
    level = np.concatenate([left, right], axis=1)
    block = np.zeros(level.shape[:2], np.uint8)
    block[:, :SIDE] = 255
    return level, block, np.asarray(255 - block, np.uint8)


def noise(low: int, high: int, seed: int, channels: tuple[int, ...] = ()) -> NDArray[np.uint8]:
    return np.random.default_rng(seed).integers(low, high, (SIDE, SIDE, *channels)).astype(np.uint8)


def test_levels_apart_are_told() -> None:
    level, block, table = halves(noise(40, 60, 1), noise(120, 140, 2))
    only_block, only_table = exclusive_levels(level, block, table)
    assert np.mean(only_block[:, :SIDE] > 0) > 0.85
    assert np.mean(only_table[:, SIDE:] > 0) > 0.85
    assert not only_block[:, SIDE:].any()
    assert not only_table[:, :SIDE].any()


def test_levels_that_both_have_are_told_of_neither() -> None:
    level, block, table = halves(noise(40, 140, 1), noise(40, 140, 2))
    assert not any(np.mean(mask > 0) > 0.02 for mask in exclusive_levels(level, block, table))


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_one_channel_of_colour_is_enough(channel: int) -> None:
    left, right = noise(90, 110, 1, (3,)), noise(90, 110, 2, (3,))
    right[..., channel] += 60
    only_block, only_table = exclusive_levels(*halves(left, right))
    assert np.mean(only_block[:, :SIDE] > 0) > 0.7
    assert np.mean(only_table[:, SIDE:] > 0) > 0.7


def test_hardly_a_sample_tells_nothing() -> None:
    level, block, _ = halves(noise(40, 60, 1), noise(120, 140, 2))
    few = np.zeros_like(block)
    few[0, -5:] = 255
    assert not any(mask.any() for mask in exclusive_levels(level, block, few))
