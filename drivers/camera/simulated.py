"""A camera whose pictures come from a function: for tests, and for wiring that has a renderer at hand."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.camera import CameraUnavailable, Frame
from drivers.camera.pacing import wait_until


class SimulatedCamera:
    """Frames made by `make_picture(sequence)`, which counts from 1; what it raises comes through.

    It does not model exposure time, frame rate, buffers or a device that stalls: it exposes when it is asked.
    """

    def __init__(
        self,
        make_picture: Callable[[int], NDArray[np.uint8]],
        *,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._make_picture = make_picture
        self._now = now
        self._sleep = sleep
        self._is_open = False
        self._sequence = 0

    def open(self) -> None:
        """Make ready to grab. Opening it twice does nothing."""
        self._is_open = True

    def grab(self, exposed_after_s: float, timeout_s: float) -> Frame:
        """The next picture; raise CameraTimeout where `exposed_after_s` lies beyond `timeout_s`, CameraUnavailable."""
        if not self._is_open:
            raise CameraUnavailable("simulated camera: not open; expected open() before grab().")
        exposed_at_s = wait_until(exposed_after_s, timeout_s, now=self._now, sleep=self._sleep, source="simulated")
        pixels = self._make_picture(self._sequence + 1)
        self._sequence += 1
        return Frame(pixels, exposed_at_s, simulated=True, source="simulated", sequence=self._sequence)

    def check(self) -> None:
        """Raise CameraUnavailable where it is not open."""
        if not self._is_open:
            raise CameraUnavailable("simulated camera: not open; expected open() before check().")

    def close(self) -> None:
        """Stop grabbing; never raises. Closing it twice does nothing."""
        self._is_open = False
