"""Pictures that a third hand draws, and what they say of themselves."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from benchmarks.other_hand.drawings import within
from benchmarks.third_hand.scene import KINDS, scene

seen = cache(scene)
CLEAR, COVERED = ("lit_holes", "cables_beside"), ("over_clamp", "over_clear_tape")


@pytest.mark.parametrize("kind", [*CLEAR, *COVERED])
def test_something_hides_the_block_in_kinds_that_say_so_and_in_no_others(kind: str) -> None:
    one = seen(kind, 1)
    assert (one.hidden & one.comb).any() == kind.startswith("over_")
    assert one.hidden.any() == kind.startswith("over_")
    assert not (one.walls & one.hidden).any()


@pytest.mark.parametrize("kind", [*CLEAR, *COVERED])
def test_comb_lies_within_the_rings_and_walls_in_it(kind: str) -> None:
    one = seen(kind, 1)
    assert np.mean(one.comb != (within(one.comb.shape, one.rings) > 0)) < 0.002  # along the edge
    assert not (one.walls & ~one.comb).any()
    assert 0.0 < one.walls.mean() < one.comb.mean()


@pytest.mark.parametrize("kind", [*CLEAR, *COVERED])
def test_each_picture_is_what_it_is_said_to_be(kind: str) -> None:
    one = seen(kind, 1)
    assert one.picture.dtype == np.uint8
    assert 700 <= one.picture.shape[1] <= 1500
    assert all(mask.shape == one.picture.shape[:2] and mask.dtype == bool for mask in (one.hidden, one.walls, one.comb))
    assert all(ring.shape[1:] == (2,) and ring.dtype == np.float64 for ring in one.rings)


def test_the_same_seed_draws_the_same_picture_and_another_does_not() -> None:
    one, again, other = seen(CLEAR[0], 1), scene(CLEAR[0], 1), scene(CLEAR[0], 2)
    assert np.array_equal(one.picture, again.picture)
    assert not np.array_equal(one.picture, other.picture)


def test_about_half_of_the_kinds_have_something_over_the_block() -> None:
    assert 0.4 < np.mean([kind.startswith("over_") for kind in KINDS]) < 0.6
    assert len(set(KINDS)) == len(KINDS)


def test_a_kind_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match=r"'over_moon' is no kind: expected one of .*over_pen"):
        scene("over_moon", 1)
