"""The product's commands as processes of their own, forked from one that has loaded what they load.

Loading takes most of what a service's start takes the processor. All else is as a user has it: a process with its own
memory and files, which ends by itself, by a signal or by kill -9. That commands start from nothing too is told by tests
of the command line, of the wheel and of the tutorial.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from multiprocessing import forkserver
from pathlib import Path

from service.cli.main import COMMANDS, main

_FORKS = multiprocessing.get_context("forkserver")
_LOADED = [
    *("service.wiring.daemon", "service.web.server", "service.commissioning.scenario_file", "prometheus_client"),
    *("drivers.controller.simulated.controller", "drivers.controller.simulated.server", *COMMANDS.values()),
]
begun = False


def begin() -> None:
    """Start the process that loads and is forked, before a first test looks at what it leaves open."""
    global begun
    _FORKS.set_forkserver_preload(_LOADED)
    forkserver.ensure_running()
    begun = True


class Forked:
    """A command in a process, by the verbs of `subprocess.Popen`; what it prints is added to two files, or to one."""

    def __init__(self, words: Sequence[str], out: Path, error: Path) -> None:
        out.touch()
        self._process = _FORKS.Process(target=_run, args=(words, out, error), daemon=True)
        self._process.start()
        self.pid = int(self._process.pid or 0)
        self._status: int | None = None

    def poll(self) -> int | None:
        """Its exit status, or minus the signal that ended it; None while it runs."""
        if self._status is None and self._process.exitcode is not None:
            self._status = self._process.exitcode
            self._process.close()
        return self._status

    def wait(self, timeout: float | None = None) -> int:
        """Its exit status; raise subprocess.TimeoutExpired."""
        if self.poll() is None:
            self._process.join(timeout)
        status = self.poll()
        if status is None:
            raise subprocess.TimeoutExpired("combtrace", timeout or 0.0)
        return status

    def send_signal(self, number: signal.Signals) -> None:
        """A signal, while it runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """kill -9."""
        self.send_signal(signal.SIGKILL)


def _run(words: Sequence[str], out: Path, error: Path) -> None:
    for number, path in ((1, out), (2, error)):
        with path.open("ab") as file:
            os.dup2(file.fileno(), number)
    multiprocessing.current_process().daemon = False  # a service may have processes of its own
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    sys.exit(main(words))
