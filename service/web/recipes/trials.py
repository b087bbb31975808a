"""One try at a time: a changed recipe on archived jobs, bounded in time and memory, and jobs go first."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Literal

from service.config.recipe_keys import changes
from service.config.recipes import Recipe
from service.daemon.control import CommandRefused
from service.low_priority import go_last
from service.records.archive import document_of
from service.records.job import Job
from service.records.journal_reader import JobFilter, JournalReader, reading
from service.web.recipes.models import KeyChange, LeftOut, TrialState, TriedJob
from service.web.recipes.trial import Drawn, Trial
from service.worker import Worker, WorkerEnded

log = logging.getLogger("combtrace.page")

LONGEST_S = 600.0
MOST_DRAWN_BYTES = 32_000_000
MOST_LOOKED_AT = 2000  # jobs of the journal, for those of the recipe
LOOKED_AT_ONCE = 200

Ended = Literal["done", "stopped", "too_long", "failed"]


@dataclass(frozen=True)
class Asked:
    """What is to be tried: `changed` in the place of `recipe`, on these jobs; who wants to know."""

    recipe: Recipe
    changed: Recipe
    jobs: tuple[int, ...]
    who: str


@dataclass
class _Run:
    """A try, and what has come of it."""

    number: int
    asked: Asked
    ended: Ended | None = None
    worker: Worker | None = None
    jobs: list[TriedJob] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    drawn: dict[int, bytes] = field(default_factory=dict)
    drawn_bytes: int = 0

    def add(self, found: Drawn | LeftOut) -> None:
        """Keep it; drawings as long as there is room."""
        if isinstance(found, LeftOut):
            self.left_out.append(found)
            return
        self.jobs.append(found.job)
        self.drawn_bytes += len(found.drawing)
        if self.drawn_bytes <= MOST_DRAWN_BYTES:
            self.drawn[found.job.job_id] = found.drawing


class Trials:
    """The last try. May be called from any thread."""

    def __init__(self, archive: Path, *, longest_s: float = LONGEST_S) -> None:
        self._archive = archive
        self._longest_s = longest_s
        self._lock = threading.Lock()
        self._run: _Run | None = None

    def close(self) -> None:
        """End what runs."""
        self._end("stopped")

    def begin(self, asked: Asked) -> int:
        """The number of the try, which goes on by itself; raise CommandRefused where one runs."""
        with self._lock:
            before = self._run
            if before is not None and before.ended is None:
                raise CommandRefused(f"{before.asked.who} tries a recipe at this moment. Wait, or end it")
            # None of before a restart comes again: what is adopted is what this number was tried with.
            number = max(0 if before is None else before.number + 1, time.time_ns() // 1_000_000)
            run = self._run = _Run(number, asked)
        threading.Thread(target=self._try, args=(run,), name="recipe try", daemon=True).start()
        return number

    def stop(self) -> None:
        """End the one that runs; what it has found stays. Raise CommandRefused where none does."""
        if not self._end("stopped"):
            raise CommandRefused("no recipe is being tried: there is nothing to end")

    def state(self) -> TrialState | None:
        """How far the last one is."""
        with self._lock:
            run = self._run
            if run is None:
                return None
            return TrialState(
                number=run.number,
                recipe=run.asked.recipe.number,
                changes=key_changes(run.asked.recipe, run.asked.changed),
                who=run.asked.who,
                state=run.ended or "running",
                wanted=len(run.asked.jobs),
                jobs=list(run.jobs),
                left_out=list(run.left_out),
            )

    def drawing(self, job_id: int) -> bytes | None:
        """What would have been drawn of a job, JSON; None where that is not known."""
        with self._lock:
            return None if self._run is None else self._run.drawn.get(job_id)

    def tried(self, number: int) -> Asked:
        """What was tried by this number, to its end; raise CommandRefused."""
        with self._lock:
            run = self._run
            if run is None or run.number != number:
                raise CommandRefused("that is not the last recipe that was tried. Try it again")
            if run.ended != "done":
                raise CommandRefused("its try has not come to its end. Wait, or try it again on fewer jobs")
            if not run.jobs:
                raise CommandRefused("it could not be tried on one job. See why each was left out")
            return run.asked

    # --- in a thread of its own -----------------------------------------------------------------------------------

    def _try(self, run: _Run) -> None:
        go_last()
        limit = threading.Timer(self._longest_s, self._end, ("too_long",))
        limit.daemon = True
        limit.start()
        ended: Ended = "failed"
        try:
            worker = Worker(Trial(self._archive, run.asked.changed).tried, gives_way=True)
            with self._lock:
                run.worker = worker
                jobs = run.asked.jobs if run.ended is None else ()  # ended while its process began
            for job_id in jobs:
                found = worker.answer(job_id)
                with self._lock:
                    run.add(found)
                    if run.ended is not None:
                        break
            ended = "done"
        except WorkerEnded as error:
            if run.ended is None:
                log.warning("a recipe's try: %s", str(error))  # a record kept would keep its pipes
        except Exception:  # the one owner of its defects: whoever waits for it is told
            log.exception("a recipe's try: internal error")
        finally:
            limit.cancel()
            with self._lock:
                ending, run.worker = run.worker, None  # with which its pipes go
            if ending is not None:
                ending.end()
            with self._lock:
                run.ended = run.ended or ended

    def _end(self, how: Ended) -> bool:
        """End the one that runs; False where none does."""
        with self._lock:
            run = self._run
            if run is None or run.ended is not None:
                return False
            run.ended = how
            worker = run.worker
        if worker is not None:
            worker.end()
        return True


def key_changes(before: Recipe, after: Recipe) -> list[KeyChange]:
    """The keys that differ."""
    return [KeyChange(key=key, before=old, after=new) for key, (old, new) in changes(before, after).items()]


def last_jobs(journal: Path, archive: Path, recipe: int, count: int) -> tuple[int, ...]:
    """A recipe's last jobs that are kept, newest first, `count` at most; raise JournalUnreadable, OSError."""
    with reading(journal) as reader:
        of_it = (
            job.job_id for job in _newest(reader) if job.terms is not None and job.terms.recipe["number"] == recipe
        )
        return tuple(islice((job_id for job_id in of_it if document_of(archive, job_id) is not None), count))


def _newest(reader: JournalReader) -> Iterator[Job]:
    """The journal's last jobs, newest first."""
    below = None
    for _ in range(MOST_LOOKED_AT // LOOKED_AT_ONCE):
        some = reader.jobs(JobFilter(below=below), LOOKED_AT_ONCE)
        yield from reversed(some)
        if not some:
            return
        below = some[0].job_id
