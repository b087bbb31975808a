"""What the service writes: state folder, journal, archive, the disks they lie on; and the clock that dates them."""

from __future__ import annotations

import ctypes
import os
import pwd
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

from service.check_result import CheckResult, fault, ok, warning
from service.config.config import Config
from service.records.archive import free_bytes
from service.records.job import Job
from service.records.journal_reader import JobFilter, JournalUnreadable, reading

_MEGABYTE = 1_000_000
_NEARLY = 2.0
"""Times the bound must be free, or a nearly full disk is a warning."""
_LOOKED_AT = 100
_CLOCK_SLACK = timedelta(minutes=5)
_TIMEX_BYTES = 512
_NOT_SYNCHRONIZED = 5  # TIME_ERROR, adjtimex(2)


def check_storage(config: Config, *, running: bool, now: Callable[[], float] = time.time) -> Iterator[CheckResult]:
    """Folders, journal, disks, clock. running: a service has the journal open, and is not disturbed."""
    yield from _folders(config)
    journal, last = _journal(config, running)
    yield journal
    yield from _disks(config)
    yield _clock(datetime.fromtimestamp(now(), UTC), last)


def _folders(config: Config) -> Iterator[CheckResult]:
    wanted = {
        "state": ("service.state_dir", config.service.state_dir),
        "archive": ("archive.path", config.archive.path),
    }
    if not config.archive.max_bytes:
        del wanted["archive"]
    if config.adopted_recipes is not None:  # the file is replaced, so it is its folder that must be written
        wanted["adopted"] = ("adopted_recipes", config.adopted_recipes.parent)
    for part, (key, folder) in wanted.items():
        why = _not_writable(folder)
        if why:
            yield fault(part, f"{folder}: {why[0]}", f"{why[1]}, or set {key}")
        else:
            yield ok(part, f"{folder}" + ("" if os.path.exists(folder) else ": not there yet, the service makes it"))


def _not_writable(folder: Path) -> tuple[str, str] | None:
    """Why this user cannot write in the folder, or in the nearest one above it, and what to do; None where he can."""
    there = folder
    while not os.path.exists(there) and there != there.parent:
        there = there.parent
    if not os.path.isdir(there):
        return f"{there} is no folder", "Move it away"
    if os.access(there, os.W_OK | os.X_OK):
        return None
    if os.statvfs(there).f_flag & os.ST_RDONLY:
        return f"the disk of {there} is mounted read-only", "Look at `dmesg` and `mount`; a dying disk is mounted so"
    return f"user {_user()} may not write in {there}", "Give the folder to the service's user"


def _user() -> str:
    try:
        return pwd.getpwuid(os.getuid()).pw_name
    except KeyError:
        return str(os.getuid())


def _journal(config: Config, running: bool) -> tuple[CheckResult, Job | None]:
    path = config.journal.path
    if not os.path.exists(path):
        why = _not_writable(path.parent)
        if why:
            return fault("journal", f"{path}: {why[0]}", f"{why[1]}, or set journal.path"), None
        return ok("journal", f"{path}: no job yet"), None
    if not os.access(path, os.W_OK):
        next_step = "Give the file to the service's user, or set journal.path"
        return fault("journal", f"{path}: user {_user()} may not write it", next_step), None
    try:
        with reading(path) as reader:
            jobs = reader.jobs(JobFilter(), _LOOKED_AT)
            damaged = reader.damaged
    except JournalUnreadable as error:
        next_step = "" if running else "A damaged journal is moved aside at the service's next start"
        return fault("journal", str(error), next_step), None
    newest = jobs[-1] if jobs else None
    ended = [job for job in jobs if job.outcome is not None]
    text = f"{path}: last job {ended[-1].job_id} {ended[-1].outcome}" if ended else f"{path}: no job yet"
    if damaged:
        next_step = "Copy the file, and look at its disk. If it cannot be gone on from, the next start moves it aside"
        return warning("journal", f"{path}: {len(damaged)} damaged: {damaged[-1]}", next_step), newest
    open_ = len(jobs) - len(ended)
    return ok("journal", text + (f", {open_} in flight" if open_ else "")), newest


def _disks(config: Config) -> Iterator[CheckResult]:
    bounds = {"journal": (config.journal.path.parent, config.journal.min_free_bytes)}
    if config.archive.max_bytes:
        bounds["archive"] = (config.archive.path, config.archive.min_free_bytes)
    for what, (path, bound) in bounds.items():
        try:
            free = free_bytes(path)
        except OSError as error:
            yield fault(
                "disk",
                f"{path}: its disk cannot be looked at: {error.strerror}",
                "Check that it is mounted and may be entered",
            )
            continue
        text = f"{what}: {free / _MEGABYTE:.0f} MB free, {bound / _MEGABYTE:.0f} MB are kept free"
        if free >= bound * _NEARLY:
            yield ok("disk", text)
        elif free >= bound:
            yield warning("disk", text, f"Free space soon on the disk of {path}")
        elif what == "journal":
            yield fault("disk", f"{text}: no trigger is taken (160 storage_full)", f"Free space on the disk of {path}")
        else:
            yield warning("disk", f"{text}: the oldest evidence goes first", f"Free space on the disk of {path}")


def _clock(now: datetime, last: Job | None) -> CheckResult:
    text = f"{now.isoformat(timespec='seconds')}{_synchronized()}"
    taken = None if last is None else datetime.fromisoformat(last.taken_at)
    if taken is not None and now < taken - _CLOCK_SLACK:
        next_step = "Set the clock, and let a time service keep it: ages and times in the journal follow it"
        return warning("clock", f"{text}: before the last job, {taken.isoformat(timespec='seconds')}", next_step)
    return ok("clock", text)


def _synchronized() -> str:
    """Whether a time service keeps the clock, as the kernel says; "" where it does not say."""
    try:
        state = ctypes.CDLL(None).adjtimex(ctypes.create_string_buffer(_TIMEX_BYTES))
    except (OSError, AttributeError):
        return ""
    if state < 0:
        return ""
    return ", not kept by a time service" if state == _NOT_SYNCHRONIZED else ", kept by a time service"
