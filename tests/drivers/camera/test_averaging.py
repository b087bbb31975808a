from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.camera import CameraTimeout, FrameUnusable, SceneMoved
from drivers.camera.averaging import AveragingCamera
from drivers.camera.simulated import SimulatedCamera
from drivers.camera.stillness import movement

HEIGHT, WIDTH = 256, 320


def comb(shift=0.0):
    """Bright thin walls every 24 px on a dark table, moved to the right by a part of a pixel."""
    x = np.arange(WIDTH) - shift
    walls = 40 + 150 * np.exp(-(((x + 12) % 24 - 12) ** 2) / 4)
    y = np.arange(HEIGHT)
    floors = 60 * np.exp(-(((y + 14) % 28 - 14) ** 2) / 4)
    return walls[None, :] + floors[:, None]


def noisy(scene, seed, sigma=4.0):
    return np.clip(np.random.default_rng(seed).normal(scene, sigma), 0, 255).astype(np.uint8)


def averaging(pictures, count):
    """A camera over these pictures, one after the other."""
    camera = AveragingCamera(SimulatedCamera(lambda number: pictures[(number - 1) % len(pictures)]), count)
    camera.open()
    return camera


def test_the_mean_of_a_still_scene_has_less_noise():
    frame = averaging([noisy(comb(), seed) for seed in range(8)], 8).grab(0.0, 5.0)
    left = np.std(frame.pixels.astype(float) - np.clip(comb(), 0, 255))
    assert left < 4.0 / np.sqrt(8) * 1.3
    assert frame.pixels.dtype == np.uint8


def test_a_mean_is_rounded_to_the_nearest():
    camera = averaging([np.full((64, 64), grey, np.uint8) for grey in (10, 10, 11, 11)], 4)
    assert (camera.grab(0.0, 5.0).pixels == 11).all()
    assert (averaging([np.full((64, 64), 255, np.uint8)], 64).grab(0.0, 5.0).pixels == 255).all()


def test_the_first_frames_exposure_is_the_means():
    times = iter([1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0])
    camera = AveragingCamera(SimulatedCamera(lambda _n: noisy(comb(), 1), now=lambda: next(times)), 2)
    camera.open()
    assert camera.grab(0.0, 50.0).exposed_at_s == 1.0


@pytest.mark.parametrize("shift", [0.5, 1.0, 3.0, 11.0])
def test_a_scene_that_moves_meanwhile_is_refused(shift):
    pictures = [noisy(comb(), 1), noisy(comb(), 2), noisy(comb(shift), 3), noisy(comb(), 4)]
    with pytest.raises(SceneMoved, match=r"frames 1 and 3; expected a still scene"):
        averaging(pictures, 4).grab(0.0, 5.0)


def test_a_hand_that_comes_in_is_refused():
    scene = comb()
    cv2.ellipse(scene, (250, 200), (60, 40), 20, 0, 360, 120, -1)
    with pytest.raises(SceneMoved, match="frames 1 and 2"):
        averaging([noisy(comb(), 1), noisy(scene, 2)], 2).grab(0.0, 5.0)


def test_a_moved_scene_is_a_kind_of_unusable_frame():
    assert issubclass(SceneMoved, FrameUnusable)


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), sigma=st.floats(0.5, 12), light=st.floats(0.93, 1.07), colour=st.booleans())
def test_noise_and_flicker_are_no_movement(seed, sigma, light, colour):
    before, after = noisy(comb(), seed, sigma), noisy(comb() * light, seed + 1, sigma)
    if colour:
        before, after = cv2.merge([before] * 3), cv2.merge([after] * 3)
    assert movement(before, after) is None


def test_a_table_without_any_texture_is_still():
    flat = np.full((HEIGHT, WIDTH), 90.0)
    assert movement(noisy(flat, 1), noisy(flat, 2)) is None
    black = np.zeros((HEIGHT, WIDTH), np.uint8)
    assert movement(black, black) is None


def test_a_movement_is_told_by_its_size():
    assert "moved by 1.0 px" in movement(noisy(comb(), 1, 1.0), noisy(comb(1.0), 2, 1.0))


def test_frames_that_do_not_come_in_time_are_a_timeout_that_counts_them():
    now = [0.0]

    def slow(_number):
        now[0] += 0.4
        return noisy(comb(), 1)

    camera = AveragingCamera(SimulatedCamera(slow, now=lambda: now[0]), 4, now=lambda: now[0])
    camera.open()
    with pytest.raises(CameraTimeout, match="3 of 4 frames within 1 s"):
        camera.grab(0.0, 1.0)


def test_frames_of_another_size_are_no_still_scene():
    with pytest.raises(SceneMoved, match="another size"):
        averaging([np.zeros((64, 64), np.uint8), np.zeros((64, 80), np.uint8)], 2).grab(0.0, 5.0)


def test_averaging_fewer_than_two_frames_is_no_averaging():
    with pytest.raises(ValueError, match="expected at least 2"):
        AveragingCamera(SimulatedCamera(lambda _n: noisy(comb(), 1)), 1)
