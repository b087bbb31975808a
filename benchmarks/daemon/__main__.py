"""What the daemon takes: `python -m benchmarks.daemon [--rest-s S]`.

From its start to Ready with a warm disk; at rest with the simulated controller on loopback, processor and memory; and
of a job with a 12 MP frame what the service adds to decoding and tracing. `--write` puts the table into
docs/reports/daemon-speed.md.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from textwrap import fill

from benchmarks.daemon.figure import Figure
from benchmarks.daemon.job import JobTimes, job_times
from benchmarks.page_section import put_section
from benchmarks.rest import SETTLES_S, medians_percent, share_percent
from tests.support.processes.cell import ON_SAMPLES, Cell
from tests.support.processes.processes import resident_megabytes, until

PAGE = Path(__file__).parents[2] / "docs" / "reports" / "daemon-speed.md"
PAGE_WIDTH = 120
READY_S, REST_PERCENT, REST_MEGABYTES, JOB_MS = 2.0, 2.0, 250.0, 50.0
STARTS = 5
RESTS = 3  # parts of the rest, of which the median counts


def seconds_to_ready(cell: Cell) -> float:
    """From the start of a new process to its Ready, as its log says."""
    seen = cell.service.text.count("-> Ready")
    cell.service.stop()
    begun = time.monotonic()
    cell.service = cell.start_service()
    until(lambda: cell.service.text.count("-> Ready") > seen, 60, "Ready")
    return time.monotonic() - begun


def measured(folder: Path, rest_s: float) -> list[Figure]:
    """All figures; a moment's other load on the machine counts against them."""
    cell = Cell(folder, camera=ON_SAMPLES, triggers="[{kind: controller}]", trigger_every_s=None)
    try:
        cell.ready()
        ready = [seconds_to_ready(cell) for _ in range(STARTS)]
        time.sleep(SETTLES_S)
        process = cell.service.process_id
        share = median(share_percent(process, rest_s / RESTS) for _ in range(RESTS))
        memory = resident_megabytes(process)
        cell.service.stop()
        (bare,) = medians_percent(["bare"], cell.port, rest_s / RESTS, RESTS)
    finally:
        cell.stop()
    return [
        Figure(f"start to Ready, warm disk, median of {STARTS}", median(ready), "s", READY_S),
        Figure(
            f"processor at rest, of one core (a bare loop that reads the controller as often: {bare:.2f} %)",
            *(share, "%", REST_PERCENT),
        ),
        Figure("memory at rest", memory, "MB", REST_MEGABYTES),
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; 1 where a goal is missed."""
    parser = argparse.ArgumentParser(prog="benchmarks.daemon", description=__doc__)
    parser.add_argument("--rest-s", type=float, default=30.0, metavar="S", help="how long rest is measured; default 30")
    parser.add_argument("--write", action="store_true", help="put the table into docs/reports/daemon-speed.md")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        figures = measured(Path(folder), args.rest_s)
        times = job_times(Path(folder) / "job")
    figures.append(Figure("trigger to accepted, 12 MP, decoding and tracing taken off", times.rest, "ms", JOB_MS))
    text = told(figures, times)
    print(text)
    if args.write:
        put_section("what-it-takes", text, PAGE)
    return 0 if all(figure.met for figure in figures) else 1


def told(figures: Sequence[Figure], times: JobTimes) -> str:
    """The table, and the job beside it, Markdown."""
    job = (
        f"{datetime.now(UTC):%Y-%m-%d}, on {os.cpu_count()} cores with a load of {os.getloadavg()[0]:.1f} at the end,"
        f" `make bench-daemon`, simulated controller on loopback. Of that job decoding took {times.decoding:.0f} ms and"
        f" tracing {times.tracing:.0f} ms; its evidence was durable {times.archiving:.0f} ms after the controller's"
        " answer was in the journal."
    )
    rows = "\n".join(str(figure) for figure in figures)
    return f"| what | measured | goal | met |\n|---|---|---|---|\n{rows}\n\n{fill(job, PAGE_WIDTH)}"


if __name__ == "__main__":
    sys.exit(main())
