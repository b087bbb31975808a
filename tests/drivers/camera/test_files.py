from __future__ import annotations

import cv2
import numpy as np
import pytest

from drivers.camera import CameraTimeout, CameraUnavailable, FrameUnusable
from drivers.camera.files import FileCamera


def write_picture(path, grey):
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), np.full((8, 8), grey, np.uint8))


def greys(camera, count):
    """The grey level of each of the next frames."""
    return [int(camera.grab(0.0, 1.0).pixels[0, 0]) for _ in range(count)]


@pytest.fixture
def folder(tmp_path):
    """Three pictures that sort otherwise by characters than by numbers, and things that are no pictures."""
    for name, grey in (("frame10.png", 10), ("frame2.png", 2), ("Frame1.PNG", 1)):
        write_picture(tmp_path / name.lower(), grey)
    (tmp_path / "frame1.png").rename(tmp_path / "Frame1.PNG")
    (tmp_path / "calibration.yaml").write_text("version: 1\n")
    write_picture(tmp_path / "deeper" / "frame0.png", 99)
    write_picture(tmp_path / "hidden.png", 98)
    (tmp_path / "hidden.png").rename(tmp_path / ".hidden.png")
    (tmp_path / "folder.png").mkdir()
    return tmp_path


def test_a_folder_is_read_in_natural_order_and_from_the_start_again(folder):
    camera = FileCamera(folder, loop=True)
    camera.open()
    assert greys(camera, 5) == [1, 2, 10, 1, 2]


def test_a_folder_without_loop_ends_in_an_error_that_says_so(folder):
    camera = FileCamera(folder, loop=False)
    camera.open()
    assert greys(camera, 3) == [1, 2, 10]
    with pytest.raises(CameraUnavailable, match=r"all pictures \(3\) were handed out"):
        camera.grab(0.0, 1.0)


def test_opening_again_does_not_hand_pictures_out_twice_without_loop(folder):
    camera = FileCamera(folder, loop=False)
    camera.open()
    assert greys(camera, 2) == [1, 2]
    camera.close()
    camera.open()
    assert greys(camera, 1) == [10]
    camera.close()
    with pytest.raises(CameraUnavailable, match="were handed out"):
        camera.open()
    write_picture(folder / "frame11.png", 11)
    camera.open()
    assert greys(camera, 1) == [11]


def test_pictures_that_come_and_go_are_noticed_at_the_next_round(folder):
    camera = FileCamera(folder, loop=True)
    camera.open()
    assert greys(camera, 3) == [1, 2, 10]
    (folder / "frame2.png").unlink()
    write_picture(folder / "frame3.png", 3)
    assert greys(camera, 3) == [1, 3, 10]


def test_a_single_file_may_be_called_anything(tmp_path):
    write_picture(tmp_path / "a.png", 5)
    (tmp_path / "a.png").rename(tmp_path / "snapshot")
    camera = FileCamera(tmp_path / "snapshot", loop=True)
    camera.open()
    assert greys(camera, 2) == [5, 5]


@pytest.mark.parametrize("name", ["gone", "gone/a.png", "nul\0byte"])
def test_a_missing_path_is_an_error_at_opening(tmp_path, name):
    with pytest.raises(CameraUnavailable, match="cannot be read"):
        FileCamera(tmp_path / name, loop=True).open()


def test_an_empty_folder_is_an_error_that_says_what_counts_as_a_picture(tmp_path):
    (tmp_path / "notes.txt").write_text("no picture")
    with pytest.raises(CameraUnavailable, match=r"no pictures in this folder; expected files that end in \.png"):
        FileCamera(tmp_path, loop=True).open()


def test_a_folder_that_vanishes_makes_the_camera_unavailable(folder):
    camera = FileCamera(folder, loop=True)
    camera.open()
    assert greys(camera, 3) == [1, 2, 10]
    folder.rename(folder.with_name("elsewhere"))
    with pytest.raises(CameraUnavailable, match="No such file"):
        camera.grab(0.0, 1.0)


def test_a_bad_file_is_told_by_name_and_the_next_one_follows(folder):
    (folder / "frame2.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    camera = FileCamera(folder, loop=True)
    camera.open()
    first = camera.grab(0.0, 1.0)
    with pytest.raises(FrameUnusable, match=r"frame2\.png"):
        camera.grab(0.0, 1.0)
    second = camera.grab(0.0, 1.0)
    assert (first.sequence, second.sequence) == (1, 2)
    assert second.source.endswith("frame10.png")


def test_a_file_counts_as_exposed_when_its_reading_begins(tmp_path):
    write_picture(tmp_path / "a.png", 5)
    times, slept = [10.0], []

    def sleep(seconds):
        slept.append(seconds)
        times[0] += seconds

    camera = FileCamera(tmp_path, loop=True, now=lambda: times[0], sleep=sleep)
    camera.open()
    assert camera.grab(10.0, 1.0).exposed_at_s == 10.0
    assert camera.grab(10.5, 1.0).exposed_at_s == 10.5
    with pytest.raises(CameraTimeout, match=r"5\.000 s ahead"):
        camera.grab(15.5, 1.0)
    assert slept == [0.5, 1.0]
