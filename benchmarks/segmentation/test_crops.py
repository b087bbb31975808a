"""What the network is taught with: examples, the same for the same seed, and parts of them that say what is so."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.segmentation.crops import Crop, crop
from benchmarks.segmentation.examples import Example, example
from benchmarks.segmentation.planes import SIZE
from contour.segmentation.network import PITCH_PX
from contour.walls.cell_scale import probe

OWN, BY_ANOTHER = 96_000_002, 96_000_003


@pytest.fixture(scope="module", params=[OWN, BY_ANOTHER])
def seed(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture(scope="module")
def one(seed: int) -> Example:
    return example(seed)


def test_an_example_has_cells_of_about_the_size_that_is_learnt_and_walls_within_comb(one: Example) -> None:
    drawn = np.where(one.comb > 127, one.wall, 0).astype(np.uint8)
    assert probe(drawn, "bright").pitch_px == pytest.approx(PITCH_PX, rel=0.3)
    assert one.picture.shape[:2] == one.wall.shape == one.comb.shape == one.thing.shape
    assert np.count_nonzero(one.wall[one.comb == 0]) == 0


def test_an_example_is_the_same_for_the_same_seed(one: Example, seed: int) -> None:
    again = example(seed)
    assert all(
        np.array_equal(getattr(one, name), getattr(again, name))
        for name in ("picture", "wall", "comb", "thing", "seam")
    )


@pytest.mark.parametrize("holed", [False, True])
def test_of_a_crop_no_pixel_is_comb_and_a_thing_over_it_or_wall_without_comb(one: Example, holed: bool) -> None:
    rng = np.random.default_rng(4)
    seen: list[Crop] = [crop(one, rng, holed=holed) for _ in range(60)]
    for part in seen:
        assert all(plane.shape == (SIZE, SIZE) and plane.dtype == np.float32 for plane in part)
        assert all(plane.min() >= 0.0 and plane.max() <= 1.0 for plane in part[1:])
        assert (part.comb + part.thing).max() <= 1.0 + 1e-6
        assert (part.wall <= part.comb + 0.02).all()
    assert sum(part.thing.max() > 0.9 for part in seen) >= 5
    assert sum(part.comb.max() > 0.9 for part in seen) >= 40
    assert sum(part.seam.max() > 0.9 for part in seen) >= 3
    assert sum(part.seam.max() < 0.1 for part in seen) >= 3


def test_crops_that_are_holed_have_more_things_in_their_middle(one: Example) -> None:
    def laid(*, holed: bool) -> int:
        rng = np.random.default_rng(4)
        middles = [crop(one, rng, holed=holed).thing[64:128, 64:128] for _ in range(60)]
        return sum(bool(middle.mean() > 0.3) for middle in middles)

    assert laid(holed=True) >= 2 * laid(holed=False) > 0
