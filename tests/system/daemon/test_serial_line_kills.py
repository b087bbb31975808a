"""The service is killed at chosen and at random moments, and the serial line hears all the same how each job ended."""

from __future__ import annotations

import json
import os
import random
import select
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from service.cli.errors import EXIT_FAILED, EXIT_OK
from tests.support.processes.cell import Cell
from tests.support.processes.processes import Process, called, jobs, until
from tests.support.processes.terminal import Terminal

SLOW_CHECK = "machine: {check_scans: 60}"  # 0.6 s from the commit to the answer


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    opened = Terminal()
    yield opened
    opened.close()


@contextmanager
def running(folder: Path, terminal: Terminal, scenario: str = SLOW_CHECK) -> Iterator[Cell]:
    cell = Cell(
        folder,
        triggers=f"[{{kind: serial, port: {terminal.name}}}]",
        trigger_every_s=None,
        more="archive: {path: archive, min_free_bytes: 0}\n",
        scenario=scenario,
    )
    try:
        cell.ready()
        yield cell
    finally:
        cell.stop()


def killed_and_started(cell: Cell) -> None:
    cell.service.kill()
    cell.service = cell.start_service()


def sent(cell: Cell, number: int) -> bool:
    return any(job["job_id"] == number and job["pages"] for job in jobs(cell.journal))


def archived(cell: Cell, number: int, outcome: str) -> dict[str, Any]:
    path = cell.folder / f"archive/{number // 1000:07}xxx/{number}-{outcome}.json"
    until(path.exists, what=f"evidence of job {number}")
    return dict(json.loads(path.read_text()))


def files(cell: Cell, number: int) -> list[str]:
    return sorted(path.name.partition("-")[2] for path in cell.folder.glob(f"archive/*/{number}-*"))


def test_a_job_in_flight_at_a_kill_is_told_and_is_as_complete_as_any_other(tmp_path: Path, terminal: Terminal) -> None:
    with running(tmp_path, terminal) as cell:
        terminal.type(b"TRIG\n")
        first_number = terminal.acknowledged()
        until(lambda: sent(cell, first_number), what="the contour on its way")
        killed_and_started(cell)
        word, number, vertices, area = terminal.line(30).split()
        assert (word, int(number)) == ("DONE", first_number)
        cell.ready()
        until(lambda: "-> Ready" in cell.service.text.rpartition("was in flight")[2], what="Ready")
        terminal.type(b"TRIG\n")
        second = terminal.line().split()[1]
        assert terminal.line().startswith(f"DONE {second} ")
        resumed, usual = archived(cell, first_number, "accepted"), archived(cell, int(second), "accepted")
        whole = ["accepted.json", "frame.png", "overlay.jpg"]
        for number in (first_number, int(second)):
            until(lambda number=number: files(cell, number) == whole, what=f"all the evidence of job {number}")
        assert resumed.keys() == usual.keys()
        assert resumed["measurement"].keys() == usual["measurement"].keys()
        assert len(resumed["measurement"]["millimetres"]["exterior"]) == int(vertices)
        first, other = jobs(cell.journal)
        report = json.loads(first["report"])
        assert set(json.loads(other["report"])) - set(report) == {"transfer_ms", "total_ms"}, "the kill cut these short"
        assert (str(report["vertices"]), f"{report['area_mm2']:.0f}") == (vertices, area)
        assert first["recipe_digest"] == other["recipe_digest"] is not None
        assert json.loads(first["transfer"])["crc32"]
        config = cell.folder / "config.yaml"
        replayed = called("replay", str(first_number), "--config", config)
        assert "byte for byte as they were" in replayed.stdout, replayed.stderr
        shown = called("jobs", "show", str(first_number), "--config", config).stdout
        assert f"{first_number}-overlay.jpg" in shown


def test_a_job_of_which_nothing_was_sent_is_told_failed_after_the_restart(tmp_path: Path, terminal: Terminal) -> None:
    with running(tmp_path, terminal) as cell:
        terminal.type(b"TRIG\n")
        number = terminal.acknowledged()
        killed_and_started(cell)
        assert terminal.line(30) == f"FAIL {number} 154 service_restarted"
        assert archived(cell, number, "failed")["job"]["reason_name"] == "service_restarted"


def test_a_job_that_a_stop_cut_short_is_told_after_the_next_start(tmp_path: Path, terminal: Terminal) -> None:
    """The stop gives up waiting for the answer; the job is settled, and told, by the next start."""
    with running(tmp_path, terminal, "machine: {check_scans: 1200}") as cell:  # 12 s, longer than a stop waits
        terminal.type(b"TRIG\n")
        number = terminal.acknowledged()
        until(lambda: sent(cell, number), what="the contour on its way")
        assert cell.service.stop() == 0
        cell.service = cell.start_service()
        heard = terminal.line()
        (job,) = jobs(cell.journal)
        assert heard.startswith(
            f"DONE {number} " if job["outcome"] == "accepted" else f"FAIL {number} {job['reason']} "
        )


def ends(heard: list[str]) -> dict[int, str]:
    return {int(line.split()[1]): line for line in heard if line.startswith(("DONE", "FAIL"))}


def test_whatever_the_moment_of_a_kill_every_acknowledged_job_is_told_its_end(
    tmp_path: Path, terminal: Terminal
) -> None:
    chance, heard = random.Random(8), []
    with running(tmp_path, terminal, "machine: {check_scans: 20}") as cell:
        for _ in range(6):
            terminal.type(b"TRIG\n")
            time.sleep(chance.choice([0.0, 0.01, chance.uniform(0, 1.2)]))
            killed_and_started(cell)
            started = cell.service.text.count("-> Ready")
            until(lambda started=started: cell.service.text.count("-> Ready") > started, 40, "Ready")  # type: ignore[misc]
        terminal.type(b"PING\n")
        while "PONG" not in heard:
            heard.append(terminal.line(20))
        until(lambda: len(cell.settled()) == len(jobs(cell.journal)), what="all jobs' ends")
        found = {job["job_id"]: job for job in jobs(cell.journal)}
        while not found.keys() <= (ended := ends(heard)).keys():  # the newest may be told after the PONG
            heard.append(terminal.line(20))
    assert found, "no kill left a job"
    assert ended.keys() == found.keys(), heard
    assert {int(line.split()[1]) for line in heard if line.startswith("ACK")} <= ended.keys()
    for number, job in found.items():
        assert ended[number].startswith("DONE" if job["outcome"] == "accepted" else f"FAIL {number} {job['reason']} ")


@contextmanager
def cable(one: Terminal, other: Terminal) -> Iterator[None]:
    """Two pseudo-terminals tied together stand for the cable between panel and service."""
    stop = threading.Event()

    def carry() -> None:
        while not stop.is_set():
            for end in select.select([one.master, other.master], [], [], 0.05)[0]:
                os.write(other.master if end == one.master else one.master, os.read(end, 4096))

    thread = threading.Thread(target=carry)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def test_the_trigger_command_hears_the_end_after_a_kill_and_a_restart(tmp_path: Path, terminal: Terminal) -> None:
    panel = Terminal()
    try:
        with running(tmp_path, terminal) as cell, cable(terminal, panel):
            command = Process(tmp_path / "trigger.log", "trigger", "--port", panel.name)
            until(lambda: any(job["pages"] for job in jobs(cell.journal)), what="the contour on its way")
            number = str(cell.number(1))
            cell.service.kill()
            time.sleep(1)
            cell.service = cell.start_service()
            assert command.ended() == EXIT_OK, command.text
            assert [line.split()[:2] for line in command.text.splitlines()] == [["ACK", number], ["DONE", number]]
    finally:
        panel.close()


def test_the_trigger_command_ends_where_nobody_serves_the_line(tmp_path: Path, terminal: Terminal) -> None:
    ended = called("trigger", "--port", terminal.name)
    assert ended.returncode == EXIT_FAILED
    assert "no ACK within 10 s. Check that the daemon runs and serves this line" in ended.stderr


def test_the_line_that_is_pulled_while_a_job_runs_hears_its_end_when_it_is_back(tmp_path: Path) -> None:
    plug, first, second = tmp_path / "ttyUSB0", Terminal(), Terminal()
    plug.symlink_to(first.name)
    cell_terminal = first
    cell_terminal.name = str(plug)
    try:
        with running(tmp_path, cell_terminal) as cell:
            first.type(b"TRIG\n")
            number = first.acknowledged()
            until(lambda: sent(cell, number), what="the contour on its way")
            plug.unlink()
            first.close()
            until(cell.settled, what="the job's end")
            plug.symlink_to(second.name)
            assert second.line(20).startswith(f"DONE {number} ")
            assert cell.service.running
            cell.service.send(signal.SIGTERM)
    finally:
        second.close()
