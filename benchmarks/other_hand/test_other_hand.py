"""Pictures that another hand draws, and what they say of themselves."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
import pytest

from benchmarks.other_hand.__main__ import main
from benchmarks.other_hand.drawings import stroke, within
from benchmarks.other_hand.scene import KINDS, Scene, scene
from contour.geometry.arrays import Bools, Float32s

seen = cache(scene)


def away(mask: Bools) -> Float32s:
    """How far each pixel lies from those of the mask, (H, W)."""
    return np.asarray(cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 5), np.float32)


def edge(one: Scene) -> Bools:
    drawn = np.zeros(one.walls.shape, np.uint8)
    for ring in one.rings:
        stroke(drawn, np.vstack([ring, ring[:1]]), 255)
    return np.asarray(drawn > 127)


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_is_drawn_with_its_truth(kind: str) -> None:
    one = seen(kind, 1)
    assert 1000 <= one.picture.shape[1] <= 2000
    assert one.picture.dtype == np.uint8
    assert all(mask.shape == one.picture.shape[:2] and mask.dtype == bool for mask in (one.hidden, one.walls, one.comb))
    assert all(ring.shape[1:] == (2,) and ring.dtype == np.float64 for ring in one.rings)
    assert 12.0 <= one.pitch_px <= 60.0
    assert 0.005 < one.walls.mean() < one.comb.mean()
    assert not (one.walls & one.hidden).any()


def test_the_same_seed_draws_the_same_picture_and_another_does_not() -> None:
    one, again, other = seen("tape", 1), scene("tape", 1), scene("tape", 2)
    assert np.array_equal(one.picture, again.picture)
    assert not np.array_equal(one.picture, other.picture)


def test_walls_lie_within_the_rings_and_up_to_them() -> None:
    one = seen("undisturbed", 1)
    assert not one.hidden.any()
    assert np.mean(away(within(one.walls.shape, one.rings) > 0)[one.walls] > 2.0) < 0.001  # burrs
    assert away(one.walls)[edge(one)].max() < one.pitch_px


@pytest.mark.parametrize("kind", ["tape", "clamp", "hand", "cable"])
def test_things_hide_some_of_the_edge(kind: str) -> None:
    one = seen(kind, 1)
    assert 0.0 < np.mean(one.hidden[edge(one)]) < 0.7


def test_comb_is_both_blocks_of_a_pair_and_an_offcut_too() -> None:
    pair, offcut = seen("pair", 1), seen("offcut", 1)
    assert len(pair.rings) == 2
    assert np.array_equal(pair.comb, within(pair.comb.shape, pair.rings) > 0)
    assert (offcut.comb & (within(offcut.comb.shape, offcut.rings) == 0)).sum() > offcut.pitch_px**2


def test_the_command_judges_each_picture(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--kinds", "undisturbed", "--seeds", "1", "--list"]) == 0
    assert "undisturbed 700000 right" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main(["--kinds", "tapes"])
    assert "unknown kinds tapes" in capsys.readouterr().err
