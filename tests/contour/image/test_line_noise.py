"""Offsets of whole rows or columns are taken out; what lies in view is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from contour.geometry.arrays import Bytes
from contour.image.line_noise import without_line_noise
from contour.synthetic import Rendered, render
from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from tests.support.scenes.metrics import agreement
from tests.support.scenes.random_scenes import random_scene
from tests.support.scenes.trials import calibration_for


def with_row_noise(picture: Bytes, seed: int, levels: float = 6.0) -> Bytes:
    """The picture with an offset to each row, of this standard deviation."""
    offsets = np.random.default_rng([seed, 3]).normal(0.0, levels, (picture.shape[0], *[1] * (picture.ndim - 1)))
    return np.clip(np.rint(picture + offsets), 0, 255).astype(np.uint8)


def rendered(seed: int) -> Rendered:
    return render(random_scene(seed).scene)


# Refused, or traced more than half a cell off, while rows kept their offsets.
@pytest.mark.parametrize("seed", [610_003, 610_005, 610_011])
def test_block_behind_row_noise_is_traced_as_without(seed: int) -> None:
    clean = rendered(seed)
    rectifier = calibration_for(clean.camera).rectifier(clean.thickness_mm)
    found = trace(with_row_noise(clean.picture, seed), TraceSettings(), rectifier=rectifier)
    apart = agreement(found.contour, clean.truth_px, rectifier=rectifier)
    assert apart.mean_px < 0.5
    assert apart.hausdorff_px < 0.5 * clean.pitch_px


@pytest.mark.parametrize("turned", [False, True])
def test_offsets_are_gone_to_half_a_level_of_their_neighbours(turned: bool) -> None:
    clean = rendered(610_001).picture
    clean = np.ascontiguousarray(clean.T) if turned else clean
    noisy = with_row_noise(clean, 1) if not turned else with_row_noise(clean.T, 1).T
    left = (without_line_noise(noisy).astype(float) - clean).mean(axis=0 if turned else 1)
    assert float(np.std(np.diff(left))) < 0.7
    assert float(np.std(left)) < 1.5


def test_each_channel_has_offsets_of_its_own() -> None:
    clean = rendered(610_002).picture
    colour = np.stack([with_row_noise(clean, seed) for seed in (1, 2, 3)], axis=-1)
    left = (without_line_noise(colour).astype(float) - clean[..., None]).mean(axis=1)
    assert float(np.std(np.diff(left, axis=0))) < 0.7


@pytest.mark.parametrize("seed", [610_001, 610_003, 610_004])
def test_picture_without_row_noise_is_handed_through(seed: int) -> None:
    picture = rendered(seed).picture
    assert without_line_noise(picture) is picture
    colour = np.stack([picture] * 3, axis=-1)
    assert without_line_noise(colour) is colour


def test_slots_along_the_rows_stay_as_they_are() -> None:
    """A table's rows that are darker all along are no noise: they do not run on through the block."""
    scene = random_scene(610_001).scene
    picture = render(replace(scene, table=replace(scene.table, level=0.4))).picture.copy()
    rows = np.random.default_rng(4).normal(0.0, 12.0, (picture.shape[0], 1))
    outside = np.zeros(picture.shape, np.bool_)
    side = picture.shape[1] // 4
    outside[:, :side] = outside[:, -side:] = True
    striped = np.where(outside, np.clip(picture + rows, 0, 255), picture).astype(np.uint8)
    assert without_line_noise(striped) is striped


def test_small_picture_is_handed_through() -> None:
    picture = with_row_noise(np.full((24, 24), 90, np.uint8), 5)
    assert without_line_noise(picture) is picture
