"""Programs that others wrote, started for a test: what they need, when they are ready, and their end."""

from __future__ import annotations

import contextlib
import functools
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tests.real_parts import missing, need_program

HERE = Path(__file__).parent
LIBMODBUS_INSTALL = "apt-get install gcc pkg-config libmodbus-dev"


@functools.cache
def compiled(name: str) -> Path:
    """The program of `tests/interop/NAME.c`, linked with libmodbus; compiled once a run."""
    need_program("gcc", LIBMODBUS_INSTALL)
    need_program("pkg-config", LIBMODBUS_INSTALL)
    flags = subprocess.run(
        ["pkg-config", "--cflags", "--libs", "libmodbus"], capture_output=True, text=True, check=False
    )
    if flags.returncode:
        missing(f"libmodbus is not here. Install it: {LIBMODBUS_INSTALL}")
    folder = tempfile.TemporaryDirectory(prefix="combtrace-interop-")
    _folders.append(folder)
    program = Path(folder.name) / name
    command = ["gcc", "-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", "-o", str(program)]
    subprocess.run([*command, str(HERE / f"{name}.c"), *flags.stdout.split()], check=True)
    return program


_folders: list[tempfile.TemporaryDirectory[str]] = []  # each is removed when the interpreter ends


@contextlib.contextmanager
def running(*command: str | Path) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """The process, and the number after "ready" on its first line; killed at the end."""
    process = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True)
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
