"""Programs that others wrote, started for a test: what they need, when they are ready, and their end."""

from __future__ import annotations

import contextlib
import functools
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tests.support.real_parts import missing, need_program

HERE = Path(__file__).parent
LIBMODBUS_INSTALL = "apt-get install gcc libc6-dev pkg-config libmodbus-dev"
NODE_INSTALL = "apt-get install nodejs npm"
NPM_PACKAGES = ("modbus-serial@8", "axe-core@4")


@functools.cache
def compiled(name: str, folder: Path = HERE) -> Path:
    """The program of `NAME.c` in `folder`, linked with libmodbus; compiled once a run."""
    need_program("gcc", LIBMODBUS_INSTALL)
    need_program("pkg-config", LIBMODBUS_INSTALL)
    flags = subprocess.run(
        ["pkg-config", "--cflags", "--libs", "libmodbus"], capture_output=True, text=True, check=False
    )
    if flags.returncode:
        missing(f"libmodbus is not here. Install it: {LIBMODBUS_INSTALL}")
    program = _folder() / name
    command = ["gcc", "-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", "-o", str(program)]
    subprocess.run([*command, str(folder / f"{name}.c"), *flags.stdout.split()], check=True)
    return program


@functools.cache
def node_modules(packages: tuple[str, ...] = NPM_PACKAGES) -> Path:
    """The folder of npm packages with these in it; installed once a run."""
    npm = need_program("npm", NODE_INSTALL)
    folder = _folder()
    command = [
        npm,
        "install",
        "--prefix",
        str(folder),
        "--omit=optional",
        "--ignore-scripts",
        "--no-audit",
        "--no-fund",
    ]
    done = subprocess.run([*command, *packages], capture_output=True, text=True, timeout=120, check=False)
    if done.returncode:
        missing(f"npm cannot install {' and '.join(packages)}: {done.stderr.strip()[-300:]}")
    return folder / "node_modules"


@functools.cache
def python_packages(*packages: str) -> Path:
    """A folder with these packages and what they need, apart from ours; installed once a run."""
    folder = _folder()
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--target"]
    done = subprocess.run([*command, str(folder), *packages], capture_output=True, text=True, timeout=120, check=False)
    if done.returncode:
        missing(f"pip cannot install {' and '.join(packages)}: {done.stderr.strip()[-300:]}")
    return folder


@contextlib.contextmanager
def sparkplug_reader(port: int, file: Path, *host: str) -> Iterator[subprocess.Popen[str]]:
    """pysparkplug on a broker; it needs an older paho-mqtt than ours, so it has packages of its own."""
    packages = python_packages("pysparkplug>=0.6,<0.7")
    words = (HERE / "sparkplug_reader.py", str(port), file, *host)
    with running(sys.executable, *words, PYTHONPATH=str(packages), PYTHONWARNINGS="ignore") as (process, _):
        yield process


def _folder() -> Path:
    folder = tempfile.TemporaryDirectory(prefix="combtrace-interop-")
    _folders.append(folder)
    return Path(folder.name)


_folders: list[tempfile.TemporaryDirectory[str]] = []  # each is removed when the interpreter ends


@contextlib.contextmanager
def running(*command: str | Path, **environment: str) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """The process, and the number after "ready" on its first line; killed at the end."""
    words = [str(word) for word in command]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env={**os.environ, **environment})
    with process:
        try:
            assert process.stdout is not None
            said = process.stdout.readline()
            assert said.startswith("ready "), f"{command[0]} said {said!r}"
            yield process, int(said.split()[1])
        finally:
            process.kill()


@contextlib.contextmanager
def libmodbus_tcp(registers: int = 10_000, port: int = 0) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A libmodbus server on loopback, and its port."""
    with running(compiled("libmodbus_server"), "tcp", str(port), str(registers)) as started:
        yield started


@contextlib.contextmanager
def libmodbus_rtu(
    device: str, registers: int = 10_000, baudrate: int = 115_200, parity: str = "N", stop_bits: int = 1
) -> Iterator[subprocess.Popen[str]]:
    """A libmodbus server on a serial port."""
    line = (device, str(registers), str(baudrate), parity, str(stop_bits))
    with running(compiled("libmodbus_server"), "rtu", *line) as (process, _):
        yield process


@contextlib.contextmanager
def pymodbustcp(registers: int = 10_000) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A pyModbusTCP server on loopback, and its port."""
    with running(sys.executable, HERE / "pymodbustcp_server.py", "0", str(registers)) as started:
        yield started


@contextlib.contextmanager
def pymodbus(
    way: str = "tcp", device: str = "-", registers: int = 10_000
) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A pymodbus server: "tcp" or "rtu-over-tcp" on loopback, and its port, or "rtu" on the serial port `device`."""
    with running(sys.executable, HERE / "pymodbus_server.py", way, device, str(registers)) as started:
        yield started


@contextlib.contextmanager
def modbus_serial(registers: int = 10_000) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A server of npm's modbus-serial on loopback, and its port."""
    node = need_program("node", NODE_INSTALL)
    script = HERE / "modbus_serial_server.js"
    with running(node, script, str(registers), NODE_PATH=str(node_modules())) as started:
        yield started


TCP_SERVERS = {
    "libmodbus": libmodbus_tcp,
    "pyModbusTCP": pymodbustcp,
    "modbus-serial": modbus_serial,
    "pymodbus": pymodbus,
}


def mbpoll_reads(address: int, count: int, *where: str) -> list[int]:
    """Holding registers as mbpoll reads them; where: its device or host, and options of the line."""
    mbpoll = need_program("mbpoll", "apt-get install mbpoll")
    registers: list[int] = []
    while len(registers) < count:
        options = ["-0", "-1", "-q", "-t", "4:hex", "-r", str(address + len(registers))]
        options += ["-c", str(min(125, count - len(registers)))]
        said = subprocess.run([mbpoll, *options, *where], capture_output=True, text=True, timeout=30, check=False)
        assert said.returncode == 0, said.stdout + said.stderr
        registers += [int(value, 16) for value in re.findall(r"^\[\d+\]:\s+0x(\w{4})", said.stdout, re.MULTILINE)]
    return registers
