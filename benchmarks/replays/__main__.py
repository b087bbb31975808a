"""Whole archives done again: `python -m benchmarks.replays [--jobs 2000] [--write]`, eight minutes on two quiet cores.

An archive of rendered blocks of 640 x 480 px, small so that 2,000 jobs end in minutes; what handing out, writing and
reading cost weighs more than on a plant's frames. One process, two, and a Dask cluster of two do it; two of which ten
are killed; and two from a bucket (moto's server, on the same cores) that answers one read in twenty with 503. Then
jobs of 1600 x 1200 px by one process, from which the cost of a million is reckoned. `--write` puts it all into
docs/reports/replays.md.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from textwrap import fill

from benchmarks.page_section import put_section, table
from benchmarks.replays.runs import Took, carried_out, cpu_a_job_s, rows
from service.replays.cluster import Cluster
from service.replays.places import Place
from service.replays.workers import Processes
from tests.support.service.archives import write_archive
from tests.support.service.bucket_server import BUCKET, bucket
from tests.support.service.dask_cluster import cluster

PAGE = Path(__file__).parents[2] / "docs" / "reports" / "replays.md"
PAGE_WIDTH = 120
SMALL, LARGE = (640, 480), (1600, 1200)
LARGE_JOBS = 40
FAILS_EVERY = 20
TWICE, TWICE_BY_DASK, OVERHEAD, FLAT = 1.9, 1.85, 0.02, 0.05
MILLION = 1_000_000


@dataclass(frozen=True)
class Measured:
    """All runs over the small archive, whether their rows were the first one's, and the large one's."""

    took: dict[str, Took]
    same: dict[str, bool]
    large: Cost


@dataclass(frozen=True)
class Cost:
    """Of one job of 1600 x 1200 px: processor time and bytes; and what the rest costs of any."""

    trace_s: float
    bucket_s: float
    bytes: float
    own_s: float
    dask_s: float


def measured(folder: Path, jobs: int, kills: int, seed: int) -> Measured:
    """Each run on the same archive."""
    archive = folder / "cell"
    write_archive(archive, jobs, width=SMALL[0], height=SMALL[1])
    here = Place("cell", str(archive))
    a_job_s = cpu_a_job_s(here, 100)
    took = {}
    for name, count, killed in (("one", 1, 0), ("two", 2, 0), ("killed", 2, kills)):
        _say(name)
        took[name] = carried_out(
            here, folder / f"{name}.parquet", lambda work, count=count: Processes(work, count), kills=killed, seed=seed
        )
    _say("dask")
    with cluster(folder) as dask:
        for _ in range(2):
            dask.add_worker()
        dask.wait_for(2)
        took["dask"] = carried_out(
            here, folder / "dask.parquet", lambda work: Cluster(work, dask.url), scheduler=dask.scheduler
        )
    _say("bucket")
    with bucket(archive, fails_every=FAILS_EVERY) as variables:
        os.environ.update(variables)
        there = Place("cell", f"s3://{BUCKET}/cell")
        took["bucket"] = carried_out(there, folder / "bucket.parquet", lambda work: Processes(work, 2))
    for run in took.values():
        run.tracing_s = a_job_s * run.jobs
    first = rows(folder / "one.parquet")
    same = {name: rows(folder / f"{name}.parquet") == first for name in took}
    return Measured(took, same, cost(folder, took))


def cost(folder: Path, took: dict[str, Took]) -> Cost:
    """Of a job of larger frames, by one process."""
    _say("large")
    import pyarrow.parquet as pq

    archive = folder / "large"
    write_archive(archive, LARGE_JOBS, width=LARGE[0], height=LARGE[1])
    size = sum(path.stat().st_size for path in archive.rglob("*") if path.is_file()) / LARGE_JOBS
    reads = pq.read_table(folder / "bucket.parquet", columns=["read_ms"])["read_ms"].to_pylist()
    return Cost(
        cpu_a_job_s(Place("large", str(archive)), LARGE_JOBS),
        median(reads) / 1000,
        size,
        took["two"].own_cpu_s / took["two"].jobs,
        took["dask"].own_cpu_s / took["dask"].jobs,
    )


def _say(name: str) -> None:
    print(f"{datetime.now(UTC):%H:%M:%S} {name}", file=sys.stderr, flush=True)


def figures(found: Measured) -> list[tuple[str, str, str, bool]]:
    """What is held to a goal: what, measured, goal, met."""
    one = found.took["one"].elapsed_s
    lines = []
    for name, what, goal in (("two", "two processes", TWICE), ("dask", "a Dask cluster of two", TWICE_BY_DASK)):
        ratio = one / found.took[name].elapsed_s
        lines.append((f"{what}, times as fast as one", f"{ratio:.2f}", f"≥ {goal}", ratio >= goal))
        took = found.took[name]
        share = f"{100 * took.overhead:.2f} %"
        lines.append((f"handing out and writing, {what}, of tracing", share, "≤ 2 %", took.overhead <= OVERHEAD))
        for what_of, memory in (("a worker", took.worker_mb), ("here", took.here_mb)):
            grown = max(memory) / memory[0] - 1
            told = f"{memory[0]:.0f} to {max(memory):.0f} MB"
            lines.append((f"memory of {what_of}, {what}, from a fifth on", told, "+ 5 %", grown <= FLAT))
    for name, what in (
        ("killed", f"{found.took['killed'].kills} workers killed (-9) at random moments"),
        ("bucket", f"from a bucket, one read in {FAILS_EVERY} answered with 503"),
        ("dask", "from the cluster"),
        ("two", "from two processes"),
    ):
        same = found.same[name]
        lines.append((f"rows {what}, as one process's", "the same" if same else "OTHERS", "the same", same))
    return lines


def told(found: Measured) -> str:
    """The table, the runs, and a million on paper; Markdown."""
    lines = figures(found)
    goals = "| what | measured | goal | met |\n|---|---|---|---|\n" + "\n".join(
        f"| {what} | {value} | {goal} | {'yes' if met else '**no**'} |" for what, value, goal, met in lines
    )
    runs = table(
        ["run", "s", "jobs a second", "workers idle, start included"],
        [
            [name, f"{took.elapsed_s:.1f}", f"{took.jobs / took.elapsed_s:.2f}", f"{100 * took.idle:.1f} %"]
            for name, took in found.took.items()
            if name != "one"
        ],
    )
    one = found.took["one"]
    about = fill(
        f"{datetime.now(UTC):%Y-%m-%d}, {one.jobs} jobs of {SMALL[0]} x {SMALL[1]} px, on {os.cpu_count()} cores "
        f"with a load of {os.getloadavg()[0]:.1f} at the end, `python -m benchmarks.replays`. One process took "
        f"{one.elapsed_s:.1f} s. The bucket's server had the same cores as the workers.",
        PAGE_WIDTH,
    )
    return f"{goals}\n\n{about}\n\n{runs}\n\n{on_paper(found.large)}"


def on_paper(one: Cost) -> str:
    """What a million frames cost, from what one did."""
    hours = MILLION * one.trace_s / 3600
    network = one.bytes / one.trace_s  # of one core
    lines = [
        ["processor, all workers", f"{hours:.0f} core-hours", f"{1000 * one.trace_s:.0f} ms a job, decoding in it"],
        ["reading", f"{MILLION * one.bytes / 1e12:.2f} TB", f"{one.bytes / 1e6:.2f} MB a job, document and frame"],
        [
            "requests to a bucket",
            "2.0 million",
            "two a job; a table once a job that names one; a listing a thousand names",
        ],
        [
            "waiting for a bucket",
            f"{MILLION * one.bucket_s / 3600:.0f} hours",
            f"{1000 * one.bucket_s:.1f} ms a small job",
        ],
        ["network, a core", f"{8 * network / 1e6:.0f} Mbit/s", "bytes over time of a job"],
        ["knee by the network", f"{1.25e9 / network:.0f} cores", "10 Gbit/s, used up"],
        ["knee by handing out, processes", f"{one.trace_s / one.own_s:.0f} cores", f"{1e3 * one.own_s:.2f} ms a job"],
        ["knee by handing out, Dask", f"{one.trace_s / one.dask_s:.0f} cores", f"{1e3 * one.dask_s:.2f} ms a job"],
    ]
    head = f"A million frames of {LARGE[0]} x {LARGE[1]} px, reckoned from {LARGE_JOBS} of them by one process:"
    return f"{head}\n\n{table(['what', 'a million', 'from'], lines)}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables; 1 where a goal is missed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.replays", description=__doc__)
    parser.add_argument("--jobs", type=int, default=2000, metavar="N", help="jobs of the archive; default 2000")
    parser.add_argument("--kills", type=int, default=10, metavar="N", help="workers killed; default 10")
    parser.add_argument("--seed", type=int, default=18, metavar="N", help="of the moments of kills")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/reports/replays.md")
    args = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        found = measured(Path(folder), args.jobs, args.kills, args.seed)
    text = told(found)
    print(text)
    if args.write:
        put_section("what-replays-take", text, PAGE)
    return 0 if all(met for *_, met in figures(found)) else 1


if __name__ == "__main__":
    sys.exit(main())
