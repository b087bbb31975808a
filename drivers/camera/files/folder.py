"""Picture files in a folder: which there are, whether their writing has ended, and where they go afterwards."""

from __future__ import annotations

import os
import re
import shutil
import stat
from collections.abc import Callable, Iterable, Iterator
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
    """One content of one file: a file that is written anew under its old name is another one.

    size: -1 where the file is there and cannot be looked at; reading it tells why.
    """

    name: str
    modified_ns: int
    size: int

    @property
    def path(self) -> Path:
        """Where it is."""
        return Path(self.name)


def shown(path: str | Path) -> str:
    """The path as text that can be written anywhere: names from other systems may hold bytes that are no UTF-8."""
    return str(path).encode("utf-8", "backslashreplace").decode()


def natural_order(versions: Iterable[FileVersion]) -> list[FileVersion]:
    """The files of one folder as people sort them: frame2 before frame10, capitals beside small letters."""
    return sorted(versions, key=lambda version: _natural_key(version.name))


def _natural_key(name: str) -> tuple[list[tuple[int, str]], str]:
    parts = re.split(r"([0-9]+)", name.casefold())
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts], name


def is_video(path: Path) -> bool:
    """True for a file whose name says that it holds a video."""
    return path.suffix.lower() in VIDEOS


def list_versions(path: Path) -> list[FileVersion]:
    """The file itself, or the pictures and videos of the folder, in no order; raise OSError, ValueError."""
    if path.is_dir():
        return list(_entries(path))
    status = path.stat()
    return [FileVersion(str(path), status.st_mtime_ns, status.st_size)]


def _entries(folder: Path) -> Iterator[FileVersion]:
    """What counts as a picture. There may be tens of thousands, looked at many times a second while one is awaited."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(".") or not entry.name.lower().endswith(SUFFIXES):
                continue
            try:
                status = entry.stat()
            except FileNotFoundError:
                continue  # taken away since the folder was listed, or a link to nowhere
            except OSError:
                yield FileVersion(entry.path, 0, -1)  # one file's trouble must not hide all others
                continue
            if not stat.S_ISDIR(status.st_mode):
                yield FileVersion(entry.path, status.st_mtime_ns, status.st_size)


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
        if path.is_symlink():
            target.unlink()  # to another file system a link is made anew, which takes no name that is there
        shutil.move(path, target)
    except OSError:
        target.unlink(missing_ok=True)
        raise
    return target
