from __future__ import annotations

import re

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contour.image.picture_figures import PictureFigures, picture_figures
from service.cli.main import main
from service.cli.pictures.focus import focus_line


@pytest.fixture
def picture(tmp_path):
    noise = np.random.default_rng(2).integers(20, 235, (120, 160), np.uint8)
    cv2.imwrite(str(tmp_path / "seen.png"), noise)
    (tmp_path / "config.yaml").write_text(
        "camera: {kind: files, path: seen.png}\ncontroller: {kind: none}\n"
        "recipes: [{number: 1, name: default, thickness_mm: 20}]\n"
    )
    return noise


def test_grab_stores_the_frame_as_it_is_and_tells_of_it(picture, tmp_path, capsys):
    output = tmp_path / "grabbed.png"
    assert main(["grab", "--config", str(tmp_path / "config.yaml"), "--output", str(output)]) == 0
    np.testing.assert_array_equal(cv2.imread(str(output), cv2.IMREAD_UNCHANGED), picture)
    told = capsys.readouterr().out
    assert "160 x 120 px, grey" in told
    assert "ms from trigger to frame" in told
    assert re.search(r"trigger   at \d\d:\d\d:\d\d\.\d{3} by", told)
    assert "sharpness" in told


def test_grab_without_a_camera_has_status_1_and_says_why(tmp_path, capsys):
    status = main(["grab", "--device", str(tmp_path / "video0"), "--size", "640x480", "--output", "x.png"])
    assert status == 1
    assert "No such file" in capsys.readouterr().err


@pytest.mark.parametrize("size", [[], ["--size", "640"], ["--size", "wide x high"]])
def test_a_device_without_a_size_is_refused(size, capsys):
    assert main(["grab", "--device", "/dev/video0", "--output", "x.png", *size]) == 2
    assert "such as 1280x720" in capsys.readouterr().err


@pytest.mark.parametrize("option", [["--size", "640x480"], ["--format", "MJPG"], ["--rate", "5"]])
def test_a_device_s_option_without_a_device_is_refused_and_not_passed_over(option, tmp_path, capsys):
    assert main(["grab", "--output", str(tmp_path / "x.png"), *option]) == 2
    assert f"{option[0]} goes with --device" in capsys.readouterr().err


@pytest.mark.usefixtures("picture")
def test_grab_to_an_unknown_kind_of_picture_says_which_there_are(tmp_path, capsys):
    assert main(["grab", "--config", str(tmp_path / "config.yaml"), "--output", str(tmp_path / "x.doc")]) == 2
    assert "Use .png or .jpg" in capsys.readouterr().err


@pytest.mark.usefixtures("picture")
def test_focus_ends_after_the_frames_asked_for_and_tells_the_best(tmp_path, capsys):
    assert main(["focus", "--config", str(tmp_path / "config.yaml"), "--frames", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("[" + 30 * "#" + "] 100% of the best")
    assert lines[2].startswith("best sharpness")


def test_cameras_on_a_machine_without_any_says_so(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr("drivers.camera.v4l2.listing.look_at_nodes.__defaults__", (tmp_path,))
    monkeypatch.setattr("drivers.camera.genicam.listing.list_cameras", list)  # another test may have one on loopback
    assert main(["cameras"]) == 1
    assert "no V4L2 camera: there is no /dev/video*" in capsys.readouterr().out


def test_the_bar_is_full_at_the_best_and_clipping_is_told():
    line = focus_line(PictureFigures(5.0, 100, 0.0, 0.2), best=10.0)
    assert line.startswith("[" + 15 * "#" + 15 * " " + "]  50% of the best")
    assert "white clipped" in line
    assert "black clipped" not in line


def test_blur_lowers_sharpness_step_by_step():
    noise = np.random.default_rng(2).integers(20, 235, (120, 160), np.uint8)
    blurred = [picture_figures(cv2.GaussianBlur(noise, (0, 0), sigma)).sharpness for sigma in (1, 2, 4, 8)]
    assert blurred == sorted(blurred, reverse=True)
    assert blurred[0] > 3 * blurred[-1]


@given(gain=st.floats(0.3, 1.0), offset=st.integers(0, 60))
def test_sharpness_does_not_follow_the_light(gain, offset):
    smooth = cv2.GaussianBlur(np.random.default_rng(2).integers(0, 256, (120, 160), np.uint8), (0, 0), 2)
    stretched = cv2.normalize(smooth, None, 0, 190, cv2.NORM_MINMAX)
    dimmed = np.round(stretched * gain + offset).astype(np.uint8)
    assert picture_figures(dimmed).sharpness == pytest.approx(picture_figures(stretched).sharpness, rel=0.05)


def test_a_picture_of_one_grey_has_no_sharpness_and_a_colour_one_is_judged_by_its_grey():
    assert picture_figures(np.full((40, 40), 77, np.uint8)) == PictureFigures(0.0, 77.0, 0.0, 0.0)
    white = picture_figures(np.full((40, 40, 3), 255, np.uint8))
    assert (white.mean, white.bright_share) == (255.0, 1.0)
