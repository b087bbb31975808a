"""Pedals, scanners and contacts at a daemon: any byte and an input line, over what a shop floor does to them."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import pytest

from tests.support.controller.serial_over_network import SerialServer
from tests.support.processes.cell import Cell
from tests.support.processes.processes import until
from tests.support.processes.terminal import Terminal


@pytest.fixture
def terminal() -> Iterator[Terminal]:
    opened = Terminal()
    yield opened
    with suppress(OSError):  # the test may have pulled it out
        opened.close()


def started(folder: Path, trigger: str) -> Cell:
    cell = Cell(folder, triggers=f"[{{kind: serial, {trigger}}}]", trigger_every_s=None)
    cell.ready()
    return cell


def by_kind(cell: Cell, kind: str) -> list[object]:
    return [job["outcome"] for job in cell.settled() if job["trigger_kind"] == kind]


def test_bytes_of_a_pedal_and_a_scanner_are_a_job_each_and_a_pulled_plug_is_lived_through(
    tmp_path: Path, terminal: Terminal
) -> None:
    plug = tmp_path / "pedal"  # a name that stays, as those below /dev/serial/by-id
    plug.symlink_to(terminal.name)
    cell = started(tmp_path, f"port: {plug}, mode: byte, debounce_s: 0.1")
    try:
        terminal.type(b"\x00")
        until(lambda: len(by_kind(cell, "byte")) == 1, what="the pedal's job")
        time.sleep(0.15)  # sooner it would be the pedal's bouncing
        terminal.type(b"4006381333931\r\n" * 200)  # a flood is one trigger
        until(lambda: len(by_kind(cell, "byte")) == 2, what="the scanner's job")
        terminal.close()
        cell.in_error()
        other = Terminal()
        plug.unlink()
        plug.symlink_to(other.name)
        until(lambda: f"serial {plug}: is back" in cell.service.text, what="the port's return")
        until(lambda: cell.service.text.count("-> Ready") > cell.service.text.count("-> Error"), what="Ready")
        time.sleep(0.15)
        other.type(b"x")
        until(lambda: len(by_kind(cell, "byte")) == 3, what="a job after the return")
        assert set(by_kind(cell, "byte")) == {"accepted"}
        other.close()
    finally:
        cell.stop()


def test_an_edge_of_an_input_line_is_a_job_through_a_serial_server_that_hangs_up_too(tmp_path: Path) -> None:
    with SerialServer() as server:
        cell = started(tmp_path, f"port: '{server.url}', mode: signal, signal: cts, edge: falling")
        try:
            server.device.rts = False
            until(lambda: len(by_kind(cell, "signal")) == 1, what="the contact's job")
            server.device.rts = True
            server.hang_up()
            until(lambda: "is back" in cell.service.text, what="the server's return")
            time.sleep(0.2)
            server.device.rts = False
            until(lambda: len(by_kind(cell, "signal")) == 2, what="a job after the return")
            assert set(by_kind(cell, "signal")) == {"accepted"}
        finally:
            cell.stop()


def test_lines_that_wait_are_told_so_and_each_gets_its_end(tmp_path: Path, terminal: Terminal) -> None:
    cell = Cell(
        tmp_path,
        triggers=f"[{{kind: serial, port: {terminal.name}}}]",
        trigger_every_s=None,
        service="{state_dir: state, queue_depth: 2}",
    )
    try:
        cell.ready()
        terminal.type(b"TRIG\n" * 4)
        replies = [terminal.line() for _ in range(9)]
        first, second, third = (cell.number(nth) for nth in (1, 2, 3))
        assert replies[:4] == [f"ACK {first}", "WAIT 1", "WAIT 2", "NAK 120 busy"]
        rest = [" ".join(reply.split()[:2]) for reply in replies[4:]]
        done = [f"DONE {job}" for job in (first, second, third)]
        assert sorted(rest) == sorted([f"ACK {second}", f"ACK {third}", *done])
        assert rest.index(f"ACK {second}") < rest.index(f"DONE {second}")
        terminal.type(b"STAT\n")
        assert terminal.line() == f"STAT Ready 0 {third} 1 0 ok"
        jobs = cell.settled()
        assert [job["outcome"] for job in jobs] == ["accepted"] * 3
        for earlier, later in pairwise(jobs):
            assert str(later["taken_at"]) >= str(earlier["settled_at"]), "a frame is exposed after its own start"
    finally:
        cell.stop()
