"""What a small computer would take: `python -m benchmarks.small_computer [--turns N] [--write]`, as root.

Commands and a daemon in control groups that allow them one processor, a share of its time, and 1 GB of memory, as far
as the kernel counts it; medians of the turns. A share is no slow processor: caches, memory and disk are this machine's.
On a small computer itself the column of 100 % says what it takes. `--write` puts the table into
docs/how-to/small-computers.md.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from statistics import median

import cv2

from benchmarks.page_section import put_section, table
from tests.support.processes.processes import COMBTRACE, ENVIRONMENT, ROOT, free_port, until

PAGE = ROOT / "docs" / "how-to" / "small-computers.md"
GROUPS = Path("/sys/fs/cgroup")
SHARES = (1.0, 0.5, 0.25)
MEMORY_BYTES = 1_000_000_000
PERIOD_US = 20_000
JOBS = 5
SIZES = {"2": (1600, 1200), "12": (4000, 3000)}


@dataclass
class Took:
    """By the clock, and the most memory that the kernel counted for the group, files it keeps for it included."""

    times_s: dict[str, float]
    memory_mb: dict[str, float]


class Group:
    """A control group, of the first version's controllers or the second's."""

    def __init__(self, share: float) -> None:
        self.old = (GROUPS / "cpu").is_dir()
        self.folders = [GROUPS / kind / "combtrace" for kind in (("cpu", "memory") if self.old else ("",))]
        for folder in self.folders:
            folder.mkdir(exist_ok=True)
        cpu, memory = self.folders[0], self.folders[-1]
        quota = int(share * PERIOD_US)
        if self.old:
            (cpu / "cpu.cfs_period_us").write_text(str(PERIOD_US))
            (cpu / "cpu.cfs_quota_us").write_text(str(quota))
        else:
            (cpu / "cpu.max").write_text(f"{quota} {PERIOD_US}")
        # Its share it gets whatever else runs here.
        (cpu / ("cpu.shares" if self.old else "cpu.weight")).write_text("262144" if self.old else "10000")
        (memory / ("memory.limit_in_bytes" if self.old else "memory.max")).write_text(str(MEMORY_BYTES))
        self._peak = memory / ("memory.max_usage_in_bytes" if self.old else "memory.peak")

    def command(self, *words: str | Path) -> list[str]:
        """The command line that runs a command in it, on one processor."""
        enter = " && ".join(f"echo $$ > {folder}/cgroup.procs" for folder in self.folders)
        return ["taskset", "--cpu-list", "0", "sh", "-c", f'{enter} && exec "$@"', "sh", *map(str, words)]

    @property
    def peak_mb(self) -> float:
        return int(self._peak.read_text()) / 1e6

    def remove(self) -> None:
        for folder in self.folders:
            folder.rmdir()


@contextmanager
def group(share: float) -> Iterator[Group]:
    made = Group(share)
    try:
        yield made
    finally:
        until(lambda: not any((folder / "cgroup.procs").read_text() for folder in made.folders), what="an empty group")
        made.remove()


def timed(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def traced(share: float, folder: Path, size: str, took: Took) -> None:
    """`combtrace trace` from start to exit."""
    with group(share) as limits:
        command = limits.command(*COMBTRACE, "trace", folder / size / "block.png", "--json", os.devnull)
        what = f"`combtrace trace`, {size} MP"
        took.times_s[what] = timed(lambda: subprocess.run(command, check=True, env=ENVIRONMENT, cwd=folder))
        took.memory_mb[what] = limits.peak_mb


def served(share: float, folder: Path, size: str, took: Took) -> None:
    """A daemon with its page: start to Ready, and jobs from a trigger's command to its answer."""
    config = folder / size / "config.yaml"
    config.write_text(
        f"camera: {{kind: files, path: block.png, loop: true}}\ncontroller: {{kind: none}}\ntriggers: []\n"
        f"recipes: [{{number: 1, name: default, thickness_mm: 0}}]\npage: {{port: {free_port()}}}\n"
        "service: {state_dir: state}\n"
    )
    with group(share) as limits:
        log = folder / size / f"{share}.log"
        with log.open("wb") as output:
            begun = time.perf_counter()
            command = limits.command(*COMBTRACE, "run", "--config", config)
            daemon = subprocess.Popen(command, stdout=output, stderr=output, env=ENVIRONMENT)
            until(lambda: "-> Ready" in log.read_text(), 300, "Ready")
        took.times_s[f"daemon, start to Ready, {size} MP"] = time.perf_counter() - begun
        try:
            for _ in range(JOBS):
                subprocess.run(
                    [*COMBTRACE, "trigger", "--config", config], check=True, capture_output=True, env=ENVIRONMENT
                )
        finally:
            daemon.terminate()
            daemon.wait()
        totals = [
            float(word.partition("=")[2]) / 1e3 for word in log.read_text().split() if word.startswith("total_ms=")
        ]
        what = f"a job of the daemon, {size} MP"
        took.times_s[what], took.memory_mb[what] = median(totals), limits.peak_mb


def measured(turns: int) -> dict[float, list[Took]]:
    """What each share took, turn by turn."""
    found: dict[float, list[Took]] = {share: [] for share in SHARES}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        sample = cv2.imread(str(ROOT / "service" / "samples" / "1-rectangle.jpg"), cv2.IMREAD_GRAYSCALE)
        for size, pixels in SIZES.items():
            (folder / size).mkdir()
            cv2.imwrite(str(folder / size / "block.png"), cv2.resize(sample, pixels, interpolation=cv2.INTER_CUBIC))
        for _ in range(turns):
            for share, each in found.items():
                took = Took({}, {})
                for size in SIZES:
                    traced(share, folder, size, took)
                    served(share, folder, size, took)
                each.append(took)
    return found


def written(found: dict[float, list[Took]], turns: int) -> str:
    """The table, with how it was made."""
    whole = found[SHARES[0]]
    rows = []
    for what in whole[0].times_s:
        times = [f"{median(one.times_s[what] for one in found[share]):.1f} s" for share in SHARES]
        memory = [one.memory_mb[what] for each in found.values() for one in each if what in one.memory_mb]
        rows.append([what, *times, f"{max(memory):.0f} MB" if memory else ""])
    head = ["what", *(f"{share:.0%} of a core" for share in SHARES), "most memory"]
    kernel = Path("/proc/cpuinfo").read_text().splitlines()
    model = next((line.partition(": ")[2] for line in kernel if "model name" in line), "unknown")
    made = f"{datetime.now(UTC):%Y-%m-%d}, medians of {turns} turns, one core of an {model}"
    made += f", 1 GB, load {os.getloadavg()[0]:.1f}."
    return f"{table(head, rows)}\n\n{made}"


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.small_computer", description=__doc__)
    parser.add_argument("--turns", type=int, default=3, metavar="N")
    parser.add_argument("--write", action="store_true", help="write the table into docs/how-to/small-computers.md")
    args = parser.parse_args()
    text = written(measured(args.turns), args.turns)
    print(text)
    if args.write:
        put_section("small", text, PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
