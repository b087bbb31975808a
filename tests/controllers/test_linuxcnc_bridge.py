"""The bridge's command line, beside a LinuxCNC of straw: what it says to whoever starts it wrongly."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

BRIDGE = Path(__file__).parents[2] / "controllers" / "linuxcnc" / "bridge.py"
STRAW = """
import os

class error(Exception):
    pass

class command:
    pass

def error_channel():
    return None

class stat:
    linear_units, file = 1.0, ""
    g5x_offset, g92_offset, tool_offset = (10, 20, 30), (1, 2, 3), (0, 0, 500)

    def poll(self):
        if not os.environ.get("LINUXCNC_RUNS"):
            raise error("emcStatusBuffer invalid err=3")
"""


def python(folder: Path, *words: str | Path, **environment: str) -> subprocess.CompletedProcess[str]:
    (folder / "linuxcnc.py").write_text(STRAW)
    return subprocess.run(
        [sys.executable, *words],
        capture_output=True,
        text=True,
        check=False,
        stdin=subprocess.DEVNULL,
        timeout=30,
        env={**os.environ, "PYTHONPATH": f"{folder}:{BRIDGE.parent}", **environment},
    )


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--listen", "5020"), "argument --listen: invalid address value"),
        (("--listen", "127.0.0.1:99999"), "argument --listen: invalid address value"),
        (("--safe-z", "nan"), "argument --safe-z: invalid height value"),
        (("--feed", "0"), "argument --feed: invalid positive value"),
        (("--payload-capacity", "7"), "argument --payload-capacity: invalid capacity value"),
        (("--cut-z", "60"), "cut-z 60 is not below safe-z 50"),
        (
            ("--folder", "/proc/nowhere"),
            "--folder /proc/nowhere: No such file or directory. Name one that can be written",
        ),
        ((), "LinuxCNC does not answer (emcStatusBuffer invalid err=3). Start it first, as this user"),
    ],
)
def test_what_it_cannot_start_with_is_told_in_one_line(tmp_path: Path, options: tuple[str, ...], said: str) -> None:
    done = python(tmp_path, BRIDGE, "--folder", tmp_path, "--safe-z", "50", *options)
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert done.returncode in (1, 2)


def test_a_port_that_is_taken_is_told_in_one_line(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        listen = f"127.0.0.1:{taken.getsockname()[1]}"
        done = python(tmp_path, BRIDGE, "--folder", tmp_path, "--safe-z", "50", "--listen", listen, LINUXCNC_RUNS="1")
    assert f"--listen {listen}: Address already in use" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_tools_length_is_no_offset_since_the_program_cancels_it(tmp_path: Path) -> None:
    show = "import bridge; print(bridge.Machine('.').offset_mm())"
    assert python(tmp_path, "-c", show, LINUXCNC_RUNS="1").stdout.strip() == "[11.0, 22.0, 33.0]"
