"""A disk that takes no writes when the service starts: it comes up in Error, tells why, and recovers by itself."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.daemon.control import ask
from service.jobs.executor import ROOM
from tests.support.processes.cell import Cell
from tests.support.processes.page_client import Client, token_file
from tests.support.processes.processes import called, combtrace, free_port, jobs, lines, until
from tests.support.processes.small_disk import CannotMount, fill, mounted, remount
from tests.support.real_parts import missing


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 8 MB of its own."""
    try:
        with mounted(tmp_path / "disk", 8) as made:
            yield made
    except CannotMount as why:
        missing(str(why))


def refuse(disk: Path, how: str) -> None:
    if how == "full":
        fill(disk, 0)
    else:
        remount(disk, "ro")


def accept(disk: Path, how: str) -> None:
    if how == "full":
        (disk / "somebody-else").unlink()
    else:
        remount(disk, "rw")


def cell_on(disk: Path, folder: Path, port: int) -> Cell:
    """A service with all that it writes on the disk, and a page; triggers of the controller come all the time."""
    token_file(folder)
    cell = Cell(
        folder,
        service=f"{{state_dir: {disk}/state}}",
        journal=f"{{path: {disk}/journal.sqlite, min_free_bytes: 0}}",
        more=f"archive: {{path: {disk}/archive, min_free_bytes: 0}}\npage: {{port: {port}, token_file: tokens}}\n",
    )
    cell.journal = disk / "journal.sqlite"
    return cell


def state(port: int) -> tuple[str, str]:
    told = Client(port).get("/api/v1/state").json
    return told["state"], told["reason"]


@pytest.mark.parametrize("how", ["full", "read-only"])
def test_a_service_begun_on_a_disk_that_refuses_is_in_error_until_the_disk_accepts(
    disk: Path, tmp_path: Path, how: str
) -> None:
    refuse(disk, how)
    cell = cell_on(disk, tmp_path, port := free_port())
    try:
        cell.in_error()
        until(lambda: Client(port).get("/").status == 200, what="the page")
        time.sleep(2.5)  # it tries again meanwhile
        assert cell.service.running
        assert state(port)[0] == "Error"
        assert str(disk) in state(port)[1]
        assert lines(cell.accepted) == []
        accept(disk, how)
        cell.goes_on(2)
        assert state(port)[0] in ("Ready", "SingleExecution")
        assert ask(disk / "state", {"command": "status"})["state"] in ("Ready", "SingleExecution")
        assert cell.service.stop() == 0
    finally:
        cell.stop()
    assert "Traceback" not in cell.service.text
    assert "CRITICAL" not in cell.service.text, "a journal that never was is not lost"
    assert jobs(cell.journal)[0]["job_id"] < 2 * ROOM, "the first of a new journal"


@pytest.mark.parametrize("how", ["full", "read-only"])
def test_a_journal_on_a_disk_that_refuses_at_the_next_start_goes_on_where_it_was(
    disk: Path, tmp_path: Path, how: str
) -> None:
    cell = cell_on(disk, tmp_path, port := free_port())
    try:
        cell.goes_on(2)
        assert cell.service.stop() == 0
        refuse(disk, how)
        taken = jobs(cell.journal) if how == "full" else []
        cell.service = cell.start_service()
        until(lambda: cell.service.text.count("-> Error") == 1, what="Error")
        time.sleep(1.5)
        assert state(port)[0] == "Error"
        if taken:
            assert jobs(cell.journal) == taken
        accept(disk, how)
        cell.goes_on(2)
        assert cell.service.stop() == 0
    finally:
        cell.stop()
    numbers = [job["job_id"] for job in jobs(cell.journal)]
    assert len(set(numbers)) == len(numbers) >= 4
    assert "CRITICAL" not in cell.service.text


def test_while_it_waits_it_is_the_only_one_and_ends_when_told_to(disk: Path, tmp_path: Path) -> None:
    (disk / "state").mkdir()
    refuse(disk, "full")
    cell = cell_on(disk, tmp_path, free_port())
    config = ("--config", tmp_path / "config.yaml")
    try:
        cell.in_error()
        until((disk / "state" / "control.sock").exists, what="its socket")
        status = called("status", *config)
        assert (status.returncode, "storage_full" in status.stdout) == (1, True), status.stdout + status.stderr
        second = combtrace("run", *config)
        assert (second.returncode, "another combtrace" in second.stderr) == (2, True), second.stderr
        begun = time.monotonic()
        assert cell.service.stop() == 0
        assert time.monotonic() - begun < 10
        assert not (disk / "state" / "combtrace.lock").exists(), "or the next start would miss a journal"
    finally:
        cell.stop()


def test_a_state_folder_that_is_a_file_is_a_wrong_configuration(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("")
    (tmp_path / "config.yaml").write_text(
        f"camera: {{kind: files, path: {tmp_path}}}\ncontroller: {{kind: none}}\nservice: {{state_dir: state}}\n"
    )
    ended = combtrace("run", "--config", tmp_path / "config.yaml")
    assert (ended.returncode, "Check service.state_dir" in ended.stderr) == (2, True), ended.stderr
