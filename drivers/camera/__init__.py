"""Cameras: a role of four verbs, and what is thrown when one cannot be kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class CameraError(Exception):
    """Base of all camera errors. The message says what was seen, what was expected, and the next step."""


class CameraUnavailable(CameraError):
    """The device or the source is not there, or has gone; opening again later may help."""


class CameraRefused(CameraUnavailable):
    """The device is there and does not do what was asked of it: a setting, a format. Waiting does not help."""


class CameraTimeout(CameraError):
    """No frame exposed after the asked time arrived within the time-out."""


class FrameUnusable(CameraError):
    """A frame or file arrived that is no usable picture; the next one may be."""


class SceneMoved(FrameUnusable):
    """Frames that were to show one still scene do not."""


@dataclass(frozen=True)
class Frame:
    """One exposure.

    pixels: shape (H, W) grey or (H, W, 3) BGR, uint8. deep: uint16 of the same shape where the source has more than
    eight bits: pixels are the eight of them that the picture uses, and follow from them alone. exposed_at_s: start of
    the exposure on `time.monotonic`'s scale; a file counts as exposed when it is read. simulated: not from a live
    camera. source: what it came from, for log and journal. sequence: counts frames of this camera from 1. camera:
    which device took it, its name with its serial number or, without one, its place on the bus; a calibration holds for
    that one. "" = not told, as of files.
    """

    pixels: NDArray[np.uint8]
    exposed_at_s: float
    simulated: bool
    source: str
    sequence: int
    camera: str = ""
    deep: NDArray[np.uint16] | None = None

    @property
    def samples(self) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """All that the source gave: what is to be kept."""
        return self.pixels if self.deep is None else self.deep


class Camera(Protocol):
    """A source of frames. Blocking: the service gives it a thread of its own."""

    def open(self) -> None:
        """Make ready to grab; raise CameraUnavailable. Opening an open camera does nothing."""

    def grab(self, exposed_after_s: float, timeout_s: float) -> Frame:
        """Return the first good frame exposed at or after `exposed_after_s` (monotonic clock).

        Raises CameraTimeout after `timeout_s`, CameraUnavailable where the source has gone, FrameUnusable.
        """

    def check(self) -> None:
        """Raise CameraUnavailable where the open camera has gone or fallen silent since; takes no frame away."""

    def close(self) -> None:
        """Let the device go; never raises. Closing a closed camera does nothing."""
