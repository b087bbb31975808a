"""What the network tells of walls, comb and things over it, on a table as light as the walls."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from contour.image.opencv import grey
from contour.segmentation.network import PITCH_PX, Segments, segments
from contour.synthetic import area_coverage, render, truth_px
from tests.support.scenes.shop_floor_scenes import shop_floor_scene


def agreed(seen: Segments, rings: tuple[np.ndarray, ...], shape: tuple[int, ...]) -> float:
    """Intersection over union of what is told to be comb and what is."""
    height, width = seen.comb.shape
    scale = np.array([width / shape[1], height / shape[0]])
    true = area_coverage(tuple((ring + 0.5) * scale - 0.5 for ring in rings), width, height) > 0.5
    told = seen.comb > 0.5
    return float(np.count_nonzero(true & told) / np.count_nonzero(true | told))


@pytest.mark.parametrize("kind", ["wood", "brushed", "old_cuts", "cork"])
@pytest.mark.parametrize("sized", [0.8, 1.0, 1.25])
def test_comb_is_told_from_a_table_as_light_as_its_walls_also_where_its_pitch_is_little_known(
    kind: str, sized: float
) -> None:
    scene = shop_floor_scene(kind, 95_000_003, alone=True).scene
    rendered = render(scene)
    seen = segments(grey(rendered.picture), sized * rendered.pitch_px)
    assert agreed(seen, truth_px(scene).rings, rendered.picture.shape) > 0.93


def test_maps_have_cells_of_one_size_and_sides_that_can_be_halved() -> None:
    seen = segments(np.full((601, 803), 90, np.uint8), 2.0 * PITCH_PX)
    assert seen.wall.shape == seen.comb.shape == seen.thing.shape == (304, 400)


def test_what_is_told_is_the_same_with_one_thread_and_two() -> None:
    light = grey(render(shop_floor_scene("wood", 95_000_003, alone=True).scene).picture)
    before = cv2.getNumThreads()
    try:
        told = []
        for threads in (1, 2):
            cv2.setNumThreads(threads)
            told.append(segments(light, 30.0))
    finally:
        cv2.setNumThreads(before)
    assert all(np.array_equal(getattr(told[0], name), getattr(told[1], name)) for name in ("wall", "comb", "thing"))
