"""What is done to a job, wherever it is done: its name comes in, its row goes out."""

from __future__ import annotations

import os
import resource
import socket
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from contour.image.side_by_side import keep_to_one_thread
from service.records.archived_job import ArchivedJob, load_archived
from service.records.evidence import EvidenceError, Flaw, measurement_fields
from service.records.replay import Replayed, Settings, replay
from service.replays.against import OtherVersion, OtherVersionError
from service.replays.errors import ReplayError
from service.replays.places import Place
from service.replays.rows import COLUMNS, Row, Side, Versions, apart_between, fitting, job_columns, row_of
from service.replays.thumbnails import Thumbnails, thumbnails
from service.replays.versions import versions_here

_others: dict[Path, OtherVersion] = {}
_others_lock: Final = threading.Lock()


class Lost(StrEnum):
    """Why a job was left out that has no flaw itself, by kind."""

    OTHER_VERSION = "other_version"
    WORKER_ENDED = "worker_ended"
    DEFECT = "defect"


@dataclass(frozen=True, slots=True)
class JobName:
    """A job: the number of its place, its own number, and the end that its document's name says."""

    place: int
    job_id: int
    ended: str


@dataclass(frozen=True)
class Done:
    """What a worker made of some jobs: their rows, how long it took, and the most memory that it ever had."""

    rows: list[Row]
    worker: str
    busy_s: float
    peak_mb: float


@dataclass(frozen=True)
class Work:
    """What is done to each job of a run. It is small and holds no picture: it goes with every task.

    against: a wheel, or the folder of an environment, whose version says what was before.
    """

    places: tuple[Place, ...]
    settings: Settings = field(default_factory=Settings)
    against: Path | None = None
    versions: Versions = field(default_factory=lambda: Versions(**versions_here()))

    def done(self, names: Sequence[JobName], worker: str | None = None) -> Done:
        """A row for each job, in order; raises nothing. worker: its name, else that of this process."""
        worker = worker or f"{socket.gethostname()}:{os.getpid()}"
        keep_to_one_thread()
        begun = time.perf_counter()
        rows = [{**self.row(name), "worker": worker} for name in names]
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        return Done(rows, worker, time.perf_counter() - begun, peak_mb)

    def row(self, name: JobName) -> Row:
        """The job's row, but for who did it; raises nothing."""
        begun = time.perf_counter()
        row = self.row_of_name(name)
        try:
            with self.places[name.place].at_hand(name.job_id, name.ended) as archive:
                archived = load_archived(archive, name.job_id)
                row |= fitting(job_columns(archived.document))
                row["read_ms"] = 1000 * (time.perf_counter() - begun)
                again, before, after = self._sides(archived, archive)
                told = row_of(archived.document, before, after)
            if self.against is None:
                told["identical"] = again.identical
            row |= fitting(told)
        except EvidenceError as error:
            row |= left_out(error.flaw, str(error))
        except OtherVersionError as error:
            row |= left_out(Lost.OTHER_VERSION, str(error))
        except (KeyError, TypeError, ValueError, IndexError, OverflowError) as error:
            row |= left_out(Flaw.DOCUMENT_DAMAGED, f"job {name.job_id}: {type(error).__name__}: {error}")
        except Exception as error:  # noqa: BLE001 - a job's owner: one that cannot be done must not end the others
            row |= left_out(Lost.DEFECT, f"job {name.job_id}: {type(error).__name__}: {error}")
        return {column: row.get(column) for column in COLUMNS}

    def row_of_name(self, name: JobName) -> Row:
        """What is known of a job before anything is read."""
        return {"cell": self.places[name.place].cell, "job_id": name.job_id, "archived_as": name.ended or None}

    def drawn(self, name: JobName) -> Thumbnails | None:
        """Pictures of a job before and after, made again; None where it cannot be."""
        try:
            with self.places[name.place].at_hand(name.job_id, name.ended) as archive:
                archived = load_archived(archive, name.job_id)
                _, before, after = self._sides(archived, archive)
                return thumbnails(archived.frame(), before, after, apart_between(before, after))
        except (EvidenceError, OtherVersionError, KeyError, TypeError, ValueError, IndexError):
            return None  # its row says why, or it is there no more

    def _sides(self, archived: ArchivedJob, archive: Path) -> tuple[Replayed, Side, Side]:
        """The job done again, what it was before, and what it is now."""
        again = replay(archived, self.settings)
        after = Side(_codes(again.reasons), measurement_fields(again.seen), self.versions)
        if self.against is not None:
            with _others_lock:  # threads of one process share the one that answers them
                before = other_version(self.against).measured(archive, archived.job_id, self.settings)
            return again, before, after
        known: dict[str, Any] = archived.document
        then = Versions(known["combtrace"], known["numpy"], known["opencv"])
        return again, Side(_codes(again.reasons_were), known["measurement"], then), after


def left_out(kind: Flaw | Lost, text: str) -> Row:
    """What the row of a job tells that could not be done."""
    return {"left_out": str(kind), "left_out_text": text.encode(errors="replace").decode()}


def other_version(given: Path) -> OtherVersion:
    """The process of the other version: one for each process that works, started where there is none, or none alive.

    Raise OtherVersionError where it cannot be started here, as on a worker that has no such wheel.
    """
    known = _others.pop(given, None)
    if known is not None and not known.alive:
        known.close()
        known = None
    try:
        _others[given] = known or OtherVersion(given)
    except ReplayError as error:
        raise OtherVersionError(str(error)) from error
    return _others[given]


def _codes(reasons: Sequence[int]) -> tuple[int, ...]:
    return tuple(int(reason) for reason in reasons)
