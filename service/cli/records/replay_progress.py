"""How far a run over archives is, on a terminal as one line that changes, else as a line every half minute."""

from __future__ import annotations

import resource
import shutil
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Self, TextIO

if TYPE_CHECKING:
    from service.replays.run import Progress

EVERY_S = 30.0
REDRAWN_S = 0.5
BAR = 20


class ProgressTold:
    """Called with the progress as often as one likes; the last is told at the end."""

    def __init__(self, stream: TextIO, now: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream
        self._terminal = stream.isatty()
        self._now = now
        self._told_at = now()
        self._last: Progress | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._last is not None:
            self._write(self._last)
            if self._terminal:
                print(file=self._stream)

    def __call__(self, progress: Progress) -> None:
        self._last = progress
        if self._now() - self._told_at >= (REDRAWN_S if self._terminal else EVERY_S):
            self._told_at = self._now()
            self._write(progress)

    def _write(self, progress: Progress) -> None:
        line = progress_line(progress, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            print(f"\r{line[:width]}\x1b[K", end="", file=self._stream, flush=True)
        else:
            print(line, file=self._stream, flush=True)


def progress_line(progress: Progress, here_mb: float) -> str:
    """Jobs done, pace of all and of a worker, time left, what was left out, the most memory of a worker and of here."""
    done = progress.before + progress.done
    filled = BAR * done // max(progress.jobs, 1)
    told = [f"[{'#' * filled}{'.' * (BAR - filled)}] {done}/{progress.jobs} jobs"]
    if progress.waits:
        told.append("no worker is there: waiting for one")
    if progress.workers:
        each = sum(one.jobs_a_second for one in progress.workers.values()) / len(progress.workers)
        count = len(progress.workers)
        told.append(f"{progress.jobs_a_second:.2f} a second by {count} worker{'s' * (count > 1)} ({each:.2f} each)")
    if progress.left_s is not None:
        told.append(f"{lasting(progress.left_s)} left")
    if progress.left_out:
        told.append(f"{progress.left_out.total()} left out")
    if progress.workers:
        worker_mb = max(one.peak_mb for one in progress.workers.values())
        told.append(f"memory {worker_mb:.0f} MB a worker, {here_mb:.0f} MB here at most")
    return ", ".join(told)


def lasting(seconds: float) -> str:
    """A time as a person says it, rounded up."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = -(-int(seconds) // 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60:02d} min"
