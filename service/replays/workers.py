"""Who does batches of jobs: processes of this machine, or a Dask cluster. Both are handed names, and hand back rows."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from types import TracebackType
from typing import Protocol, Self

from service.replays.work import Done, JobName, Work
from service.worker import Worker, WorkerEnded

AHEAD = 2  # batches on their way to a worker: the next is there when one ends


@dataclass(frozen=True)
class Task:
    """Jobs of one batch that are done together. tries: how often that was begun before."""

    batch: int
    names: tuple[JobName, ...]
    tries: int = 0


@dataclass(frozen=True)
class Ended:
    """A task, and what came of it; None where the worker that had it ended, so that it is to be done again."""

    task: Task
    done: Done | None


class Workers(Protocol):
    """Does tasks, several at a time, in no order."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    @property
    def room(self) -> int:
        """How many tasks may be on their way now; raise ReplayError where no worker there is may be used."""

    @property
    def left_out(self) -> dict[str, str]:
        """Workers that are given nothing, and why."""

    def begin(self, task: Task) -> None:
        """Hand a task over; it does not block."""

    def ended(self, at_most_s: float) -> Ended | None:
        """The next that ends, None where none does so soon; raise ReplayError where none can any more."""


class Processes:
    """Processes of this machine, one core each, at a low priority: a daemon's jobs go first."""

    def __init__(self, work: Work, count: int) -> None:
        self._work = work
        self._count = count
        self._tasks: SimpleQueue[Task | None] = SimpleQueue()
        self._ended: SimpleQueue[Ended | BaseException] = SimpleQueue()
        self._workers: list[Worker | None] = [None] * count
        self._closing = False
        self._threads = [threading.Thread(target=self._serve, args=(place,), name="replay") for place in range(count)]

    def __enter__(self) -> Self:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """What is being done is dropped: its batch is not written, and the next run does it."""
        self._closing = True
        for _ in self._threads:
            self._tasks.put(None)
        for thread in self._threads:
            while thread.is_alive():
                for worker in self._workers:
                    if worker is not None:
                        worker.end()
                thread.join(0.05)

    @property
    def room(self) -> int:
        return self._count * AHEAD

    @property
    def left_out(self) -> dict[str, str]:
        return {}  # they are of this installation

    def begin(self, task: Task) -> None:
        self._tasks.put(task)

    def ended(self, at_most_s: float) -> Ended | None:
        try:
            found = self._ended.get(timeout=at_most_s)
        except Empty:
            return None
        if isinstance(found, BaseException):
            raise found
        return found

    def _serve(self, place: int) -> None:
        """Have one process do task after task, and start another where it ends."""
        try:
            while not self._closing and (task := self._tasks.get()) is not None:
                self._ended.put(self._one(place, task))
        except Exception as error:  # noqa: BLE001 - told to who waits for the task, in its thread
            self._ended.put(error)
        finally:
            self._drop(place)

    def _one(self, place: int, task: Task) -> Ended:
        worker = self._workers[place]
        if worker is None:
            worker = self._workers[place] = Worker(self._work.done, gives_way=True)
        try:
            return Ended(task, worker.answer(task.names))
        except WorkerEnded:
            self._drop(place)
            return Ended(task, None)

    def _drop(self, place: int) -> None:
        worker, self._workers[place] = self._workers[place], None
        if worker is not None:
            worker.end()
