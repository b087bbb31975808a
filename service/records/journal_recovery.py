"""The journal as the daemon opens it: a damaged one is moved aside, and numbers go on above all that can be found."""

from __future__ import annotations

import json
import logging
import os
import re
import shutil
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from service.link.job_numbers import LARGEST_JOB
from service.reasons import Reason
from service.records.journal import Journal
from service.records.journal_file import JournalDamaged, JournalError, readable_text, stamp
from service.records.journal_restart import RESTORED
from service.records.journal_schema import UNSETTLED

log = logging.getLogger("combtrace.journal")

PARTS = ("", "-wal", "-shm")  # SQLite's files of one database
TABLE_LEAF = 0x0D  # b-tree page type: https://sqlite.org/fileformat2.html, 1.6
PAGE_SIZES = range(512, 65537)
WAL_MAGIC = (b"\x37\x7f\x06\x82", b"\x37\x7f\x06\x83")
WAL_HEADER, WAL_FRAME_HEADER, FILE_HEADER = 32, 24, 100
TAKEN_AT = re.compile(rb"20\d\d-[01]\d-[0-3]\dT[0-2]\d:[0-5]\d")  # each job's row holds one, no other row does
TAKEN_AT_WITHIN = 64  # bytes of a row's beginning


def open_journal(
    path: Path, archive: Path, *, ran_before: bool = False, now: Callable[[], float] = time.time
) -> Journal:
    """The journal; a damaged one is moved aside with an alarm in the log, and a new one begun. Raise JournalError.

    ran_before: the service ran here before, so a journal that is not there was lost. Without that, a file that holds no
    job is somebody else's, and refused. The first number of a new journal is above the highest in those moved aside and
    in the archive; where one was lost and none is found, it is the Unix time. Above `last_job` it is anyway.
    """
    alarm, kept = "", None
    try:
        if path.exists() and path.stat().st_size > 0:
            return Journal(path)
        kept = _broken_off(path)
        alarm = f"{path}: is damaged, and moving it aside was broken off. It is in {kept}. " if kept else ""
    except JournalDamaged as error:
        if not ran_before and highest_job(path) == 0:
            raise
        kept = _move_aside(path, now())
        alarm = f"{error} It was moved to {kept}. "
    except OSError as error:
        raise JournalError(f"{path}: cannot be looked at: {error.strerror}. Check journal.path") from error
    if ran_before and not alarm:
        alarm = f"{path}: the journal is lost: the service ran here before. Look jobs in flight up at the controller. "
    highest = max([highest_archived(archive), *map(highest_job, set_aside(path))])
    otherwise_from = int(now()) if alarm else 1
    journal = Journal(path, above=highest, otherwise_from=otherwise_from)
    if kept is not None:
        alarm += _restore(kept, journal)
    text = (
        f"a new journal: jobs from {highest + 1 if highest else otherwise_from} on, "
        "or from 1000 above that and above what the controller knows"
    )
    log.log(logging.CRITICAL if alarm else logging.INFO, "%s%s: %s", alarm, path, text)
    return journal


def set_aside(path: Path) -> list[Path]:
    """Journals of this path that were moved aside before."""
    return sorted(path.parent.glob(f"{path.name}.damaged-*[0-9Z]"))


def _move_aside(path: Path, unix_s: float) -> Path:
    """Give the journal and its write-ahead log another name; nothing of them is lost, killed at whatever moment.

    First all have both names, then the old ones go, the database's before its log's: without its log a database looks
    sound and older than it is.
    """
    kept = _free_name(path, unix_s)
    try:
        for source in _files(path):
            target = kept.with_name(kept.name + source.name.removeprefix(path.name))
            if not (target.exists() and target.samefile(source)):
                _name_also(source, target)
        for source in _files(path):
            source.unlink()
    except OSError as error:
        raise JournalError(f"{path}: is damaged and cannot be moved aside: {error.strerror}. Move it away") from error
    return kept


def _free_name(path: Path, unix_s: float) -> Path:
    """A name by the clock that no other journal has: where it starts anew at each boot, the same second comes again."""
    while True:
        stamp = datetime.fromtimestamp(unix_s, UTC).strftime("%Y%m%dT%H%M%SZ")
        kept = path.with_name(f"{path.name}.damaged-{stamp}")
        if not any(kept.with_name(kept.name + part).exists() for part in PARTS):
            return kept
        if kept.exists() and path.exists() and kept.samefile(path):
            return kept  # our own, broken off
        unix_s += 1


def _files(path: Path) -> list[Path]:
    """SQLite's files of the database that are there."""
    return [file for part in PARTS if (file := path.with_name(path.name + part)).exists()]


def _name_also(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except OSError:  # a file system without hard links; a copy that is broken off is made anew under another name
        shutil.copy2(source, target)
        with target.open("rb") as copy:
            os.fsync(copy.fileno())


def _broken_off(path: Path) -> Path | None:
    """The name of a journal that was being moved aside when the service was killed, after clearing up behind it."""
    left, aside = _files(path), set_aside(path)
    if path.exists() or not left or not aside:
        return None
    kept = aside[-1]
    if any(not _is_in(file, kept.with_name(kept.name + file.name.removeprefix(path.name))) for file in left):
        return None  # they belong to another journal, which was lost
    for file in left:
        file.unlink()
    return kept


def _is_in(file: Path, copy: Path) -> bool:
    return copy.exists() and (copy.samefile(file) or copy.read_bytes() == file.read_bytes())


def _restore(kept: Path, journal: Journal) -> str:
    """Bring over what had not ended, where it can be read; a sentence of what that was."""
    try:
        with closing(_reading(kept)) as old:
            rows = old.execute(f"SELECT {_there(old)} FROM jobs WHERE {UNSETTLED}").fetchall()
            pairs = "SELECT trigger_session, trigger_counter FROM jobs WHERE trigger_counter IS NOT NULL"
            pair = old.execute(f"{pairs} ORDER BY job_id DESC LIMIT 1").fetchone() or (0, 0)
        journal.restore([_sound(row) for row in rows], pair)
    except (sqlite3.Error, JournalError) as error:
        log.info("%s: %s", kept, error)
        return "Which jobs had not ended cannot be read in it: look them up at the controller. "
    return f"Jobs in it that had not ended: {', '.join(str(row[0]) for row in rows) or 'none'}. "


def _there(old: sqlite3.Connection) -> str:
    """The columns of RESTORED, those that a journal of an earlier version has not as NULL."""
    known = {str(row[1]) for row in old.execute("PRAGMA table_info(jobs)")}
    return ", ".join(name if name in known else "NULL" for name in RESTORED.split(", "))


def _sound(row: tuple[Any, ...]) -> tuple[Any, ...]:
    """Columns as in RESTORED, with what no job can hold put right: this job is to be settled, not to be understood."""
    *columns, pages, target, withdraw_reason = row
    known = withdraw_reason is None or withdraw_reason in set(Reason)
    try:
        datetime.fromisoformat(str(columns[1]))
    except ValueError:
        columns[1] = stamp(datetime.fromtimestamp(0, UTC))
    try:
        target = target if isinstance(json.loads(target or "{}"), dict) else None
    except ValueError:
        target = None
    return (*columns, pages, target, withdraw_reason if known else int(Reason.SERVICE_RESTARTED))


def _reading(path: Path) -> sqlite3.Connection:
    database = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)
    database.text_factory = readable_text
    return database


def highest_archived(archive: Path) -> int:
    """The highest number that begins the name of a file or folder in the archive, as `17`, `17.json`; 0 without any."""
    numbers = (int(found[0]) for entry in archive.rglob("*") if (found := re.match(r"\d{1,10}(?!\d)", entry.name)))
    return max((number for number in numbers if number <= LARGEST_JOB), default=0)


def highest_job(path: Path) -> int:
    """The highest job number that can still be read in a damaged journal; 0 where none can."""
    asked = 0
    try:
        with closing(_reading(path)) as database:
            asked = database.execute("SELECT COALESCE(MAX(job_id), 0) FROM jobs").fetchone()[0]
    except sqlite3.Error as error:
        log.info("%s: %s; its rows are looked for one by one", path, error)
    numbers = [asked]
    for part in ("", "-wal"):
        try:
            numbers += _numbers_in(path.with_name(path.name + part).read_bytes())
        except OSError:
            continue
    return max(numbers)


def _numbers_in(content: bytes) -> Iterator[int]:
    """Job numbers in the leaf pages of a database file or write-ahead log, found without the tree above them."""
    in_log = content[:4] in WAL_MAGIC
    size = int.from_bytes(content[8:12] if in_log else content[16:18], "big")
    size = 65536 if size == 1 else size
    if size not in PAGE_SIZES or size & (size - 1):
        size = 4096  # the header is gone: SQLite's own default
    start, step = (WAL_HEADER + WAL_FRAME_HEADER, size + WAL_FRAME_HEADER) if in_log else (0, size)
    for offset in range(start, len(content), step):
        page = content[offset : offset + size]
        begin = FILE_HEADER if offset == 0 and not in_log else 0
        yield from _rows(page, begin)


def _rows(page: bytes, begin: int) -> Iterator[int]:
    """Row numbers of the jobs in one leaf page; `begin` is where its header stands."""
    if len(page) < begin + 8 or page[begin] != TABLE_LEAF:
        return
    count = int.from_bytes(page[begin + 3 : begin + 5], "big")
    for number in range(count):
        at = begin + 8 + 2 * number
        cell = int.from_bytes(page[at : at + 2], "big")
        _, after = _varint(page, cell)
        job_id, body = _varint(page, after)
        if 0 < job_id <= LARGEST_JOB and TAKEN_AT.search(page, body, body + TAKEN_AT_WITHIN):
            yield job_id


def _varint(page: bytes, at: int) -> tuple[int, int]:
    """SQLite's variable-length integer at `at`, and where it ends."""
    value = 0
    for length, byte in enumerate(page[at : at + 9], start=1):
        if length == 9:
            return value << 8 | byte, at + 9
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, at + length
    return 0, len(page)
