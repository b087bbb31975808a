"""What a job now would come to, frame after frame: each is measured as a job's frame is, by processes of their own."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from contour.errors import PictureError
from contour.image.picture_figures import PictureFigures, picture_figures
from drivers.camera import Camera, Frame, FrameUnusable, SceneMoved
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.reasons import Reason

if TYPE_CHECKING:
    from service.config.recipes import AnyRecipe

MOST_PROCESSES = 4
LAST = 10  # niceness: a job has nine times the weight


@dataclass(frozen=True, eq=False)
class Look:
    """A frame, what a job would have made of it, and its figures; frame and figures are None where none could be
    used.
    """

    frame: Frame | None
    measurement: Measurement
    figures: PictureFigures | None


@dataclass(frozen=True, eq=False)
class Sight:
    """What frames are measured by."""

    measurer: Measurer
    recipe: AnyRecipe
    thickness_mm: float

    def of(self, pixels: NDArray[np.uint8], camera: str) -> tuple[Measurement, PictureFigures]:
        """What a job would make of a picture; raise ParameterError where the recipe does not hold."""
        try:
            measured = self.measurer.measure(pixels, self.recipe, self.thickness_mm, camera)
        except PictureError as error:
            measured = Measurement(self.recipe.method, findings=((Reason.NO_FRAME, str(error)),))
        return measured, picture_figures(pixels)


class LiveView:
    """Looks at the newest frames of a camera.

    A frame is asked for when a process is free to measure it, and is one that is exposed after that: what the camera
    shows meanwhile is dropped, and none waits. No look knows of another, so that each is what a job would see. Python
    lets one thread of a process work at a time: so each core gets a process, and one more works while the camera
    exposes.
    """

    def __init__(self, sight: Sight, *, processes: int | None = None, gives_way: bool = False) -> None:
        """gives_way: measure at a low priority."""
        self._method = sight.recipe.method
        self.processes = processes or min(MOST_PROCESSES, (os.cpu_count() or 1) + 1)
        self._measuring = ProcessPoolExecutor(self.processes, get_context("spawn"), _begin, (sight, gives_way))
        self._grabbing = ThreadPoolExecutor(1, "live-camera")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._grabbing.shutdown()
        self._measuring.shutdown(cancel_futures=True)

    def looks(self, camera: Camera, timeout_s: float, most_hz: float) -> Iterator[Look]:
        """Looks without end, in the order of their frames, at most so many frames a second.

        Raises CameraTimeout, CameraUnavailable, ParameterError, BrokenProcessPool.
        """
        ahead: deque[tuple[Frame, Future[Any]]] = deque()
        grabbed: Future[Any] | None = None
        due_s = time.monotonic()
        while True:
            now_s, pause_s = time.monotonic(), None
            if grabbed is None and len(ahead) < self.processes:
                if now_s >= due_s:
                    due_s = max(due_s + 1.0 / most_hz, now_s)
                    grabbed = self._grabbing.submit(camera.grab, now_s, timeout_s)
                else:
                    pause_s = due_s - now_s
            _wait_for([one for _, one in ahead][:1] + ([] if grabbed is None else [grabbed]), pause_s)
            if grabbed is not None and grabbed.done():
                try:
                    frame = grabbed.result()
                except FrameUnusable as error:
                    yield self._unusable(error)
                else:
                    ahead.append((frame, self._measured(frame)))
                grabbed = None
            while ahead and ahead[0][1].done():
                frame, seen = ahead.popleft()
                yield Look(frame, *seen.result())

    def _measured(self, frame: Frame) -> Future[Any]:
        # A terminal sends Ctrl-C to all processes, and it is for the one that shows: a new one keeps what is blocked.
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return self._measuring.submit(_seen, frame.pixels, frame.camera)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)

    def _unusable(self, error: FrameUnusable) -> Look:
        reason = Reason.SCENE_MOVED if isinstance(error, SceneMoved) else Reason.NO_FRAME
        return Look(None, Measurement(self._method, findings=((reason, str(error)),)), None)


def _wait_for(awaited: list[Future[Any]], at_most_s: float | None) -> None:
    """Return once one of them is done, or so much time has passed."""
    if awaited:
        wait(awaited, at_most_s, FIRST_COMPLETED)
    else:
        time.sleep(at_most_s or 0.0)


_sights: list[Sight] = []  # of a measuring process: the one that it began with


def _begin(sight: Sight, gives_way: bool) -> None:
    if gives_way:
        os.setpriority(os.PRIO_PROCESS, 0, max(LAST, os.getpriority(os.PRIO_PROCESS, 0)))
    threading.Thread(target=_end_with_the_parent, daemon=True).start()
    cv2.setNumThreads(1)
    _sights.append(sight)


def _end_with_the_parent() -> None:
    """A parent that was killed tells nobody: its processes would wait for work for ever."""
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _seen(pixels: NDArray[np.uint8], camera: str) -> tuple[Measurement, PictureFigures]:
    return _sights[0].of(pixels, camera)
