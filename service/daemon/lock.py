"""One service per state folder, journal and controller: locks that the kernel lets go when the process ends.

Folder and journal are locked by a file beside them. A controller has no file: it is locked by a name among Linux's
abstract sockets, because no folder is seen and written alike by all users, containers and sandboxed units.
"""

from __future__ import annotations

import fcntl
import os
import socket
import struct
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Protocol

NAME_PREFIX = "\0combtrace/controller/"
LONGEST_NAME = 107  # bytes of a socket's address
PEER_CREDENTIALS = struct.Struct("3i")  # process, user, group: unix(7), SO_PEERCRED


class LockError(Exception):
    """Another service holds the lock, or it cannot be taken."""


class Held(Protocol):
    """A lock that is held."""

    def release(self) -> None:
        """Let it go."""


class Lock:
    """Holds a lock file until `release`; raise LockError. what, next_step: for its message."""

    def __init__(
        self,
        path: Path,
        what: str = "this state folder",
        next_step: str = "Stop it, or give this one its own service.state_dir and journal.path",
    ) -> None:
        self._path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._open()
        except OSError as error:
            raise LockError(f"{path}: cannot be opened: {error.strerror}. Check service.state_dir") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            while not os.path.sameopenfile(self._file, again := self._open()):  # taken away before we held it
                os.close(self._file)
                self._file = again
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.close(again)
        except OSError as error:
            holder = os.pread(self._file, 20, 0).decode("ascii", "replace").strip() or "unknown"
            os.close(self._file)
            raise LockError(
                f"{path}: another combtrace (process {holder}) runs on {what}, expected one. {next_step}"
            ) from error
        with suppress(OSError):  # a full disk: the lock holds without the number, which is for people
            os.ftruncate(self._file, 0)
            os.pwrite(self._file, f"{os.getpid()}\n".encode(), 0)

    def release(self) -> None:
        """Let it go."""
        os.close(self._file)

    def leave_no_file(self) -> None:
        """Take the file away while it is held, so that nothing tells of this run."""
        with suppress(OSError):
            self._path.unlink()

    def _open(self) -> int:
        return os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)


def journal_lock(journal: Path) -> Lock:
    """The lock of a journal, by whatever path it is named."""
    real = journal.resolve()
    next_step = "Stop it, or give this one its own journal.path: two services in one journal would mix their jobs"
    return Lock(real.with_name(real.name + ".lock"), "this journal", next_step)


class NameLock:
    """Holds a name on this machine until `release`; raise LockError."""

    def __init__(self, name: str) -> None:
        address = (NAME_PREFIX + name).encode()[:LONGEST_NAME]
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.bind(address)
            self._socket.listen(1)  # so that who asks can learn whose it is
        except OSError as error:
            self._socket.close()
            raise LockError(
                f"controller {name}: another combtrace (process {_holder(address)}) runs on it, expected one. "
                "Stop it; to run beside it, set controller.mode: observe"
            ) from error

    def release(self) -> None:
        """Let it go."""
        self._socket.close()


def name_is_held(name: str) -> bool:
    """True where a process of this machine holds the name; the holder does not notice that it was looked at."""
    written = "@" + NAME_PREFIX[1:] + name  # as the kernel lists abstract names
    try:
        table = Path("/proc/net/unix").read_text()
    except OSError:
        return False
    return any(line.endswith(f" {written[:LONGEST_NAME]}") for line in table.splitlines())


def _holder(address: bytes) -> str:
    """The process that holds the name."""
    with suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
        asking.settimeout(0.2)
        asking.connect(address)
        found = asking.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, PEER_CREDENTIALS.size)
        return str(PEER_CREDENTIALS.unpack(found)[0])
    return "unknown"


class Locks:
    """Several locks as one."""

    def __init__(self, held: Sequence[Held] = ()) -> None:
        self._held = list(held)

    def add(self, lock: Held) -> None:
        """Hold one more."""
        self._held.append(lock)

    def release(self) -> None:
        """Let all go."""
        while self._held:
            self._held.pop().release()


def network_names(host: str, port: int, unit: int | None) -> list[str]:
    """Names of a controller behind a network address, one for each address that its host name stands for.

    unit: the device id; None where the address is a line, which only one program may talk on.
    """
    try:
        found = {str(entry[4][0]) for entry in socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)}
    except (OSError, UnicodeError):  # not known now: it is told when it is to be reached
        found = {host}
    return sorted(f"{address}:{port}" + ("" if unit is None else f"/{unit}") for address in found)


def serial_name(port: str) -> str:
    """The name of a serial port, by whatever link it is named."""
    return str(Path(port).resolve())
