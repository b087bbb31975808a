"""What makes a picture of a block not good enough, measured on the block, whatever the picture's size."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from contour.acceptance.quality import (
    Quality,
    QualityLimits,
    block_quality,
    lost_in_noise,
    picture_faults,
    quality_faults,
)
from contour.geometry.rings import Contour
from contour.walls.lightness import wall_light
from tests.support.pictures.small_scenes import block

LIMITS = QualityLimits()
GOOD = Quality(level=180.0, contrast=120.0, noise=1.5, blur_px=1.4, pitch_px=24.0, clipped_share=0.01)


def measured(picture: np.ndarray, name: str = "rectangle", kind: str = "easy") -> Quality:
    rendered = block(name, kind)
    return block_quality(picture, wall_light(picture), rendered.truth_px, rendered.pitch_px)


@pytest.mark.parametrize("kind", ["easy", "shop", "dim", "dark"])
@pytest.mark.parametrize("name", ["rectangle", "crescent", "holed"])
def test_blocks_that_can_be_traced_are_good_enough(name: str, kind: str) -> None:
    quality = measured(block(name, kind).picture, name, kind)
    assert quality_faults(quality, LIMITS) == ()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"level": 12.0}, ("12 of 255", "at least 16", "light")),
        ({"contrast": 7.0}, ("7.0 grey levels", "at least 8")),
        ({"clipped_share": 0.8}, ("80 %", "at most 70 %", "shorter exposure")),
        ({"blur_px": 3.5}, ("3.5 px", "at most 3.2 px", "focus")),
        ({"blur_px": 2.0, "pitch_px": 8.0}, ("2.0 px", "at most 1.9 px")),
    ],
)
def test_a_fault_tells_the_measured_value_the_limit_and_what_to_do(change: dict, words: tuple[str, ...]) -> None:
    (fault,) = quality_faults(replace(GOOD, **change), LIMITS)
    for word in words:
        assert word in fault


def test_walls_no_higher_than_noise_are_none() -> None:
    assert lost_in_noise(replace(GOOD, contrast=12.1, noise=3.0), LIMITS) is None
    told = lost_in_noise(replace(GOOD, contrast=11.9, noise=3.0), LIMITS)
    assert told is not None
    assert "11.9 grey levels of a noise of 3.0, at least 12.0" in told


def test_all_faults_are_told() -> None:
    assert len(quality_faults(Quality(5.0, 1.0, 1.0, 9.0, 20.0, 0.9), LIMITS)) == 4


def test_defocus_is_seen() -> None:
    picture = block("rectangle").picture
    widths = [measured(cv2.GaussianBlur(picture, (0, 0), sigma)).blur_px for sigma in (0.7, 2.0, 3.5)]
    assert widths == sorted(widths)
    blurred = measured(cv2.GaussianBlur(picture, (0, 0), 0.22 * block("rectangle").pitch_px))
    assert any("blurred" in fault for fault in quality_faults(blurred, LIMITS))


@pytest.mark.parametrize("way", [0, 45, 90])
def test_movement_is_blur_in_its_own_direction(way: float) -> None:
    length = 10
    kernel = np.zeros((2 * length + 1, 2 * length + 1), np.float32)
    along = length * np.array([np.cos(np.radians(way)), np.sin(np.radians(way))])
    ends = [tuple(np.rint(length + sign * along).astype(int).tolist()) for sign in (-1, 1)]
    cv2.line(kernel, *ends, 1.0, 1)
    picture = block("rectangle").picture
    moved = cv2.filter2D(picture, -1, kernel / kernel.sum())
    assert measured(moved).blur_px > 2 * measured(picture).blur_px


def test_the_size_of_the_picture_does_not_matter() -> None:
    """Twice the size is twice the blur and twice the pitch."""
    rendered = block("rectangle")
    twice = cv2.resize(rendered.picture, None, fx=2, fy=2, interpolation=cv2.INTER_CUBIC)
    small = measured(rendered.picture)
    scaled = type(rendered.truth_px)(rendered.truth_px.exterior * 2 + 0.5)
    large = block_quality(twice, wall_light(twice), scaled, 2 * rendered.pitch_px)
    assert large.contrast == pytest.approx(small.contrast, rel=0.15)
    assert large.blur_px / large.pitch_px == pytest.approx(small.blur_px / small.pitch_px, rel=0.5)


@pytest.mark.parametrize("pitch", [24, 45, 90])
def test_crisp_walls_a_pixel_wide_are_seen_however_large_the_cells(pitch: int) -> None:
    picture = np.zeros((12 * pitch, 14 * pitch), np.uint8)
    picture[pitch // 2 :: pitch] = picture[:, pitch // 2 :: pitch] = 255
    edge = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]) * (np.array(picture.shape[::-1]) - 4.0 * pitch)
    quality = block_quality(picture, picture, Contour(edge + 2.0 * pitch), float(pitch))
    assert (quality.level, quality.blur_px > 0.0) == (255.0, True)
    assert quality_faults(quality, LIMITS) == ()


def test_overexposure_counts_on_the_block_and_not_beside_it() -> None:
    picture = block("rectangle").picture.copy()
    picture[:90] = 255
    assert measured(picture).clipped_share < 0.05
    bright = np.clip(block("rectangle").picture.astype(int) * 12, 0, 255).astype(np.uint8)
    assert measured(bright).clipped_share > 0.25


def test_noise_is_that_of_a_pixel() -> None:
    rng = np.random.default_rng(3)
    flat = np.full((480, 640), 90.0)
    noisy = np.clip(np.rint(flat + rng.normal(0, 4, flat.shape)), 0, 255).astype(np.uint8)
    assert measured(noisy).noise == pytest.approx(4.0, rel=0.2)


def test_a_colour_in_which_walls_stand_out_counts() -> None:
    """Walls and cells of one lightness, told apart by colour alone."""
    grey = block("rectangle").picture.astype(np.float32)
    share = (grey - grey.min()) / (grey.max() - grey.min())
    planes = [130 - 90 * share, 130 + 0 * share, 100 + 60 * share]
    picture = np.clip(np.stack(planes, axis=-1), 0, 255).astype(np.uint8)
    assert measured(picture).contrast > 20


@pytest.mark.parametrize(
    ("picture", "word"),
    [
        (np.full((480, 640), 3, np.uint8), "brightest parts reach 3"),
        (np.full((480, 640, 3), 255, np.uint8), "100 % of it is overexposed"),
        (cv2.GaussianBlur(block("rectangle").picture, (0, 0), 9.0), "sharpest edges are blurred"),
    ],
)
def test_a_picture_in_which_nothing_can_be_seen_is_told(picture: np.ndarray, word: str) -> None:
    (fault,) = picture_faults(picture)
    assert word in fault


def test_an_empty_table_is_no_fault_of_the_picture() -> None:
    rng = np.random.default_rng(5)
    table = 60 + rng.normal(0, 2, (480, 640))
    table += 20 * np.sin(np.arange(640) / 200.0)
    assert picture_faults(np.clip(table, 0, 255).astype(np.uint8)) == ()
    scratched = np.clip(table, 0, 255).astype(np.uint8)
    cv2.line(scratched, (50, 60), (500, 400), 160, 1, cv2.LINE_AA)
    assert picture_faults(scratched) == ()
