"""A clean Debian as a machine of its own: its systemd is the first process of a container without any network."""

from __future__ import annotations

import os
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.support.processes.processes import until
from tests.support.real_parts import missing, need_program

INSTALL = "apt-get install mmdebstrap systemd-container"
PACKAGES = (
    "python3,systemd,udev,dbus"  # of which the second last is on every machine, and python3 on all but the barest
)


def made(folder: Path) -> Path:
    """A root file system with Debian's essential packages and few more, from the mirror that this machine uses."""
    if os.geteuid() != 0:
        missing("a clean root file system is made by root")
    need_program("systemd-nspawn", INSTALL)
    release = Path("/etc/os-release").read_text(encoding="utf-8")
    suite = next(line.partition("=")[2] for line in release.splitlines() if line.startswith("VERSION_CODENAME="))
    root = folder / "root"
    command = [
        need_program("mmdebstrap", INSTALL),
        "--quiet",
        "--variant=minbase",
        f"--include={PACKAGES}",
        suite,
        root,
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return root


class Machine:
    """Commands in a running container, as root."""

    def __init__(self, leader: int) -> None:
        self._enter = ["nsenter", "--target", str(leader), "--all"]

    def tried(self, *command: str | Path) -> subprocess.CompletedProcess[str]:
        environment = {
            "PATH": "/usr/sbin:/usr/bin:/sbin:/bin",
            "LC_ALL": "C.UTF-8",
            "DEBIAN_FRONTEND": "noninteractive",
        }
        words = [*self._enter, *(str(word) for word in command)]
        return subprocess.run(words, capture_output=True, text=True, check=False, env=environment)

    def done(self, *command: str | Path) -> str:
        """What a command prints; it must succeed."""
        found = self.tried(*command)
        assert found.returncode == 0, f"{command}: {found.stdout}{found.stderr}"
        return found.stdout.strip()

    def process(self, *command: str | Path) -> subprocess.Popen[str]:
        """A command that goes on."""
        return subprocess.Popen([*self._enter, *(str(word) for word in command)], text=True)

    def log(self) -> str:
        return self.done("journalctl", "--no-pager", "--output=cat", "--unit=combtrace")


@contextmanager
def booted(root: Path, shown: Path) -> Iterator[Machine]:
    """The machine while it runs; the folder `shown` is its working folder /media."""
    with tempfile.TemporaryFile() as console:
        outer = subprocess.Popen(
            [
                *("systemd-nspawn", "--quiet", "--boot", "--private-network", "--register=no", "--keep-unit"),
                *("--directory", str(root), f"--bind-ro={shown}:/media"),
            ],
            stdin=subprocess.DEVNULL,
            stdout=console,
            stderr=subprocess.STDOUT,
        )
        children = Path(f"/proc/{outer.pid}/task/{outer.pid}/children")

        def up() -> Machine | None:
            """The machine once it has started; its first process is not the first one that is forked for it."""
            if outer.poll() is not None:
                console.seek(0)
                # No package mends that: whoever runs this lacks the rights.
                pytest.skip(f"no container can be booted here: {console.read().decode(errors='replace')}")
            machines = [Machine(int(process)) for process in children.read_text().split()]
            state = "systemctl", "is-system-running"
            return next((one for one in machines if one.tried(*state).stdout.strip() in UP), None)

        try:
            yield until(up, 120, "the machine", 0.2)
        finally:
            with suppress(ProcessLookupError):
                outer.terminate()  # systemd-nspawn has its machine switched off then
            outer.wait(60)


UP = ("running", "degraded")  # in a container some units of a machine cannot run
