"""`combtrace trigger` without a serial line: the same answers and exit statuses, by the daemon's control socket."""

from __future__ import annotations

import json
import re
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.control import MOST_STREAMS, ask
from tests.system.cell import Cell
from tests.system.processes import COMBTRACE, ENVIRONMENT, combtrace, jobs, until

RECIPES = "recipes: [{number: 1, name: a}, {number: 2, name: b, min_area_mm2: 1, max_area_mm2: 100}]\n"
SLOW = "{state_dir: state, queue_depth: 20}"


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[Cell]:
    started = Cell(tmp_path, triggers="[]", trigger_every_s=None, service=SLOW, more=RECIPES)
    try:
        started.ready()
        yield started
    finally:
        started.stop()


def trigger(cell: Cell, *options: str) -> subprocess.CompletedProcess[str]:
    return combtrace("trigger", "--config", cell.folder / "config.yaml", *options)


def waiting(cell: Cell, *options: str) -> subprocess.Popen[str]:
    """A trigger that is being waited for."""
    command = [*COMBTRACE, "trigger", "--config", str(cell.folder / "config.yaml"), *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)


def test_a_trigger_is_acknowledged_and_its_end_told_by_line_and_status(cell: Cell) -> None:
    done = trigger(cell, "--thickness-mm", "20.5")
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"ACK 1\nDONE 1 \d+ \d+\n", done.stdout)
    (job,) = jobs(cell.journal)
    assert (job["trigger_kind"], job["outcome"]) == ("shell", "accepted")
    shown = combtrace("jobs", "show", "1", "--config", cell.folder / "config.yaml").stdout
    assert "thickness 20.5 mm" in shown
    refused = trigger(cell, "--recipe", "2")
    assert (refused.returncode, refused.stdout) == (3, "ACK 2\nFAIL 2 112 area_out_of_limits\n")
    assert "the recipe expects 1 to 100 mm²" in refused.stderr
    unknown = trigger(cell, "--recipe", "3")
    assert unknown.stdout == "ACK 3\nFAIL 3 122 unknown_recipe\n"
    none = trigger(cell, "--recipe", "70000")
    assert (none.returncode, none.stdout) == (3, "NAK 122 unknown_recipe\n")


def test_a_halted_daemon_answers_nak_and_says_why(cell: Cell) -> None:
    assert combtrace("halt", "--config", cell.folder / "config.yaml", "--reason", "blade").returncode == 0
    done = trigger(cell)
    assert (done.returncode, done.stdout) == (3, "NAK 121 not_ready\n")
    assert "halted: blade" in done.stderr


def test_a_trigger_that_waits_is_told_its_place_and_a_halt_still_finds_room(cell: Cell) -> None:
    cell.controller.send(signal.SIGSTOP)  # the job is sent, and its answer stays away
    first = waiting(cell)
    until(lambda: cell.journal.exists() and jobs(cell.journal), what="the first job")
    others = [waiting(cell) for _ in range(MOST_STREAMS)]
    lines = [other.stdout.readline() for other in others if other.stdout is not None]
    assert sum(line.startswith("WAIT ") for line in lines) == MOST_STREAMS - 1
    assert ask(cell.folder / "state", {"command": "halt", "reason": "enough"})["state"]
    ended = [other.communicate(timeout=30) for other in others]
    assert sum(out == "NAK 161 aborted\n" for out, _ in ended) == MOST_STREAMS - 1
    assert sum("wait for ends of jobs already. Try again" in error for _, error in ended) == 1
    cell.controller.send(signal.SIGCONT)
    out, _ = first.communicate(timeout=60)
    assert out.startswith("ACK 1\n")
    assert "\nDONE 1 " in out or "\nFAIL 1 " in out


def test_the_end_is_told_across_a_kill_of_the_daemon(cell: Cell) -> None:
    cell.controller.send(signal.SIGSTOP)
    client = waiting(cell)
    assert client.stdout is not None
    assert client.stdout.readline() == "ACK 1\n"
    cell.service.kill()
    cell.controller.send(signal.SIGCONT)
    cell.service = cell.start_service()
    out, error = client.communicate(timeout=60)
    (job,) = jobs(cell.journal)
    good = job["outcome"] == "accepted"
    assert re.fullmatch(r"DONE 1 \d+ \d+\n" if good else r"FAIL 1 \d+ \w+\n", out), error
    assert client.returncode == (0 if good else 1)


def test_a_daemon_that_stops_does_not_wait_for_those_who_wait(cell: Cell) -> None:
    cell.controller.send(signal.SIGSTOP)
    client = waiting(cell, "--timeout-s", "20")
    assert client.stdout is not None
    assert client.stdout.readline() == "ACK 1\n"
    assert cell.service.stop(bound_s=20) == 0
    cell.controller.send(signal.SIGCONT)
    out, error = client.communicate(timeout=60)
    assert (client.returncode, out) in ((1, ""), (1, out))
    assert "`combtrace jobs show 1` tells how it ended" in error


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--thickness-mm", "0"], "--thickness-mm 0: expected above 0"),
        (["--port", "/dev/nowhere", "--thickness-mm", "3"], "cannot be told over a serial line"),
    ],
)
def test_what_no_block_has_is_a_usage_error(cell: Cell, options: list[str], expected: str) -> None:
    done = trigger(cell, *options)
    assert (done.returncode, expected in done.stderr) == (2, True), done.stderr


def test_the_socket_refuses_numbers_that_are_none(cell: Cell) -> None:
    for request in ({"recipe": -1}, {"recipe": "2"}, {"thickness_um": True}, {"thickness_um": 10**9}):
        with pytest.raises(Exception, match="expected"):
            ask(cell.folder / "state", {"command": "trigger", **request})
    with pytest.raises(Exception, match="there is no job 77"):
        ask(cell.folder / "state", {"command": "end", "job": 77})
    assert json.loads(combtrace("status", "--config", cell.folder / "config.yaml", "--json").stdout)["job"] is None


def test_without_a_daemon_it_says_so(tmp_path: Path) -> None:
    done = combtrace("trigger", "--state-dir", tmp_path)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert "no daemon listens. Check that it runs" in done.stderr
