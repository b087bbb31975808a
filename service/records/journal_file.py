"""The journal's file: opened, brought to this version, looked through, and written in durable steps.

WAL keeps readers out of the way; synchronous=FULL makes the last commit survive a power cut (NORMAL does not).
"""

from __future__ import annotations

import os
import secrets
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from service.records.journal_schema import SCHEMA_VERSION, TABLES, migration

LARGEST_OWNER = 0xFFFF
PAGE_CACHE_KIB = 512  # a job looks at the newest rows; the library's 2 MB fill over the first two thousand jobs
LARGEST_LOG_BYTES = 8_000_000  # of the write-ahead log, once it was taken over into the file


class JournalError(Exception):
    """The journal cannot be read or written; without it no trigger is taken."""


class JournalFull(JournalError):
    """The disk that holds the journal is full."""


class JournalDamaged(JournalError):
    """The file is there, may be read and written, and is no sound journal."""


def stamp(time: datetime) -> str:
    """As the journal writes times: they sort as text."""
    return time.astimezone(UTC).isoformat(timespec="milliseconds")


def readable_text(stored: bytes) -> str:
    """Text of the journal, also where its bytes were damaged: a job is more than its detail."""
    return stored.decode("utf-8", "replace")


class JournalFile:
    """One SQLite file. Its methods block for a commit (milliseconds) and may be called from any thread."""

    def __init__(self, path: Path, *, above: int, otherwise_from: int) -> None:
        """above, otherwise_from: for a new journal, the highest number that is known, or where to begin without one."""
        self.path = path
        self._lock = threading.Lock()
        if os.path.exists(path) and not os.path.isfile(path):  # opening a pipe would wait for ever
            raise JournalError(f"{path}: is no file, expected a journal or nothing. Name another journal.path.")
        with self._translated():
            path.parent.mkdir(parents=True, exist_ok=True)
            self.db = sqlite3.connect(path, check_same_thread=False, isolation_level=None)
        try:
            with self._translated():
                self._prepare(above, otherwise_from)
        except JournalError:
            self.db.close()
            raise

    def _prepare(self, above: int, otherwise_from: int) -> None:
        self.db.text_factory = readable_text
        version = self.db.execute("PRAGMA user_version").fetchone()[0]
        if version == 0:
            self._refuse_tables()
        self.db.execute("PRAGMA journal_mode = WAL")
        self.db.execute("PRAGMA synchronous = FULL")
        self.db.execute(f"PRAGMA journal_size_limit = {LARGEST_LOG_BYTES}")
        self.db.execute(f"PRAGMA cache_size = -{PAGE_CACHE_KIB}")
        if version == 0:
            self.db.executescript(
                f"BEGIN IMMEDIATE; {TABLES}"
                f" INSERT INTO meta VALUES ('owner', '{1 + secrets.randbelow(LARGEST_OWNER)}');"
                f" INSERT INTO meta VALUES ('above', '{above}'), ('otherwise_from', '{otherwise_from}');"
                f" PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;"
            )
        elif version != SCHEMA_VERSION:
            self._migrate(version)
        check = self.db.execute("PRAGMA quick_check(1)").fetchone()[0]
        if check != "ok":
            raise self.damaged(check)

    def _refuse_tables(self) -> None:
        """Raise where a file without a version has tables: it is another program's, or has lost its version."""
        tables = {str(row[0]) for row in self.db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if {"meta", "jobs"} <= tables:
            raise self.damaged("it has lost its version")
        if tables:
            names = ", ".join(sorted(tables)[:3])
            raise JournalError(
                f"{self.path}: a database of another program (tables {names}), expected a journal or nothing. "
                "Name another journal.path."
            )

    def damaged(self, seen: str) -> JournalDamaged:
        """The error that says what was seen."""
        return JournalDamaged(f"{self.path}: the journal is damaged ({seen}). Move it away and start again.")

    def _migrate(self, version: int) -> None:
        """All steps from an earlier version, or none of them."""
        script = migration(version)
        if script is None:
            raise JournalError(
                f"{self.path}: journal of schema version {version}, expected 1 to {SCHEMA_VERSION}. "
                "It was written by another version of combtrace: use that one, or name another journal.path."
            )
        try:
            self.db.executescript(f"BEGIN IMMEDIATE; {script} PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;")
        except sqlite3.Error:
            if self.db.in_transaction:
                self.db.execute("ROLLBACK")
            raise

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.OperationalError as error:
            if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL:
                raise JournalFull(
                    f"{self.path}: the disk is full. Free space; no trigger is taken until then."
                ) from error
            raise JournalError(f"{self.path}: cannot use the journal: {error}") from error
        except (sqlite3.Error, OSError) as error:
            code = getattr(error, "sqlite_errorcode", None)
            kind = JournalDamaged if code in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB) else JournalError
            raise kind(
                f"{self.path}: cannot use the journal: {error}. Check the path, or move the file away."
            ) from error

    @contextmanager
    def transaction(self) -> Iterator[sqlite3.Connection]:
        """One durable step: all of it is in the file when the block has ended, or none of it is."""
        with self._lock, self._translated():
            self.db.execute("BEGIN IMMEDIATE")
            try:
                yield self.db
                self.db.execute("COMMIT")
            except BaseException:
                if self.db.in_transaction:  # SQLite has ended it itself after some errors
                    self.db.execute("ROLLBACK")
                raise

    def refuse_writes(self) -> None:
        """From here on each write raises JournalError."""
        with self._lock:
            self.db.execute("PRAGMA query_only = ON")

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self.db.close()

    @contextmanager
    def reading(self) -> Iterator[sqlite3.Connection]:
        """One look into the file, between durable steps."""
        with self._lock, self._translated():
            yield self.db

    def keep(self, **numbers: int) -> None:
        """Numbers of `meta`, as they are from now on; within a transaction."""
        self.db.executemany("INSERT OR REPLACE INTO meta VALUES (?, ?)", [(key, str(n)) for key, n in numbers.items()])

    def number(self, key: str) -> int:
        """A number of `meta`, 0 where it is not there; within a transaction or the lock."""
        row = self.db.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
        return int(row[0]) if row else 0
