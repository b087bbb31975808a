"""One service per state folder: a lock that the kernel lets go when the process ends, however it ends."""

from __future__ import annotations

import fcntl
import os
from contextlib import suppress
from pathlib import Path


class LockError(Exception):
    """Another service holds the lock, or it cannot be taken."""


class Lock:
    """Holds a lock file until `release`; raise LockError."""

    def __init__(self, path: Path) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise LockError(f"{path}: cannot be opened: {error.strerror}. Check service.state_dir") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            holder = os.pread(self._file, 20, 0).decode("ascii", "replace").strip() or "unknown"
            os.close(self._file)
            raise LockError(
                f"{path}: another combtrace (process {holder}) runs on this state folder, expected one. "
                "Stop it, or give this one its own service.state_dir and journal.path"
            ) from error
        with suppress(OSError):  # a full disk: the lock holds without the number, which is for people
            os.ftruncate(self._file, 0)
            os.pwrite(self._file, f"{os.getpid()}\n".encode(), 0)

    def release(self) -> None:
        """Let it go."""
        os.close(self._file)
