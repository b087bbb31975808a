"""`combtrace trigger` without a serial line: the same answers and exit statuses, by the daemon's control socket."""

from __future__ import annotations

import json
import re
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from service.daemon.control import MOST_STREAMS, ask
from tests.support.processes.cell import Cell
from tests.support.processes.forked import Forked
from tests.support.processes.processes import called, jobs, until

RECIPES = "recipes: [{number: 1, name: a}, {number: 2, name: b, min_area_mm2: 1, max_area_mm2: 100}]\n"
QUEUE = "{state_dir: state, queue_depth: 20}"


NEVER_ANSWERS = "machine: {check_scans: 10000}"  # not within 100 s


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cell]:
    """Each test leaves it ready."""
    yield from _running(tmp_path_factory.mktemp("cell"), "")


@pytest.fixture
def stuck(tmp_path: Path) -> Iterator[Cell]:
    """A cell whose controller leaves a job undecided until it is started again."""
    yield from _running(tmp_path, NEVER_ANSWERS)


def _running(folder: Path, scenario: str) -> Iterator[Cell]:
    started = Cell(
        folder,
        triggers="[]",
        trigger_every_s=None,
        service=QUEUE,
        more=RECIPES,
        scenario=scenario,
        link=", max_repeats: 100",
    )
    try:
        started.ready()
        yield started
    finally:
        started.controller.kill()
        started.stop()


def restart_controller(cell: Cell) -> None:
    """It forgets the job under way: that fails with 153."""
    cell.controller.kill()
    cell.scenario = ""
    cell.controller = cell.start_controller()


class Waiting:
    """A trigger that is being waited for."""

    def __init__(self, cell: Cell, *options: str) -> None:
        folder = Path(tempfile.mkdtemp(dir=cell.folder))
        self._files = folder / "out", folder / "error"
        self._process = Forked(["trigger", "--config", str(cell.folder / "config.yaml"), *options], *self._files)

    def line(self) -> str:
        """The first line that it printed, "" where it ended without."""
        out, _ = self._files
        until(lambda: "\n" in out.read_text() or self._process.poll() is not None, what="a line")
        return out.read_text().partition("\n")[0]

    def acknowledged(self) -> str:
        """The job's number, once it is told."""
        word, number = self.line().split()
        assert word == "ACK"
        return number

    def ended(self) -> tuple[int, str, str]:
        """Its exit status, and all that it printed, to standard output and error."""
        out, error = self._files
        return self._process.wait(90), out.read_text(), error.read_text()


def trigger(cell: Cell, *options: str) -> subprocess.CompletedProcess[str]:
    return called("trigger", "--config", cell.folder / "config.yaml", *options)


def test_a_trigger_is_acknowledged_and_its_end_told_by_line_and_status(cell: Cell) -> None:
    done = trigger(cell, "--thickness-mm", "20.5")
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"ACK (\d+)\nDONE \1 \d+ \d+\n", done.stdout)
    (job,) = jobs(cell.journal)
    assert (job["trigger_kind"], job["outcome"]) == ("shell", "accepted")
    shown = called("jobs", "show", str(job["job_id"]), "--config", cell.folder / "config.yaml").stdout
    assert "thickness 20.5 mm" in shown
    refused = trigger(cell, "--recipe", "2")
    assert re.fullmatch(r"ACK (\d+)\nFAIL \1 112 area_out_of_limits\n", refused.stdout)
    assert (refused.returncode, "the recipe expects 1 to 100 mm²" in refused.stderr) == (3, True)
    unknown = trigger(cell, "--recipe", "3")
    assert re.fullmatch(r"ACK (\d+)\nFAIL \1 122 unknown_recipe\n", unknown.stdout)
    none = trigger(cell, "--recipe", "70000")
    assert (none.returncode, none.stdout) == (3, "NAK 122 unknown_recipe\n")


def test_a_halted_daemon_answers_nak_and_says_why(cell: Cell) -> None:
    assert called("halt", "--config", cell.folder / "config.yaml", "--reason", "blade").returncode == 0
    done = trigger(cell)
    assert (done.returncode, done.stdout) == (3, "NAK 121 not_ready\n")
    assert "halted: blade" in done.stderr
    assert called("resume", "--config", cell.folder / "config.yaml").returncode == 0


def test_a_trigger_that_waits_is_told_its_place_and_a_halt_still_finds_room(stuck: Cell) -> None:
    first = Waiting(stuck)
    number = first.acknowledged()
    others = [Waiting(stuck) for _ in range(MOST_STREAMS)]
    lines = [other.line() for other in others]
    assert sum(line.startswith("WAIT ") for line in lines) == MOST_STREAMS - 1
    assert ask(stuck.folder / "state", {"command": "halt", "reason": "enough"})["state"]
    ended = [other.ended() for other in others]
    assert sum(out.endswith("\nNAK 161 aborted\n") for _, out, _ in ended) == MOST_STREAMS - 1
    assert sum("wait for ends of jobs already. Try again" in error for _, _, error in ended) == 1
    restart_controller(stuck)
    status, out, error = first.ended()
    assert (status, out) == (1, f"ACK {number}\nFAIL {number} 153 controller_restarted\n"), error


def test_the_end_is_told_across_a_kill_of_the_daemon(stuck: Cell) -> None:
    client = Waiting(stuck)
    number = client.acknowledged()
    stuck.service.kill()
    restart_controller(stuck)
    stuck.service = stuck.start_service()
    status, out, error = client.ended()
    (job,) = jobs(stuck.journal)
    assert re.fullmatch(rf"ACK {number}\nFAIL {number} {job['reason']} \w+\n", out), error
    assert status == 1


def test_a_daemon_that_stops_does_not_wait_for_those_who_wait(stuck: Cell) -> None:
    client = Waiting(stuck, "--timeout-s", "20")
    number = client.acknowledged()
    assert stuck.service.stop(bound_s=30) == 0
    status, out, error = client.ended()
    assert (status, out) == (1, f"ACK {number}\n")
    assert f"`combtrace jobs show {number}` tells how it ended" in error


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
    assert json.loads(called("status", "--config", cell.folder / "config.yaml", "--json").stdout)["job"] is None


def test_without_a_daemon_it_says_so(tmp_path: Path) -> None:
    done = called("trigger", "--state-dir", tmp_path)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert "no daemon listens. Check that it runs" in done.stderr
