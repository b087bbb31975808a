"""A slab of foam, told by being rough all over and sawn, is traced without its shadow; what is neither is refused."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.geometry.agreement import agreement
from contour.synthetic import render
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from service.reasons import Reason
from tests.support.scenes.foam import foam_slab
from tests.support.scenes.shop_floor_scenes import shop_floor_scene
from tests.support.scenes.trials import measured


@pytest.mark.parametrize("seed", [112, 117], ids=["a hard shadow along two sides", "bubbles as light as the table"])
def test_a_slab_of_foam_is_traced_within_its_bound(seed: int) -> None:
    # The outline around all that differs from the table is 15 and 20 px off where 95 % of it lie.
    slab = foam_slab(seed)
    found = Measurer(None).measure(slab.picture, PlainRecipe(), 0.0)
    assert (found.reasons, found.edge) == ((), "cut")
    assert found.pixels is not None
    assert found.uncertainty_px is not None
    near = agreement(found.pixels, slab.outline)
    assert near.holds(found.uncertainty_px)
    assert near.mean_px < 1.5


def test_a_heap_as_rough_as_foam_is_refused_as_no_block() -> None:
    found = Measurer(None).measure(foam_slab(105, heap=True).picture, PlainRecipe(), 0.0)
    assert Reason.NO_BLOCK_FOUND in found.reasons


def test_a_printed_code_is_flat_between_its_borders_and_no_foam() -> None:
    rng = np.random.default_rng(3)
    picture = np.full((600, 700), 205.0)
    picture[110:470, 120:540] = np.kron(rng.integers(0, 2, (24, 28)) * 140.0 + 40.0, np.ones((15, 15)))
    seen = cv2.GaussianBlur(picture, (0, 0), 0.9) + rng.normal(0.0, 1.5, picture.shape)
    found = Measurer(None).measure(np.clip(seen, 0, 255).astype(np.uint8), PlainRecipe(), 0.0)
    assert Reason.NO_BLOCK_FOUND in found.reasons


def test_a_slab_of_which_a_point_is_left_is_none() -> None:
    """Beside a blurred block with writing; nothing is divided by how long its outline is."""
    assert measured(render(shop_floor_scene("writing", 3_910_011).scene)).reasons
