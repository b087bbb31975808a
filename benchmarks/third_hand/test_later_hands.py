"""Pictures that a third hand and those after it draw, and what they say of themselves."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from benchmarks.other_hand.drawings import within
from benchmarks.segmentation.examples import LATER_HANDS
from benchmarks.third_hand.scene import Scene

CLEAR = {
    "third": ("lit_holes", "cables_beside"),
    "fourth": ("bare", "cloth_beside"),
    "fifth": ("holes_deep", "things_near"),
    "sixth": ("holes_lit", "beside_forms"),
}
COVERED = {
    "third": ("over_clamp", "over_clear_tape"),
    "fourth": ("over_hose", "over_tape_clear"),
    "fifth": ("over_glove", "over_hole_plug"),
    "sixth": ("over_tool", "over_sheet_film"),
}
LAST = {"third": "over_pen", "fourth": "over_sleeve", "fifth": "over_hole_plug", "sixth": "over_small"}
DRAWN = [(hand, kind) for hand in LATER_HANDS for kind in (*CLEAR[hand], *COVERED[hand])]


def drawn(hand: str, kind: str, seed: int) -> Scene:
    _, scene = LATER_HANDS[hand]
    return scene(kind, seed)


@cache
def seen(hand: str, kind: str) -> Scene:
    return drawn(hand, kind, 1)


@pytest.mark.parametrize(("hand", "kind"), DRAWN)
def test_something_hides_the_block_in_kinds_that_say_so_and_in_no_others(hand: str, kind: str) -> None:
    one = seen(hand, kind)
    assert (one.hidden & one.comb).any() == kind.startswith("over_")
    assert one.hidden.any() == kind.startswith("over_")
    assert not (one.walls & one.hidden).any()


@pytest.mark.parametrize(("hand", "kind"), DRAWN)
def test_comb_lies_within_the_rings_and_walls_in_it(hand: str, kind: str) -> None:
    one = seen(hand, kind)
    assert np.mean(one.comb != (within(one.comb.shape, one.rings) > 0)) < 0.002  # along the edge
    assert not (one.walls & ~one.comb).any()
    assert 0.0 < one.walls.mean() < one.comb.mean()


@pytest.mark.parametrize(("hand", "kind"), DRAWN)
def test_each_picture_is_what_it_is_said_to_be(hand: str, kind: str) -> None:
    one = seen(hand, kind)
    assert one.picture.dtype == np.uint8
    assert 700 <= one.picture.shape[1] <= 1500
    assert all(mask.shape == one.picture.shape[:2] and mask.dtype == bool for mask in (one.hidden, one.walls, one.comb))
    assert all(ring.shape[1:] == (2,) and ring.dtype == np.float64 for ring in one.rings)


@pytest.mark.parametrize("hand", LATER_HANDS)
def test_the_same_seed_draws_the_same_picture_and_another_does_not(hand: str) -> None:
    kind = CLEAR[hand][0]
    one, again, other = seen(hand, kind), drawn(hand, kind, 1), drawn(hand, kind, 2)
    assert np.array_equal(one.picture, again.picture)
    assert not np.array_equal(one.picture, other.picture)


@pytest.mark.parametrize("hand", LATER_HANDS)
def test_about_half_of_the_kinds_have_something_over_the_block(hand: str) -> None:
    kinds, _ = LATER_HANDS[hand]
    assert 0.4 < np.mean([kind.startswith("over_") for kind in kinds]) < 0.6
    assert len(set(kinds)) == len(kinds)


@pytest.mark.parametrize(("hand", "last"), LAST.items())
def test_a_kind_that_is_none_is_refused(hand: str, last: str) -> None:
    with pytest.raises(ValueError, match=rf"'over_moon' is no kind: expected one of .*{last}"):
        drawn(hand, "over_moon", 1)
