"""Keeps the camera open: looks after it while nothing is asked of it, and opens it again after it was lost."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from drivers.camera import Camera, CameraError
from service.jobs.health import Fault, Health
from service.poll_timing import until_beat
from service.reasons import Reason

log = logging.getLogger("combtrace.camera_watch")

RETRY_S = 0.5  # a camera that returns is back within two seconds, opening included
CHECK_S = 1.0
WATCH_PERIOD_S = 0.25


def camera_is_being_opened(health: Health) -> None:
    """Have the camera opened, anew where it is open."""
    health.report("camera", Fault(Reason.NO_FRAME, "the camera is being opened", starting=True))


class CameraWatch:
    """Reports the camera's fault to `health`, under "camera", where jobs report theirs too.

    warm_up_s: time after opening in which no trigger is taken. A camera that was away needs as long as it was away, as
    it cools about as fast as it warms. once_open: done in the camera's thread after it was opened for the first time,
    without waiting for it; must not raise.
    """

    def __init__(
        self,
        camera: Camera,
        pool: ThreadPoolExecutor,
        health: Health,
        *,
        warm_up_s: float = 0.0,
        feed_watchdog: Callable[[], None] = lambda: None,
        once_open: Callable[[], None] = lambda: None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._camera = camera
        self._pool = pool
        self._health = health
        self._warm_up_s = warm_up_s
        self._feed_watchdog = feed_watchdog
        self._once_open = once_open
        self._now = now
        self._logged: str | None = None
        self._lost_at_s: float | None = None
        self._ever_open = False
        self._checked_at_s = now()
        self._tried_at_s = -RETRY_S + now()
        self._warming: Fault | None = None
        self._warm_at_s = 0.0

    def start(self) -> None:
        """Say that the camera is being opened: no fault yet, but nothing can be done without it."""
        camera_is_being_opened(self._health)

    async def run(self) -> None:
        """Look after the camera for ever."""
        while True:
            await self.look()
            self._feed_watchdog()
            await asyncio.sleep(until_beat(asyncio.get_running_loop().time(), WATCH_PERIOD_S))

    async def look(self) -> None:
        """One look: check, reopen or warm up, whichever is due; nothing while a job has the camera."""
        if self._health.job is not None:
            return
        fault = self._health.fault("camera")
        if fault is not None and fault is not self._warming:
            if self._lost_at_s is None:
                self._lost_at_s = self._now()
            if self._now() - self._tried_at_s >= RETRY_S:
                await self._reopen()
        elif self._now() - self._checked_at_s >= CHECK_S:
            await self._check()
        if self._warming is not None and self._health.fault("camera") is self._warming:
            self._end_warming()

    async def _reopen(self) -> None:
        self._tried_at_s = self._now()
        if await self._tried(self._close_and_open):
            away_s = 0.0 if self._lost_at_s is None else self._now() - self._lost_at_s
            needed_s = min(self._warm_up_s, away_s) if self._ever_open else self._warm_up_s
            if not self._ever_open:
                self._pool.submit(self._once_open)
            self._ever_open, self._lost_at_s, self._logged = True, None, None
            self._checked_at_s = self._now()
            self._warm_at_s = self._now() + needed_s
            text = f"the camera warms up for {needed_s:.0f} s"
            self._warming = Fault(Reason.NOT_READY, text, starting=True) if needed_s > 0 else None
            self._report(self._warming)

    async def _check(self) -> None:
        self._checked_at_s = self._now()
        await self._tried(self._camera.check)

    async def _tried(self, call: Callable[[], None]) -> bool:
        """True where the call did what it should; else the fault is told and reported."""
        try:
            await asyncio.get_running_loop().run_in_executor(self._pool, call)
        except CameraError as error:
            if str(error) != self._logged:
                log.warning("camera: %s", error)
                self._logged = str(error)
            self._report(Fault(Reason.NO_FRAME, str(error)))
            return False
        return True

    def _end_warming(self) -> None:
        if self._now() >= self._warm_at_s:
            self._warming = None
            self._report(None)

    def _close_and_open(self) -> None:
        self._camera.close()
        self._camera.open()

    def _report(self, fault: Fault | None) -> None:
        self._health.report("camera", fault)
