"""The V4L2 driver against a real kernel's camera; runs in the guest that `make test-camera` boots."""

from __future__ import annotations

import os
import re
import threading
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from contour.tracing.trace import TraceSettings
from contour.tracing.tracing import trace
from drivers.camera import CameraTimeout, CameraUnavailable
from drivers.camera.depth import eight_bits
from drivers.camera.v4l2.camera import V4l2Camera, V4l2Settings
from drivers.camera.v4l2.listing import list_cameras
from tests.support.camera.vivid import (
    BIND,
    CAPTURE,
    OUTPUT,
    PATIENT_S,
    UNBIND,
    ctl,
    hdmi,
    opened,
    set_control,
    shown_on_the_hdmi_input,
    webcam,
)

SAMPLES = Path(__file__).parents[2] / "service" / "samples"
COLOUR_SQUARES, BLACK, WHITE, RED, BLUE, CHECKERS = 4, 5, 6, 7, 9, 14


@pytest.fixture(autouse=True)
def vivid_as_it_was_loaded():
    """Every test begins with an undisturbed webcam that shows plain pictures."""
    ctl("-i", "0")
    for name, value in {"percentage_of_dropped_buffers": 0, "timestamp_source": 0, "test_pattern": 0}.items():
        set_control(name, value)
    set_control("osd_text_mode", 2)
    set_control("gain_automatic", 1)


def grab_on(camera, frames):
    """Grab until something is raised, at most so many frames: trouble may need a moment to show."""
    for _ in range(frames):
        grabbed_now(camera)


def grabbed_now(camera, timeout_s=PATIENT_S):
    asked = time.monotonic()
    frame = camera.grab(asked, timeout_s)
    return frame, frame.exposed_at_s - asked


# --- frames --------------------------------------------------------------------------------------------------------


def test_a_frame_after_three_seconds_of_idling_shows_what_was_there_after_the_trigger():
    set_control("test_pattern", BLACK)
    with opened(webcam(pixel_format="GREY")) as camera:
        assert grabbed_now(camera)[0].pixels.max() < 32
        time.sleep(3)
        set_control("test_pattern", WHITE)
        frame, after_s = grabbed_now(camera)
    assert after_s >= 0
    assert frame.pixels.min() > 200
    assert camera.counts.early > 0


@pytest.mark.parametrize("code", ["Y10", "Y12", "Y16"])
def test_deep_grey_is_the_grey_of_eight_bits_and_more(code):
    set_control("test_pattern", CHECKERS)
    with opened(webcam(pixel_format="GREY")) as camera:
        grey = grabbed_now(camera)[0].pixels
    with opened(webcam(pixel_format=code)) as camera:
        frame = grabbed_now(camera)[0]
    assert frame.deep.dtype == np.uint16
    assert np.abs((frame.deep >> 8).astype(int) - grey).max() <= 1
    np.testing.assert_array_equal(frame.pixels, eight_bits(frame.deep))


@pytest.mark.parametrize("code", ["RGGB", "BA81", "GB10", "BA12", "RG16"])
def test_a_mosaic_has_the_colours_of_the_scene(code):
    for pattern, channel in ((RED, 2), (BLUE, 0)):
        set_control("test_pattern", pattern)
        with opened(webcam(pixel_format=code)) as camera:
            pixels = grabbed_now(camera)[0].pixels
        others = [pixels[4:-4, 4:-4, other] for other in {0, 1, 2} - {channel}]
        assert pixels[4:-4, 4:-4, channel].min() > 200
        assert max(other.max() for other in others) < 40


@pytest.mark.parametrize("source", [0, 1], ids=["end of frame", "start of exposure"])
def test_no_frame_is_taken_that_may_have_begun_before_the_trigger(source):
    set_control("timestamp_source", source)
    with opened(webcam()) as camera:
        for _ in range(10):
            frame, after_s = grabbed_now(camera)
            assert after_s >= 0
            assert not frame.simulated


def test_start_of_exposure_stamps_are_waited_for_one_period_less():
    waits = {}
    for source in (0, 1):
        set_control("timestamp_source", source)
        with opened(webcam(frame_rate=5.0, exposure_s=None)) as camera:
            before = camera.counts.early
            grabbed_now(camera)
            grabbed_now(camera)
            waits[source] = camera.counts.early - before
    assert waits[1] < waits[0]


@pytest.mark.parametrize("code", ["GREY", "YUYV", "UYVY", "NV12", "BGR3", "RGB3"])
def test_every_pixel_format_shows_the_same_colours(code):
    set_control("test_pattern", COLOUR_SQUARES)
    with opened(webcam(pixel_format="BGR3")) as camera:
        expected = grabbed_now(camera)[0].pixels.astype(int)
    with opened(webcam(pixel_format=code)) as camera:
        pixels = grabbed_now(camera)[0].pixels.astype(int)
    if code == "GREY":
        expected = cv2.cvtColor(expected.astype(np.uint8), cv2.COLOR_BGR2GRAY).astype(int)
    assert pixels.shape == expected.shape
    # YUV colours are rounded, in another range, and shared by neighbours; GREY weighs colours by another standard.
    tolerance = {"BGR3": 1, "RGB3": 1, "GREY": 25}.get(code, 12)
    assert np.median(np.abs(pixels - expected)) <= tolerance


def test_a_rendered_block_comes_through_the_camera_pixel_by_pixel_and_is_traced_the_same(tmp_path):
    sample = cv2.imread(str(next(SAMPLES.glob("*.jpg"))))
    block = cv2.resize(sample, (1280, 720), interpolation=cv2.INTER_AREA)
    with shown_on_the_hdmi_input(block, tmp_path), opened(hdmi()) as camera:
        frame, _ = grabbed_now(camera)
    np.testing.assert_array_equal(frame.pixels, block)
    settings = TraceSettings()
    seen, expected = trace(frame.pixels, settings), trace(block, settings)
    np.testing.assert_array_equal(seen.contour.exterior, expected.contour.exterior)


def test_frames_flagged_as_damaged_are_skipped_and_counted():
    with opened(webcam()) as camera:
        grabbed_now(camera)
        for _ in range(3):
            set_control("inject_v4l2_buf_flag_error", 1)
            asked = time.monotonic() - 1.0  # so that the damaged one, which is on its way, would do by its time
            assert camera.grab(asked, PATIENT_S).exposed_at_s >= asked
            grabbed_now(camera)
        assert camera.counts.bad >= 1


# --- trouble -------------------------------------------------------------------------------------------------------


def test_a_silent_camera_is_a_timeout_that_holds_and_comes_back():
    with opened(webcam()) as camera:
        grabbed_now(camera)
        set_control("percentage_of_dropped_buffers", 100)
        began = time.monotonic()
        with pytest.raises(CameraTimeout, match=r"silent|too early"):
            grabbed_now(camera, 1.0)
        assert 1.0 <= time.monotonic() - began < 20.0
        set_control("percentage_of_dropped_buffers", 0)
        assert grabbed_now(camera)[1] >= 0


def test_a_fatal_error_of_the_stream_closes_the_camera_and_opening_brings_it_back():
    camera = webcam()
    with opened(camera):
        grabbed_now(camera)
        set_control("inject_fatal_streaming_error", 1)
        with pytest.raises(CameraUnavailable):
            grab_on(camera, 20)
        camera.open()
        assert grabbed_now(camera)[1] >= 0


def test_a_disconnected_camera_has_gone_and_its_settings_are_written_again_when_it_is_back():
    camera = webcam(controls={"gain_automatic": 0, "gain": 77})
    with opened(camera):
        grabbed_now(camera)
        set_control("disconnect", 1)
        with pytest.raises(CameraUnavailable, match=r"has gone.*Check its cable"):
            grab_on(camera, 20)
        assert camera.opened is None
        set_control("gain", 10)
        camera.open()
        assert grabbed_now(camera)[1] >= 0
        assert "gain: 77" in ctl("-C", "gain")


def test_a_camera_whose_driver_is_unbound_is_gone_and_comes_back_with_it():
    camera = webcam()
    with opened(camera):
        grabbed_now(camera)
        unbinding = threading.Thread(target=UNBIND.write_text, args=("vivid.0",))
        unbinding.start()
        with pytest.raises(CameraUnavailable):
            grab_on(camera, 50)
        unbinding.join(PATIENT_S)
        with pytest.raises(CameraUnavailable, match="No such file"):
            camera.open()
        BIND.write_text("vivid.0")
        began = time.monotonic()
        while True:
            try:
                camera.open()
                break
            except CameraUnavailable:
                assert time.monotonic() - began < PATIENT_S
                time.sleep(0.05)
        assert grabbed_now(camera)[1] >= 0


# --- requests that the driver does not fulfil ----------------------------------------------------------------------


def refusal(camera):
    with pytest.raises(CameraUnavailable) as refused, opened(camera):
        pass
    assert camera.opened is None
    return str(refused.value)


def test_a_size_that_the_driver_changes_is_refused_with_what_there_is():
    text = refusal(webcam(width=641, height=361))
    assert "asked for 641 x 361 YUYV, the driver gives" in text
    assert "640 x 360" in text


def test_a_rate_that_the_driver_changes_is_refused_with_what_there_is():
    text = refusal(webcam(width=1920, height=1080, frame_rate=59.0))
    assert "asked for 59 frames a second" in text
    assert "There is:" in text


def test_a_format_that_nobody_reads_is_refused():
    assert "expected one of GREY, YUYV" in refusal(webcam(pixel_format="RGBP"))
    assert "MJPG, the driver gives" in refusal(webcam(pixel_format="MJPG"))


@pytest.mark.parametrize(
    ("controls", "text"),
    [
        ({"gain": 300}, r"control gain = 300; expected 0 to 255"),
        ({"test_pattern": 99}, r"expected 0 \(75% Colorbar\)"),
        ({"shutter": 1}, r"no control 'shutter'; there are: .*brightness"),
        ({"button": 1}, r"of kind button"),
        ({"read_only_integer_32_bits": 1}, r"read-only"),
        ({"gain": 50}, r"gain = 50 does not hold, it is inactive.*gain_automatic: 0"),
    ],
)
def test_a_control_that_does_not_hold_is_refused_with_its_range_or_cause(controls, text):
    assert re.search(text, refusal(webcam(controls=controls)))


def test_an_automatic_is_switched_off_before_the_value_it_would_hold_whatever_their_order():
    with opened(webcam(controls={"gain": 50, "gain_automatic": 0})) as camera:
        assert camera.opened.controls == {"gain_automatic": 0, "gain": 50}


def test_an_input_that_is_not_there_and_one_without_signal_are_told():
    assert "no input 7; there are 0 (Webcam 0), 1 (HDMI 0)" in refusal(webcam(input=7))
    ctl("-i", "1")
    set_control("dv_timings_signal_mode", 1)
    try:
        assert "no signal on its input HDMI 0" in refusal(hdmi())
    finally:
        set_control("dv_timings_signal_mode", 0)


def test_a_node_that_captures_nothing_is_refused():
    assert "captures no video" in refusal(webcam(device=OUTPUT))


def test_a_camera_in_use_names_how_to_find_the_other_program():
    with opened(webcam()):
        assert f"fuser -v {CAPTURE}" in refusal(webcam())


def test_a_device_file_without_permission_names_its_group():
    os.chmod(CAPTURE, 0o600)
    child = os.fork()
    if child == 0:
        os.setuid(65534)
        try:
            V4l2Camera(V4l2Settings(CAPTURE, 640, 360)).open()
        except CameraUnavailable as error:
            os._exit(0 if "usermod -aG root" in str(error) else 3)
        finally:
            os._exit(4)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


# --- what there is -------------------------------------------------------------------------------------------------


def test_the_list_of_cameras_agrees_with_v4l2_ctl():
    cameras = list_cameras()
    assert [camera.device for camera in cameras] == [CAPTURE]
    camera = cameras[0]
    theirs = [code.strip() for code in re.findall(r"'(.{4})(?:-BE)?'", ctl("--list-formats"))]
    assert [entry.code.removesuffix("-BE") for entry in camera.formats] == theirs
    for name, value in re.findall(r"^\s+(\w+) 0x\w+ \(int\).* value=(-?\d+)", ctl("-l"), re.MULTILINE):
        if name != "gain":  # its automatic moves it
            assert next(control.value for control in camera.controls if control.name == name) == int(value)


def test_thousands_of_frames_leave_memory_and_descriptors_as_they_were():
    frames = int(os.environ.get("COMBTRACE_CAMERA_FRAMES", "1500"))
    with opened(webcam(width=320, height=180, frame_rate=None)) as camera:
        for _ in range(100):
            camera.grab(0.0, PATIENT_S)
        began = resident_bytes(), len(os.listdir("/proc/self/fd"))
        for _ in range(frames):
            camera.grab(0.0, PATIENT_S)
        assert len(os.listdir("/proc/self/fd")) == began[1]
        assert resident_bytes() - began[0] < 4_000_000


def resident_bytes():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
