"""The daemon's camera between jobs: who only looks gets a frame while no job wants the camera."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Executor as ThreadPool
from dataclasses import dataclass

from drivers.camera import Camera, CameraError, Frame, FrameUnusable
from service.jobs.cycle_terms import Plan

WAIT_S = 0.05  # between two looks whether the camera is free
AGAIN_S = 1.0  # after a camera that could not keep its promise


class NobodyLooks(Exception):
    """There is nobody left who wants a frame."""


@dataclass(frozen=True)
class LookSources:
    """What of the daemon it takes to look; all may be called from any thread.

    pool: the one thread in which jobs use the camera. idle: True where no job is taken or executed. works: True where
    the camera is known to work. spare: False where each frame of the camera is a job's.
    """

    camera: Camera
    pool: ThreadPool
    idle: Callable[[], bool]
    works: Callable[[], bool]
    plan: Callable[[], Plan]
    timeout_s: float
    spare: bool


class SpareCamera:
    """A camera that gives frames only between jobs.

    A job that comes while a frame is exposed waits for that one at most, for a camera cannot be called back; one that
    is there already goes before.
    """

    def __init__(
        self, sources: LookSources, wanted: Callable[[], bool], *, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        """wanted: False once nobody looks any more."""
        self._sources = sources
        self._wanted = wanted
        self._sleep = sleep
        self.trouble: str | None = None

    def open(self) -> None:
        """Nothing: the daemon has it open."""

    def check(self) -> None:
        """Nothing: the daemon watches it."""

    def close(self) -> None:
        """Nothing: jobs need it."""

    def grab(self, exposed_after_s: float, timeout_s: float) -> Frame:
        """The next frame that no job wants, however long that takes; raise FrameUnusable, NobodyLooks.

        A camera that fails is asked again: that it does is the daemon's to report.
        """
        while self._wanted():
            try:
                frame = self._grabbed(timeout_s) if self._free() else None
            except FrameUnusable:
                raise
            except CameraError as error:
                self.trouble = str(error)
                self._sleep(AGAIN_S)
                continue
            if frame is not None:
                self.trouble = None
                return frame
            self._sleep(WAIT_S)
        raise NobodyLooks

    def _free(self) -> bool:
        return self._sources.idle() and self._sources.works()

    def _grabbed(self, timeout_s: float) -> Frame | None:
        def grab() -> Frame | None:
            # Asked again in the camera's thread: it may have waited there behind a job's first step.
            return self._sources.camera.grab(time.monotonic(), timeout_s) if self._free() else None

        try:
            return self._sources.pool.submit(grab).result()
        except RuntimeError as error:  # the pool has been shut down
            raise NobodyLooks from error
