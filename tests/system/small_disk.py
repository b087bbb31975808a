"""A small file system of its own, which goes with the test also where that is killed."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class CannotMount(Exception):
    """Why not."""


@contextmanager
def mounted(disk: Path, megabytes: int) -> Iterator[Path]:
    """The folder `disk`, made a file system of that size; raise CannotMount, where root's rights are missing."""
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


def remount(disk: Path, how: str) -> None:
    """Mount it anew, `ro` or `rw`."""
    subprocess.run(["mount", "-o", f"remount,{how}", disk], check=True)
