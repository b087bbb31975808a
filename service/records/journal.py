"""The journal: every job, durable before its trigger is acknowledged, and how it ended. SQLite.

WAL keeps readers out of the way; synchronous=FULL makes the last commit survive a power cut (NORMAL does not).
"""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import sqlite3
import sys
import threading
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path
from typing import Any

from drivers.controller.mailbox.mailbox import Page, ServiceBlock
from service.reasons import Outcome, Reason
from service.records.job import Job, Progress, Terms, TriggerStamp
from service.records.journal_schema import COLUMNS, SCHEMA_VERSION, TABLES, migration

HEADER_REGISTERS = 31
PAYLOAD_LENGTH = 6  # where a header, which begins with offset 1, says how many registers of payload follow
LARGEST_JOB = 0xFFFFFFFF  # job_id is a u32
LARGEST_OWNER = 0xFFFF
LATER = 32768  # a trigger counter that is less ahead than this is later, one that is more is earlier
RESTORED = (
    "job_id, taken_at, trigger_kind, line, trigger_session, trigger_counter, recipe, thickness_um, session, pages,"
    " target, withdraw_reason"
)
UNSETTLED = "outcome IS NULL"
PRUNED_AT_ONCE = 500  # rows: some milliseconds, for a job may wait behind it
MOST_NOTES = 10_000  # of the audit: who asked for what
PAGE_CACHE_KIB = 512  # a job looks at the newest rows; the library's 2 MB fill over the first two thousand jobs
LARGEST_LOG_BYTES = 8_000_000  # of the write-ahead log, once it was taken over into the file


class JournalError(Exception):
    """The journal cannot be read or written; without it no trigger is taken."""


class JournalFull(JournalError):
    """The disk that holds the journal is full."""


class JournalDamaged(JournalError):
    """The file is there, may be read and written, and is no sound journal."""


class JournalConflict(Exception):
    """A job is not there, or has ended already: a defect of the caller, which trying again does not mend."""


@dataclass(frozen=True)
class GoneOn:
    """What was learnt from the service block at the controller: a trigger that counts as taken, a job to take back."""

    pair: tuple[int, int] | None = None
    in_flight: int | None = None


class Journal:
    """Jobs in one SQLite file. Methods block for a commit (milliseconds) and may be called from any thread."""

    def __init__(
        self,
        path: Path,
        *,
        above: int = 0,
        otherwise_from: int = 1,
        now: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        """above, otherwise_from: for a new journal, the highest number that is known, or where to begin without one."""
        self._path = path
        self._begin = (above, otherwise_from)
        self._now = now
        self._lock = threading.Lock()
        if os.path.exists(path) and not os.path.isfile(path):  # opening a pipe would wait for ever
            raise JournalError(f"{path}: is no file, expected a journal or nothing. Name another journal.path.")
        with self._translated():
            path.parent.mkdir(parents=True, exist_ok=True)
            self._db = sqlite3.connect(path, check_same_thread=False, isolation_level=None)
        try:
            with self._translated():
                self._prepare()
        except JournalError:
            self._db.close()
            raise

    def _prepare(self) -> None:
        self._db.text_factory = readable_text
        version = self._db.execute("PRAGMA user_version").fetchone()[0]
        if version == 0:
            self._refuse_tables()
        self._db.execute("PRAGMA journal_mode = WAL")
        self._db.execute("PRAGMA synchronous = FULL")
        self._db.execute(f"PRAGMA journal_size_limit = {LARGEST_LOG_BYTES}")
        self._db.execute(f"PRAGMA cache_size = -{PAGE_CACHE_KIB}")
        if version == 0:
            self._db.executescript(
                f"BEGIN IMMEDIATE; {TABLES}"
                f" INSERT INTO meta VALUES ('owner', '{1 + secrets.randbelow(LARGEST_OWNER)}');"
                f" INSERT INTO meta VALUES ('above', '{self._begin[0]}'), ('otherwise_from', '{self._begin[1]}');"
                f" PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;"
            )
        elif version != SCHEMA_VERSION:
            self._migrate(version)
        check = self._db.execute("PRAGMA quick_check(1)").fetchone()[0]
        if check != "ok":
            raise self._damaged(check)
        self._look_through()

    def _refuse_tables(self) -> None:
        """Raise where a file without a version has tables: it is another program's, or has lost its version."""
        tables = {str(row[0]) for row in self._db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if {"meta", "jobs"} <= tables:
            raise self._damaged("it has lost its version")
        if tables:
            names = ", ".join(sorted(tables)[:3])
            raise JournalError(
                f"{self._path}: a database of another program (tables {names}), expected a journal or nothing. "
                "Name another journal.path."
            )

    def _look_through(self) -> None:
        """Raise JournalDamaged where what the service goes on from cannot be read: SQLite looks at no content."""
        try:
            owner = self.owner
            self.last_controller_trigger(), self.last_settled(), self.last_taken(), self.unsettled()
        except (ValueError, TypeError) as error:
            raise self._damaged("its notes of itself") from error
        except JournalDamaged as error:
            raise self._damaged(str(error)) from error
        except JournalError as error:
            cause = error.__cause__
            if getattr(cause, "sqlite_errorcode", None) == sqlite3.SQLITE_ERROR:  # a table or column is missing
                raise self._damaged(str(cause)) from cause
            raise
        if not 1 <= owner <= LARGEST_OWNER:
            raise self._damaged(f"owner {owner}")

    def _damaged(self, seen: str) -> JournalDamaged:
        return JournalDamaged(f"{self._path}: the journal is damaged ({seen}). Move it away and start again.")

    def _migrate(self, version: int) -> None:
        """All steps from an earlier version, or none of them."""
        script = migration(version)
        if script is None:
            raise JournalError(
                f"{self._path}: journal of schema version {version}, expected 1 to {SCHEMA_VERSION}. "
                "It was written by another version of combtrace: use that one, or name another journal.path."
            )
        try:
            self._db.executescript(f"BEGIN IMMEDIATE; {script} PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;")
        except sqlite3.Error:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.OperationalError as error:
            if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL:
                raise JournalFull(
                    f"{self._path}: the disk is full. Free space; no trigger is taken until then."
                ) from error
            raise JournalError(f"{self._path}: cannot use the journal: {error}") from error
        except (sqlite3.Error, OSError) as error:
            code = getattr(error, "sqlite_errorcode", None)
            kind = JournalDamaged if code in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB) else JournalError
            raise kind(
                f"{self._path}: cannot use the journal: {error}. Check the path, or move the file away."
            ) from error

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        """One durable step: all of it is in the file when the block has ended, or none of it is."""
        with self._lock, self._translated():
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield self._db
                self._db.execute("COMMIT")
            except BaseException:
                if self._db.in_transaction:  # SQLite has ended it itself after some errors
                    self._db.execute("ROLLBACK")
                raise

    def refuse_writes(self) -> None:
        """From here on each write raises JournalError."""
        with self._lock:
            self._db.execute("PRAGMA query_only = ON")

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            self._db.close()

    @property
    def owner(self) -> int:
        """The number drawn once for this journal, 1…65535: the protocol's `owner`."""
        return int(self._one("SELECT value FROM meta WHERE key = 'owner'")[0])

    def probe(self) -> None:
        """Write and commit something that changes nothing; raise JournalError where that does not work."""
        with self._transaction() as db:
            db.execute("UPDATE meta SET value = value WHERE key = 'owner'")

    def take(self, trigger: TriggerStamp, *, above: int = 0) -> Job:
        """A new job, durable on return; its id is above all in the journal and above `above`."""
        taken_at = self._stamp()
        with self._transaction() as db:
            highest = db.execute("SELECT COALESCE(MAX(job_id), 0) FROM jobs").fetchone()[0]
            found = max(self._number(key) for key in ("above", "adopted_job", "begin_above"))
            job_id = max(highest, above, found) + 1
            if job_id == 1:  # nothing is known of any job of before
                job_id = self._number("otherwise_from") or 1
            if job_id > LARGEST_JOB:
                raise JournalError(
                    f"{self._path}: {job_id - 1} was the last number that a register can hold. Move it away"
                )
            db.execute(
                "INSERT INTO jobs (job_id, taken_at, trigger_kind, trigger_session, trigger_counter, recipe,"
                " thickness_um, line, owed) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    job_id,
                    taken_at,
                    trigger.kind,
                    trigger.session,
                    trigger.counter,
                    trigger.recipe,
                    trigger.thickness_um,
                    trigger.line,
                    int(trigger.line is not None),
                ),
            )
        return Job(job_id, taken_at, trigger)

    def go_on_above(self, found: ServiceBlock, session: int, room: int, running: int = 0) -> GoneOn:
        """Begin at a controller whose service block shows `found` in its session `session`; durable on return.

        New jobs are numbered from more than `room` above all that is known. The block's trigger counts as taken where
        it is later than ours, and its job, where it had not ended there and is not in the journal, becomes one of ours
        that is to be taken back: the block may be another service's, and the journal may be an old one. `running` is a
        job of this life, which knows itself what was sent of it.
        """
        with self._transaction() as db:
            highest = db.execute("SELECT COALESCE(MAX(job_id), 0) FROM jobs").fetchone()[0]
            adopted = max(found.job_id, found.settled_job, self._number("adopted_job"))
            known = max(highest, adopted, self._number("above")) or self._number("otherwise_from") - 1
            self._keep(adopted_job=adopted, begin_above=min(known + room, LARGEST_JOB - 1))
            pair = (found.session_ack, found.trigger_ack)
            later = _is_later(pair, self._last_pair(), session)
            if later:
                self._keep(adopted_above=highest, adopted_session=pair[0], adopted_counter=pair[1])
            if session:  # one that this journal calls unsent may have been sent in a life that it does not know
                db.execute(
                    "UPDATE jobs SET session = ?, withdraw_reason = ?"
                    f" WHERE {UNSETTLED} AND session IS NULL AND job_id <= ? AND job_id != ?",
                    (session, int(Reason.SERVICE_RESTARTED), found.job_id, running),
                )
            unknown = (
                found.job_id > found.settled_job
                and session
                and not db.execute("SELECT 1 FROM jobs WHERE job_id = ?", (found.job_id,)).fetchone()
            )
            if unknown:
                db.execute(
                    "INSERT INTO jobs (job_id, taken_at, trigger_kind, recipe, thickness_um, session, withdraw_reason)"
                    " VALUES (?, ?, 'found', 0, 0, ?, ?)",
                    (found.job_id, self._stamp(), session, int(Reason.SERVICE_RESTARTED)),
                )
        return GoneOn(pair if later else None, found.job_id if unknown else None)

    def restore(self, rows: list[tuple[Any, ...]], pair: tuple[int, int]) -> None:
        """Take over from a damaged journal: jobs that had not ended (columns as in RESTORED), and the last trigger."""
        marks = ", ".join("?" * len(RESTORED.split(",")))
        with self._transaction() as db:
            db.executemany(f"INSERT INTO jobs ({RESTORED}) VALUES ({marks})", rows)
            db.execute(f"UPDATE jobs SET owed = 1 WHERE line IS NOT NULL AND {UNSETTLED}")
            if pair[1]:
                highest = max((row[0] for row in rows), default=0)
                self._keep(adopted_above=highest, adopted_session=pair[0], adopted_counter=pair[1])

    def _keep(self, **numbers: int) -> None:
        """Numbers of `meta`, as they are from now on; within a transaction."""
        self._db.executemany("INSERT OR REPLACE INTO meta VALUES (?, ?)", [(key, str(n)) for key, n in numbers.items()])

    def _number(self, key: str) -> int:
        """A number of `meta`, 0 where it is not there; within a transaction or the lock."""
        row = self._db.execute("SELECT value FROM meta WHERE key = ?", (key,)).fetchone()
        return int(row[0]) if row else 0

    def store_pages(
        self,
        job_id: int,
        session: int,
        pages: tuple[Page, ...],
        progress: Progress | None = None,
        *,
        target: Mapping[str, Any] | None = None,
    ) -> None:
        """Make the pages durable, before the first request of theirs is sent, and all that is known of the job.

        target: at which controller they are to be sent and how laid out there, by configuration key.
        """
        known = progress or Progress()
        values = session, pages_to_text(pages), *_texts(known), json.dumps(dict(target or {}))
        self._update(job_id, "session = ?, pages = ?, report = ?, transfer = ?, target = ?", values, known.terms)

    def store_withdrawal(self, job_id: int, reason: Reason) -> None:
        """Make durable that the job is being withdrawn, and why; the first reason stands."""
        self._update(job_id, "withdraw_reason = COALESCE(withdraw_reason, ?)", (int(reason),))

    def settle(
        self, job_id: int, outcome: Outcome, reason: Reason | None, detail: str | None, progress: Progress | None = None
    ) -> Job:
        """The job with its final state, durable; its pages are dropped. A job settles once: raise JournalConflict."""
        known = progress or Progress()
        return self._update(
            job_id,
            "outcome = ?, reason = ?, detail = ?, settled_at = ?, report = ?, transfer = ?, pages = NULL",
            (
                str(outcome),
                None if reason is None else int(reason),
                # Whatever a text holds, a job that was taken ends.
                None if detail is None else detail.encode("utf-8", "backslashreplace").decode(),
                self._stamp(),
                *_texts(known),
            ),
            known.terms,
        )

    def note(self, who: str | None, address: str, action: str, detail: str | None = None) -> int:
        """Make durable that somebody asks for `action`, before it is done; the number of the note.

        who: None where nobody proved to be anybody. Of more than MOST_NOTES the oldest are let go.
        """
        with self._transaction() as db:
            values = self._stamp(), who, address, action, detail
            query = "INSERT INTO audit (at, who, address, action, detail) VALUES (?, ?, ?, ?, ?)"
            number = int(db.execute(query, values).lastrowid or 0)
            db.execute("DELETE FROM audit WHERE id <= ?", (number - MOST_NOTES,))
        return number

    def note_result(self, number: int, result: str) -> None:
        """Make durable what became of it."""
        with self._transaction() as db:
            db.execute("UPDATE audit SET result = ? WHERE id = ?", (result, number))

    def prune(self, keep: int) -> int:
        """Delete the oldest of more than `keep` jobs, some at a time; how many that were.

        What numbers and triggers go on from stays: the newest jobs, the controller's last, those that have not ended.
        """
        with self._transaction() as db:
            bound = db.execute("SELECT job_id FROM jobs ORDER BY job_id DESC LIMIT 1 OFFSET ?", (keep,)).fetchone()
            if bound is None:
                return 0
            cursor = db.execute(
                "DELETE FROM jobs WHERE job_id IN (SELECT job_id FROM jobs WHERE job_id <= ? AND outcome IS NOT NULL"
                " AND job_id IS NOT (SELECT MAX(job_id) FROM jobs WHERE trigger_counter IS NOT NULL)"
                " ORDER BY job_id LIMIT ?)",
                (bound[0], PRUNED_AT_ONCE),
            )
            return cursor.rowcount

    def _update(self, job_id: int, assignments: str, values: tuple[Any, ...], terms: Terms | None = None) -> Job:
        """The job as it is then; read in the same step: a failure after the commit would say that nothing was done."""
        with self._transaction() as db:
            if terms is not None:
                settings = json.dumps(terms.recipe, sort_keys=True)
                digest = hashlib.sha256(settings.encode()).hexdigest()
                db.execute("INSERT OR IGNORE INTO recipe_settings VALUES (?, ?)", (digest, settings))
                assignments += ", recipe_digest = ?, calibration = ?"
                values = (*values, digest, terms.calibration)
            cursor = db.execute(f"UPDATE jobs SET {assignments} WHERE job_id = ? AND {UNSETTLED}", (*values, job_id))
            if cursor.rowcount != 1:
                raise JournalConflict(f"{self._path}: job {job_id} is not there, or has ended already")
            return job_of(db.execute(f"SELECT {COLUMNS} FROM jobs WHERE job_id = ?", (job_id,)).fetchone())

    def find(self, job_id: int) -> Job | None:
        """The job, or None."""
        return next(iter(self._jobs("WHERE job_id = ?", (job_id,))), None)

    def unsettled(self) -> tuple[Job, ...]:
        """Jobs without a final state, oldest first: after a crash at most the one in flight."""
        return self._jobs(f"WHERE {UNSETTLED} ORDER BY job_id")

    def owed(self, line: str) -> tuple[Job, ...]:
        """Jobs that have ended, and whose end this line has not been told, oldest first."""
        return self._jobs("WHERE owed = 1 AND line = ? AND outcome IS NOT NULL ORDER BY job_id", (line,))

    def told(self, job_ids: Iterable[int]) -> None:
        """Make durable that the ends of these jobs are owed to their line no more."""
        with self._transaction() as db:
            db.executemany("UPDATE jobs SET owed = 0 WHERE job_id = ?", [(job_id,) for job_id in job_ids])

    def last_settled(self) -> Job | None:
        """The settled job with the highest id."""
        return next(iter(self._jobs("WHERE outcome IS NOT NULL ORDER BY job_id DESC LIMIT 1")), None)

    def last_taken(self) -> Job | None:
        """The job with the highest id."""
        return next(iter(self._jobs("ORDER BY job_id DESC LIMIT 1")), None)

    def last_controller_trigger(self) -> tuple[int, int]:
        """(session, trigger_counter) last taken from the controller; (0, 0) where there was none."""
        with self._lock, self._translated():
            return self._last_pair()

    def _last_pair(self) -> tuple[int, int]:
        row = self._db.execute(
            "SELECT trigger_session, trigger_counter FROM jobs WHERE trigger_counter IS NOT NULL AND job_id > ?"
            " ORDER BY job_id DESC LIMIT 1",
            (self._number("adopted_above"),),
        ).fetchone()
        row = row or (self._number("adopted_session"), self._number("adopted_counter"))
        return int(row[0]), int(row[1])

    def _one(self, query: str) -> Any:
        with self._lock, self._translated():
            return self._db.execute(query).fetchone()

    def _jobs(self, where: str, values: tuple[Any, ...] = ()) -> tuple[Job, ...]:
        with self._lock, self._translated():
            rows = self._db.execute(f"SELECT {COLUMNS} FROM jobs {where}", values).fetchall()
        return tuple(job_of(row) for row in rows)

    def _stamp(self) -> str:
        return self._now().isoformat(timespec="milliseconds")


def _is_later(pair: tuple[int, int], than: tuple[int, int], session: int) -> bool:
    """True where `pair`, as (session, trigger_counter), was taken in this session after `than` was."""
    if pair[0] != session or 0 in pair:
        return False
    return than[0] != session or 0 < (pair[1] - than[1]) % 65536 < LATER


def _texts(known: Progress) -> tuple[str, str | None]:
    """Report and transfer as they stand in their columns."""
    return json.dumps(known.report), json.dumps(known.transfer) if known.transfer else None


def readable_text(stored: bytes) -> str:
    """Text of the journal, also where its bytes were damaged: a job is more than its detail."""
    return stored.decode("utf-8", "replace")


def job_of(row: tuple[Any, ...]) -> Job:
    """The job of a row that holds `COLUMNS`; raise JournalDamaged where it cannot be one."""
    try:
        return _job_of(row)
    except (ValueError, TypeError) as error:
        raise JournalDamaged(f"job {row[0]} in it cannot be read: {error}") from error


def _job_of(row: tuple[Any, ...]) -> Job:
    job_id, taken_at, kind, recipe, thickness_um, trigger_session, counter, session, pages = row[:9]
    withdraw_reason, outcome, reason, detail, settled_at, report, settings, calibration, transfer = row[9:18]
    line, target = row[18:]
    for moment in (taken_at, settled_at or taken_at):
        datetime.fromisoformat(moment)
    return Job(
        job_id=job_id,
        taken_at=taken_at,
        trigger=TriggerStamp(kind, recipe, thickness_um, trigger_session, counter, line),
        session=session,
        pages=pages_from_text(pages or ""),
        withdraw_reason=None if withdraw_reason is None else Reason(withdraw_reason),
        outcome=None if outcome is None else Outcome(outcome),
        reason=None if reason is None else Reason(reason),
        detail=detail,
        settled_at=settled_at,
        report=_fields(report),
        terms=None if settings is None else Terms(_fields(settings), calibration),
        transfer=_fields(transfer),
        target=_fields(target),
    )


def _fields(text: str | None) -> dict[str, Any]:
    found = json.loads(text or "{}")
    if not isinstance(found, dict):
        raise ValueError(f"{text!r} has no fields")
    return found


def pages_to_text(pages: tuple[Page, ...]) -> str:
    """Pages one after the other, header then payload, four hexadecimal digits a register."""
    registers = array("H", chain.from_iterable(chain(page.header, page.payload) for page in pages))
    if sys.byteorder == "little":
        registers.byteswap()
    return registers.tobytes().hex()


def pages_from_text(text: str) -> tuple[Page, ...]:
    """The pages that `pages_to_text` wrote; each header says where its page ends. None where the text was damaged."""
    try:
        registers = array("H", bytes.fromhex(text))
    except ValueError:
        return ()
    if sys.byteorder == "little":
        registers.byteswap()
    pages, start = [], 0
    while start < len(registers):
        body = start + HEADER_REGISTERS
        if body > len(registers):
            return ()
        end = body + registers[start + PAYLOAD_LENGTH]
        if end > len(registers):
            return ()
        pages.append(Page(tuple(registers[start:body]), tuple(registers[body:end])))
        start = end
    return tuple(pages)
