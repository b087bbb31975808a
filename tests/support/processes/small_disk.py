"""A small file system of its own, which goes with the test also where that is killed."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


class CannotMount(Exception):
    """Why not."""


@contextmanager
def mounted(disk: Path, megabytes: int) -> Iterator[Path]:
    """The folder `disk`, made a file system of that size; raise CannotMount, where root's rights or mount are."""
    if shutil.which("mount") is None:
        raise CannotMount("mount is not here. Install it: apt-get install mount")
    disk.mkdir()
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "combtrace-test", disk],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        raise CannotMount(f"a small disk cannot be mounted here, which needs root: {done.stderr.strip()}")
    # Who unmounts waits for the end of its input, which comes with the end of this process, however it ends.
    unmounts = subprocess.Popen(
        ["sh", "-c", 'cat >/dev/null; exec umount --lazy "$1"', "sh", disk], stdin=subprocess.PIPE, process_group=0
    )
    try:
        yield disk
    finally:
        unmounts.communicate()


def fill(disk: Path, leave: int) -> Path:
    """Somebody else's file, which leaves so many bytes free."""
    file = disk / "somebody-else"
    with suppress(OSError), file.open("wb") as stream:  # the daemon may have taken some meanwhile
        while (room := free(disk) - leave) > 0:
            stream.write(bytes(min(room, 64 * 1024)))
            stream.flush()
    return file


def free(disk: Path) -> int:
    """Bytes that are free."""
    room = os.statvfs(disk)
    return room.f_bavail * room.f_frsize


def remount(disk: Path, how: str) -> None:
    """`ro` or `rw`: read-only, as a file system that has found a fault, or writable again."""
    subprocess.run(["mount", "-o", f"remount,{how}", disk], check=True, capture_output=True)
