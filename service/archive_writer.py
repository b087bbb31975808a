"""Writes evidence in a thread of its own, after the job: what does not fit its queue is counted, never waited for."""

from __future__ import annotations

import logging
import os
import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import cv2

from contour.errors import PictureError
from service.allocator import give_back
from service.archive import Archive, ArchiveError
from service.evidence import (
    FRAME,
    OVERLAY,
    Evidence,
    document_bytes,
    frame_bytes,
    overlay_bytes,
    table_digest,
)
from service.recipe_exports import exports_of
from service.table_file import TableRecord, table_bytes

log = logging.getLogger("combtrace.archive")

DEPTH = 4  # frames that may wait: a burst of jobs; each may be tens of megabytes
NICENESS = 10  # the next job goes before the last one's picture
CLOSE_BOUND_S = 10.0
GIVEN_BACK_EVERY = (
    200  # jobs; frames and their copies are the largest that a job leaves behind in the allocator's heaps
)


@dataclass(frozen=True)
class ArchiveFigures:
    """What has become of evidence since the start, and what is kept now."""

    stored: int = 0
    dropped: int = 0
    failed: int = 0
    jobs: int = 0
    bytes: int = 0


class ArchiveWriter:
    """Stores what `keep` is handed; `figures` and `trouble` may be read from any thread."""

    def __init__(self, archive: Archive, *, depth: int = DEPTH) -> None:
        self._archive = archive
        self._queue: queue.Queue[Evidence | None] = queue.Queue(depth)
        self._thread = threading.Thread(target=self._run, name="archive", daemon=True)
        self._stored = self._dropped = self._failed = self._since_given = 0
        self._table: tuple[TableRecord, str] | None = None
        self._opened = self._closing = False
        self.trouble: str | None = None
        self.on_stored: Callable[[Evidence], None] = lambda _evidence: None  # told in the writer's thread

    @property
    def figures(self) -> ArchiveFigures:
        """Counts since the start, and what is kept."""
        return ArchiveFigures(self._stored, self._dropped, self._failed, self._archive.jobs, self._archive.kept_bytes)

    def start(self) -> None:
        """Begin: the archive is looked through first."""
        self._thread.start()

    def keep(self, evidence: Evidence) -> None:
        """Have it written; never blocks. Where too many wait already, it is counted and let go."""
        try:
            self._queue.put_nowait(evidence)
        except queue.Full:
            self._dropped += 1
            log.warning("archive: evidence of job %d is not kept: the disk is slower than jobs", evidence.job.job_id)

    def make_room(self) -> None:
        """Have the bounds looked after, where nothing waits to be written, which does it anyway."""
        if self._queue.empty() and self._thread.is_alive():
            try:
                self._queue.put_nowait(None)
            except queue.Full:
                return

    def close(self, bound_s: float = CLOSE_BOUND_S) -> None:
        """Write what waits, for a bounded time, and end."""
        if not self._thread.is_alive():
            return
        self._closing = True
        try:
            self._queue.put(None, timeout=bound_s)
        except queue.Full:
            log.warning("archive: %d jobs' evidence is lost: the disk does not follow", self._queue.qsize())
            return
        self._thread.join(bound_s)

    def _run(self) -> None:
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
        self._tell(self._open)
        while True:
            evidence = self._queue.get()
            if evidence is not None:
                self._tell(partial(self._store, evidence))
                self._give_back()
            elif self._closing and self._queue.empty():
                return
            else:
                self._tell(self._make_room)
            evidence = None  # or it would hold a frame until the next job

    def _give_back(self) -> None:
        """Where nothing waits, so that it falls between two jobs where it can."""
        self._since_given += 1
        if self._since_given >= GIVEN_BACK_EVERY and self._queue.empty():
            self._since_given = 0
            give_back()

    def _make_room(self) -> None:
        self._open()
        self._archive.make_room()

    def _open(self) -> None:
        if self._opened:
            return
        self._archive.open()
        self._opened = True
        if self._archive.swept:
            log.info("archive: %d files of jobs whose writing was cut short were swept", self._archive.swept)

    def _tell(self, step: Callable[[], None]) -> None:
        """Do it; what goes wrong is told once, and the writer goes on."""
        try:
            step()
        except (ArchiveError, PictureError, cv2.error, ValueError) as error:
            self._failed += 1
            if str(error) != self.trouble:
                log.warning("archive: %s", error)
            self.trouble = str(error)
        else:
            self.trouble = None

    def _store(self, evidence: Evidence) -> None:
        self._open()
        job = evidence.job
        assert job.outcome is not None
        files = {}
        if evidence.frame is not None:
            files[FRAME] = frame_bytes(evidence.frame)
            if evidence.measurement is not None:
                files[OVERLAY] = overlay_bytes(evidence.frame, evidence.measurement)
        errors: list[str] = []
        if evidence.recipe is not None and evidence.measurement is not None:
            exports, errors = exports_of(evidence.recipe, evidence.measurement, f"job {job.job_id}")
            files |= exports
        document = document_bytes(evidence, self._stored_table(evidence.measurer.table))
        self._archive.store(job.job_id, job.outcome, files, document)
        self._stored += 1
        self.on_stored(evidence)
        if errors:
            raise ArchiveError(f"job {job.job_id}: not exported: {'; '.join(errors)}")

    def _stored_table(self, record: TableRecord | None) -> str | None:
        if record is None:
            return None
        if self._table is None or self._table[0] is not record:
            self._table = record, table_digest(record)
        return self._archive.store_table(self._table[1], lambda: table_bytes(record))
