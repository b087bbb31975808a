"""Writes evidence: a draft while the job goes on, durable before its contour is sent, and all of it after the job.

The draft is what cannot be made again: the frame as plain bytes, for compressing it would take longer than measuring,
and the document. After the job, in a thread of low priority, the document is completed with the end, also where a
restart came in between, and pictures and exports are made. What does not fit the queue is counted, never waited for.
"""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Callable, Collection, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

import cv2

from contour.errors import PictureError
from service.export.recipe_exports import exports_of
from service.low_priority import go_last
from service.malloc import give_back
from service.measuring.table_file import TableRecord, table_bytes
from service.records.archive import DRAFT, PLAIN_FRAME, Archive, ArchiveError
from service.records.archived_job import drafted_evidence, load_draft
from service.records.evidence import (
    FRAME,
    OVERLAY,
    Evidence,
    EvidenceError,
    document,
    document_bytes,
    frame_bytes,
    job_fields,
    overlay_bytes,
    plain_bytes,
    table_digest,
)
from service.records.job import Job
from service.records.journal_file import JournalError

log = logging.getLogger("combtrace.archive")

DEPTH = 4  # frames that may wait: a burst of jobs; each may be tens of megabytes
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
    """Stores what it is handed; `figures` and `trouble` may be read from any thread."""

    def __init__(
        self,
        archive: Archive,
        find: Callable[[int], Job | None] = lambda _job_id: None,
        in_flight: Collection[int] = (),
        last_taken: int = 0,
        *,
        depth: int = DEPTH,
    ) -> None:
        """find: a job in the journal; raises JournalError. in_flight: jobs whose evidence will come after a restart.

        last_taken: the highest number in the journal; one above it may be found at the controller yet.
        """
        self._archive = archive
        self._find = find
        self._in_flight = frozenset(in_flight)
        self._last_taken = last_taken
        self._lock = threading.Lock()  # of the archive
        self._queue: queue.Queue[Evidence | None] = queue.Queue(depth)
        self._thread = threading.Thread(target=self._run, name="archive", daemon=True)
        self.drafting = ThreadPoolExecutor(1, "draft")  # a job waits for it: not at low priority
        self._drafted: Future[None] | None = None
        self._draft_trouble = ""
        self._unkept: list[int] = []
        self._stored = self._dropped = self._failed = self._since_given = 0
        self._table: tuple[TableRecord, str] | None = None
        self._opened = self._closing = False
        self.trouble: str | None = None
        self.on_stored: Callable[[Evidence], None] = lambda _evidence: None  # told in the writer's thread
        self.keep_remnants: Callable[[Evidence], None] = lambda _evidence: None  # likewise

    @property
    def figures(self) -> ArchiveFigures:
        """Counts since the start, and what is kept."""
        return ArchiveFigures(self._stored, self._dropped, self._failed, self._archive.jobs, self._archive.kept_bytes)

    def start(self) -> None:
        """Begin: the archive is looked through first."""
        self._thread.start()

    def draft(self, evidence: Evidence) -> Future[None] | None:
        """Done once the draft is durable, or cannot be; None where the disk hangs with that of an earlier job."""
        if self._drafted is not None and not self._drafted.done():
            text = "archive: job %d goes on without its evidence: the disk still writes an earlier job's"
            log.warning(text, evidence.job.job_id)
            return None
        self._drafted = self.drafting.submit(self._draft, evidence)
        return self._drafted

    def keep(self, evidence: Evidence) -> None:
        """Have it written; never blocks. Where too many wait already, it is counted and let go."""
        try:
            self._queue.put_nowait(evidence)
        except queue.Full:
            self._dropped += 1
            self._unkept.append(evidence.job.job_id)
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
        self.drafting.shutdown(wait=False, cancel_futures=True)
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
        go_last()
        self._tell(self._complete_drafts)
        while True:
            evidence = self._queue.get()
            if evidence is not None:
                self._tell(partial(self._keep, evidence))
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
        with self._opened_archive() as archive:
            while self._unkept:
                archive.forget(self._unkept.pop())
            archive.make_room()

    @contextmanager
    def _opened_archive(self) -> Iterator[Archive]:
        """The archive, for us alone; the first to come looks it through."""
        with self._lock:
            self._open()
            yield self._archive

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
        except (ArchiveError, EvidenceError, PictureError, cv2.error, ValueError) as error:
            self._failed += 1
            if str(error) != self.trouble:
                log.warning("archive: %s", error)
            self.trouble = str(error)
        else:
            self.trouble = None

    # --- before the contour is sent -----------------------------------------------------------------------------

    def _draft(self, evidence: Evidence) -> None:
        job_id, frame = evidence.job.job_id, evidence.frame
        if frame is not None and self._put(job_id, PLAIN_FRAME, lambda: plain_bytes(frame)):
            self._put(job_id, DRAFT, lambda: document_bytes(self._document(evidence)))

    def _put(self, job_id: int, suffix: str, content: Callable[[], bytes]) -> bool:
        """True where it is kept. Without room the job goes on, and its evidence is tried again at its end."""
        try:
            with self._opened_archive() as archive:
                if not archive.has(job_id, suffix):
                    archive.put(job_id, suffix, content())
        except (ArchiveError, ValueError) as error:
            if str(error) != self._draft_trouble:
                log.warning("archive: job %d goes on without its evidence: %s", job_id, error)
            self._draft_trouble = str(error)
            return False
        self._draft_trouble = ""
        return True

    # --- after the job ------------------------------------------------------------------------------------------

    def _complete_drafts(self) -> None:
        """Complete the drafts of jobs that had ended when the service was killed; nobody waits for the others."""
        with self._opened_archive() as archive:
            drafts = [job_id for job_id in archive.drafts if job_id not in self._in_flight]
        for job_id in drafts:
            try:
                job = self._find(job_id)
            except JournalError as error:
                raise ArchiveError(f"job {job_id}: its evidence is completed at the next start: {error}") from error
            if job is not None and job.outcome is not None:
                self._keep(Evidence(job, None))
            elif job_id <= self._last_taken:
                with self._opened_archive() as archive:
                    archive.forget(job_id)

    def _keep(self, evidence: Evidence) -> None:
        job_id, drafted = evidence.job.job_id, None
        with self._opened_archive() as archive:
            has_draft = archive.has(job_id, DRAFT)
            if evidence.frame is None and not has_draft and archive.document_of(job_id) is not None:
                return  # it had ended before its journal was lost or restored, and less is known of it now
        try:
            if has_draft:
                draft = load_draft(self._archive.path, job_id)
                evidence = drafted_evidence(draft, evidence.job) if evidence.frame is None else evidence
                drafted = {**draft.document, "job": job_fields(evidence.job)}
        except EvidenceError as error:
            log.warning("archive: job %d: its draft cannot be completed: %s", job_id, error)
            with self._opened_archive() as archive:
                archive.forget(job_id)
            if evidence.measurer is None:
                return
        self._store(evidence, drafted)

    def _store(self, evidence: Evidence, drafted: dict[str, Any] | None) -> None:
        """drafted: the document, where it was drafted before."""
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
        with self._opened_archive() as archive:
            written = self._document(evidence) if drafted is None else drafted
            archive.store(job.job_id, job.outcome, files, document_bytes(written))
        self._stored += 1
        self.on_stored(evidence)
        self.keep_remnants(evidence)
        if errors:
            raise ArchiveError(f"job {job.job_id}: not exported: {'; '.join(errors)}")

    def _document(self, evidence: Evidence) -> dict[str, Any]:
        assert evidence.measurer is not None
        return document(evidence, self._stored_table(evidence.measurer.table))

    def _stored_table(self, record: TableRecord | None) -> str | None:
        if record is None:
            return None
        if self._table is None or self._table[0] is not record:
            self._table = record, table_digest(record)
        return self._archive.store_table(self._table[1], lambda: table_bytes(record))
