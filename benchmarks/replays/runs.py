"""Whole runs over an archive, with what they took and what became of their rows."""

from __future__ import annotations

import os
import random
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from service.replays.places import Place
from service.replays.rows import OF_THE_RUN
from service.replays.run import Progress, Run
from service.replays.run_files import RunFiles
from service.replays.work import JobName, Work
from service.replays.workers import Workers
from tests.support.processes.processes import resident_megabytes

EARLY = 0.2  # of the jobs, from where on memory is to stay as it is
TICKS = os.sysconf("SC_CLK_TCK")


@dataclass
class Took:
    """What a run took. own_cpu_s: of the process that hands out and writes, and of a scheduler beside it.

    tracing_s: processor time of all jobs, as one process alone needs it.
    """

    jobs: int
    tracing_s: float = 0.0
    elapsed_s: float = 0.0
    busy_s: float = 0.0
    own_cpu_s: float = 0.0
    here_mb: list[float] = field(default_factory=list)
    worker_mb: list[float] = field(default_factory=list)
    kills: int = 0

    @property
    def overhead(self) -> float:
        """Handing out and writing, of tracing; both by the processor."""
        return self.own_cpu_s / self.tracing_s

    @property
    def idle(self) -> float:
        """Of the workers' time, their start in it; two of them."""
        return 1 - self.busy_s / (2 * self.elapsed_s)


def carried_out(
    place: Place,
    output: Path,
    workers: Callable[[Work], Workers],
    *,
    kills: int = 0,
    seed: int = 0,
    scheduler: int | None = None,
) -> Took:
    """The table of a whole run; kill -9 of workers at random moments. scheduler: the number of its process."""
    work = Work((place,))
    took = Took(0)
    moments = random.Random(seed)
    with RunFiles(output, {"bench": place.address}) as files:
        files.open([JobName(0, job, ended) for job, ended in sorted(place.jobs())])
        took.jobs = files.jobs
        due = sorted(moments.sample(range(took.jobs // 20, took.jobs * 9 // 10), kills))

        def tell(progress: Progress) -> None:
            if progress.done > EARLY * took.jobs:
                took.here_mb.append(resident_megabytes(os.getpid()))
                took.worker_mb.append(max(one.peak_mb for one in progress.workers.values()))
            while due and progress.done >= due[0]:
                due.pop(0)
                took.kills += 1
                threading.Timer(moments.random(), _kill_one, (progress, moments)).start()

        own, beside = time.process_time(), _cpu_s(scheduler)
        with workers(work) as started:
            run = Run(work, files, started, tell)
            run.carry_out()
        took.own_cpu_s = time.process_time() - own + _cpu_s(scheduler) - beside
        files.join({})
    took.elapsed_s = run.progress.elapsed_s
    took.busy_s = sum(one.busy_s for one in run.progress.workers.values())
    return took


def _kill_one(progress: Progress, moments: random.Random) -> None:
    """End one of those processes that have done something and are alive, wherever it is."""
    there = [int(name.rpartition(":")[2]) for name in list(progress.workers)]
    moments.shuffle(there)
    for number in there:
        try:
            os.kill(number, signal.SIGKILL)
        except ProcessLookupError:
            continue
        return


def cpu_a_job_s(place: Place, jobs: int) -> float:
    """Processor time of a job in this process, reading and decoding in it: what other load does not change much."""
    work = Work((place,))
    names = [JobName(0, job, ended) for job, ended in sorted(place.jobs())][:jobs]
    work.done(names[:2])
    begun = time.process_time()
    work.done(names)
    return (time.process_time() - begun) / len(names)


def _cpu_s(process: int | None) -> float:
    """Processor time of a process, 0 where there is none."""
    if process is None:
        return 0.0
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def rows(output: Path) -> list[dict[str, Any]]:
    """The rows of a table, without what is another each time."""
    import pyarrow.parquet as pq

    return [
        {key: value for key, value in row.items() if key not in OF_THE_RUN} for row in pq.read_table(output).to_pylist()
    ]
