"""A file that is whole or as it was before, whoever reads it meanwhile and whatever fails."""

from __future__ import annotations

import errno
import os
import tempfile
from contextlib import suppress
from pathlib import Path

# What a disk says that takes no writes now, which may pass: full, read-only, failing.
REFUSALS = frozenset({errno.ENOSPC, errno.EROFS, errno.EDQUOT, errno.EIO, errno.ESTALE})


def write_whole(path: Path, data: bytes, mode: int | None = None) -> None:
    """Put the data there in one step, durable; raise OSError. mode: else the old file's, or what a new one would get.

    A link stays a link. A device or pipe is written to and never replaced: whoever may write to /dev/null may not mean
    to take it away from all others.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        path.write_bytes(data)
        return
    target = path.resolve()
    mode = file_mode(target) if mode is None else mode
    number, beside = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    try:
        with open(number, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(number)
            os.fchmod(number, mode)
        os.replace(beside, target)
    finally:
        with suppress(FileNotFoundError):
            os.unlink(beside)
    sync_folder(target.parent)


def sync_folder(folder: Path) -> None:
    """Make durable which files are in the folder, and under which names; raise OSError."""
    number = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(number)
    finally:
        os.close(number)


def file_mode(target: Path) -> int:
    """The mode of the file that is there, or what a new one would get."""
    if target.exists():
        return target.stat().st_mode & 0o777
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
