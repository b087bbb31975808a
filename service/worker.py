"""A process of its own for work that must not hold up this one: Python lets one thread of a process work at a time."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection
from typing import Any

from contour.errors import ParameterError
from contour.image.side_by_side import keep_to_one_thread
from service.low_priority import NICENESS
from service.malloc import keep_freed


class WorkerEnded(Exception):
    """A process that works has ended by itself, or was killed."""


class Worker:
    """Answers one question at a time. An executor's pool would wait for ever for a question that is on its way to a
    process that was killed (Python before 3.11.5).
    """

    def __init__(self, work: Callable[..., Any], *, gives_way: bool) -> None:
        """work: makes the answers, and can be pickled as they can. gives_way: at a low priority."""
        spawn = get_context("spawn")
        self._here, there = spawn.Pipe()
        self._process = spawn.Process(target=_work, args=(there, work, gives_way), daemon=True)
        resource_tracker.ensure_running()  # else it is started with the first process, and unblocks the signal for it
        # A terminal sends Ctrl-C to all processes, and it is for the one that shows: a new one keeps what is blocked.
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            self._process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
            there.close()

    def answer(self, *question: Any) -> Any:
        """What the work makes of it; raise WorkerEnded, and ParameterError where the work did."""
        try:
            self._here.send(question)
            answer = self._here.recv()
        except (OSError, EOFError) as error:
            raise WorkerEnded("a process that measures has ended; is there memory enough?") from error
        if isinstance(answer, ParameterError):
            raise answer
        return answer

    def end(self) -> None:
        """It keeps nothing that could be lost; who waits for an answer is told."""
        self._process.kill()
        self._process.join()


def _work(there: Connection, work: Callable[..., Any], gives_way: bool) -> None:
    """Answer question after question, until nobody is left who asks."""
    if gives_way:
        os.setpriority(os.PRIO_PROCESS, 0, max(NICENESS, os.getpriority(os.PRIO_PROCESS, 0)))
    keep_to_one_thread()
    keep_freed()
    with suppress(OSError, EOFError):
        while True:
            question = there.recv()
            try:
                answer: object = work(*question)
            except ParameterError as error:
                answer = error
            there.send(answer)
