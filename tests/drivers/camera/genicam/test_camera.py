"""The driver over real sockets, on Aravis' fake GigE Vision camera."""

from __future__ import annotations

import logging
import threading
import time

import numpy as np
import pytest

from drivers.camera import CameraError, CameraRefused, CameraTimeout, CameraUnavailable
from drivers.camera.depth import eight_bits
from drivers.camera.genicam.camera import GenicamCamera
from drivers.camera.genicam.listing import list_cameras
from drivers.camera.genicam.settings import GenicamSettings
from tests.support.gige_camera import GigeCamera, aravis_is_loaded, need_aravis, started_at_s

__all__ = ["aravis_is_loaded"]
WIDTH, HEIGHT, MARK = 320, 240, 8
PICTURES = np.random.default_rng(5).integers(0, 256, (3, HEIGHT * WIDTH)).astype(np.uint8)
PATIENT_S = 20.0


@pytest.fixture
def gige(tmp_path):
    need_aravis()
    with GigeCamera(tmp_path, PICTURES) as camera:
        yield camera


@pytest.fixture
def opened(request):
    """Opens cameras by their settings, and closes them."""
    cameras = []

    def make(**settings):
        settings = {"serial": "GV7", "width": WIDTH, "height": HEIGHT, "exposure_us": 2000, **settings}
        cameras.append(GenicamCamera(GenicamSettings(**settings)))
        cameras[-1].open()
        return cameras[-1]

    yield make
    for camera in cameras:
        camera.close()
    for thread in threading.enumerate():
        if thread.name == "genicam-let-go":  # waits for a camera that has gone, as long as Aravis does
            thread.join(PATIENT_S)


def until_open(camera):
    """Open it as the service does, twice a second; what was said before it succeeded."""
    said = []
    give_up_at = time.monotonic() + PATIENT_S
    while True:
        try:
            camera.open()
            return said
        except CameraUnavailable as error:
            said.append(str(error))
            assert time.monotonic() < give_up_at, said
            time.sleep(0.5)


def test_pictures_come_byte_for_byte_and_exposed_after_the_trigger(gige, opened):
    camera = opened()
    for _ in range(6):
        asked_s = time.monotonic()
        frame = camera.grab(asked_s, PATIENT_S)
        assert asked_s <= frame.exposed_at_s <= started_at_s(frame)
        latest = PICTURES[(gige.made() - 1) % 3]  # a machine under load loses packets, and the next frame was taken
        np.testing.assert_array_equal(frame.pixels.ravel()[MARK:], latest[MARK:])
    assert camera.counts.good == 6
    assert camera.counts.stale == 0
    assert frame.camera == "Aravis Fake serial GV7"


def test_a_free_running_camera_hands_out_no_frame_exposed_before_the_trigger(gige, opened):
    # Nobody can read its clock: the driver takes a frame to come within a period of its stamp, the longest time to read
    # out, and a machine under load keeps a frame of 50 Hz for longer than that.
    camera = opened(trigger="free", frame_rate=10)
    for _ in range(10):
        asked_s = time.monotonic()
        frame = camera.grab(asked_s, PATIENT_S)
        assert asked_s <= frame.exposed_at_s <= started_at_s(frame)


def test_the_late_frame_of_a_job_that_timed_out_is_not_the_next_job_s(gige, opened):
    camera = opened(exposure_us=400_000)
    for _ in range(3):
        with pytest.raises(CameraTimeout, match="expected one exposed after the trigger"):
            camera.grab(time.monotonic(), 0.1)
        asked_s = time.monotonic()
        assert asked_s <= started_at_s(camera.grab(asked_s, PATIENT_S))


def test_a_frame_with_a_missing_packet_is_never_used_and_counted(gige, opened):
    camera = opened(packet_size=1400)
    gige.tell("loss 0.01")
    for _ in range(20):
        asked_s = time.monotonic()
        frame = camera.grab(asked_s, PATIENT_S)
        assert asked_s <= started_at_s(frame)
        assert any(np.array_equal(frame.pixels.ravel()[MARK:], picture[MARK:]) for picture in PICTURES)
    assert camera.stream_counts.broken > 0
    assert camera.stream_counts.missing_packets > 0


def test_where_no_packet_comes_through_the_advice_is_about_packets(gige, opened):
    camera = opened()
    gige.tell("loss 1")
    with pytest.raises(CameraTimeout, match=r"packets of 9000 bytes on both ends .*rmem_max.*packet_delay_ns"):
        camera.grab(time.monotonic(), 1.0)
    gige.tell("loss 0")
    assert camera.grab(time.monotonic(), PATIENT_S).pixels.shape == (HEIGHT, WIDTH)


def test_a_frame_of_another_size_than_was_asked_for_is_never_used(gige, opened):
    camera = opened()
    gige.tell("width 160")
    with pytest.raises(CameraTimeout, match="cannot be used"):
        camera.grab(time.monotonic(), 1.0)
    gige.tell(f"width {WIDTH}")
    assert camera.grab(time.monotonic(), PATIENT_S).pixels.shape == (HEIGHT, WIDTH)


def test_a_camera_that_is_switched_off_is_told_and_taken_up_again_with_its_settings(gige, opened):
    camera = opened(exposure_us=3000)
    gige.kill()
    with pytest.raises(CameraUnavailable, match="the camera has gone"):
        camera.check()
    with pytest.raises(CameraUnavailable, match="no such camera answers"):
        camera.open()
    gige.start()
    until_open(camera)
    assert "ExposureTimeAbs = 3000" in str(camera.opened)
    asked_s = time.monotonic()
    assert started_at_s(camera.grab(asked_s, PATIENT_S)) >= asked_s


def test_a_camera_that_dies_within_a_job_is_told_before_the_job_times_out(gige, opened):
    camera = opened(trigger="free")
    gige.freeze()
    with pytest.raises(CameraUnavailable, match="has gone"):
        camera.grab(time.monotonic(), PATIENT_S)


def test_a_camera_that_was_off_for_a_moment_is_not_taken_for_the_one_that_was_set_up(gige, opened):
    camera = opened()
    gige.kill()
    gige.start()
    with pytest.raises(CameraUnavailable, match="switched off and on"):
        camera.check()
    until_open(camera)
    assert camera.grab(time.monotonic(), PATIENT_S).sequence == 1


def test_another_client_s_control_is_told_and_ends_with_it(gige, opened):
    first = opened()
    second = GenicamCamera(GenicamSettings("GV7"))
    with pytest.raises(CameraUnavailable, match="controlled by another client"):
        second.open()
    first.check()
    assert first.grab(time.monotonic(), PATIENT_S).sequence == 1
    first.close()
    until_open(second)
    second.close()


def test_a_line_s_edge_makes_the_frame_and_edges_without_a_job_are_told(tmp_path, opened, caplog):
    need_aravis()
    with GigeCamera(tmp_path, PICTURES, line=True) as gige:
        camera = opened(trigger="line", line="Line0", frame_rate=10)  # as above, of a machine under load
        gige.tell("edge")
        time.sleep(0.3)
        with caplog.at_level(logging.WARNING), pytest.raises(CameraTimeout, match="edge comes after the trigger"):
            camera.grab(time.monotonic(), 0.3)
        assert "1 edges of the line came without a job" in caplog.text
        edge = threading.Timer(0.3, gige.tell, ["edge"])
        edge.start()
        asked_s = time.monotonic()
        frame = camera.grab(asked_s, PATIENT_S)
        edge.join()
        assert asked_s <= frame.exposed_at_s <= started_at_s(frame)
        assert (camera.counts.unasked, camera.counts.missed) == (1, 0)
        camera.close()


def test_an_edge_whose_frame_was_lost_is_counted(tmp_path, opened, caplog):
    need_aravis()
    with GigeCamera(tmp_path, PICTURES, line=True) as gige:
        camera = opened(trigger="line", line="Line0", frame_rate=50)
        for _ in range(2):
            edge = threading.Timer(0.2, gige.tell, ["edge"])
            edge.start()
            camera.grab(time.monotonic(), PATIENT_S)
            edge.join()
            gige.tell("loss 1")
            gige.tell("edge")
            with pytest.raises(CameraTimeout):
                camera.grab(time.monotonic(), 0.3)
            gige.tell("loss 0")
        assert camera.counts.missed == 1
        assert "1 edges of the line have brought no whole frame" in caplog.text
        camera.close()


@pytest.mark.parametrize("name", ["Mono10", "Mono12p", "Mono12Packed", "Mono16"])
def test_deep_samples_come_whole(tmp_path, opened, name):
    need_aravis()
    size = {"Mono10": 2, "Mono16": 2}.get(name, 1.5)
    data = np.random.default_rng(7).integers(0, 4, (1, int(WIDTH * HEIGHT * size))).astype(np.uint8)
    with GigeCamera(tmp_path, data):
        camera = opened(pixel_format=name)
        frame = camera.grab(time.monotonic(), PATIENT_S)
        whole = camera.opened.picture.samples(data.tobytes(), WIDTH, HEIGHT)
        assert frame.deep is not None
        np.testing.assert_array_equal(frame.deep.ravel()[MARK:], whole.ravel()[MARK:])
        np.testing.assert_array_equal(frame.pixels, eight_bits(frame.deep))
        camera.close()


def test_a_colour_sensor_s_frames_are_colour_of_full_depth(tmp_path, opened):
    need_aravis()
    data = np.tile(np.array([[1000, 300], [300, 100]], "<u2"), (1, HEIGHT // 2, WIDTH // 2)).reshape(1, -1)
    with GigeCamera(tmp_path, data.view(np.uint8)):
        camera = opened(pixel_format="BayerRG12")
        frame = camera.grab(time.monotonic(), PATIENT_S)
        assert frame.deep is not None
        assert tuple(frame.deep[100, 100] >> 4) == (100, 300, 1000)
        assert tuple(frame.pixels[100, 100]) == (100 >> 2, 300 >> 2, 1000 >> 2)
        camera.close()


def test_cameras_are_listed_with_serial_number_and_user_name_and_found_by_either(gige, opened):
    (found,) = list_cameras()
    assert (found.serial, found.user_name, found.address) == ("GV7", "over table 2", "127.0.0.1")
    assert opened(serial="", user_name="over table 2").opened.identity.serial == "GV7"


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"serial": "GV8"}, r"no such camera answers; there are: Aravis Fake serial GV7 \(over table 2\)"),
        (
            {"pixel_format": "Mono14"},
            r"PixelFormat = Mono14; expected one of .*did you mean Mono1",
        ),
        ({"width": 4000}, r"Width = 4000; expected a whole number, .* to 2048.*camera.width"),
        ({"gain_db": 11}, r"GainRaw = 11; expected a whole number, 0 to 10.*camera.gain_db"),
        ({"exposure_us": 1}, r"ExposureTimeAbs = 1; expected a number, 10 to 10000000.*camera.exposure_us"),
        ({"frame_rate": 1e9}, r"camera.frame_rate"),
        ({"black_level": 300}, r"BlackLevelRaw = 300; expected a whole number, 0 to 255.*camera.black_level"),
        ({"white_balance": {"red": 256}}, r"BalanceRatioRaw = 256; .*camera.white_balance.red"),
        ({"strobe": "Line3"}, r"LineSelector = Line3; expected one of Line1, Line2 .*Correct camera.strobe"),
        ({"line": "Line7", "trigger": "line"}, r"TriggerSource = Line7; expected one of Line0, Software.*camera.line"),
        ({"features": {"TestBolean": True}}, r"no feature TestBolean; did you mean TestBoolean\?"),
        ({"features": {"TestBoolean": 3}}, r"TestBoolean = 3; expected true or false"),
        ({"features": {"AcquisitionStart": 1}}, r"AcquisitionStart is a command"),
        ({"features": {"PixelFormat": "Mono8"}}, r"PixelFormat is set by camera.pixel_format"),
        ({"packet_size": 100_000}, r"packets of"),
    ],
)
def test_what_the_camera_cannot_do_is_refused_with_what_it_can(gige, opened, settings, said):
    with pytest.raises(CameraError, match=said):
        opened(**settings)


def test_features_are_written_and_read_back(gige, opened):
    camera = opened(features={"TestBoolean": True, "GainAuto": False, "GainRaw": 4, "AcquisitionFrameRate": 33.0})
    written = {entry.name: entry for entry in camera.opened.written}
    assert written["TestBoolean"].held is True
    assert written["GainAuto"].held == "Off"  # YAML reads Off as false
    assert written["GainRaw"].held == 4
    rate = written["AcquisitionFrameRate"]
    assert rate.held == pytest.approx(33.0, rel=0.01)
    assert "(asked 33)" in str(rate)  # the camera rounds it, and that is told


def test_black_level_white_balance_and_strobe_reach_the_camera_s_registers(gige, opened):
    camera = opened(black_level=9, white_balance={"red": 7, "blue": 5}, strobe="Line2")
    black, balance, mode, source = 0x40C, 0x420, 0x440, 0x460
    assert gige.at(black) == 9
    assert [gige.at(balance + 4 * colour) for colour in range(3)] == [7, 0, 5]
    assert [gige.at(mode + 4 * line) for line in range(2)] == [0, 1], "an input, and the output"
    assert [gige.at(source + 4 * line) for line in range(2)] == [0, 1], "off, and on while exposing"
    held = {entry.name: entry.held for entry in camera.opened.written}
    assert (held["BlackLevelRaw"], held["LineSource"]) == (9, "ExposureActive")


def test_a_refused_setting_lets_the_camera_go(gige, opened):
    with pytest.raises(CameraRefused):
        opened(gain_db=11)
    assert opened().grab(time.monotonic(), PATIENT_S).sequence == 1
