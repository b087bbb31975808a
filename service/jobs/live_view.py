"""What a job now would come to, frame after frame: each is measured as a job's frame is, by processes of their own."""

from __future__ import annotations

import os
import time
from collections import deque
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from queue import SimpleQueue
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from contour.errors import PictureError
from contour.image.picture_figures import PictureFigures, picture_figures
from drivers.camera import Camera, Frame, FrameUnusable, SceneMoved
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.reasons import Reason
from service.worker import Worker

if TYPE_CHECKING:
    from service.config.recipes import AnyRecipe

MOST_PROCESSES = 4


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
        self._sees = [Worker(sight.of, gives_way=gives_way) for _ in range(self.processes)]
        self._free: SimpleQueue[Worker] = SimpleQueue()
        for process in self._sees:
            self._free.put(process)
        self._measuring = ThreadPoolExecutor(self.processes, "live-measuring")
        self._grabbing = ThreadPoolExecutor(1, "live-camera")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._grabbing.shutdown()
        for process in self._sees:
            process.end()
        self._measuring.shutdown(cancel_futures=True)

    def looks(self, camera: Camera, timeout_s: float, most_hz: float) -> Iterator[Look]:
        """Looks without end, in the order of their frames, at most so many frames a second.

        Raises CameraTimeout, CameraUnavailable, ParameterError, WorkerEnded.
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
                    ahead.append((frame, self._measuring.submit(self._seen, frame)))
                grabbed = None
            while ahead and ahead[0][1].done():
                frame, seen = ahead.popleft()
                yield Look(frame, *seen.result())

    def _seen(self, frame: Frame) -> tuple[Measurement, PictureFigures]:
        process = self._free.get()
        try:
            seen: tuple[Measurement, PictureFigures] = process.answer(frame.pixels, frame.camera)
            return seen
        finally:
            self._free.put(process)

    def _unusable(self, error: FrameUnusable) -> Look:
        reason = Reason.SCENE_MOVED if isinstance(error, SceneMoved) else Reason.NO_FRAME
        return Look(None, Measurement(self._method, findings=((reason, str(error)),)), None)


def _wait_for(awaited: list[Future[Any]], at_most_s: float | None) -> None:
    """Return once one of them is done, or so much time has passed."""
    if awaited:
        wait(awaited, at_most_s, FIRST_COMPLETED)
    else:
        time.sleep(at_most_s or 0.0)
