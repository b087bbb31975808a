"""Thousands of jobs in one daemon: its memory, descriptors, archive and journal. `make soak-daemon [JOBS=20000]`.

The daemon and the simulated controller run as processes, on small frames; every fifth picture shows an empty table. The
daemon's memory after the first jobs is held against that at each later look. `--write` puts the report into
docs/reports/reliability.md.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sqlite3
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path, PurePath
from textwrap import wrap

import cv2
import numpy as np

from service.cli.daemon.run import FILE_THREADS
from tests.support.processes.cell import SAMPLES, Cell
from tests.support.processes.processes import resident_megabytes, until

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reports" / "reliability.md"
BEGIN, END = "<!-- long run: written by `make soak-daemon` -->", "<!-- end of long run -->"
JOBS = 20_000
WARM_UP = 1000  # jobs in which caches fill
MOST_GROWTH_MB = 5.0
ARCHIVE_BYTES = 20_000_000
WIDTH, HEIGHT = 267, 200
STALLED_S = 60.0
LOOK_S = 2.0
PAGE_WIDTH = 120
GLANCES, GLANCE_S = 6, 0.05
MORE = """\
archive: {{path: archive, max_bytes: {max_bytes}, min_free_bytes: 0}}
recipes: [{{number: 1, name: small, method: sliding-matrix, max_disagreement_pitches: 0}}]
"""


@dataclass(frozen=True)
class Look:
    """The daemon at one moment. descriptors: those that stay open. archive_bytes: as `du` says, in whole blocks."""

    jobs: int
    seconds: float
    memory_mb: float
    descriptors: int
    threads: int
    archive_bytes: int
    passing: frozenset[str] = frozenset()
    """What was open for a moment only."""


@dataclass
class Course:
    """A run's looks, and what the journal says at its end."""

    archive_bound: int
    looks: list[Look] = field(default_factory=list)
    outcomes: dict[str, int] = field(default_factory=dict)
    unsettled: int = 0
    journal_bytes: int = 0

    @property
    def first(self) -> Look:
        """The first look after the caches have filled."""
        warm = [look for look in self.looks if look.jobs >= min(WARM_UP, self.looks[-1].jobs // 2)]
        return warm[0]

    @property
    def later(self) -> list[Look]:
        """All looks from then on."""
        return [look for look in self.looks if look.jobs >= self.first.jobs]

    @property
    def growth_mb(self) -> float:
        """From then on to the highest."""
        return max(look.memory_mb for look in self.later) - self.first.memory_mb

    @property
    def descriptors(self) -> tuple[int, int]:
        """Fewest and most from then on."""
        found = [look.descriptors for look in self.later]
        return min(found), max(found)

    @property
    def threads(self) -> int:
        """Most from then on."""
        return max(look.threads for look in self.later)

    def faults(self) -> list[str]:
        """What does not hold, in words."""
        low, high = self.descriptors
        found = {
            f"memory grew by {self.growth_mb:.1f} MB, {MOST_GROWTH_MB:g} are allowed": self.growth_mb > MOST_GROWTH_MB,
            f"descriptors went from {low} to {high}": high > low,
            f"threads went from {self.first.threads} to {self.threads}": self.threads
            >= self.first.threads + FILE_THREADS,
            "the archive left its bound": any(look.archive_bytes > self.archive_bound for look in self.looks),
            f"{self.unsettled} jobs have no end": self.unsettled > 1,  # one may be cut short by the stop
        }
        return [text for text, broken in found.items() if broken]


def write_pictures(folder: Path) -> Path:
    """Four small blocks and an empty table; the folder."""
    folder.mkdir()
    for number, sample in enumerate(sorted(SAMPLES.glob("*.jpg")), start=1):
        picture = cv2.imread(str(sample), cv2.IMREAD_GRAYSCALE)
        cv2.imwrite(str(folder / f"{number}.png"), cv2.resize(picture, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA))
    empty = np.random.default_rng(1).integers(60, 80, (HEIGHT, WIDTH), dtype=np.uint8)
    cv2.imwrite(str(folder / "5-empty.png"), empty)
    (folder.parent / "small.yaml").write_text(
        f"{{version: 1, kind: simple, image_width: {WIDTH}, image_height: {HEIGHT}, mm_per_pixel: 2.25,"
        " plane_height_mm: 20, origin_px: [10, 190], rotation_deg: 0}\n"
    )
    return folder


def open_files(process: int) -> frozenset[str]:
    """What a process has open, each with its number."""
    found = set()
    for path in Path(f"/proc/{process}/fd").iterdir():
        try:
            found.add(f"{path.name} {os.readlink(path)}")
        except FileNotFoundError:  # closed meanwhile
            continue
    return frozenset(found)


def descriptors(process: int) -> tuple[int, frozenset[str]]:
    """How many stay open, and what is open only now and then: a frame that is read, evidence that is written."""
    seen = []
    for _ in range(GLANCES):
        seen.append(open_files(process))
        time.sleep(GLANCE_S)
    lasting = frozenset.intersection(*seen)
    passing = frozenset.union(*seen) - lasting
    return len(lasting), frozenset(PurePath(name.partition(" ")[2]).suffix or "a folder" for name in passing)


def look(cell: Cell, jobs: int, begun: float) -> Look:
    """The daemon now."""
    process = cell.service.process_id
    files = [path for path in (cell.folder / "archive").rglob("*") if path.is_file()]
    sizes = 0
    for path in files:
        try:
            sizes += -(-path.stat().st_size // 4096) * 4096
        except FileNotFoundError:  # let go meanwhile
            continue
    lasting, passing = descriptors(process)
    return Look(
        jobs,
        time.monotonic() - begun,
        resident_megabytes(process),
        lasting,
        len(os.listdir(f"/proc/{process}/task")),
        sizes,
        passing,
    )


def ended(journal: Path) -> dict[str, int]:
    """Jobs by outcome, "in flight" for those without one."""
    try:
        database = sqlite3.connect(f"file:{journal}?mode=ro", uri=True, timeout=5)
    except sqlite3.OperationalError:
        return {}
    try:
        rows = database.execute("SELECT COALESCE(outcome, 'in flight'), COUNT(*) FROM jobs GROUP BY 1").fetchall()
    except sqlite3.OperationalError:  # its tables are not made yet
        return {}
    finally:
        database.close()
    return dict(rows)


def run(folder: Path, jobs: int, looks: int = 20, archive_bytes: int = ARCHIVE_BYTES) -> Course:
    """So many jobs, looked at so often."""
    folder.mkdir(exist_ok=True)
    pictures = write_pictures(folder / "pictures")
    cell = Cell(
        folder,
        camera=f"{{kind: files, path: {pictures}, loop: true}}",
        calibration=folder / "small.yaml",
        trigger_every_s=0.02,
        link=", poll_period_s: 0.01",
        more=MORE.format(max_bytes=archive_bytes),
    )
    course = Course(archive_bytes)
    begun, moved_at, done = time.monotonic(), time.monotonic(), 0
    try:
        cell.ready()
        while done < jobs:
            time.sleep(min(LOOK_S, jobs / 1000))
            count = sum(ended(cell.journal).values())
            moved_at = time.monotonic() if count > done else moved_at
            if time.monotonic() - moved_at > STALLED_S or not cell.service.running:
                raise RuntimeError(f"no job for {STALLED_S:g} s after {count}: {cell.service.text[-2000:]}")
            done = count
            if done >= (len(course.looks) + 1) * jobs / looks:
                course.looks.append(look(cell, done, begun))
                print(course.looks[-1], flush=True)
        cell.service.stop()
        found = ended(cell.journal)
        course.unsettled = found.pop("in flight", 0)
        course.outcomes = found
        course.journal_bytes = cell.journal.stat().st_size
        until(lambda: not cell.service.running, what="the daemon's end")
    finally:
        cell.stop()
    return course


def report(course: Course) -> str:
    """The section, Markdown."""
    first, last = course.first, course.looks[-1]
    low, high = course.descriptors
    passing = frozenset[str]().union(*(look.passing for look in course.later))
    outcomes = ", ".join(f"{count} {name}" for name, count in sorted(course.outcomes.items()))
    largest = max(look.archive_bytes for look in course.looks)
    rows = [
        ("memory growth after the first jobs", f"{course.growth_mb:.1f} MB", f"≤ {MOST_GROWTH_MB:g} MB"),
        ("memory at first, at last", f"{first.memory_mb:.1f}, {last.memory_mb:.1f} MB", ""),
        ("descriptors that stay open", f"{low} to {high}" if high > low else f"{low} at each look", "constant"),
        ("threads at first, at last", f"{first.threads}, {last.threads}", f"< {FILE_THREADS} more"),
        ("archive, largest", f"{largest / 1e6:.1f} MB", f"≤ {course.archive_bound / 1e6:g} MB"),
        ("journal", f"{course.journal_bytes / 1e6:.1f} MB, {course.journal_bytes / last.jobs:.0f} bytes a job", ""),
    ]
    lines = [
        "## A long run",
        "",
        *wrap(
            f"{datetime.now(UTC):%Y-%m-%d}: {sum(course.outcomes.values())} jobs, one daemon,"
            f" {last.seconds / 60:.0f} min ({outcomes}), {WIDTH} x {HEIGHT} px frames, simulated controller on"
            f" loopback. From job {first.jobs} on, at {len(course.later)} looks:",
            PAGE_WIDTH,
        ),
        "",
        "| what | measured | goal |",
        "|---|---|---|",
        *(f"| {what} | {measured} | {goal} |" for what, measured, goal in rows),
        "",
        *wrap("; ".join(course.faults()) or "All goals were met.", PAGE_WIDTH),
        "",
        *wrap(f"Memory, MB, at the looks: {', '.join(f'{look.memory_mb:.1f}' for look in course.later)}.", PAGE_WIDTH),
        "",
        *wrap(f"Open for a moment, at some looks: {', '.join(sorted(passing)) or 'nothing'}.", PAGE_WIDTH),
        "",
    ]
    return "\n".join(lines)


def write_page(section: str) -> None:
    """Put the section between the page's markers, at its end where it has none."""
    text = PAGE.read_text(encoding="utf-8")
    if BEGIN not in text:
        text = f"{text.rstrip()}\n\n{BEGIN}\n{END}\n"
    before, _, rest = text.partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n{section}{END}{rest.partition(END)[2]}", encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the report; 1 where something does not hold."""
    parser = argparse.ArgumentParser(prog="make soak-daemon", description=__doc__)
    parser.add_argument("--jobs", type=int, default=JOBS, metavar="N", help=f"default {JOBS}")
    parser.add_argument("--write", action="store_true", help="put the report into docs/reports/reliability.md")
    args = parser.parse_args(arguments)
    folder = Path(tempfile.mkdtemp(prefix="combtrace-long-run-"))
    course = run(folder, args.jobs)
    section = report(course)
    print(section)
    if args.write:
        write_page(section)
    if course.faults():
        print(f"kept: {folder}")
        return 1
    shutil.rmtree(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
