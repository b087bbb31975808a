"""What commands show on a terminal and in a pipe: colour, and a status that is followed."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.support.processes.cell import Cell
from tests.support.processes.processes import COMBTRACE, ENVIRONMENT, combtrace, until

SAMPLES = Path(__file__).parents[3] / "service" / "samples"
RED, GREEN = "\x1b[31m", "\x1b[32m"


class OnTerminal:
    """A command whose output is a pseudo-terminal."""

    def __init__(self, *arguments: str | Path, **variables: str) -> None:
        self._master, slave = pty.openpty()
        environment = {name: value for name, value in ENVIRONMENT.items() if name != "NO_COLOR"}
        self._process = subprocess.Popen(
            [*COMBTRACE, *map(str, arguments)],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            env={**environment, "TERM": "xterm", **variables},
        )
        os.close(slave)
        self.text = ""

    def until(self, words: str) -> None:
        """Read until the words have come."""
        give_up_at = time.monotonic() + 60
        while words not in self.text:
            assert time.monotonic() < give_up_at, self.text
            self._read(0.2)

    def _read(self, bound_s: float) -> bool:
        if not select.select([self._master], [], [], bound_s)[0]:
            return self._process.poll() is None
        try:
            self.text += os.read(self._master, 65536).decode()
        except OSError:  # the other side has closed
            return False
        return True

    def interrupt(self) -> None:
        """Ctrl-C."""
        self._process.send_signal(signal.SIGINT)

    def ended(self) -> int:
        """The exit status, once all was read."""
        give_up_at = time.monotonic() + 60
        while self._read(0.2):
            assert time.monotonic() < give_up_at, "it goes on"
        status = self._process.wait(60)
        os.close(self._master)
        return status


@pytest.fixture
def black(tmp_path: Path) -> Path:
    path = tmp_path / "black.png"
    cv2.imwrite(str(path), np.zeros((200, 300), np.uint8))
    return path


def test_verdicts_and_errors_are_coloured_on_a_terminal(black: Path) -> None:
    shown = OnTerminal("trace", black, SAMPLES / "1-rectangle.jpg", black.parent / "none.png")
    assert shown.ended() == 2
    assert f"{RED}{black}: refused:\x1b[0m 102 image_quality" in shown.text
    assert f"{GREEN}{SAMPLES / '1-rectangle.jpg'}:\x1b[0m wall-tips" in shown.text
    assert f"{RED}{black.parent / 'none.png'}:\x1b[0m cannot be read" in shown.text
    wrong = OnTerminal("check", "--config", black.parent / "none.yaml")
    assert wrong.ended() == 2
    assert f"{RED}FAULT\x1b[0m config" in wrong.text
    error = OnTerminal("status", "--config", black.parent / "none.yaml")
    assert error.ended() == 2
    assert f"{RED}combtrace status:\x1b[0m " in error.text


@pytest.mark.parametrize("variables", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
def test_no_colour_where_it_is_not_wanted_or_not_understood(black: Path, variables: dict[str, str]) -> None:
    shown = OnTerminal("trace", black, **variables)
    assert shown.ended() == 3
    assert "refused: 102" in shown.text
    assert "\x1b" not in shown.text


def test_no_colour_into_a_pipe(black: Path) -> None:
    done = combtrace("trace", black, variables={"TERM": "xterm"})
    assert "\x1b" not in done.stdout + done.stderr


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[Cell]:
    started = Cell(tmp_path, triggers="[]", trigger_every_s=None)
    try:
        started.ready()
        yield started
    finally:
        started.stop()


def test_a_status_that_is_followed_is_drawn_anew_on_a_terminal_until_ctrl_c(cell: Cell) -> None:
    shown = OnTerminal("status", "--config", cell.folder / "config.yaml", "--watch")
    shown.until(f"{GREEN}state     Ready")
    assert shown.text.startswith("\x1b[H")
    assert combtrace("halt", "--config", cell.folder / "config.yaml").returncode == 0
    shown.until("state     Halted")
    cell.service.kill()
    shown.until("no daemon listens")
    shown.interrupt()
    assert shown.ended() == 130
    assert "Traceback" not in shown.text


@pytest.mark.parametrize("form", [(), ("--json",)])
def test_a_status_that_is_followed_is_a_line_a_change_in_a_pipe(cell: Cell, form: tuple[str, ...]) -> None:
    config = ("--config", cell.folder / "config.yaml")
    log = cell.folder / "watch.log"
    with log.open("wb") as file:
        command = [*COMBTRACE, *map(str, ("status", *config, "--watch", *form))]
        watching = subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT, env=ENVIRONMENT)
        until(log.read_text, what="the first line")
        time.sleep(1.5)  # three looks that show the same
        assert combtrace("halt", *config, "--reason", "blade").returncode == 0
        until(lambda: "blade" in log.read_text(), what="the change")
        watching.send_signal(signal.SIGINT)
        assert watching.wait(60) == 130
    first, second = log.read_text().splitlines()
    if form:
        assert [json.loads(line)["state"] for line in (first, second)] == ["Ready", "Halted"]
    else:
        assert re.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d Ready; job none", first)
        assert " Halted: halted: blade (" in second
