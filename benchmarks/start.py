"""What a process's start and its first trace take: `python -m benchmarks.start [--turns N] [--write]`.

`combtrace trace` of a picture of 2 MP from the process's start to its exit, over a process that loads OpenCV, numpy and
pydantic and ends; the first trace in a process over the second; a daemon's first job over its tenth. Turn by turn, each
in a process of its own, with their bytecode written before, as pip leaves an installed package. Medians of the turns'
ratios; the processor's beside the clock's, as other load on the machine falls on the clock. And the memory that a trace
of 12 MP takes. `--write` puts the table into docs/reports/start-speed.md.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from statistics import median
from textwrap import fill

import cv2
import numpy as np

from benchmarks.daemon.job import HEIGHT, WIDTH, in_turn
from benchmarks.page_section import put_section, table
from service.config.plain_recipe import PlainRecipe
from service.measuring.measure import Measurer
from tests.support.processes.cell import SAMPLES

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "reports" / "start-speed.md"
PAGE_WIDTH = 120
PICTURE = SAMPLES / "2-l-shape.jpg"
BARE = (sys.executable, "-c", "import cv2, numpy, pydantic")
TRACE = (sys.executable, "-m", "service.cli.main", "trace", str(PICTURE))
JOBS = 10
DAEMONS = 5

Took = tuple[float, float]
"""Seconds by the clock, and of processor, user and system, all threads."""


def took(work: Callable[[], object], whose: int = resource.RUSAGE_SELF) -> Took:
    """What the work took this process, or, with RUSAGE_CHILDREN, those that it started and waited for."""
    before, begun = resource.getrusage(whose), time.perf_counter()
    work()
    clock_s, after = time.perf_counter() - begun, resource.getrusage(whose)
    return clock_s, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def run(command: Sequence[str], bytecode: str) -> str:
    """The standard output of a process, started with the bytecode of that folder."""
    variables = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    variables |= {"PYTHONPATH": str(ROOT), "PYTHONPYCACHEPREFIX": bytecode}
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=variables).stdout


def pairs(turns: int, one: Callable[[], list[Took]]) -> list[list[Took]]:
    """The first and the second of so many turns; one before them warms the disk."""
    return [one() for _ in range(turns + 1)][1:]


def whole_processes(bytecode: str) -> list[Took]:
    """A trace from start to exit, and the bare process."""
    return [took(partial(run, command, bytecode), resource.RUSAGE_CHILDREN) for command in (TRACE, BARE)]


def inside(what: str, bytecode: str) -> list[Took]:
    """What a new process of this module measures in itself."""
    return [(clock, processor) for clock, processor in json.loads(run((*THIS, what), bytecode))]


THIS = (sys.executable, "-m", "benchmarks.start", "--inside")


# --- in processes of their own ----------------------------------------------------------------------------------------


def first_traces() -> list[Took]:
    """The first trace in this process, and the second."""
    picture, measurer = np.asarray(cv2.imread(str(PICTURE)), np.uint8), Measurer(None)
    return [took(lambda: measurer.measure(picture, PlainRecipe(), 0.0)) for _ in range(2)]


def first_jobs() -> list[Took]:
    """Trigger to accepted with a frame of 12 MP, a daemon's first job and its tenth; the processor is not told."""
    with tempfile.TemporaryDirectory() as folder:
        jobs = asyncio.run(in_turn(Path(folder) / "job", JOBS))
    return [(job.whole / 1000, 0.0) for job in (jobs[0], jobs[-1])]


def memory() -> list[Took]:
    """By how much a picture of 12 MP in grey and its trace raise the process's peak, and the picture's own size, MB."""
    small = np.asarray(cv2.imread(str(PICTURE), cv2.IMREAD_GRAYSCALE))
    before_mb = _peak_mb()
    picture = np.asarray(cv2.resize(small, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC), np.uint8)
    Measurer(None).measure(picture, PlainRecipe(), 0.0)
    return [(_peak_mb() - before_mb, picture.nbytes / 1e6)]


def _peak_mb() -> float:
    """This program's peak by proc(5); getrusage's would be that of the process before it became this program, too."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 / 1e6 for line in lines if line.startswith("VmHWM:"))


INSIDE = {"traces": first_traces, "jobs": first_jobs, "memory": memory}


# --- the table --------------------------------------------------------------------------------------------------------


def row(what: str, found: list[list[Took]], must: str, aim: str) -> list[str]:
    """A line: the medians of both, of their ratios by the clock and by the processor, and the goals."""
    one, other = (1000 * median(turn[k][0] for turn in found) for k in (0, 1))
    clock = median(first[0] / second[0] for first, second in found)
    processor = [first[1] / second[1] for first, second in found if second[1]]
    told = f"{median(processor):.2f} ×" if processor else ""
    return [what, f"{one:.0f} / {other:.0f} ms", f"{clock:.2f} ×", told, must, aim]


def measured(turns: int) -> str:
    """The table, and what belongs to it in words, Markdown."""
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as bytecode:
        whole = pairs(turns, lambda: whole_processes(bytecode))
        traces = pairs(turns, lambda: inside("traces", bytecode))
        jobs = pairs(DAEMONS, lambda: inside("jobs", bytecode))
        ((held, size),) = inside("memory", bytecode)
    head = ["what", "medians", "ratio by the clock", "by the processor", "must", "aim"]
    rows = [
        row("`combtrace trace` of 2 MP, start to exit / `import cv2, numpy, pydantic`", whole, "≤ 2.5 ×", "≤ 1.8 ×"),
        row("first trace in a process / the second, 2 MP", traces, "≤ 1.5 ×", "≤ 1.1 ×"),
        row(f"first job of a daemon / the tenth, 12 MP, of {DAEMONS} daemons", jobs, "", ""),
    ]
    told = (
        f"{datetime.now(UTC):%Y-%m-%d}, `make bench-start`, {turns} turns on {os.cpu_count()} cores with a load of"
        f" {load:.1f} at the beginning and {os.getloadavg()[0]:.1f} at the end. A grey picture of 12 MP and its trace"
        f" take {held:.0f} MB at most, {held / size:.1f} times the picture's own size."
    )
    return f"{table(head, rows)}\n\n{fill(told, PAGE_WIDTH)}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="benchmarks.start", description=__doc__)
    parser.add_argument("--turns", type=int, default=15, metavar="N", help="of each comparison; default 15")
    parser.add_argument("--write", action="store_true", help=f"put the table into docs/reports/{PAGE.name}")
    parser.add_argument("--inside", choices=INSIDE, help=argparse.SUPPRESS)
    args = parser.parse_args(arguments)
    if args.inside:
        print(json.dumps(INSIDE[args.inside]()))
        return 0
    text = measured(args.turns)
    print(text)
    if args.write:
        put_section("start", text, PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
