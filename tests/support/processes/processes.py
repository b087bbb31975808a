"""The product's own commands as processes, as a user starts them."""

from __future__ import annotations

import io
import json
import os
import signal
import socket
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from service.cli.main import main
from tests.support.processes import forked
from tests.support.processes.forked import Forked

COMBTRACE = [sys.executable, "-m", "service.cli.main"]
ROOT = Path(__file__).parents[3]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
BOUND_S = 300.0
"""What is not there by then does not come, however busy the machine is: what gives way to jobs may wait a minute."""


def combtrace(
    *arguments: str | Path, cwd: Path | None = None, bound_s: float = BOUND_S, variables: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end; with a folder or variables of its own it starts from nothing."""
    if forked.begun and cwd is None and variables is None:
        return _forked(list(map(str, arguments)), bound_s)
    return subprocess.run(
        [*COMBTRACE, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=bound_s,
        check=False,
        cwd=cwd,
        env={**ENVIRONMENT, **(variables or {})},
    )


def _forked(words: list[str], bound_s: float) -> subprocess.CompletedProcess[str]:
    with TemporaryDirectory() as folder:
        out, error = Path(folder) / "out", Path(folder) / "error"
        process = Forked(words, out, error)
        try:
            status = process.wait(bound_s)
        finally:
            process.kill()
        return subprocess.CompletedProcess(words, status, out.read_text(), error.read_text())


def called(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a command to its end in this process: the same words and status, without the second that a process takes to
    start."""
    words = [str(argument) for argument in arguments]
    with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as error:
        try:
            status = main(words)
        except SystemExit as ended:  # argparse's own
            status = int(ended.code or 0)
    return subprocess.CompletedProcess(words, status, out.getvalue(), error.getvalue())


class Process:
    """A command that goes on until it is stopped or killed; its output is in a file."""

    def __init__(self, log: Path, *arguments: str | Path) -> None:
        self.log = log
        words = list(map(str, arguments))
        self._process = Forked(words, log, log) if forked.begun else _started(words, log)

    def kill(self) -> None:
        """kill -9."""
        self._process.kill()
        self._process.wait()

    def stop(self, bound_s: float = BOUND_S) -> int:
        """SIGTERM, and its exit status."""
        self.send(signal.SIGTERM)
        return self.ended(bound_s)

    def send(self, number: signal.Signals) -> None:
        """A signal."""
        self._process.send_signal(number)

    def ended(self, bound_s: float = BOUND_S) -> int:
        """Its exit status, once it has ended by itself."""
        try:
            return self._process.wait(bound_s)
        finally:
            if self._process.poll() is None:
                self._process.kill()
                self._process.wait()

    def reload(self) -> None:
        """SIGHUP."""
        self.send(signal.SIGHUP)

    @property
    def running(self) -> bool:
        return self._process.poll() is None

    @property
    def process_id(self) -> int:
        return self._process.pid

    @property
    def text(self) -> str:
        return self.log.read_text(errors="replace")


def _started(words: list[str], log: Path) -> subprocess.Popen[bytes]:
    with log.open("ab") as file:
        return subprocess.Popen([*COMBTRACE, *words], stdout=file, stderr=subprocess.STDOUT, env=ENVIRONMENT)


def until(condition: Callable[[], Any], bound_s: float = BOUND_S, what: str = "it", pause_s: float = 0.02) -> Any:
    """What `condition` gives once it is true; it is asked again after each pause."""
    give_up_at = time.monotonic() + bound_s
    while not (result := condition()):
        assert time.monotonic() < give_up_at, f"{what} did not come within {bound_s:g} s"
        time.sleep(pause_s)
    return result


def free_port() -> int:
    """A TCP port that is free now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def jobs(journal: Path) -> list[dict[str, Any]]:
    """All jobs of a journal, read by SQLite's own hands while the service may be writing."""
    if not journal.exists():
        return []
    database = sqlite3.connect(f"file:{journal}?mode=ro", uri=True, timeout=BOUND_S)
    try:
        database.row_factory = sqlite3.Row
        return [dict(row) for row in database.execute("SELECT * FROM jobs ORDER BY job_id")]
    except sqlite3.OperationalError:  # the tables are not made yet
        return []
    finally:
        database.close()


def lines(path: Path) -> list[dict[str, Any]]:
    """JSON Lines, whole ones only."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().splitlines(keepends=True) if line.endswith("\n")]


def resident_megabytes(process_id: int) -> float:
    """Memory that a process holds, in 10⁶ bytes."""
    status = Path(f"/proc/{process_id}/status").read_text()
    (line,) = (line for line in status.splitlines() if line.startswith("VmRSS:"))
    return int(line.split()[1]) * 1024 / 1e6
