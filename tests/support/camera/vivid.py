"""The kernel's virtual camera as the tests handle it: by `v4l2-ctl`, which knows nothing of our driver."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from drivers.camera.v4l2.camera import V4l2Camera, V4l2Settings

PATIENT_S = 300.0  # bounds a wait that ends by itself: the guest is emulated, on a machine that may be slow
WEBCAM, HDMI = 0, 1
CAPTURE, OUTPUT = "/dev/video0", "/dev/video1"
UNBIND = Path("/sys/bus/platform/drivers/vivid/unbind")
BIND = Path("/sys/bus/platform/drivers/vivid/bind")


def ctl(*arguments: str, device: str = CAPTURE) -> str:
    """What v4l2-ctl prints."""
    done = subprocess.run(["v4l2-ctl", "-d", device, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr + done.stdout
    return done.stdout


def set_control(name: str, value: int, device: str = CAPTURE) -> None:
    """Set one of vivid's controls; buttons are pressed with any value."""
    ctl("-c", f"{name}={value}", device=device)


def webcam(**changes: object) -> V4l2Camera:
    """A camera on vivid's webcam, 640 x 360 at 30 frames a second unless `changes` say otherwise. A drawn picture has
    no exposure time."""
    settings = {
        "device": CAPTURE, "width": 640, "height": 360, "frame_rate": 30.0, "input": WEBCAM, "exposure_s": 0.0,
    }  # fmt: skip
    return V4l2Camera(V4l2Settings(**settings | changes))


def hdmi(**changes: object) -> V4l2Camera:
    """A camera on vivid's HDMI input, 1280 x 720 at 60 frames a second."""
    settings = {"width": 1280, "height": 720, "pixel_format": "BGR3", "frame_rate": None, "input": HDMI}
    return webcam(**settings | changes)


@contextmanager
def opened(camera: V4l2Camera) -> Iterator[V4l2Camera]:
    """The camera, open until the end of the block."""
    camera.open()
    try:
        yield camera
    finally:
        camera.close()


@contextmanager
def shown_on_the_hdmi_input(picture: np.ndarray, folder: Path) -> Iterator[None]:
    """A BGR picture of 1280 x 720 sent out of vivid's HDMI output (720p60 from its start), in through its input."""
    assert picture.shape == (720, 1280, 3)
    raw = folder / "picture.bgr"
    raw.write_bytes(picture.tobytes() * 4)
    ctl("-i", str(HDMI))
    ctl("--set-fmt-video-out", "width=1280,height=720,pixelformat=BGR3", device=OUTPUT)
    set_control("osd_text_mode", 2)
    set_control("loop_video", 1)
    player = subprocess.Popen(
        ["v4l2-ctl", "-d", OUTPUT, "--stream-out-mmap", "--stream-loop", f"--stream-from={raw}"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    try:
        assert player.stderr is not None
        player.stderr.read(1)  # it has sent one: a sign for each
        time.sleep(0.5)
        yield
    finally:
        player.kill()
        player.communicate()
        set_control("loop_video", 0)
