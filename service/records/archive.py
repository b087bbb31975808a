"""The archive: files of each job's evidence in a folder, bounded by bytes and by free space, oldest first.

A file is written under another name, made durable and renamed, the job's document last: without it, what lies there is
of a job whose writing was cut short, and is swept at the start. Of a job that has not ended there is a draft instead,
with the frame as plain bytes: they stay over a restart, until the job has ended. Names begin with the job's number, so
that numbers go on above them where the journal is lost (`service.records.journal_recovery`).
"""

from __future__ import annotations

import os
import re
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from service.reasons import Outcome

JOBS_A_FOLDER = 1000
DOCUMENT = re.compile(r"(\d{1,10})-(accepted|written|refused|failed)\.json")
DRAFT, PLAIN_FRAME = "draft.json", "frame.raw"
OURS = re.compile(r"\.?(\d{1,10})-[a-z]+\.(?:json|raw|png|jpg|dxf|svg|geojson|ngc)(?:\.new)?")
FOLDER = re.compile(r"\d{7}xxx")
TABLES = "tables"
BLOCK = 4096  # what a file takes of most disks is a multiple of it
TABLE_SLACK_S = 3600.0  # a table is noted as used some seconds before the document that names it is written
REFUSALS_SHARE = 0.5  # of max_bytes that jobs not accepted may keep from those that were
GOOD = (Outcome.ACCEPTED, Outcome.WRITTEN)


class ArchiveError(Exception):
    """Evidence cannot be written or read: where, and why."""


class ArchiveFull(ArchiveError):
    """Evidence does not fit within the bounds, though all older has been let go."""


@dataclass(frozen=True)
class ArchiveLimits:
    """Most bytes kept, and how many the disk keeps free whatever that costs; 0 bytes = nothing is kept."""

    max_bytes: int
    min_free_bytes: int = 0


class Archive:
    """The evidence in one folder, for one writer. `open` looks what is there; not for several threads at once."""

    def __init__(self, path: Path, limits: ArchiveLimits) -> None:
        self.path = path
        self.limits = limits
        self._good: OrderedDict[int, int] = OrderedDict()  # job: bytes, oldest first
        self._bad: OrderedDict[int, int] = OrderedDict()
        self._unended: dict[int, int] = {}  # never let go for room: they are few, and their time is near
        self._good_bytes = self._bad_bytes = self._table_bytes = 0
        self.swept = 0

    @property
    def kept_bytes(self) -> int:
        """Bytes kept, each file rounded up to whole blocks."""
        return self._good_bytes + self._bad_bytes + self._table_bytes + sum(self._unended.values())

    @property
    def jobs(self) -> int:
        """Ended jobs kept."""
        return len(self._good) + len(self._bad)

    @property
    def drafts(self) -> list[int]:
        """Jobs kept that have not ended, as far as the archive knows."""
        return sorted(self._unended)

    def open(self) -> None:
        """Make the folder, sweep what was cut short, and count what is there; raise ArchiveError."""
        try:
            self.path.mkdir(parents=True, exist_ok=True, mode=0o750)
            found = sorted(self._found())
            self._table_bytes = sum(_on_disk(entry.stat().st_size) for entry in self._tables())
            for job_id, good, size in found:
                self._count(job_id, good, size)
            self._make_room(0)
        except OSError as error:
            raise _cannot(self.path, error) from error

    def _found(self) -> Iterator[tuple[int, bool, int]]:
        """Ended jobs, whether accepted or written, bytes; drafts are counted, what has no document is deleted."""
        for folder in _folders(self.path):
            groups: dict[int, list[os.DirEntry[str]]] = {}
            with os.scandir(folder) as entries:
                for entry in entries:
                    name = OURS.fullmatch(entry.name)
                    if name is None or not entry.is_file(follow_symlinks=False):
                        continue  # not ours: it stays, and is not counted
                    if entry.name.startswith("."):
                        Path(entry.path).unlink()
                        self.swept += 1
                    else:
                        groups.setdefault(int(name[1]), []).append(entry)
            for job_id, files in groups.items():
                outcomes = [found[2] for file in files if (found := DOCUMENT.fullmatch(file.name))]
                unended = [file for file in files if file.name in (f"{job_id}-{DRAFT}", f"{job_id}-{PLAIN_FRAME}")]
                if outcomes:
                    size = sum(_size(file) for file in files if file not in unended)
                    yield job_id, outcomes[-1] in GOOD, size
                elif any(file.name == f"{job_id}-{DRAFT}" for file in unended):
                    self._unended[job_id] = sum(_size(file) for file in files)
                    continue
                for file in unended if outcomes else files:
                    Path(file.path).unlink()
                    self.swept += 1

    def _count(self, job_id: int, good: bool, size: int) -> None:
        if good:
            self._good[job_id] = size
            self._good_bytes += size
        else:
            self._bad[job_id] = size
            self._bad_bytes += size

    # --- writing ------------------------------------------------------------------------------------------------

    def has(self, job_id: int, suffix: str) -> bool:
        """True where DRAFT or PLAIN_FRAME of a job that has not ended is kept."""
        return job_id in self._unended and (self.folder_of(job_id) / f"{job_id}-{suffix}").is_file()

    def put(self, job_id: int, suffix: str, data: bytes) -> None:
        """Keep DRAFT or PLAIN_FRAME, durable, of a job that has not ended; raise as `store`, and leave nothing then."""
        if job_id in self._good or job_id in self._bad:
            return  # it came late
        self._write_all(job_id, {suffix: data})
        self._unended[job_id] = self._unended.get(job_id, 0) + _on_disk(len(data))

    def store(self, job_id: int, outcome: Outcome, files: Mapping[str, bytes], document: bytes) -> None:
        """Keep a job's files and, last, its document, in the place of its draft; raise ArchiveFull, ArchiveError, and
        leave nothing then.
        """
        written = {**files, f"{outcome}.json": document}
        size = sum(_on_disk(len(data)) for data in written.values())
        if job_id in self._unended and not self._has_room(size):
            self.forget(job_id)  # all of it is in memory still
        self._write_all(job_id, written)
        self._count(job_id, outcome in GOOD, size)
        if job_id not in self._unended:
            return
        try:
            for suffix in (DRAFT, PLAIN_FRAME):
                (self.folder_of(job_id) / f"{job_id}-{suffix}").unlink(missing_ok=True)
        except OSError as error:
            raise _cannot(self.folder_of(job_id), error) from error
        del self._unended[job_id]

    def _has_room(self, size: int) -> bool:
        try:
            self._make_room(size)
        except (ArchiveFull, OSError):
            return False
        return True

    def _write_all(self, job_id: int, files: Mapping[str, bytes]) -> None:
        folder = self.folder_of(job_id)
        try:
            self._drop(job_id)
            self._make_room(sum(_on_disk(len(data)) for data in files.values()))
            if not folder.exists():
                folder.mkdir(mode=0o750)
                _sync_folder(self.path)
            for suffix, data in files.items():
                _write(folder / f"{job_id}-{suffix}", data)
            _sync_folder(folder)
        except OSError as error:
            self.forget(job_id)
            raise _cannot(folder, error) from error
        except ArchiveFull:
            self.forget(job_id)
            raise

    def forget(self, job_id: int) -> None:
        """Delete what is kept of a job that has not ended; raise ArchiveError."""
        try:
            self._delete_files(job_id)
        except OSError as error:
            raise _cannot(self.folder_of(job_id), error) from error
        self._unended.pop(job_id, None)

    def store_table(self, digest: str, make: Callable[[], bytes]) -> str:
        """Keep a taught table once for all jobs that used it; its place in the archive. Raise ArchiveError."""
        path = self.path / TABLES / f"{digest}.npz"
        try:
            if path.exists():
                os.utime(path)  # used last now
            else:
                data = make()
                self._make_room(_on_disk(len(data)))
                path.parent.mkdir(exist_ok=True, mode=0o750)
                _write(path, data)
                self._table_bytes += _on_disk(len(data))
        except OSError as error:
            raise _cannot(path, error) from error
        return f"{TABLES}/{digest}.npz"

    def make_room(self) -> None:
        """Keep the bounds, whoever filled the disk; raise ArchiveError."""
        try:
            self._make_room(0)
        except OSError as error:
            raise _cannot(self.path, error) from error

    def _make_room(self, size: int) -> None:
        limit = self.limits.max_bytes
        if size > limit:
            raise ArchiveFull(f"{self.path}: {size} bytes, archive.max_bytes allows {limit}. Raise it")
        while self.kept_bytes + size > limit or self.free_bytes() < self.limits.min_free_bytes + size:
            if not self.jobs:
                if not size:
                    return
                raise ArchiveFull(
                    f"{self.path}: {self.free_bytes()} bytes of the disk are free and nothing older is left to delete; "
                    f"archive.min_free_bytes keeps {self.limits.min_free_bytes}. Free space, or lower it"
                )
            self._drop(self._next_to_go())

    def _next_to_go(self) -> int:
        """The oldest accepted or written one, while the others take no more than their share."""
        others = self._bad and (not self._good or self._bad_bytes > REFUSALS_SHARE * self.limits.max_bytes)
        return next(iter(self._bad if others else self._good))

    def _drop(self, job_id: int) -> None:
        if job_id in self._good:
            self._delete_files(job_id)
            self._good_bytes -= self._good.pop(job_id)
        elif job_id in self._bad:
            self._delete_files(job_id)
            self._bad_bytes -= self._bad.pop(job_id)
        if self._table_bytes and self.jobs:
            self._drop_tables()

    def _delete_files(self, job_id: int) -> None:
        """The document first: what is left when this is cut short is swept at the next start."""
        folder = self.folder_of(job_id)
        mine = _files_of(folder, job_id, also_unfinished=True)
        for path in sorted(mine, key=lambda path: path.suffix != ".json"):
            path.unlink(missing_ok=True)
        if not self._kept_in(folder):
            try:
                folder.rmdir()
            except OSError:
                return  # somebody keeps something of his own there

    def _kept_in(self, folder: Path) -> bool:
        try:
            with os.scandir(folder) as entries:
                return next(entries, None) is not None
        except FileNotFoundError:
            return True

    def _drop_tables(self) -> None:
        """Tables that were last used before the oldest job that is kept, whose document came after its table."""
        oldest = min(next(iter(kept)) for kept in (self._good, self._bad) if kept)
        document = self.document_of(oldest)
        if document is None:
            return
        since = document.stat().st_mtime
        for entry in self._tables():
            found = entry.stat()
            if found.st_mtime < since - TABLE_SLACK_S:
                entry.unlink()
                self._table_bytes -= _on_disk(found.st_size)

    def _tables(self) -> list[Path]:
        return [path for path in (self.path / TABLES).glob("*.npz") if path.is_file() and not path.is_symlink()]

    # --- reading ------------------------------------------------------------------------------------------------

    def free_bytes(self) -> int:
        """Bytes of the archive's disk that this process may still use."""
        return free_bytes(self.path)

    def folder_of(self, job_id: int) -> Path:
        """Where a job's files are."""
        return folder_of(self.path, job_id)

    def document_of(self, job_id: int) -> Path | None:
        """A job's document, None where there is none."""
        return document_of(self.path, job_id)


def folder_of(archive: Path, job_id: int) -> Path:
    """Where in an archive a job's files are: `0000012xxx` holds jobs 12000 to 12999."""
    return archive / f"{job_id // JOBS_A_FOLDER:07d}xxx"


def document_of(archive: Path, job_id: int) -> Path | None:
    """A job's document, None where there is none."""
    found = [path for path in _files_of(folder_of(archive, job_id), job_id) if DOCUMENT.fullmatch(path.name)]
    return found[0] if found else None


def files_of(archive: Path, job_id: int) -> list[Path]:
    """All files of a job in an archive, by name."""
    return sorted(_files_of(folder_of(archive, job_id), job_id))


def free_bytes(path: Path) -> int:
    """Bytes that this process may still use of the disk on which `path` is, or will be; raise OSError."""
    while not path.exists() and path != path.parent:
        path = path.parent
    found = os.statvfs(path)
    return found.f_bavail * found.f_frsize


def _folders(archive: Path) -> Iterator[Path]:
    with os.scandir(archive) as entries:
        found = [Path(entry.path) for entry in entries if entry.is_dir(follow_symlinks=False)]
    yield from (folder for folder in found if FOLDER.fullmatch(folder.name))


def _files_of(folder: Path, job_id: int, *, also_unfinished: bool = False) -> list[Path]:
    patterns = [f"{job_id}-*", *([f".{job_id}-*"] if also_unfinished else [])]
    return [path for pattern in patterns for path in folder.glob(pattern) if OURS.fullmatch(path.name)]


def _size(file: os.DirEntry[str]) -> int:
    return _on_disk(file.stat(follow_symlinks=False).st_size)


def _on_disk(size: int) -> int:
    return -(-size // BLOCK) * BLOCK


def _write(path: Path, data: bytes) -> None:
    """Put the data there in one step, durable."""
    beside = path.with_name(f".{path.name}.new")
    handle = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW | os.O_CLOEXEC, 0o640)
    with os.fdopen(handle, "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _cannot(path: Path, error: OSError) -> ArchiveError:
    where = error.filename or path
    return ArchiveError(f"{where}: cannot keep evidence: {error.strerror}. Check archive.path and its disk")
