from __future__ import annotations

import os
import re

import cv2
import numpy as np
import pytest

from drivers.camera import CameraTimeout, CameraUnavailable, FrameUnusable
from drivers.camera.files.camera import FileCamera


def write_picture(path, grey):
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), np.full((8, 8), grey, np.uint8))


def greys(camera, count):
    """The grey level of each of the next frames."""
    return [int(camera.grab(0.0, 1.0).pixels.flat[0]) for _ in range(count)]


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


# --- watching, moving aside ------------------------------------------------------------------------------------------


class Clock:
    """A clock that goes on only while somebody sleeps, with things that happen at their time."""

    def __init__(self):
        self.now_s = 100.0
        self.events = []

    def now(self):
        return self.now_s

    def sleep(self, seconds):
        self.now_s += seconds
        due = [event for event in self.events if event[0] <= self.now_s]
        self.events = [event for event in self.events if event[0] > self.now_s]
        for _, happen in due:
            happen()


def watching(folder, clock, **options):
    camera = FileCamera(folder, loop=False, watch=True, now=clock.now, sleep=clock.sleep, **options)
    camera.open()
    return camera


def test_a_watched_folder_may_be_empty_and_gives_the_picture_that_comes(tmp_path):
    clock = Clock()
    camera = watching(tmp_path, clock)
    with pytest.raises(CameraTimeout, match="no new picture came in time"):
        camera.grab(clock.now(), 1.0)
    clock.events = [(clock.now() + 0.5, lambda: write_picture(tmp_path / "a.png", 7))]
    frame = camera.grab(clock.now(), 2.0)
    assert frame.pixels[0, 0] == 7
    assert frame.exposed_at_s >= 101.5


def test_a_picture_that_is_still_being_written_is_waited_for(tmp_path):
    clock = Clock()
    write_picture(tmp_path / "whole.png", 7)
    whole = (tmp_path / "whole.png").read_bytes()
    (tmp_path / "whole.png").unlink()
    growing = tmp_path / "growing.png"

    def grow(length):
        return lambda: growing.write_bytes(whole[:length])

    steps = [0, 10, 20, 30, 40, len(whole)]
    clock.events = [(clock.now() + 0.2 * step, grow(length)) for step, length in enumerate(steps, 1)]
    camera = watching(tmp_path, clock)
    frame = camera.grab(clock.now(), 5.0)
    assert frame.pixels[0, 0] == 7
    assert frame.exposed_at_s >= 100 + 0.2 * len(steps)


def test_a_file_that_never_gets_done_is_told(tmp_path):
    clock = Clock()
    (tmp_path / "empty.png").write_bytes(b"")
    with pytest.raises(CameraTimeout, match="1 files are still being written"):
        watching(tmp_path, clock).grab(clock.now(), 1.0)


def test_a_file_written_anew_under_its_name_is_another_picture(tmp_path):
    clock = Clock()
    write_picture(tmp_path / "latest.png", 1)
    camera = watching(tmp_path, clock)
    assert camera.grab(clock.now(), 2.0).pixels[0, 0] == 1
    with pytest.raises(CameraTimeout):
        camera.grab(clock.now(), 1.0)
    write_picture(tmp_path / "latest.png", 2)
    os.utime(tmp_path / "latest.png", ns=(1, 1))
    assert camera.grab(clock.now(), 2.0).pixels[0, 0] == 2


def test_a_watched_folder_that_vanishes_makes_the_camera_unavailable(tmp_path):
    clock = Clock()
    (tmp_path / "in").mkdir()
    camera = watching(tmp_path / "in", clock)
    clock.events = [(clock.now() + 0.5, (tmp_path / "in").rmdir)]
    with pytest.raises(CameraUnavailable, match="No such file"):
        camera.grab(clock.now(), 2.0)


def test_a_file_that_is_written_anew_while_another_is_taken_is_waited_for_again(tmp_path):
    clock = Clock()
    for name, grey in (("a.png", 1), ("b.png", 2)):
        write_picture(tmp_path / name, grey)
    camera = watching(tmp_path, clock)
    assert camera.grab(clock.now(), 2.0).pixels[0, 0] == 1
    write_picture(tmp_path / "whole.png", 3)
    whole = (tmp_path / "whole.png").read_bytes()
    (tmp_path / "whole.png").unlink()
    (tmp_path / "b.png").write_bytes(whole[:30])
    clock.events = [(clock.now() + 0.2, lambda: (tmp_path / "b.png").write_bytes(whole))]
    assert camera.grab(clock.now(), 2.0).pixels[0, 0] == 3


def test_a_file_that_is_taken_away_while_another_is_taken_is_no_bad_picture(tmp_path):
    clock = Clock()
    for name, grey in (("a.png", 1), ("b.png", 2), ("c.png", 3)):
        write_picture(tmp_path / name, grey)
    camera = watching(tmp_path, clock)
    assert camera.grab(clock.now(), 2.0).pixels[0, 0] == 1
    (tmp_path / "b.png").unlink()
    assert camera.grab(clock.now(), 2.0).pixels[0, 0] == 3


def test_a_name_that_is_no_utf_8_is_told_as_text_that_can_be_written_anywhere(tmp_path):
    bad, good = (tmp_path / os.fsdecode(name) for name in (b"bad-\xe4.png", b"good-\xe4.png"))
    bad.write_bytes(b"no picture")
    write_picture(tmp_path / "good.png", 4)
    (tmp_path / "good.png").rename(good)
    camera = FileCamera(tmp_path, loop=True)
    camera.open()
    with pytest.raises(FrameUnusable) as raised:
        camera.grab(0.0, 1.0)
    assert "bad-\\udce4.png: no picture" in str(raised.value)
    str(raised.value).encode()
    frame = camera.grab(0.0, 1.0)
    assert frame.pixels[0, 0] == 4
    assert frame.source.endswith("good-\\udce4.png")


@pytest.mark.parametrize("watch", [False, True])
def test_a_link_in_a_circle_is_one_bad_file_and_hides_no_other(tmp_path, watch):
    clock = Clock()
    (tmp_path / "a.png").symlink_to("a.png")
    (tmp_path / "b.png").symlink_to("nowhere.png")
    write_picture(tmp_path / "c.png", 3)
    camera = FileCamera(tmp_path, loop=False, watch=watch, now=clock.now, sleep=clock.sleep)
    camera.open()
    with pytest.raises(FrameUnusable, match=r"a\.png: cannot be read \(Too many levels of symbolic links\)"):
        camera.grab(clock.now(), 2.0)
    assert camera.grab(clock.now(), 2.0).pixels[0, 0] == 3


def test_files_are_moved_aside_once_read_also_bad_ones_and_none_is_overwritten(tmp_path):
    write_picture(tmp_path / "in" / "a.png", 1)
    (tmp_path / "in" / "b.png").write_bytes(b"no picture")
    write_picture(tmp_path / "done" / "a.png", 99)
    camera = FileCamera(tmp_path / "in", loop=False, move_to=tmp_path / "done")
    camera.open()
    assert greys(camera, 1) == [1]
    with pytest.raises(FrameUnusable, match=r"b\.png"):
        camera.grab(0.0, 1.0)
    assert list((tmp_path / "in").iterdir()) == []
    assert sorted(path.name for path in (tmp_path / "done").iterdir()) == ["a-1.png", "a.png", "b.png"]
    assert cv2.imread(str(tmp_path / "done" / "a.png"))[0, 0, 0] == 99
    assert cv2.imread(str(tmp_path / "done" / "a-1.png"))[0, 0, 0] == 1


def test_a_file_that_cannot_be_moved_stays_and_is_told(tmp_path, monkeypatch):
    write_picture(tmp_path / "in" / "a.png", 1)
    camera = FileCamera(tmp_path / "in", loop=False, move_to=tmp_path / "done")
    camera.open()
    (tmp_path / "done").rmdir()
    (tmp_path / "done").write_text("in the way")
    with pytest.raises(CameraUnavailable, match=r"a\.png: cannot be moved to .*done"):
        camera.grab(0.0, 1.0)
    (tmp_path / "done").unlink()
    assert greys(camera, 1) == [1]


def test_a_folder_is_not_moved_into_itself(tmp_path):
    with pytest.raises(CameraUnavailable, match="expected another folder"):
        FileCamera(tmp_path, loop=False, move_to=tmp_path / ".").open()


def test_a_file_of_its_own_is_not_moved_into_its_own_folder(tmp_path):
    write_picture(tmp_path / "a.png", 1)
    with pytest.raises(CameraUnavailable, match="expected another folder"):
        FileCamera(tmp_path / "a.png", loop=False, move_to=tmp_path).open()


@pytest.mark.parametrize("closed", ["in", "done"])
def test_a_folder_that_cannot_be_written_is_told_at_opening_where_files_are_to_be_moved(tmp_path, monkeypatch, closed):
    for name in ("in", "done"):
        write_picture(tmp_path / name / "a.png", 1)
    readable = os.access  # root, who may run the tests, may write everywhere
    monkeypatch.setattr(os, "access", lambda path, mode: readable(path, mode) and path.name != closed)
    with pytest.raises(CameraUnavailable, match=rf"{closed}: files cannot be moved .* cannot be written"):
        FileCamera(tmp_path / "in", loop=False, move_to=tmp_path / "done").open()
    FileCamera(tmp_path / "in", loop=False).open()


# --- videos ----------------------------------------------------------------------------------------------------------


def write_video(path, greys, size=(64, 48)):
    """Frames whose left half is of one grey; the right half is noise, so that they fill the file."""
    noise = np.random.default_rng(3).integers(0, 256, (size[1], size[0] // 2, 3), np.uint8)
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"MJPG"), 10.0, size)
    assert writer.isOpened()
    for grey in greys:
        writer.write(np.hstack([np.full_like(noise, grey), noise]))
    writer.release()


def test_a_video_gives_its_frames_in_order_and_from_the_start_again(tmp_path):
    write_video(tmp_path / "cell.avi", [10, 60, 110])
    camera = FileCamera(tmp_path / "cell.avi", loop=True)
    camera.open()
    assert greys(camera, 5) == pytest.approx([10, 60, 110, 10, 60], abs=3)
    camera.close()


def test_a_frame_of_a_video_is_named_by_its_number(tmp_path):
    write_video(tmp_path / "cell.avi", [10, 60])
    camera = FileCamera(tmp_path / "cell.avi", loop=False)
    camera.open()
    sources = [camera.grab(0.0, 1.0).source for _ in range(2)]
    assert [source.rsplit("/", 1)[-1] for source in sources] == ["cell.avi frame 1", "cell.avi frame 2"]
    with pytest.raises(CameraUnavailable, match="were handed out"):
        camera.grab(0.0, 1.0)


def test_videos_and_pictures_of_a_folder_follow_each_other(tmp_path):
    write_picture(tmp_path / "1.png", 5)
    write_video(tmp_path / "2.avi", [60, 110])
    write_picture(tmp_path / "3.png", 7)
    camera = FileCamera(tmp_path, loop=False)
    camera.open()
    assert greys(camera, 4) == pytest.approx([5, 60, 110, 7], abs=3)


def test_a_video_that_is_cut_off_says_after_how_many_frames_and_the_next_file_follows(tmp_path):
    write_video(tmp_path / "1.avi", range(0, 250, 10))
    whole = (tmp_path / "1.avi").read_bytes()
    (tmp_path / "1.avi").write_bytes(whole[: len(whole) // 2])
    write_picture(tmp_path / "2.png", 7)
    camera = FileCamera(tmp_path, loop=False)
    camera.open()
    with pytest.raises(FrameUnusable, match=r"1\.avi: the video is cut off after \d+ frames; expected 25") as cut:
        greys(camera, 30)
    read = int(re.search(r"after (\d+)", str(cut.value))[1])
    assert 5 < read < 20
    assert greys(camera, 1) == [7]


def test_a_video_whose_name_is_no_utf_8_is_read(tmp_path):
    write_video(tmp_path / "a.avi", [40, 80])
    (tmp_path / "a.avi").rename(tmp_path / os.fsdecode(b"a-\xe4.avi"))
    camera = FileCamera(tmp_path, loop=True)
    camera.open()
    assert [round(grey / 10) * 10 for grey in greys(camera, 3)] == [40, 80, 40]


def test_a_pipe_called_a_video_holds_nobody_up(tmp_path):
    os.mkfifo(tmp_path / "a.mp4")
    write_video(tmp_path / "b.avi", [40])
    camera = FileCamera(tmp_path, loop=False)
    camera.open()
    with pytest.raises(FrameUnusable, match=r"a\.mp4: no regular file"):
        camera.grab(0.0, 1.0)
    assert camera.grab(0.0, 1.0).source.endswith("b.avi frame 1")


def test_a_video_without_a_frame_is_told_as_that(tmp_path):
    write_video(tmp_path / "a.avi", [])
    camera = FileCamera(tmp_path, loop=False)
    camera.open()
    with pytest.raises(FrameUnusable, match="a video without a frame"):
        camera.grab(0.0, 1.0)


def test_a_file_that_is_no_video_is_told(tmp_path):
    (tmp_path / "1.mp4").write_bytes(b"no video" * 100)
    camera = FileCamera(tmp_path / "1.mp4", loop=False)
    camera.open()
    with pytest.raises(FrameUnusable, match="no video that can be read"):
        camera.grab(0.0, 1.0)
