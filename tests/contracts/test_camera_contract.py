"""What every camera driver promises. A new driver joins by one entry in CAMERAS."""

from __future__ import annotations

import functools
import os
import time
from contextlib import ExitStack

import cv2
import numpy as np
import pytest

from contour.synthetic import render
from drivers.camera import CameraTimeout, CameraUnavailable, Frame
from drivers.camera.averaging import AveragingCamera
from drivers.camera.files.camera import FileCamera
from drivers.camera.genicam.camera import GenicamCamera
from drivers.camera.genicam.settings import GenicamSettings
from drivers.camera.simulated import SimulatedCamera
from drivers.camera.v4l2.camera import V4l2Camera, V4l2Settings
from tests.support.gige_camera import GigeCamera, aravis_is_loaded, need_aravis
from tests.support.scenes.sample_scenes import sample_scenes

__all__ = ["aravis_is_loaded"]
PATIENT_S = 60.0  # a camera of an emulated machine is among them


def picture(number):
    """A picture that tells frames apart."""
    return np.full((48, 64), number % 256, np.uint8)


def folder_camera(tmp_path, _stack):
    for number in range(1, 4):
        cv2.imwrite(str(tmp_path / f"{number}.png"), picture(number))
    return FileCamera(tmp_path, loop=True)


def single_file_camera(tmp_path, _stack):
    cv2.imwrite(str(tmp_path / "only.png"), cv2.merge([picture(1)] * 3))
    return FileCamera(tmp_path / "only.png", loop=True)


def vivid_camera(_tmp_path, _stack):
    return V4l2Camera(V4l2Settings("/dev/video0", 640, 360, frame_rate=30.0, input=0, exposure_s=0.0))


@functools.cache
def blocks():
    """Rendered blocks."""
    return [render(scene).picture[:480, :640] for scene in sample_scenes()[:2]]


def gige_camera(trigger):
    """Aravis' fake on loopback, serving pictures of blocks through real sockets."""

    def make(tmp_path, stack):
        need_aravis()
        stack.enter_context(GigeCamera(tmp_path, blocks(), serial="GV7"))
        return GenicamCamera(GenicamSettings("GV7", width=640, height=480, exposure_us=2000, trigger=trigger))

    return make


CAMERAS = {
    "folder": folder_camera,
    "single file": single_file_camera,
    "simulated": lambda *_: SimulatedCamera(picture),
    "averaging": lambda *_: AveragingCamera(SimulatedCamera(lambda _number: picture(7)), 3),
    "genicam": gige_camera("software"),
    "genicam, running freely": gige_camera("free"),
}
if os.environ.get("COMBTRACE_CAMERA_GUEST"):
    CAMERAS["v4l2"] = vivid_camera


@pytest.fixture(params=CAMERAS.values(), ids=CAMERAS.keys())
def camera(request, tmp_path):
    with ExitStack() as stack:
        made = request.param(tmp_path, stack)
        stack.callback(made.close)
        yield made


def test_a_frame_is_a_grey_or_bgr_picture_of_bytes(camera):
    camera.open()
    frame = camera.grab(0.0, PATIENT_S)
    assert isinstance(frame, Frame)
    assert frame.pixels.dtype == np.uint8
    assert frame.pixels.ndim == 2 or frame.pixels.shape[2:] == (3,)
    assert frame.pixels.flags.c_contiguous
    assert frame.source
    assert isinstance(frame.simulated, bool)


def test_a_frame_is_exposed_at_or_after_the_time_asked_for(camera):
    camera.open()
    for ahead_s in (0.0, 0.02):
        asked = time.monotonic() + ahead_s
        frame = camera.grab(asked, PATIENT_S)
        assert asked <= frame.exposed_at_s <= time.monotonic()


def test_sequence_numbers_rise_from_1(camera):
    camera.open()
    numbers = [camera.grab(0.0, PATIENT_S).sequence for _ in range(4)]
    assert numbers[0] == 1
    assert numbers == sorted(set(numbers))


def test_a_frame_asked_for_beyond_the_time_out_is_a_timeout_and_the_next_one_comes(camera):
    camera.open()
    with pytest.raises(CameraTimeout, match="expected"):
        camera.grab(time.monotonic() + 3600.0, 0.01)
    assert camera.grab(0.0, PATIENT_S).sequence >= 1


def test_a_frame_stays_as_it_is_when_the_next_one_comes(camera):
    camera.open()
    first = camera.grab(0.0, PATIENT_S).pixels
    before = first.copy()
    camera.grab(0.0, PATIENT_S)
    np.testing.assert_array_equal(first, before)


def test_a_closed_camera_gives_no_frame(camera):
    with pytest.raises(CameraUnavailable, match="not open"):
        camera.grab(0.0, 1.0)
    camera.open()
    camera.grab(0.0, PATIENT_S)
    camera.close()
    with pytest.raises(CameraUnavailable, match="not open"):
        camera.grab(0.0, 1.0)


def test_opening_and_closing_twice_does_nothing_more(camera):
    camera.close()
    camera.open()
    camera.grab(0.0, PATIENT_S)
    camera.open()
    assert camera.grab(0.0, PATIENT_S).sequence == 2
    camera.close()
    camera.close()


def test_a_camera_can_be_opened_again(camera):
    camera.open()
    camera.grab(0.0, PATIENT_S)
    camera.close()
    camera.open()
    assert camera.grab(0.0, PATIENT_S).sequence == 2


def test_a_check_takes_no_frame_and_finds_an_open_camera_well(camera):
    with pytest.raises(CameraUnavailable, match="not open"):
        camera.check()
    camera.open()
    camera.grab(0.0, PATIENT_S)
    camera.check()
    assert camera.grab(0.0, PATIENT_S).sequence == 2
