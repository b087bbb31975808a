"""The V4L2 driver on the kernel's driver for USB webcams, which drives a webcam that the test itself plugs in."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from drivers.camera import CameraTimeout, CameraUnavailable
from drivers.camera.v4l2.listing import list_cameras
from tests.support.camera.usb_webcam import HEIGHT, SERIAL, WIDTH, Webcam
from tests.support.camera.vivid import PATIENT_S, ctl, opened
from tests.support.camera.webcam_scene import Scene, camera_on, node_of_the_webcam


@pytest.fixture
def scene():
    return Scene()


@pytest.fixture
def plugged(scene):
    """A webcam in the socket, and its node."""
    subprocess.run(["/bin/busybox", "modprobe", "uvcvideo"], check=True)
    webcam = Webcam(scene.encode)
    webcam.plug_in()
    webcam.node = node_of_the_webcam()
    try:
        yield webcam
    finally:
        webcam.pull_out()
        gone(webcam.node)


def gone(node, within_s=PATIENT_S):
    began = time.monotonic()
    while Path(node).exists():
        assert time.monotonic() - began < within_s
        time.sleep(0.02)


def grabbed(camera, timeout_s=PATIENT_S):
    return camera.grab(time.monotonic(), timeout_s)


def grab_on(camera, frames):
    for _ in range(frames):
        grabbed(camera)


def test_it_is_listed_once_with_its_serial_number_formats_and_controls(plugged):
    camera = next(found for found in list_cameras() if found.device == plugged.node)
    assert camera.identity.driver == "uvcvideo"
    assert camera.identity.serial == SERIAL
    assert [(entry.code, entry.usable) for entry in camera.formats] == [("MJPG", True), ("YUYV", True)]
    assert {control.name for control in camera.controls} >= {"auto_exposure", "exposure_time_absolute", "gain"}


@pytest.mark.parametrize("pixel_format", ["MJPG", "YUYV"])
@pytest.mark.parametrize("rate", [30.0, 10.0])
def test_no_frame_is_taken_that_began_to_be_exposed_before_the_trigger(plugged, scene, pixel_format, rate):
    with opened(camera_on(plugged.node, pixel_format=pixel_format, frame_rate=rate)) as camera:
        for number in range(8):
            time.sleep(0.02 + 0.61 * number % 1 / rate)
            plugged.late_s, asked = 0.0, time.monotonic()
            frame = camera.grab(asked, PATIENT_S)
            began = scene.exposure_of(frame.pixels)
            assert began >= asked - plugged.late_s
            assert frame.exposed_at_s <= began + plugged.late_s + 0.002  # the picture is not called newer than it is


@pytest.mark.parametrize("latency_s", [0.0, 0.15], ids=["latency not told", "latency told"])
def test_a_camera_that_keeps_its_frames_back_is_only_waited_for_if_that_is_told(plugged, scene, latency_s):
    plugged.lag_s = 0.15
    late = 0
    with opened(camera_on(plugged.node, latency_s=latency_s)) as camera:
        for _ in range(6):
            asked = time.monotonic()
            late += scene.exposure_of(camera.grab(asked, PATIENT_S).pixels) < asked
    assert (late > 0) == (latency_s == 0)


def test_padding_behind_a_jpeg_does_no_harm(plugged, scene):
    scene.padding = bytes(3000)
    with opened(camera_on(plugged.node)) as camera:
        assert grabbed(camera).pixels.shape[:2] == (HEIGHT, WIDTH)


def test_torn_jpegs_are_skipped_and_counted(plugged, scene):
    with opened(camera_on(plugged.node)) as camera:
        grabbed(camera)
        scene.torn = 12
        frame = grabbed(camera)
        assert np.ptp(frame.pixels) <= 4
        assert camera.counts.bad > 0


def test_frames_that_the_camera_flags_as_damaged_are_not_handed_out(plugged, scene):
    with opened(camera_on(plugged.node)) as camera:
        grabbed(camera)
        scene.damaged = 12
        for _ in range(4):
            assert grabbed(camera).pixels.max() < 252
        assert scene.damaged == 0


def test_exposure_under_its_automatic_is_refused_and_holds_without(plugged):
    with pytest.raises(CameraUnavailable, match=r"exposure_time_absolute.*auto_exposure"):
        camera_on(plugged.node, controls={"exposure_time_absolute": 80}).open()
    controls = {"exposure_time_absolute": 80, "auto_exposure": 1, "gain": 7}
    with opened(camera_on(plugged.node, controls=controls)) as camera:
        assert camera.opened.controls == controls
        assert camera.opened.exposure_s == 0.008
        grabbed(camera)
        assert "exposure_time_absolute: 80" in ctl("-C", "exposure_time_absolute", device=plugged.node)


def test_one_that_is_pulled_out_and_plugged_in_again_has_its_settings_again(plugged):
    camera = camera_on(plugged.node, controls={"auto_exposure": 1, "exposure_time_absolute": 80})
    with opened(camera):
        grabbed(camera)
        plugged.pull_out()
        with pytest.raises(CameraUnavailable, match="has gone"):
            grab_on(camera, 20)
        gone(plugged.node)
        plugged.plug_in()
        assert node_of_the_webcam() == plugged.node
        assert "auto_exposure: 3 " in ctl("-C", "auto_exposure", device=plugged.node)
        camera.open()
        grabbed(camera)
        assert camera.opened.exposure_s == 0.008


def test_a_silent_one_is_a_timeout_and_comes_back(plugged):
    with opened(camera_on(plugged.node)) as camera:
        grabbed(camera)
        plugged.silent = True
        with pytest.raises(CameraTimeout, match=r"silent|too early"):
            grabbed(camera, 1.0)
        plugged.silent = False
        grabbed(camera)
