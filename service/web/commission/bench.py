"""What all actions share: the daemon's camera, the notes, and one thread of low priority that works for them."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from drivers.camera import Frame, FrameUnusable
from service.config.config import Config
from service.jobs.spare_camera import NobodyLooks, SpareCamera
from service.low_priority import go_last
from service.web.commission.board_shots import BoardShots, Judged
from service.web.commission.session import Session, StepRefused
from service.web.daemon_access import DaemonAccess, DaemonSilent

T = TypeVar("T")

FRAME_WAIT_S = 15.0


class Bench:
    """The place where a cell is set up. One action at a time works here: the caller sees to that."""

    def __init__(self, daemon: DaemonAccess) -> None:
        self.daemon = daemon
        self.session = Session(daemon.sources.commission.folder)
        self.judged = Judged()
        self.progress = ""
        self._shots = BoardShots(self.session)
        self._thread = ThreadPoolExecutor(1, "commission", initializer=go_last)
        self._closed = False
        self._begun = False

    async def begun(self) -> None:
        """Look at the pictures of before, once."""
        if not self._begun:
            self._begun = True
            await self.in_thread(self.judge)

    def close(self) -> None:
        """Let go of the thread; what it works at ends at its next step."""
        self._closed = True
        self._thread.shutdown(wait=False, cancel_futures=True)

    @property
    def config(self) -> Config:
        """The configuration in force."""
        return self.daemon.sources.commission.config()

    def in_thread(self, work: Callable[[], T]) -> Awaitable[T]:
        """What `work` gives, in the thread."""
        return asyncio.get_running_loop().run_in_executor(self._thread, work)

    def go_on(self, progress: str = "") -> None:
        """Tell how far it is; raise StepRefused where the service is being stopped."""
        if self._closed:
            raise StepRefused("the service is being stopped. Do it again")
        self.progress = self.without_folder(progress)

    def without_folder(self, text: object) -> str:
        """The text with pictures by their names alone."""
        return str(text).replace(f"{self.session.folder}/", "")

    def judge(self) -> None:
        """Judge the pictures of the board that are there."""
        self.judged = self._shots.judged(self.go_on)

    def frame(self) -> Frame:
        """A frame that no job wants; raise StepRefused."""
        looks, health = self.daemon.sources.looks, self.daemon.sources.health
        if not looks.spare:
            raise StepRefused("each frame of this camera is a job's, so none is taken here. Use the command")
        until_s = time.monotonic() + FRAME_WAIT_S
        camera = SpareCamera(looks, lambda: not self._closed and time.monotonic() < until_s)
        try:
            return camera.grab(time.monotonic(), looks.timeout_s)
        except FrameUnusable as error:
            raise StepRefused(str(error)) from error
        except NobodyLooks as error:
            fault = health.fault("camera")
            why = camera.trouble or (fault.text if fault is not None else "jobs keep the camera. Halt, and try again")
            raise StepRefused(f"no picture came within {FRAME_WAIT_S:g} s: {why}") from error

    async def take_effect(self) -> None:
        """Have the daemon read the files anew that its configuration names; raise StepRefused."""
        try:
            why = await self.daemon.reload()
        except DaemonSilent as error:
            why = str(error)
        if why is not None:
            raise StepRefused(f"the file is written, but not in force: {why}")


def not_writable(error: Exception | str) -> str:
    """What went wrong, with the next step for a unit of systemd, that may write its state alone."""
    hint = ". The service may write its state folder only: let the configuration name a file there"
    return f"{error}{hint}" if "Read-only" in str(error) or "Permission" in str(error) else str(error)
