"""What the test's webcam sees, the node that the kernel gives it, and our driver on that."""

from __future__ import annotations

import time
from pathlib import Path

import cv2
import numpy as np

from drivers.camera.v4l2.camera import V4l2Camera, V4l2Settings
from tests.support.camera.usb_webcam import HEIGHT, MJPG, WIDTH
from tests.support.camera.vivid import PATIENT_S

GREYS = 25  # frames that can be told apart by their grey


class Scene:
    """What the webcam sees: a grey that changes with each frame, and when each was exposed."""

    def __init__(self) -> None:
        self.exposed_at_s: list[float] = []
        self.padding = b""
        self.torn = 0  # so many of the next frames end in their middle
        self.damaged = 0  # so many are white, and flagged by the camera

    def encode(self, kind: int) -> tuple[bytes, bool]:
        number = len(self.exposed_at_s)
        self.exposed_at_s.append(time.monotonic())
        damaged, self.damaged = self.damaged > 0, max(self.damaged - 1, 0)
        grey = 255 if damaged else 10 * (number % GREYS) + 5
        if kind != MJPG:
            return bytes([round(16 + grey * 219 / 255), 128]) * (WIDTH * HEIGHT), damaged
        done, data = cv2.imencode(".jpg", np.full((HEIGHT, WIDTH), grey, np.uint8))
        assert done
        torn, self.torn = self.torn > 0, max(self.torn - 1, 0)
        return (data.tobytes()[: len(data) // 2] if torn else data.tobytes() + self.padding), damaged

    def exposure_of(self, pixels: np.ndarray) -> float:
        """When the frame that these pixels show began to be exposed."""
        number = round((float(np.median(pixels)) - 5) / 10)
        recent = range(len(self.exposed_at_s) - 1, max(len(self.exposed_at_s) - GREYS, 0) - 1, -1)
        return next(self.exposed_at_s[n] for n in recent if n % GREYS == number)


def node_of_the_webcam(within_s=PATIENT_S):
    began = time.monotonic()
    while time.monotonic() - began < within_s:
        for name in sorted(Path("/sys/class/video4linux").glob("video*")):
            if "Test webcam" in (name / "name").read_text() and (name / "index").read_text().strip() == "0":
                return f"/dev/{name.name}"
        time.sleep(0.05)
    raise AssertionError("the kernel has made no node for the webcam")


def camera_on(node, **changes):
    settings = {"device": node, "width": WIDTH, "height": HEIGHT, "pixel_format": "MJPG", "frame_rate": 30.0}
    return V4l2Camera(V4l2Settings(**settings | changes))
