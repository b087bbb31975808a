"""A headless LinuxCNC with the bridge, as processes of a user who may run it (LinuxCNC refuses root)."""

from __future__ import annotations

import os
import pwd
import re
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.support.processes.processes import free_port

HERE = Path(__file__).parent
BRIDGE = HERE.parents[1] / "controllers" / "linuxcnc"
USER = "combtrace-cnc"
PYTHON = "/usr/bin/python3"


class LinuxCnc:
    """A running session in a folder of its own; what is written there, and by whom, is the machine's user's."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.user = _user()
        for name in ("sim.ini", "core.hal", "hold.sh", "operate.py"):
            text = (HERE / name).read_text(encoding="utf-8").replace("@DIR@", str(folder))
            (folder / name).write_text(text, encoding="utf-8")
        (folder / "hold.sh").chmod(0o755)
        (folder / "sim.tbl").touch()
        shutil.copytree(BRIDGE, folder / "bridge", ignore=shutil.ignore_patterns("__pycache__"))
        if self.user:
            subprocess.run(["chown", "-R", self.user, str(folder)], check=True)
        environment = {name: value for name, value in os.environ.items() if name != "DISPLAY"}
        with open(folder / "linuxcnc.log", "wb") as log:
            self._session = subprocess.Popen(
                self.by_user("linuxcnc", "-r", str(folder / "sim.ini")),
                cwd=folder,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def by_user(self, *command: str) -> list[str]:
        """The command as the machine's user runs it."""
        return ["runuser", "-u", self.user, "--", *command] if self.user else list(command)

    def wait_until_up(self, bound_s: float = 30.0) -> None:
        """Until the session's screen stands; raise AssertionError with its log."""
        end = time.monotonic() + bound_s
        while not (self.folder / "display.pid").exists():
            told = (self.folder / "linuxcnc.log").read_text(errors="replace")
            assert time.monotonic() < end, f"LinuxCNC does not start:\n{told[-2000:]}"
            assert self._session.poll() is None, f"LinuxCNC has ended:\n{told[-2000:]}"
            time.sleep(0.05)

    def operate(self, *words: str) -> None:
        """Do what an operator does; see operate.py."""
        subprocess.run(self.by_user(PYTHON, str(self.folder / "operate.py"), *words), check=True, timeout=60)

    def set_pin(self, pin: str, value: str) -> None:
        """Set a HAL pin that no signal is connected to."""
        subprocess.run(self.by_user("halcmd", "setp", pin, value), check=True, timeout=30)

    def pin(self, pin: str) -> str:
        """What a HAL pin shows, as halcmd tells it."""
        return subprocess.check_output(self.by_user("halcmd", "getp", pin), text=True, timeout=30).strip()

    def sampling(self, path: Path) -> subprocess.Popen[bytes]:
        """A process that samples the next program's way."""
        return subprocess.Popen(self.by_user(PYTHON, str(self.folder / "operate.py"), "sample", str(path)))

    def end(self) -> None:
        """End the screen, which ends the session in order."""
        pid_file = self.folder / "display.pid"
        if pid_file.exists():
            os.kill(int(pid_file.read_text()), signal.SIGTERM)
        try:
            self._session.wait(30)
        except subprocess.TimeoutExpired:
            os.killpg(self._session.pid, signal.SIGKILL)
            raise


class Bridge:
    """The bridge's process on a session."""

    def __init__(self, machine: LinuxCnc, *options: str) -> None:
        self.port = free_port()
        self.folder = machine.folder / "contours"
        self.log = machine.folder / "bridge.log"
        command = [PYTHON, "-u", str(machine.folder / "bridge" / "bridge.py"), "--listen", f"127.0.0.1:{self.port}"]
        command += ["--folder", str(self.folder), "--safe-z", "50", "--feed", "12000", *options]
        with open(self.log, "wb") as log:
            self._process = subprocess.Popen(
                machine.by_user(*command), stdin=subprocess.PIPE, stdout=log, stderr=subprocess.STDOUT
            )
        self.says("listening")

    def says(self, pattern: str, bound_s: float = 30.0) -> str:
        """Its log, once the pattern is found in it."""
        end = time.monotonic() + bound_s
        while re.search(pattern, told := self.log.read_text(errors="replace")) is None:
            assert time.monotonic() < end, f"no {pattern!r} in:\n{told}"
            assert self._process.poll() is None, f"the bridge has ended:\n{told}"
            time.sleep(0.02)
        return told

    def request(self) -> None:
        """Ask for a measurement, as the operator does."""
        assert self._process.stdin is not None
        self._process.stdin.write(b"request\n")
        self._process.stdin.flush()

    def end(self) -> None:
        """End it."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.terminate()
        self._process.wait(10)


@contextmanager
def linuxcnc_session() -> Iterator[LinuxCnc]:
    """A session, homed and on, in a folder that the machine's user can reach."""
    folder = Path(tempfile.mkdtemp(prefix="combtrace-linuxcnc-"))
    folder.chmod(0o755)
    machine = LinuxCnc(folder)
    try:
        machine.wait_until_up()
        machine.operate("prepare")
        yield machine
    finally:
        machine.end()
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def bridge_on(machine: LinuxCnc, *options: str) -> Iterator[Bridge]:
    """A bridge on the session, ended with the block."""
    bridge = Bridge(machine, *options)
    try:
        yield bridge
    finally:
        bridge.end()
        shutil.rmtree(bridge.folder, ignore_errors=True)


def _user() -> str:
    """Whom to run LinuxCNC as: "" for ourselves, a user made for it where we are root."""
    if os.geteuid() != 0:
        return ""
    try:
        pwd.getpwnam(USER)
    except KeyError:
        subprocess.run(["useradd", "--create-home", USER], check=True)
    return USER
