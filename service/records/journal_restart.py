"""What a journal goes on from after a start: what stands at the controller, and what a damaged journal held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drivers.controller.mailbox.blocks import ServiceBlock
from service.link.job_numbers import LARGEST_JOB
from service.reasons import Reason
from service.records.journal_file import JournalFile
from service.records.journal_schema import UNSETTLED

LATER = 32768  # a trigger counter that is less ahead than this is later, one that is more is earlier
RESTORED = (
    "job_id, taken_at, trigger_kind, line, trigger_session, trigger_counter, recipe, thickness_um, session, pages,"
    " target, withdraw_reason"
)


@dataclass(frozen=True)
class GoneOn:
    """What was learnt from the service block at the controller: a trigger that counts as taken, a job to take back."""

    pair: tuple[int, int] | None = None
    in_flight: int | None = None


def go_on_above(
    file: JournalFile, found: ServiceBlock, trigger: tuple[int, int], room: int, running: int, at: str
) -> GoneOn:
    """Begin at a controller with `found` as service block and `trigger` as (session, counter); durable on return.

    New jobs are numbered from more than `room` above all that is known. The block's trigger counts as taken where it
    is later than ours and ours is not the controller's newest one. Its job, where it had not ended there and is not in
    the journal, becomes one of ours that is to be taken back: the block may be another service's, and the journal may
    be an old one. `running` is a job of this life, which knows itself what was sent of it. `at`: the time.
    """
    session, _ = trigger
    with file.transaction() as db:
        highest = db.execute("SELECT COALESCE(MAX(job_id), 0) FROM jobs").fetchone()[0]
        adopted = max(found.job_id, found.settled_job, file.number("adopted_job"))
        known = max(highest, adopted, file.number("above")) or file.number("otherwise_from") - 1
        file.keep(adopted_job=adopted, begin_above=min(known + room, LARGEST_JOB - 1))
        pair = (found.session_ack, found.trigger_ack)
        ours = last_pair(file)
        later = ours != trigger and _is_later(pair, ours, session)
        if later:
            file.keep(adopted_above=highest, adopted_session=pair[0], adopted_counter=pair[1])
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
                (found.job_id, at, session, int(Reason.SERVICE_RESTARTED)),
            )
    return GoneOn(pair if later else None, found.job_id if unknown else None)


def restore(file: JournalFile, rows: list[tuple[Any, ...]], pair: tuple[int, int]) -> None:
    """Take over from a damaged journal: jobs that had not ended (columns as in RESTORED), and the last trigger."""
    marks = ", ".join("?" * len(RESTORED.split(",")))
    with file.transaction() as db:
        db.executemany(f"INSERT INTO jobs ({RESTORED}) VALUES ({marks})", rows)
        db.execute(f"UPDATE jobs SET owed = 1 WHERE line IS NOT NULL AND {UNSETTLED}")
        if pair[1]:
            highest = max((row[0] for row in rows), default=0)
            file.keep(adopted_above=highest, adopted_session=pair[0], adopted_counter=pair[1])


def last_pair(file: JournalFile) -> tuple[int, int]:
    """(session, trigger_counter) last taken from the controller; within a transaction or a look."""
    row = file.db.execute(
        "SELECT trigger_session, trigger_counter FROM jobs WHERE trigger_counter IS NOT NULL AND job_id > ?"
        " ORDER BY job_id DESC LIMIT 1",
        (file.number("adopted_above"),),
    ).fetchone()
    row = row or (file.number("adopted_session"), file.number("adopted_counter"))
    return int(row[0]), int(row[1])


def _is_later(pair: tuple[int, int], than: tuple[int, int], session: int) -> bool:
    """True where `pair`, as (session, trigger_counter), was taken in this session after `than` was."""
    if pair[0] != session or 0 in pair:
        return False
    return than[0] != session or 0 < (pair[1] - than[1]) % 65536 < LATER
