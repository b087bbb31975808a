"""A day of the daemon, told by its log: `python -m benchmarks.daemon.a_day` writes docs/reports/a-day.md from a run.

The real daemon and the simulated controller as processes, two minutes for a day: whatever befalls a cell is done to
them, and what the log said meanwhile goes on the page, with nothing but paths and dates made shorter. Needs root for a
small disk that fills.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import fill

import cv2
import numpy as np

from tests.support.processes.cell import SAMPLES, Cell
from tests.support.processes.processes import combtrace, until
from tests.support.processes.small_disk import mounted

PAGE = Path(__file__).parents[2] / "docs" / "reports" / "a-day.md"
WIDTH = 120
SHOWN_FOLDER = "/var/lib/combtrace"
DATE = re.compile(r"^\d{4}-\d\d-\d\d ", re.MULTILINE)
HEAD = """\
# A day in the life, told by its log

Written by `python -m benchmarks.daemon.a_day` from a real run of the daemon and the simulated controller, two minutes
for a day: nothing below is made up, only dates are left out and paths made shorter. Each part says what was done to the
cell, then what the log said.
"""


@dataclass
class Day:
    """The cell, and the page that grows."""

    cell: Cell
    folder: Path
    told: int = 0
    parts: list[str] = field(default_factory=list)

    def tell(self, title: str, text: str) -> None:
        """What the log said since the last part, under a title, after what was done."""
        time.sleep(0.3)
        log = self.cell.service.text
        said, self.told = log[self.told :], len(log)
        self.parts += [f"\n## {title}\n\n{fill(' '.join(text.split()), WIDTH)}\n\n```\n{self.shortened(said)}```\n"]

    def shell(self, *arguments: str) -> None:
        """A command, and what it said."""
        done = combtrace(*arguments, "--config", self.folder / "config.yaml")
        shown = " ".join(("combtrace", *arguments))
        self.parts.append(f"\n```\n$ {shown}\n{self.shortened(done.stdout + done.stderr)}```\n")

    def shortened(self, text: str) -> str:
        """Without dates, and with the folder as it would be called."""
        return DATE.sub("", text.replace(str(self.folder), SHOWN_FOLDER))

    def state(self, name: str) -> None:
        """Wait until the last state in the log is this."""
        until(lambda: re.findall(r"state \w+ -> (\w+)", self.cell.service.text)[-1:] == [name], 40, name)

    def jobs(self, count: int) -> None:
        """Wait for so many more jobs to end."""
        before = len(self.cell.settled())
        until(lambda: len(self.cell.settled()) >= before + count, 40, f"{count} jobs")

    def send(self, number: signal.Signals, process: int) -> None:
        """Send a signal."""
        os.kill(process, number)


def morning(day: Day) -> None:
    """Start before the controller, which comes later."""
    day.state("Error")
    day.tell(
        "The cell is switched on",
        "The computer is up before the cutting machine. The daemon says what is missing, once, and waits for it.",
    )
    day.cell.controller = day.cell.start_controller()
    day.jobs(3)
    day.tell(
        "The machine is switched on too",
        "Nobody does anything at the computer. The controller asks for measurements, and blocks are cut. One record a "
        "job: outcome, vertices, area, how sure (mm), and where the time went.",
    )


def empty_table(day: Day) -> None:
    """A picture without a block."""
    pictures = day.folder / "pictures"
    height, width = cv2.imread(str(SAMPLES / "1-rectangle.jpg")).shape[:2]
    noise = np.random.default_rng(1).integers(60, 80, (height, width), dtype=np.uint8)
    for sample in SAMPLES.glob("*.jpg"):
        cv2.imwrite(str(day.folder / "empty.jpg"), noise)
        (day.folder / "empty.jpg").replace(pictures / sample.name)  # whole, as the camera may be reading it
    until(lambda: any(job["outcome"] == "refused" for job in day.cell.settled()), 40, "a refusal")
    for sample in SAMPLES.glob("*.jpg"):
        shutil.copy(sample, day.folder / "block.jpg")
        (day.folder / "block.jpg").replace(pictures / sample.name)
    until(lambda: day.cell.settled()[-1]["outcome"] == "accepted", 40, "an acceptance")
    day.tell(
        "Somebody forgets the block",
        "A measurement is asked for while the table is empty. It is refused, with the reason, and nothing is sent; the "
        "next one, with a block, is cut.",
    )


def cable(day: Day) -> None:
    """The controller falls silent and comes back."""
    day.send(signal.SIGSTOP, day.cell.controller.process_id)
    day.state("Error")
    time.sleep(2)
    day.send(signal.SIGCONT, day.cell.controller.process_id)
    day.jobs(1)
    day.state("Ready")
    day.tell(
        "A cable is pulled, and put back",
        "The controller's process is stopped and goes on some seconds later. The daemon goes to Error by itself and "
        "comes back by itself; a job that was under way is settled first.",
    )


def camera(day: Day) -> None:
    """The camera goes and comes back."""
    pictures = day.folder / "pictures"
    pictures.rename(day.folder / "unplugged")
    day.state("Error")
    time.sleep(1)
    (day.folder / "unplugged").rename(pictures)
    day.state("Ready")
    day.jobs(1)
    day.tell(
        "The camera is unplugged",
        "Should a job come first, it fails (100). From then on no trigger is taken, so none is lost: the controller's "
        "stays open, and is served when the camera is back.",
    )


def recipes(day: Day) -> None:
    """A bad change of the configuration, then a good one."""
    path = day.folder / "config.yaml"
    good = path.read_text()
    path.write_text(good + "recipes: [{number: 1, name: default, tolerance_mm: -3}]\n")
    day.send(signal.SIGHUP, day.cell.service.process_id)
    time.sleep(1)
    path.write_text(good + "recipes: [{number: 1, name: default, tolerance_mm: 0.2}]\n")
    day.send(signal.SIGHUP, day.cell.service.process_id)
    day.jobs(1)
    day.tell(
        "An engineer changes a recipe",
        "The first try has a mistake: it is named, and the old recipe stays. The second is taken over between two "
        "jobs.",
    )


def disk(day: Day) -> None:
    """The disk fills, and is emptied."""
    theirs = day.folder / "disk" / "somebody-else"
    with theirs.open("wb") as file:
        while "-> Error" not in day.cell.service.text[day.told :]:  # what the archive lets go is taken too
            found = os.statvfs(theirs.parent)
            file.write(bytes(max(found.f_bavail * found.f_frsize - 3_000_000, 0)))
            file.flush()
            time.sleep(0.2)
    time.sleep(1)
    theirs.unlink()
    day.state("Ready")
    day.jobs(1)
    day.tell(
        "The disk fills up",
        "Another program writes until 3 MB are left. The archive gives way, oldest jobs first, refused ones last; "
        "where that does not help, no trigger is taken (160) while the journal still has room to settle what was. "
        "Space is freed, and the daemon goes on.",
    )


def power_cut(day: Day) -> None:
    """kill -9 in the middle of it all."""
    day.state("SingleExecution")
    day.cell.service.kill()
    day.cell.service = day.cell.start_service()
    until(lambda: day.cell.service.text.rpartition("process ")[2].count("-> Ready"), what="Ready")
    day.jobs(1)
    day.tell(
        "The power goes",
        "`kill -9` in the middle of a job, and a start. The job that was under way is settled first, with the "
        "controller where anything of it was sent. Numbers go on, and no trigger is taken twice.",
    )


def evening(day: Day) -> None:
    """Stop; then what can be asked afterwards."""
    day.cell.service.stop()
    day.tell("The cell is switched off", "SIGTERM: the running job would be brought to its end first.")
    day.parts.append("\n## What can be asked afterwards\n")
    day.shell("jobs", "--limit", "8")
    refused = next(str(job["job_id"]) for job in day.cell.settled() if job["outcome"] == "refused")
    day.shell("jobs", "show", refused)
    last = str(day.cell.settled()[-1]["job_id"])
    day.shell("replay", last)
    day.shell("replay", "--limit", "8", "--set", "recipe.max_area_mm2=60000")


@contextmanager
def started() -> Iterator[Day]:
    """The daemon, without its controller yet, on a folder with a small disk in it."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="combtrace-day-")))
        small = stack.enter_context(mounted(folder / "disk", 40))
        shutil.copytree(SAMPLES, folder / "pictures", ignore=shutil.ignore_patterns("*.yaml"))
        cell = Cell(
            folder,
            camera=f"{{kind: files, path: {folder}/pictures, loop: true}}",
            journal=f"{{path: {small}/journal.sqlite, min_free_bytes: 5000000}}",
            trigger_every_s=1.0,
            more=f"archive: {{path: {small}/archive, min_free_bytes: 8000000}}\n",
        )
        cell.journal = small / "journal.sqlite"
        cell.controller.kill()
        stack.callback(cell.stop)
        yield Day(cell, folder)


SCENES: tuple[Callable[[Day], None], ...] = (
    morning,
    empty_table,
    cable,
    camera,
    recipes,
    disk,
    power_cut,
    evening,
)


def main() -> int:
    """Run the day, and write it down."""
    with started() as day:
        for scene in SCENES:
            scene(day)
            print(scene.__name__, flush=True)
        PAGE.write_text(HEAD + "".join(day.parts), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
