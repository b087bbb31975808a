"""The journal read while the daemon writes it, or after it: nothing is written, nothing waits."""

from __future__ import annotations

import sqlite3
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from itertools import chain
from pathlib import Path
from typing import Any

from service.reasons import Outcome, Reason
from service.records.job import Job
from service.records.journal import job_of
from service.records.journal_file import JournalDamaged, readable_text, stamp
from service.records.journal_schema import SCHEMA_VERSION, columns

BUSY_S = 5.0
NOTES_SINCE = 3  # version of the journal


class JournalUnreadable(Exception):
    """A journal cannot be read: the file, what was seen, what to do."""


@dataclass(frozen=True)
class Note:
    """Who asked for what, when and from where. who None = nobody proved to be anybody; result None = cut short."""

    at: str
    who: str | None
    address: str
    action: str
    detail: str | None
    result: str | None


@dataclass(frozen=True)
class JobFilter:
    """Which jobs: taken at `since` or later, ended so, for this reason, numbered below; None = whatever it is.

    faulty: only those that were refused or have failed.
    """

    since: datetime | None = None
    outcome: Outcome | None = None
    reason: Reason | None = None
    below: int | None = None
    faulty: bool = False

    def condition(self) -> tuple[str, tuple[Any, ...]]:
        """As SQL, with its values."""
        wanted: list[tuple[str, tuple[Any, ...]]] = []
        if self.since is not None:  # the journal's times are UTC in one form, so they sort as text
            wanted.append(("taken_at >= ?", (stamp(self.since),)))
        if self.outcome is not None:
            wanted.append(("outcome = ?", (str(self.outcome),)))
        if self.reason is not None:
            wanted.append(("reason = ?", (int(self.reason),)))
        if self.below is not None:
            wanted.append(("job_id < ?", (self.below,)))
        if self.faulty:
            wanted.append(("outcome IN (?, ?)", (str(Outcome.REFUSED), str(Outcome.FAILED))))
        return " AND ".join(text for text, _ in wanted) or "1", tuple(chain.from_iterable(one for _, one in wanted))


class JournalReader:
    """Jobs of one journal; close it soon, for the write-ahead log grows while a reader is there."""

    def __init__(self, database: sqlite3.Connection, path: Path) -> None:
        self._database = database
        self._path = path
        self.damaged: list[str] = []  # what is wrong with rows that were left out
        version = self._read("PRAGMA user_version")[0][0]
        if not 1 <= version <= SCHEMA_VERSION:
            raise JournalUnreadable(
                f"{path}: journal of schema version {version}, this combtrace reads 1 to {SCHEMA_VERSION}. "
                "Use the version that wrote it, or name another journal.path"
            )
        self._version = version
        self._columns = columns(version)

    def jobs(self, wanted: JobFilter, limit: int | None = None) -> list[Job]:
        """The newest `limit` jobs of these, oldest first."""
        condition, values = wanted.condition()
        query = f"SELECT {self._columns} FROM jobs WHERE {condition} ORDER BY job_id DESC LIMIT ?"
        found = []
        for row in reversed(self._read(query, (*values, -1 if limit is None else limit))):
            try:
                found.append(job_of(row))
            except JournalDamaged as error:
                self.damaged.append(str(error))
        return found

    def find(self, job_id: int) -> Job | None:
        """The job, or None."""
        rows = self._read(f"SELECT {self._columns} FROM jobs WHERE job_id = ?", (job_id,))
        try:
            return job_of(rows[0]) if rows else None
        except JournalDamaged as error:
            raise JournalUnreadable(f"{self._path}: {error}") from error

    def notes(self, limit: int) -> list[Note]:
        """The newest `limit` notes of who asked for what, newest first; none in journals of before version 3."""
        if self._version < NOTES_SINCE:
            return []
        query = "SELECT at, who, address, action, detail, result FROM audit ORDER BY id DESC LIMIT ?"
        return [Note(*row) for row in self._read(query, (limit,))]

    def rows(self, query: str, values: tuple[Any, ...] = (), since: int = 1) -> list[Any]:
        """What a query of another room finds; nothing in a journal of before version `since`."""
        return [] if self._version < since else self._read(query, values)

    def _read(self, query: str, values: tuple[Any, ...] = ()) -> list[Any]:
        try:
            return self._database.execute(query, values).fetchall()
        except sqlite3.Error as error:
            raise JournalUnreadable(f"{self._path}: cannot be read: {error}. Check journal.path") from error


@contextmanager
def reading(path: Path) -> Iterator[JournalReader]:
    """The journal, open for reading; raise JournalUnreadable."""
    try:
        found = path.stat()
    except FileNotFoundError:
        found = None
    except OSError as error:
        next_step = "Run it as the service's user or a member of its group, or check journal.path"
        raise JournalUnreadable(f"{path}: cannot be looked at: {error.strerror}. {next_step}") from error
    if found is not None and not stat.S_ISREG(found.st_mode):
        raise JournalUnreadable(f"{path}: is no file. Check journal.path")
    if found is None or not found.st_size:
        raise JournalUnreadable(f"{path}: there is no journal yet. Check journal.path, or run the daemon first")
    database = _connected(path)
    try:
        yield JournalReader(database, path)
    finally:
        database.close()


def _connected(path: Path) -> sqlite3.Connection:
    """Without a daemon and without the right to write beside it, the file is whole and may be read as it is."""
    name = path.absolute().as_uri()
    try:
        database = sqlite3.connect(f"{name}?mode=ro", uri=True, timeout=BUSY_S)
        try:
            database.execute("PRAGMA schema_version").fetchone()
        except sqlite3.OperationalError:
            database.close()
            if path.with_name(path.name + "-wal").exists():
                raise
            database = sqlite3.connect(f"{name}?mode=ro&immutable=1", uri=True)
    except sqlite3.Error as error:
        raise JournalUnreadable(f"{path}: cannot be opened: {error}. Check its permissions") from error
    database.text_factory = readable_text
    return database
