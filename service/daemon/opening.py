"""Locks and journal at the start, each taken as soon as its disk lets it be: one that refuses writes may recover."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable
from functools import partial
from pathlib import Path

from service.atomic_file import REFUSALS
from service.daemon.lock import Held, Lock, LockError, Locks, NameLock, journal_lock
from service.jobs.health import Fault
from service.reasons import Reason
from service.records.journal import Journal
from service.records.journal_file import JournalError
from service.records.journal_recovery import open_journal

PASSING = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)
IF_THE_DISK_IS = (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN)  # a mistaken path or owner gives these too


class DiskRefuses(Exception):
    """A disk takes no writes: read-only, full or failing. That may pass, where a wrong configuration does not."""

    def __init__(self, message: str, *, full: bool) -> None:
        super().__init__(message)
        self._full = full

    @property
    def fault(self) -> Fault:
        """What it means for the service."""
        return Fault(
            Reason.STORAGE_FULL if self._full else Reason.INTERNAL_ERROR,
            f"{str(self).rstrip('.')}. It is tried again by itself",
        )


class Opening:
    """Takes the locks in turn, then opens the journal; what it has it keeps from one attempt to the next."""

    def __init__(self, state_dir: Path, journal: Path, archive: Path, names: Callable[[], list[str]]) -> None:
        """names: of what else must be this service's alone on this machine."""
        self._state_lock = state_dir / "combtrace.lock"
        self._path = journal
        self._archive = archive
        self._locks = Locks()
        self._state: Lock | None = None
        self._journal: Journal | None = None
        self._ran_before = False
        self._names = names
        self._steps: list[Callable[[], Held]] = [self._lock_state, partial(journal_lock, journal), self._lock_names]

    def journal(self) -> Journal:
        """The journal, all locks held; raise DiskRefuses, which may pass, LockError and JournalError, which do not."""
        if self._journal is not None:
            return self._journal
        try:
            while self._steps:
                self._locks.add(self._steps[0]())
                self._steps.pop(0)
            self._journal = open_journal(self._path, self._archive, ran_before=self._ran_before)
        except (LockError, JournalError) as error:
            if _is_refusal(error, self._path):
                raise DiskRefuses(str(error), full=_is_full(self._path)) from error
            raise
        return self._journal

    def release(self) -> None:
        """Let all go. Where no journal was opened, nothing tells of this run: the next would take it for lost."""
        if self._journal is not None:
            self._journal.close()
        elif self._state is not None and not self._ran_before:
            self._state.leave_no_file()
        self._locks.release()

    def _lock_state(self) -> Held:
        self._ran_before = os.path.exists(self._state_lock)
        self._state = Lock(self._state_lock)
        return self._state

    def _lock_names(self) -> Held:
        held = Locks()
        try:
            for name in self._names():
                held.add(NameLock(name))
        except LockError:
            held.release()
            raise
        return held


def stand_in() -> Journal:
    """A journal without a job, in memory, which takes none either."""
    journal = Journal(Path(":memory:"))
    journal.refuse_writes()
    return journal


def _is_refusal(error: BaseException, path: Path) -> bool:
    """True where a disk refused; path: of the journal, for errors that do not say why."""
    cause = error.__cause__
    if isinstance(cause, sqlite3.Error):
        code = getattr(cause, "sqlite_errorcode", 0) & 0xFF  # the rest of it says more of the same
        refused = code in IF_THE_DISK_IS and (_is_full(path) or bool(_disk_of(path).f_flag & os.ST_RDONLY))
        return refused or code in PASSING
    return isinstance(cause, OSError) and cause.errno in REFUSALS


def _is_full(path: Path) -> bool:
    """True where the disk on which `path` is, or will be, has no room left for bytes or for files."""
    found = _disk_of(path)
    return not found.f_bavail or bool(found.f_files and not found.f_favail)


def _disk_of(path: Path) -> os.statvfs_result:
    while not path.exists() and path != path.parent:
        path = path.parent
    return os.statvfs(path)
