"""The unit as `install-service` writes it, under a systemd that runs it: all that it closes, and what it leaves open.

systemd is the first process of a namespace of its own in the guest. A drop-in changes of the unit what this machine
needs: where Python and sources lie, a shorter watchdog, time for a slow start, and no waiting for the parts of a whole
machine's start.
"""

from __future__ import annotations

import os
import pwd
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from service.commissioning.install_files import packaged
from tests.support.real_parts import need_program

ROOT = Path(__file__).parents[2]
SOURCES, PROGRAM = Path("/opt/src"), Path("/opt/combtrace/bin/combtrace")
CONFIG = """\
camera: {kind: v4l2, device: /dev/video0, width: 640, height: 360, frame_rate: 30, exposure_ms: 0, timeout_s: 10}
controller: {kind: none}
recipes: [{number: 1, name: default, thickness_mm: 20, method: find-contours}]
triggers: [{kind: interval, period_s: 3}, {kind: serial, port: /dev/ttyS3, mode: byte}]
service: {state_dir: /var/lib/combtrace}
journal: {path: /var/lib/combtrace/journal.sqlite}
archive: {path: /var/lib/combtrace/archive, min_free_bytes: 0}
"""
LOG = Path("/var/log/combtrace")
BOUND_S = 400.0  # more than a start may take
DROP_IN = f"""\
[Unit]
DefaultDependencies=no
[Service]
Environment=PYTHONPATH={SOURCES}
ProtectHome=read-only
WatchdogSec=45
TimeoutStartSec=300
StandardOutput=append:{LOG}
StandardError=append:{LOG}
"""


def done(*command: str | Path) -> str:
    """What a command says; it must succeed."""
    try:
        found = subprocess.run(
            [str(part) for part in command], capture_output=True, text=True, check=False, timeout=BOUND_S
        )
    except subprocess.TimeoutExpired as hung:
        pytest.fail(f"{command} hangs: {hung.stdout} {hung.stderr} {LOG.read_text() if LOG.exists() else ''}")
    assert found.returncode == 0, f"{command}: {found.stdout}{found.stderr}"
    return found.stdout.strip()


def until(condition: Callable[[], object], what: str, bound_s: float = 300.0) -> None:
    give_up_at = time.monotonic() + bound_s
    while not condition():
        assert time.monotonic() < give_up_at, f"no {what}: {LOG.read_text() if LOG.exists() else ''}"
        time.sleep(0.2)


def write(path: Path, content: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content)


def knows_user(name: str) -> bool:
    return any(user.pw_name == name for user in pwd.getpwall())


class Systemd:
    """A system manager in a namespace, and its commands."""

    def __init__(self) -> None:
        write(Path("/etc/systemd/system/alone.target"), "[Unit]\nDefaultDependencies=no\n")
        write(Path("/etc/machine-id"), "0123456789abcdef0123456789abcdef\n")
        if not os.path.ismount("/sys/fs/cgroup"):
            done("/bin/busybox", "mount", "-t", "cgroup2", "cgroup2", "/sys/fs/cgroup")
        self._outer = subprocess.Popen(
            [
                *("unshare", "--pid", "--mount", "--cgroup", "--fork", "--mount-proc", "--kill-child"),
                *("/lib/systemd/systemd", "--unit=alone.target", "--log-target=console", "--show-status=no"),
            ],
            env={"container": "other", "PATH": "/usr/sbin:/usr/bin:/sbin:/bin"},
        )
        children = Path(f"/proc/{self._outer.pid}/task/{self._outer.pid}/children")
        until(lambda: children.read_text().split(), "systemd")
        self._process = children.read_text().split()[0]
        until(Path(f"/proc/{self._process}/root/run/systemd/private").is_socket, "socket of systemd")

    def inside(self, *command: str, process: str | None = None) -> list[str]:
        """The command line that runs a command where systemd, or one of its processes, runs."""
        target = ("-t", process) if process else ("-t", self._process, "-p", "-C")
        return ["nsenter", *target, "-m", "-r", "-w", *command]

    def ctl(self, *arguments: str) -> str:
        return done(*self.inside("systemctl", *arguments))

    def shown(self, name: str) -> str:
        """A property of the unit."""
        return self.ctl("show", "-P", name, "combtrace")

    def end(self) -> None:
        self._outer.kill()
        self._outer.wait()


@pytest.fixture
def systemd() -> Iterator[Systemd]:
    need_program("systemd-analyze", "apt-get install systemd")
    SOURCES.mkdir(parents=True, exist_ok=True)
    done("/bin/busybox", "mount", "-o", "bind", ROOT, SOURCES)  # its own place may be below /tmp, which the unit hides
    for folder in (Path("/root"), SOURCES):
        folder.chmod(0o755)
    write(PROGRAM, f'#!/bin/sh\nexec {SOURCES}/.venv/bin/python -m service.cli.main "$@"\n')
    PROGRAM.chmod(0o755)
    write(Path("/etc/combtrace/config.yaml"), CONFIG)
    write(Path("/etc/systemd/system/combtrace.service"), packaged()["systemd/combtrace.service"])
    write(Path("/etc/systemd/system/combtrace.service.d/here.conf"), DROP_IN)
    if not knows_user("combtrace"):  # the guest sees this machine's users
        done("useradd", "--system", "--home-dir", "/var/lib/combtrace", "--shell", "/usr/sbin/nologin", "combtrace")
    for device, group in (("/dev/video0", "video"), ("/dev/ttyS3", "dialout")):  # as udev does
        done("chgrp", group, device)
        Path(device).chmod(0o660)
    started = Systemd()
    yield started
    started.end()


def test_the_unit_runs_closed_in_reloads_is_started_again_where_it_hangs_and_stops(systemd: Systemd) -> None:
    systemd.ctl("start", "combtrace")  # Type=notify: returns when it runs
    main = systemd.shown("MainPID")
    until(lambda: "job 1 " in LOG.read_text() and "job 2 " in LOG.read_text(), "jobs")
    assert "camera /dev/video0 opened" in LOG.read_text()
    assert "-> Error" not in LOG.read_text(), "camera and serial port are open to it"
    assert systemd.shown("StatusText") in ("Ready", "SingleExecution")

    status = dict(line.split(":\t", 1) for line in done(*systemd.inside("cat", f"/proc/{main}/status")).splitlines())
    assert status["Uid"].split()[0] == done("id", "-u", "combtrace")
    assert {int(status[name], 16) for name in ("CapEff", "CapPrm", "CapBnd", "CapAmb")} == {0}
    assert (status["NoNewPrivs"], status["Seccomp"]) == ("1", "2")
    for folder, writable in (("/etc/combtrace", False), ("/opt/combtrace", False), ("/var/lib/combtrace", True)):
        command = ["nsenter", "-t", main, "-m", "-r", "touch", f"{folder}/tried"]  # by root: only the mount forbids it
        tried = subprocess.run(systemd.inside(*command), capture_output=True, text=True, check=False)
        assert (tried.returncode == 0) is writable, f"{folder}: {tried.stderr}{LOG.read_text()}"

    systemd.ctl("reload", "combtrace")
    until(lambda: "configuration reloaded" in LOG.read_text(), "reload")

    time.sleep(50)  # more than the watchdog waits
    assert systemd.shown("NRestarts") == "0", "work feeds the watchdog"
    done(*systemd.inside("kill", "-STOP", main))
    until(lambda: systemd.shown("NRestarts") == "1", "restart")
    assert "most recent call first" in LOG.read_text(), "where it hung"
    until(lambda: systemd.shown("ActiveState") == "active", "the second start")
    until(lambda: LOG.read_text().count("-> Ready") > 1, "Ready again")

    systemd.ctl("stop", "combtrace")
    assert (systemd.shown("Result"), systemd.shown("ExecMainStatus")) == ("success", "0")
    assert "-> Halted" in LOG.read_text()
