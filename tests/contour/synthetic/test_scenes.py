"""The bench's scenes are what they say: named once, in the frame, within the bounds that make them traceable."""

import numpy as np
import pytest
import shapely

from contour.synthetic import pitch_px, truth_px
from tests.support.scenes.bench_scenes import DIM_BELOW, contrast_to_noise, measured_scenes, tuned_scenes
from tests.support.scenes.random_scenes import BORDER_PX, random_scene

MEASURED, TUNED = measured_scenes(), tuned_scenes()


def margin(scene):
    """Least distance of the outline to the picture's border, pixels."""
    ring = truth_px(scene).exterior
    camera = scene.camera
    return min(ring.min(), camera.width - 1 - ring[:, 0].max(), camera.height - 1 - ring[:, 1].max())


def test_at_least_thirty_scenes_are_measured_and_none_of_them_is_tuned():
    assert len(MEASURED) >= 30
    assert not any(scene.tuned or scene.name.startswith("tuned-") for scene in MEASURED)
    assert all(scene.tuned and scene.name.startswith("tuned-") for scene in TUNED)


def test_names_and_seeds_differ():
    names = [scene.name for scene in MEASURED + TUNED]
    assert len(set(names)) == len(names)
    seeds = [scene.scene.seed for scene in MEASURED + TUNED]
    assert len(set(seeds)) == len(seeds)


@pytest.mark.parametrize("scene", MEASURED + TUNED, ids=lambda scene: scene.name)
def test_every_block_lies_in_the_frame_and_shows_cells_of_6_to_150_px(scene):
    assert margin(scene.scene) >= 12.0
    assert 5.9 <= pitch_px(scene.scene) <= 151.0


# Contrast in lightness says nothing where colour separates.
GREY = [scene for scene in MEASURED + TUNED if not scene.scene.sensor.colour]


@pytest.mark.parametrize("scene", GREY, ids=lambda scene: scene.name)
def test_a_scene_is_labelled_dim_where_its_darkest_walls_hardly_stand_out_of_the_noise(scene):
    assert scene.dim == (contrast_to_noise(scene.scene) < DIM_BELOW)


def test_the_kinds_asked_for_are_all_there():
    kinds = {scene.scene.cells.kind for scene in MEASURED}
    assert kinds >= {"honeycomb", "irregular", "foam", "perforated"}
    assert max(scene.scene.camera.width * scene.scene.camera.height for scene in MEASURED) == 12_000_000
    assert any(scene.scene.sensor.colour for scene in MEASURED)
    assert any(scene.scene.clutter.neighbours for scene in MEASURED)
    assert {scene.scene.edge for scene in MEASURED} == {"cut", "cells"}


def test_three_hundred_random_scenes_keep_their_bounds():
    pitches = []
    for seed in range(300):
        scene = random_scene(seed).scene
        assert shapely.Polygon(scene.outline.exterior, scene.outline.holes).is_valid
        assert margin(scene) >= BORDER_PX
        scale = scene.camera.mm_per_px((0.0, 0.0), scene.thickness_mm)
        assert scene.cells.wall_mm / scale > 0.8
        pitches.append(pitch_px(scene))
        assert contrast_to_noise(scene) > 6.0
    assert 7.0 < min(pitches) < 12.0
    assert 55.0 < max(pitches) < 110.0
    assert np.median(pitches) > 12.0


def test_the_same_seed_gives_the_same_random_scene():
    one, two = random_scene(7).scene, random_scene(7).scene
    assert np.array_equal(one.outline.exterior, two.outline.exterior)
    assert (one.cells, one.light, one.camera) == (two.cells, two.light, two.camera)
