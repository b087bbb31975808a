"""Picture files in a folder: which there are, whether their writing has ended, and where they go afterwards."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

# What counts as a picture in a folder, which may hold notes and calibrations beside them. A single file may be called
# anything: its content decides.
PICTURES = (
    *(".png", ".jpg", ".jpeg", ".jpe", ".bmp", ".dib", ".tif", ".tiff", ".webp", ".gif", ".jp2", ".avif"),
    *(".pbm", ".pgm", ".ppm", ".pnm", ".pam"),
)
VIDEOS = (".mp4", ".m4v", ".avi", ".mkv", ".mov", ".webm", ".mpg", ".mpeg", ".wmv")
SUFFIXES = PICTURES + VIDEOS

# A program that writes a picture in pieces pauses between them for less than that on any disk or share seen in use.
SETTLED_S = 0.3


class FileVersion(NamedTuple):
    """One content of one file: a file that is written anew under its old name is another one."""

    path: Path
    modified_ns: int
    size: int


def natural_key(path: Path) -> tuple[list[tuple[int, str]], str]:
    """A key that sorts names as people do: frame2 before frame10, capitals beside small letters."""
    parts = re.split(r"([0-9]+)", path.name.casefold())
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts], path.name


def is_video(path: Path) -> bool:
    """True for a file whose name says that it holds a video."""
    return path.suffix.lower() in VIDEOS


def list_versions(path: Path) -> list[FileVersion]:
    """The file itself, or the pictures and videos of the folder, by name; raise OSError, ValueError."""
    if not path.is_dir():
        return [_version(path)]
    found = []
    for entry in sorted(path.iterdir(), key=natural_key):
        if entry.name.startswith(".") or entry.suffix.lower() not in SUFFIXES or entry.is_dir():
            continue
        try:
            found.append(_version(entry))
        except FileNotFoundError:
            continue  # taken away since the folder was listed
    return found


def _version(path: Path) -> FileVersion:
    status = path.stat()
    return FileVersion(path, status.st_mtime_ns, status.st_size)


class Settling:
    """Tells files whose writing has ended: those that have not changed for SETTLED_S on our own clock."""

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._since: dict[FileVersion, float] = {}

    def settled(self, versions: list[FileVersion]) -> list[FileVersion]:
        """Those of the present versions that were the same SETTLED_S ago; empty files are never done."""
        now = self._now()
        self._since = {version: self._since.get(version, now) for version in versions}
        return [version for version in versions if version.size and now - self._since[version] >= SETTLED_S]


def move_aside(path: Path, folder: Path) -> Path:
    """The new path of the file, moved into `folder` under a name that is free there; raise OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    target, count = folder / path.name, 1
    while True:
        try:
            # Taking the name first keeps an older picture of that name, also against another program.
            os.close(os.open(target, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o644))
            break
        except FileExistsError:
            target, count = folder / f"{path.stem}-{count}{path.suffix}", count + 1
    try:
        shutil.move(path, target)
    except OSError:
        target.unlink(missing_ok=True)
        raise
    return target
