"""Looks after the disks: no trigger where the journal might soon not be written, archive and journal within bounds."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import dataclass
from pathlib import Path

from service.jobs.health import Fault, Health
from service.reasons import Reason
from service.records.archive import free_bytes
from service.records.archive_writer import ArchiveWriter
from service.records.journal import Journal
from service.records.journal_file import JournalError

log = logging.getLogger("combtrace.storage")

PERIOD_S = 1.0
PRUNE_PERIOD_S = 600.0
PRUNE_PAUSE_S = 0.2
RELEASE = 1.1  # times the bound must be free again: without it the state would flicker
MEGABYTE = 1_000_000


@dataclass(frozen=True)
class StorageLimits:
    """Free bytes without which no trigger is taken, and most jobs in the journal."""

    min_free_bytes: int = 0
    max_jobs: int = 500_000


class StorageWatch:
    """Reports a disk that is nearly full to `health`, under "storage"."""

    def __init__(
        self,
        journal: Journal,
        path: Path,
        health: Health,
        archive: ArchiveWriter | None,
        limits: StorageLimits,
    ) -> None:
        self._journal = journal
        self._path = path
        self._health = health
        self._archive = archive
        self._limits = limits
        self.free_bytes: int | None = None

    async def run(self) -> None:
        """Look after the disks for ever."""
        loop = asyncio.get_running_loop()
        prune_at = loop.time()
        while True:
            await self.look()
            if loop.time() >= prune_at:
                await self._prune()
                prune_at = loop.time() + PRUNE_PERIOD_S
            await asyncio.sleep(PERIOD_S)

    async def look(self) -> None:
        """One look at the journal's disk; the archive is told to keep its bounds."""
        if self._archive is not None:
            self._archive.make_room()
        try:
            self.free_bytes = await asyncio.to_thread(free_bytes, self._path)
        except OSError as error:
            text = f"{self._path}: its disk cannot be looked at: {error.strerror}. Check journal.path"
            self._health.report("storage", Fault(Reason.STORAGE_FULL, text))
            return
        full = self._health.fault("storage") is not None
        if self.free_bytes < self._limits.min_free_bytes * (RELEASE if full else 1.0):
            if not full:
                self._health.report("storage", Fault(Reason.STORAGE_FULL, self._text(self.free_bytes)))
        elif full:
            self._health.report("storage", None)

    def _text(self, free: int) -> str:
        return (
            f"{self._path}: {free / MEGABYTE:.0f} MB of the disk are free, {self._limits.min_free_bytes / MEGABYTE:.0f}"
            " are needed. Free space; no trigger is taken until then"
        )

    async def _prune(self) -> None:
        """Let the oldest jobs go, a few at a time, so that a job hardly waits."""
        try:
            while await asyncio.to_thread(self._journal.prune, self._limits.max_jobs):
                await asyncio.sleep(PRUNE_PAUSE_S)
        except JournalError as error:
            log.warning("journal: %s", error)
