"""Disks that fill and files that break: the whole daemon refuses in time, keeps its bounds, and goes on by itself."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.cli.daemon.run import FILE_THREADS
from tests.soak.long_run import run
from tests.support.processes.cell import Cell
from tests.support.processes.processes import ENVIRONMENT, called, jobs, until
from tests.support.processes.small_disk import CannotMount, fill, mounted
from tests.support.real_parts import missing

MEGABYTE = 1_000_000


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 40 MB of its own."""
    try:
        with mounted(tmp_path / "disk", 40) as disk:
            yield disk
    except CannotMount as why:
        missing(str(why))


def documents(folder: Path) -> list[Path]:
    """The archive's documents; a folder of it may go while it is looked into, and is looked into again."""
    while True:
        try:
            return list(folder.glob("archive/*/*.json"))
        except FileNotFoundError:
            continue


def test_on_a_disk_that_fills_evidence_gives_way_then_triggers_are_refused_and_all_comes_back(
    small_disk: Path, tmp_path: Path
) -> None:
    cell = Cell(
        tmp_path,
        trigger_every_s=0.3,
        journal=f"{{path: {small_disk}/journal.sqlite, min_free_bytes: {4 * MEGABYTE}}}",
        more=f"archive: {{path: {small_disk}/archive, min_free_bytes: {8 * MEGABYTE}}}\n",
    )
    cell.journal = small_disk / "journal.sqlite"
    try:
        cell.goes_on(2)
        until(lambda: documents(small_disk), what="evidence")
        theirs = fill(small_disk, 6 * MEGABYTE)
        until(lambda: not documents(small_disk), what="room for the rest")
        cell.goes_on(1)  # no evidence any more, and jobs all the same
        theirs.unlink()
        theirs = fill(small_disk, 2 * MEGABYTE)
        cell.in_error()
        assert "MB of the disk are free, 4 are needed. Free space" in cell.service.text
        taken = len(jobs(cell.journal))
        until(lambda: len(cell.settled()) == taken, what="the end of what was taken")
        theirs.unlink()
        cell.goes_on(2)
        until(lambda: list(small_disk.glob("archive/*/*.json")), what="evidence again")
        assert cell.service.stop() == 0
    finally:
        cell.stop()
    assert {job["outcome"] for job in cell.settled()} == {"accepted"}


def test_on_a_disk_without_a_byte_left_no_trigger_is_acknowledged_and_none_is_lost(
    small_disk: Path, tmp_path: Path
) -> None:
    cell = Cell(
        tmp_path,
        trigger_every_s=0.3,
        journal=f"{{path: {small_disk}/journal.sqlite, min_free_bytes: 0}}",
        more="archive: {path: archive, max_bytes: 0}\n",
    )
    cell.journal = small_disk / "journal.sqlite"
    try:
        cell.goes_on(1)
        theirs = fill(small_disk, 0)
        until(lambda: "disk is full" in cell.service.text, what="a write that failed")
        theirs.unlink()
        cell.goes_on(2)
        assert "Traceback" not in cell.service.text
        assert cell.service.stop() == 0
    finally:
        cell.stop()
    assert len(jobs(cell.journal)) - len(cell.settled()) <= 1
    pairs = [(job["trigger_session"], job["trigger_counter"]) for job in jobs(cell.journal)]
    assert len(pairs) == len(set(pairs))


def test_a_damaged_journal_is_set_aside_and_numbers_and_evidence_go_on(tmp_path: Path) -> None:
    cell = Cell(tmp_path, trigger_every_s=0.3, more="archive: {path: archive, min_free_bytes: 0}\n")
    try:
        cell.goes_on(2)
        second = cell.number(2)
        until(lambda: list(tmp_path.glob(f"archive/*/{second}-accepted.json")), what="evidence")
        cell.service.kill()
        highest = max(job["job_id"] for job in jobs(cell.journal))
        for part in ("journal.sqlite-wal", "journal.sqlite-shm"):
            (tmp_path / part).unlink(missing_ok=True)
        content = bytearray(cell.journal.read_bytes())
        content[100:8192] = b"\xa5" * (min(len(content), 8192) - 100)
        cell.journal.write_bytes(content)
        cell.service = cell.start_service()
        cell.goes_on(1)
        assert (next(tmp_path.glob("journal.sqlite.damaged-*"))).exists()
        new = [job["job_id"] for job in jobs(cell.journal) if job["trigger_kind"] != "found"]
        assert min(new) > highest, "found: the last one, taken back as the controller knew of it"
        again = called("replay", str(second), "--config", tmp_path / "config.yaml")
        assert "byte for byte as they were" in again.stdout, again.stderr
    finally:
        cell.stop()


def test_many_jobs_leave_descriptors_threads_and_the_archive_as_they_were(tmp_path: Path) -> None:
    """A slice of `make soak-daemon`, which looks at memory too."""
    course = run(tmp_path / "run", jobs=40, looks=5, archive_bytes=2 * MEGABYTE)
    assert max(look.archive_bytes for look in course.looks) <= 2 * MEGABYTE
    assert course.looks[-1].archive_bytes > MEGABYTE
    assert len(set(course.descriptors)) == 1, course.looks
    assert course.threads <= course.first.threads + FILE_THREADS - 1, "those for files begin as they are needed"
    cut_short = course.outcomes.pop("failed", 0) + course.unsettled
    assert course.outcomes.keys() == {"accepted", "refused"}
    assert cut_short <= 1, "by the stop"


def test_a_small_disk_goes_with_the_test_that_is_killed(small_disk: Path, tmp_path: Path) -> None:
    """The fixture's own promise, as a mount that stays would fill up with every run."""
    program = (
        "import os, signal, sys\nfrom pathlib import Path\nfrom tests.support.processes.small_disk import mounted\n"
        "with mounted(Path(sys.argv[1]), 1):\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    disk = tmp_path / "other"
    killed = subprocess.run([sys.executable, "-c", program, disk], check=False, env=ENVIRONMENT)
    assert killed.returncode == -signal.SIGKILL, "while it was mounted"
    until(lambda: disk.exists() and not os.path.ismount(disk), what="the end of the mount")
    assert os.path.ismount(small_disk)
