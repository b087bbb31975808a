"""A run over archives: batches out to workers, rows in, parts written; what a worker loses is done again."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from service.records.evidence import Flaw
from service.replays.rows import COLUMNS, Row
from service.replays.run_files import RunFiles
from service.replays.work import Done, JobName, Lost, Work, left_out
from service.replays.workers import Task, Workers

MOST_TRIES: Final = 3
MOST_PUT_OFF: Final = 1000  # batches that wait for a storage to answer again; more would fill the memory
WAIT_S: Final = 0.5


@dataclass
class WorkerFigures:
    """What one worker has done."""

    jobs: int = 0
    busy_s: float = 0.0
    peak_mb: float = 0.0

    @property
    def jobs_a_second(self) -> float:
        """While it was busy."""
        return self.jobs / self.busy_s if self.busy_s else 0.0


@dataclass
class Progress:
    """How far a run is. before: jobs that earlier runs of the same command did. waits: there is no worker now."""

    jobs: int
    before: int
    done: int = 0
    elapsed_s: float = 0.0
    waits: bool = False
    left_out: Counter[str] = field(default_factory=Counter)
    workers: dict[str, WorkerFigures] = field(default_factory=dict)

    @property
    def left_s(self) -> float | None:
        """Seconds to go at the pace of this run; None before the first job."""
        todo = self.jobs - self.before - self.done
        return self.elapsed_s * todo / self.done if self.done else None

    @property
    def jobs_a_second(self) -> float:
        """Of all workers together."""
        return self.done / self.elapsed_s if self.elapsed_s else 0.0


class Run:
    """One run to its end."""

    def __init__(
        self,
        work: Work,
        files: RunFiles,
        workers: Workers,
        tell: Callable[[Progress], None],
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """tell: called whenever there is something new, and twice a second."""
        self._work = work
        self._files = files
        self._workers = workers
        self._tell = tell
        self._now = now
        self._missing = deque(files.missing())
        self._urgent: deque[Task] = deque()
        self._put_off: deque[Task] = deque()
        self._rows: dict[int, dict[JobName, Row]] = {}  # of batches that are not whole
        to_do = sum(map(files.size, self._missing))
        self.progress = Progress(files.jobs, files.jobs - to_do)

    def carry_out(self) -> None:
        """Do all that is missing; raise ReplayError."""
        begun, flying = self._now(), 0
        while self._left or flying:
            while self._left and flying < self._workers.room:
                self._workers.begin(self._next())
                flying += 1
            ended = self._workers.ended(WAIT_S)
            self.progress.elapsed_s = self._now() - begun
            self.progress.waits = self._workers.room == 0
            if ended is not None:
                flying -= 1
                if ended.done is None:
                    self._again(ended.task)
                else:
                    self._take(ended.task, ended.done)
            self._tell(self.progress)

    @property
    def _left(self) -> int:
        return len(self._urgent) + len(self._missing) + len(self._put_off)

    def _next(self) -> Task:
        if self._urgent:
            return self._urgent.popleft()
        if self._missing:
            number = self._missing.popleft()
            return Task(number, tuple(self._files.batch(number)))
        return self._put_off.popleft()

    def _again(self, task: Task) -> None:
        """The task's worker ended: again, then job by job; a job that always ends its worker is left out."""
        if task.tries + 1 < MOST_TRIES:
            self._urgent.append(Task(task.batch, task.names, task.tries + 1))
        elif len(task.names) > 1:
            self._urgent.extend(Task(task.batch, (name,)) for name in task.names)
        else:
            (name,) = task.names
            told = f"job {name.job_id}: its worker ended {MOST_TRIES} times. Is there memory enough?"
            row = {**self._work.row_of_name(name), **left_out(Lost.WORKER_ENDED, told)}
            self._keep(task, {name: {column: row.get(column) for column in COLUMNS}})

    def _take(self, task: Task, done: Done) -> None:
        """Keep the rows; jobs whose storage did not answer are put off to the end, twice."""
        figures = self.progress.workers.setdefault(done.worker, WorkerFigures())
        figures.jobs += len(task.names)
        figures.busy_s += done.busy_s
        figures.peak_mb = max(figures.peak_mb, done.peak_mb)
        rows = dict(zip(task.names, done.rows, strict=True))
        silent = tuple(name for name, row in rows.items() if row["left_out"] == Flaw.STORAGE)
        if silent and task.tries + 1 < MOST_TRIES and len(self._rows) < MOST_PUT_OFF:
            self._put_off.append(Task(task.batch, silent, task.tries + 1))
            rows = {name: row for name, row in rows.items() if name not in silent}
        self._keep(task, rows)

    def _keep(self, task: Task, rows: dict[JobName, Row]) -> None:
        """Write the batch where it is whole."""
        known = self._rows.setdefault(task.batch, {})
        known.update(rows)
        self.progress.done += len(rows)
        self.progress.left_out.update(row["left_out"] for row in rows.values() if row["left_out"] is not None)
        if len(known) == self._files.size(task.batch):
            self._files.put(task.batch, [known[name] for name in self._files.batch(task.batch)])
            del self._rows[task.batch]
