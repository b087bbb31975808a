"""A person at a serial line: what is typed into a real pseudo-terminal, and what the daemon answers."""

from __future__ import annotations

import os
import select
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.processes.cell import Cell
from tests.support.processes.processes import called
from tests.support.processes.terminal import Terminal


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    opened = Terminal()
    yield opened
    opened.close()


@pytest.fixture
def cell(tmp_path: Path, terminal: Terminal) -> Iterator[Cell]:
    started = Cell(tmp_path, triggers=f"[{{kind: serial, port: {terminal.name}}}]", trigger_every_s=None)
    try:
        started.ready()
        yield started
    finally:
        started.stop()


def test_trig_is_acknowledged_once_durable_and_told_done_at_the_end(cell: Cell, terminal: Terminal) -> None:
    terminal.type(b"TRIG\r\n")
    taken = terminal.acknowledged()
    word, job, vertices, area = terminal.line().split()
    assert (word, job) == ("DONE", str(taken))
    (settled,) = cell.settled()
    assert settled["outcome"] == "accepted"
    assert settled["trigger_kind"] == "serial"
    assert int(vertices) >= 4
    assert float(area) > 1000


def test_an_unknown_recipe_is_acknowledged_and_ends_in_fail_122(cell: Cell, terminal: Terminal) -> None:
    terminal.type(b"TRIG recipe=77\n")
    job = terminal.acknowledged()
    assert terminal.line() == f"FAIL {job} 122 unknown_recipe"


def test_ping_stat_and_nonsense_are_answered(cell: Cell, terminal: Terminal) -> None:
    terminal.type(b"PING\r")
    assert terminal.line() == "PONG"
    terminal.type(b"STAT\r\n")
    assert terminal.line() == "STAT Ready 0 0 0 0 ok"
    terminal.type(b"\x00\xff\x80 hello\r\n")
    assert terminal.line().startswith("NAK ")
    terminal.type(b"PING\n")
    assert terminal.line() == "PONG"


def test_a_trigger_while_the_controller_is_away_is_refused_at_once_with_121(cell: Cell, terminal: Terminal) -> None:
    cell.controller.kill()
    cell.in_error()
    terminal.type(b"TRIG\n")
    assert terminal.line() == "NAK 121 not_ready"
    assert cell.settled() == []
    terminal.type(b"STAT\n")
    assert terminal.line() == "STAT Error 0 0 1 152 controller_lost"
    cell.controller = cell.start_controller()


def test_triggers_in_a_burst_give_one_job_and_refusals_that_are_counted(cell: Cell, terminal: Terminal) -> None:
    terminal.type(b"TRIG\n" * 4)
    replies = [terminal.line() for _ in range(5)]
    assert replies.count("NAK 120 busy") == 3
    job = cell.number(1)
    assert replies[0] == f"ACK {job}"
    assert replies[-1].startswith(f"DONE {job} ")
    terminal.type(b"STAT\n")
    assert terminal.line() == f"STAT Ready 0 {job} 3 0 ok"


def test_the_trigger_command_waits_for_the_end(cell: Cell, terminal: Terminal, tmp_path: Path) -> None:
    """Two pseudo-terminals tied together stand for the cable between panel and daemon."""
    import threading

    other = Terminal()
    stop = threading.Event()

    def cable() -> None:
        while not stop.is_set():
            readable, _, _ = select.select([terminal.master, other.master], [], [], 0.05)
            for end in readable:
                os.write(other.master if end == terminal.master else terminal.master, os.read(end, 4096))

    thread = threading.Thread(target=cable)
    thread.start()
    try:
        done = called("trigger", "--port", other.name, "--timeout-s", "20")
        refused = called("trigger", "--port", other.name, "--recipe", "9", "--timeout-s", "20")
    finally:
        stop.set()
        thread.join()
        other.close()
    assert done.returncode == 0, done.stderr
    assert [line.split()[0] for line in done.stdout.splitlines()] == ["ACK", "DONE"]
    assert refused.returncode == 3
    assert refused.stdout.splitlines()[-1] == f"FAIL {cell.number(2)} 122 unknown_recipe"
