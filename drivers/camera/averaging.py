"""Several frames of a still scene as one with less noise."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.camera import Camera, CameraTimeout, Frame, SceneMoved
from drivers.camera.depth import looked_at
from drivers.camera.stillness import movement


class AveragingCamera:
    """A camera whose frames are the mean of `count` frames of another, all exposed after the trigger."""

    def __init__(self, camera: Camera, count: int, *, now: Callable[[], float] = time.monotonic) -> None:
        if count < 2:
            raise ValueError(f"count is {count}, expected at least 2 frames to average")
        self._camera = camera
        self._count = count
        self._now = now
        self._sequence = 0

    @property
    def single(self) -> Camera:
        """The camera behind it, which gives frames one by one."""
        return self._camera

    @property
    def opened(self) -> object | None:
        """What the camera behind it is and was set to, where it tells."""
        return getattr(self._camera, "opened", None)

    def open(self) -> None:
        """Open the camera behind it; raise CameraUnavailable."""
        self._camera.open()

    def grab(self, exposed_after_s: float, timeout_s: float) -> Frame:
        """The mean of the next frames; `exposed_at_s` is the first one's.

        Raises SceneMoved where they do not show the same still scene, and what the camera behind it raises.
        """
        give_up_at = self._now() + timeout_s
        first = self._camera.grab(exposed_after_s, timeout_s)
        total: NDArray[np.uint32] = first.samples.astype(np.uint32)
        latest = first
        for number in range(2, self._count + 1):
            left_s = give_up_at - self._now()
            if left_s <= 0:
                raise CameraTimeout(
                    f"{first.source}: {number - 1} of {self._count} frames within {timeout_s:g} s; expected all. "
                    "Lower camera.average or raise camera.timeout_s."
                )
            latest = self._camera.grab(np.nextafter(latest.exposed_at_s, np.inf), left_s)
            self._check_still(first, latest, number)
            total += latest.samples
        mean, deep = looked_at(((total + self._count // 2) // self._count).astype(first.samples.dtype))
        self._sequence += 1
        return Frame(mean, first.exposed_at_s, first.simulated, first.source, self._sequence, first.camera, deep)

    def check(self) -> None:
        """Raise CameraUnavailable where the camera behind it has gone."""
        self._camera.check()

    def close(self) -> None:
        """Close the camera behind it; never raises."""
        self._camera.close()

    def _check_still(self, first: Frame, later: Frame, number: int) -> None:
        if later.pixels.shape != first.pixels.shape:
            seen = f"frame {number} has another size"
        else:
            moved = movement(first.pixels, later.pixels)
            if moved is None:
                return
            seen = f"{moved} between frames 1 and {number}"
        raise SceneMoved(
            f"{first.source}: {seen}; expected a still scene while {self._count} frames are averaged. "
            "Let table and hands rest before the trigger, or set camera.average to 1."
        )
