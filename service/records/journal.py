"""The journal: every job, durable before its trigger is acknowledged, and how it ended. SQLite."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from drivers.controller.mailbox.blocks import ServiceBlock
from drivers.controller.mailbox.page_text import pages_from_text, pages_to_text
from drivers.controller.mailbox.pages import Page
from service.link.job_numbers import LARGEST_JOB
from service.reasons import Outcome, Reason
from service.records.job import Job, Progress, Terms, TriggerStamp
from service.records.journal_file import LARGEST_OWNER, JournalDamaged, JournalError, JournalFile, stamp
from service.records.journal_restart import GoneOn, go_on_above, last_pair, restore
from service.records.journal_schema import COLUMNS, UNSETTLED

PRUNED_AT_ONCE = 500  # rows: some milliseconds, for a job may wait behind it
MOST_NOTES = 10_000  # of the audit: who asked for what


class JournalConflict(Exception):
    """A job is not there, or has ended already: a defect of the caller, which trying again does not mend."""


class Journal:
    """Jobs in one file. Methods block for a commit (milliseconds) and may be called from any thread."""

    def __init__(
        self,
        path: Path,
        *,
        above: int = 0,
        otherwise_from: int = 1,
        now: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        """above, otherwise_from: for a new journal, the highest number that is known, or where to begin without one."""
        self._file = JournalFile(path, above=above, otherwise_from=otherwise_from)
        self._now = now
        try:
            self._look_through()
        except JournalError:
            self._file.close()
            raise

    def _look_through(self) -> None:
        """Raise JournalDamaged where what the service goes on from cannot be read: SQLite looks at no content."""
        try:
            owner = self.owner
            self.last_controller_trigger(), self.last_settled(), self.last_taken(), self.unsettled()
        except (ValueError, TypeError) as error:
            raise self._file.damaged("its notes of itself") from error
        except JournalDamaged as error:
            raise self._file.damaged(str(error)) from error
        except JournalError as error:
            cause = error.__cause__
            if getattr(cause, "sqlite_errorcode", None) == sqlite3.SQLITE_ERROR:  # a table or column is missing
                raise self._file.damaged(str(cause)) from cause
            raise
        if not 1 <= owner <= LARGEST_OWNER:
            raise self._file.damaged(f"owner {owner}")

    def refuse_writes(self) -> None:
        """From here on each write raises JournalError."""
        self._file.refuse_writes()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    @property
    def owner(self) -> int:
        """The number drawn once for this journal, 1…65535: the protocol's `owner`."""
        with self._file.reading() as db:
            return int(db.execute("SELECT value FROM meta WHERE key = 'owner'").fetchone()[0])

    def probe(self) -> None:
        """Write and commit something that changes nothing; raise JournalError where that does not work."""
        with self._file.transaction() as db:
            db.execute("UPDATE meta SET value = value WHERE key = 'owner'")

    def step(self) -> AbstractContextManager[sqlite3.Connection]:
        """One durable step of another room's, in tables of its own."""
        return self._file.transaction()

    def take(self, trigger: TriggerStamp, *, above: int = 0) -> Job:
        """A new job, durable on return; its id is above all in the journal and above `above`."""
        taken_at = self._stamp()
        with self._file.transaction() as db:
            highest = db.execute("SELECT COALESCE(MAX(job_id), 0) FROM jobs").fetchone()[0]
            found = max(self._file.number(key) for key in ("above", "adopted_job", "begin_above"))
            job_id = max(highest, above, found) + 1
            if job_id == 1:  # nothing is known of any job of before
                job_id = self._file.number("otherwise_from") or 1
            if job_id > LARGEST_JOB:
                raise JournalError(
                    f"{self._file.path}: {job_id - 1} was the last number that a register can hold. Move it away"
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

    def go_on_above(self, found: ServiceBlock, trigger: tuple[int, int], room: int, running: int = 0) -> GoneOn:
        """Begin at a controller whose service block shows `found`; see `journal_restart.go_on_above`."""
        return go_on_above(self._file, found, trigger, room, running, self._stamp())

    def restore(self, rows: list[tuple[Any, ...]], pair: tuple[int, int]) -> None:
        """Take over what a damaged journal held; see `journal_restart.restore`."""
        restore(self._file, rows, pair)

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
        with self._file.transaction() as db:
            values = self._stamp(), who, address, action, detail
            query = "INSERT INTO audit (at, who, address, action, detail) VALUES (?, ?, ?, ?, ?)"
            number = int(db.execute(query, values).lastrowid or 0)
            db.execute("DELETE FROM audit WHERE id <= ?", (number - MOST_NOTES,))
        return number

    def note_result(self, number: int, result: str) -> None:
        """Make durable what became of it."""
        with self._file.transaction() as db:
            db.execute("UPDATE audit SET result = ? WHERE id = ?", (result, number))

    def prune(self, keep: int) -> int:
        """Delete the oldest of more than `keep` jobs, some at a time; how many that were.

        What numbers and triggers go on from stays: the newest jobs, the controller's last, those that have not ended.
        """
        with self._file.transaction() as db:
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
        with self._file.transaction() as db:
            if terms is not None:
                settings = json.dumps(terms.recipe, sort_keys=True)
                digest = hashlib.sha256(settings.encode()).hexdigest()
                db.execute("INSERT OR IGNORE INTO recipe_settings VALUES (?, ?)", (digest, settings))
                assignments += ", recipe_digest = ?, calibration = ?"
                values = (*values, digest, terms.calibration)
            cursor = db.execute(f"UPDATE jobs SET {assignments} WHERE job_id = ? AND {UNSETTLED}", (*values, job_id))
            if cursor.rowcount != 1:
                raise JournalConflict(f"{self._file.path}: job {job_id} is not there, or has ended already")
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

    def cross_off(self, job_ids: Iterable[int]) -> None:
        """Make durable that the ends of these jobs are owed to their line no more."""
        with self._file.transaction() as db:
            db.executemany("UPDATE jobs SET owed = 0 WHERE job_id = ?", [(job_id,) for job_id in job_ids])

    def last_settled(self) -> Job | None:
        """The settled job with the highest id."""
        return next(iter(self._jobs("WHERE outcome IS NOT NULL ORDER BY job_id DESC LIMIT 1")), None)

    def last_taken(self) -> Job | None:
        """The job with the highest id."""
        return next(iter(self._jobs("ORDER BY job_id DESC LIMIT 1")), None)

    def last_controller_trigger(self) -> tuple[int, int]:
        """(session, trigger_counter) last taken from the controller; (0, 0) where there was none."""
        with self._file.reading():
            return last_pair(self._file)

    def _jobs(self, where: str, values: tuple[Any, ...] = ()) -> tuple[Job, ...]:
        with self._file.reading() as db:
            rows = db.execute(f"SELECT {COLUMNS} FROM jobs {where}", values).fetchall()
        return tuple(job_of(row) for row in rows)

    def _stamp(self) -> str:
        return stamp(self._now())


def _texts(known: Progress) -> tuple[str, str | None]:
    """Report and transfer as they stand in their columns."""
    return json.dumps(known.report), json.dumps(known.transfer) if known.transfer else None


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
