"""What a journal keeps beside jobs, for those who ask how a shift was: checks on a master, and triggers not taken."""

from __future__ import annotations

import sqlite3
from collections import Counter
from collections.abc import Mapping
from contextlib import closing
from datetime import datetime, timedelta
from pathlib import Path

from service.measuring.trend_file import COLUMNS, TrendLine
from service.records.journal import Journal
from service.records.journal_file import stamp
from service.records.journal_schema import SCHEMA_VERSION

TAKEN = "taken"
CELL_MIN = 10
"""Missed triggers are counted by so many minutes: a machine that asks all night adds some rows, not thousands."""
KEPT_FOR = timedelta(days=400)
MOST_CHECKS = 10_000
BUSY_S = 5.0


class NotKept(Exception):
    """A check is not in the journal: why, and what to do."""


def keep_check(path: Path, line: TrendLine) -> None:
    """Make a check durable in the journal, a daemon may run beside; raise NotKept."""
    values = stamp(line.time), *(getattr(line, name) for name in COLUMNS[1:])
    names = ", ".join(("at", "kind", *COLUMNS[2:]))
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=rw", uri=True, timeout=BUSY_S)) as db, db:
            version = db.execute("PRAGMA user_version").fetchone()[0]
            if version != SCHEMA_VERSION:
                expected = f"expected {SCHEMA_VERSION}. Start the daemon of this version once"
                raise NotKept(f"{path}: schema version {version}, {expected}")
            db.execute(f"INSERT INTO checks ({names}) VALUES ({', '.join('?' * len(values))})", values)
            db.execute("DELETE FROM checks WHERE id <= (SELECT MAX(id) FROM checks) - ?", (MOST_CHECKS,))
    except sqlite3.Error as error:
        raise NotKept(f"{path}: {error}. Run it as the service's user, once the daemon has run") from error


def keep_missed(journal: Journal, now: datetime, missed: Mapping[tuple[str, str], int]) -> None:
    """Add to the counts of triggers not taken, by kind and name of the reason; raise JournalError."""
    if not missed:
        return
    cell = stamp(now.replace(minute=now.minute - now.minute % CELL_MIN, second=0, microsecond=0))
    with journal.step() as db:
        db.executemany(
            "INSERT INTO missed VALUES (?, ?, ?, ?)"
            " ON CONFLICT (at, kind, reason) DO UPDATE SET count = count + excluded.count",
            [(cell, kind, reason, count) for (kind, reason), count in missed.items()],
        )
        db.execute("DELETE FROM missed WHERE at < ?", (stamp(now - KEPT_FOR),))


def missed_since(counts: Counter[tuple[str, str]], before: Counter[tuple[str, str]]) -> Counter[tuple[str, str]]:
    """What was not taken between two looks at the executor's counts."""
    return Counter({key: count for key, count in (counts - before).items() if key[1] != TAKEN})
