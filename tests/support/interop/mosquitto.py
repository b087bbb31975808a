"""A real broker for tests: Mosquitto, which may be killed and started again on its port."""

from __future__ import annotations

import socket
import subprocess
from contextlib import suppress
from pathlib import Path

from tests.support.processes.processes import free_port, until
from tests.support.real_parts import need_program

MOSQUITTO_INSTALL = "apt-get install mosquitto"


class Mosquitto:
    """The broker on loopback. more: lines of its configuration; without any it lets everybody in."""

    def __init__(self, folder: Path, more: str = "allow_anonymous true\n", *, config: Path | None = None) -> None:
        self._program = need_program("mosquitto", MOSQUITTO_INSTALL)
        self._folder, self.port = folder, free_port()
        self._config = config or folder / "mosquitto.conf"
        if config is None:
            self._config.write_text(f"listener {self.port} 127.0.0.1\nuser root\npersistence false\n{more}")
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Until it listens."""
        with (self._folder / "mosquitto.log").open("ab") as log:
            self._process = subprocess.Popen([self._program, "-c", str(self._config)], stdout=log, stderr=log)
        until(self._listens, 30, "the broker", 0.01)

    def _listens(self) -> bool:
        assert self._process is not None
        assert self._process.poll() is None, (self._folder / "mosquitto.log").read_text()
        with suppress(OSError), socket.create_connection(("127.0.0.1", self.port), timeout=5):
            return True
        return False

    def kill(self) -> None:
        """kill -9, where it runs."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None
