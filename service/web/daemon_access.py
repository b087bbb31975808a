"""What the page sees of the daemon and may ask of it. The page has a thread and a loop of its own: calls cross here.

Looking reads what the daemon keeps anyway; asking runs in the daemon's loop, in its turn. Nothing in the daemon waits
for the page.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from service.config.config import Config
from service.config.recipes import Recipe
from service.daemon.operations import Operations
from service.daemon.recipe_book import RecipeBook
from service.daemon.storage_watch import StorageWatch
from service.jobs.executor import Executor
from service.jobs.health import Health
from service.jobs.spare_camera import LookSources
from service.jobs.trigger_queue import Queued
from service.link.link import Link
from service.measuring.calibration_guard import CalibrationGuard
from service.probing.probe import ProbeFindings
from service.records.archive_writer import ArchiveWriter
from service.records.job import Job, TriggerStamp
from service.records.journal import Journal
from service.state import State
from service.web.people.lease import Lease

T = TypeVar("T")

ANSWER_BOUND_S = 10.0
PROBE_BOUND_S = 600.0
TRIGGER_KIND = "page"


class DaemonSilent(Exception):
    """The daemon's loop does not answer, or has ended."""


@dataclass(frozen=True)
class CommissionSources:
    """What setting up a cell takes. folder: for its notes and pictures. path: of the configuration's file, None where
    the daemon has none. reload: the files that the configuration names are read again; why not, else None. probe: of
    the controller, None where there is none; whether to write too.
    """

    folder: Path
    config: Callable[[], Config]
    path: Path | None
    reload: Callable[[], Awaitable[str | None]]
    probe: Callable[[bool], Awaitable[ProbeFindings]] | None


@dataclass(frozen=True)
class PageSources:
    """The daemon's parts; None where it has no such part."""

    health: Health
    executor: Executor
    journal: Journal
    journal_path: Path
    archive_path: Path
    archive_max_bytes: int
    recipes: Callable[[], tuple[tuple[int, str], ...]]  # number and name of each, as they are now
    guard: Callable[[], CalibrationGuard | None]
    looks: LookSources
    commission: CommissionSources
    camera: str
    controller: str
    link: Link | None = None
    archive: ArchiveWriter | None = None
    storage: StorageWatch | None = None
    book: RecipeBook | None = None


class DaemonAccess:
    """The daemon as the page sees it; `open` is called in the daemon's loop, before anything else."""

    def __init__(self, sources: PageSources) -> None:
        self.sources = sources
        self._loop: asyncio.AbstractEventLoop | None = None
        self._operations: Operations | None = None
        self._outcomes: Counter[tuple[str, str]] = Counter()
        self.lease = Lease()
        self.on_change: Callable[[], None] = lambda: None  # told of every change in the daemon's loop; must not block

    def open(self, operations: Operations) -> None:
        """Begin to look; in the daemon's loop."""
        if self._loop is None:
            self.sources.health.listen(self._changed)
            self.sources.executor.on_settled.append(self._settled)
        self._loop = asyncio.get_running_loop()
        self._operations = operations

    def _changed(self, _state: State, _reason: str | None) -> None:
        self.on_change()

    def _settled(self, job: Job) -> None:
        self._outcomes[str(job.outcome), "" if job.reason is None else job.reason.label] += 1
        self.on_change()

    # --- looking ------------------------------------------------------------------------------------------------

    async def state(self) -> dict[str, Any]:
        """All that is known now: what `combtrace status` tells, and what belongs beside it; raise DaemonSilent."""
        return await self._asked(self._state())

    async def _state(self) -> dict[str, Any]:
        """In the daemon's loop, so that all of it is of one moment."""
        assert self._operations is not None
        status = await self._operations.status({}, "page")
        outcomes = sorted(self._outcomes.items())
        return {
            **status,
            "outcomes": [
                {"outcome": outcome, "reason": reason or None, "count": count} for (outcome, reason), count in outcomes
            ],
            "recipes": [{"number": number, "name": name} for number, name in self.sources.recipes()],
            "camera": {"what": self.sources.camera, "up": "camera" not in status["faults"]},
            "link": self._link(),
            "calibration": self._calibration(),
            "disk": self._disk(),
            "lease": self.lease.told(),
        }

    def _link(self) -> dict[str, Any] | None:
        link = self.sources.link
        if link is None:
            return None
        round_trip_s = link.reading.round_trip_s
        return {
            "what": self.sources.controller,
            "up": link.fault() is None,
            "not_ready": link.controller_not_ready(),
            "round_trip_ms": None if round_trip_s is None else round(round_trip_s * 1000, 1),
            "connections": link.connection.opened,
        }

    def _calibration(self) -> dict[str, Any] | None:
        guard = self.sources.guard()
        if guard is None:
            return None
        age_days = guard.age_days
        return {
            "digest": guard.record.digest,
            "age_days": None if age_days is None else round(age_days, 2),
            "max_age_days": guard.limits.max_age_days,
        }

    def _disk(self) -> dict[str, Any]:
        storage, archive = self.sources.storage, self.sources.archive
        figures = None if archive is None else archive.figures
        return {
            "journal_free_bytes": None if storage is None else storage.free_bytes,
            "archive_bytes": 0 if figures is None else figures.bytes,
            "archive_max_bytes": self.sources.archive_max_bytes,
            "archive_jobs": 0 if figures is None else figures.jobs,
        }

    # --- asking -------------------------------------------------------------------------------------------------

    async def trigger(self, recipe: int, thickness_um: int) -> int | None:
        """The job that was taken, None where it waits for its turn; raise TriggerRefused, DaemonSilent."""
        return await self._asked(self._trigger(TriggerStamp(TRIGGER_KIND, recipe, thickness_um)))

    async def _trigger(self, stamp: TriggerStamp) -> int | None:
        taken = await self.sources.executor.ask(stamp)
        return None if isinstance(taken, Queued) else taken.job.job_id

    async def halt(self, who: str, reason: str) -> str:
        """The state after a halt; raise CommandRefused, DaemonSilent."""
        assert self._operations is not None
        return str((await self._asked(self._operations.halt({"reason": reason}, who)))["state"])

    async def resume(self, who: str) -> str:
        """The state after a halt's end; raise CommandRefused, DaemonSilent."""
        assert self._operations is not None
        return str((await self._asked(self._operations.resume({}, who)))["state"])

    async def adopt(self, book: RecipeBook, expected: Recipe, recipe: Recipe, who: str, note: str) -> tuple[int, str]:
        """The adoption's number, and from which job on; raise CommandRefused, DaemonSilent."""
        return await self._asked(book.adopt(expected, recipe, who, note))

    async def reload(self) -> str | None:
        """Why the files that the configuration names do not apply, None where they do; raise DaemonSilent."""

        async def work() -> str | None:
            return await self.sources.commission.reload()

        return await self._asked(work())

    async def probe(self, write: bool) -> ProbeFindings:
        """What the controller can do, while the service leaves it alone; raise CommandRefused, DaemonSilent."""

        async def work() -> ProbeFindings:
            assert self._operations is not None
            assert self.sources.commission.probe is not None
            return await self._operations.alone_with_the_controller(self.sources.commission.probe(write))

        return await self._asked(work(), PROBE_BOUND_S)

    async def _asked(self, work: Coroutine[Any, Any, T], bound_s: float = ANSWER_BOUND_S) -> T:
        return await answered(self._loop, work, bound_s)


async def answered(
    loop: asyncio.AbstractEventLoop | None, work: Coroutine[Any, Any, T], bound_s: float = ANSWER_BOUND_S
) -> T:
    """What `work` gives in the daemon's loop, asked from another; raise DaemonSilent.

    Once begun it comes to its end there, whoever goes away here.
    """
    if loop is None or loop.is_closed():
        work.close()
        raise DaemonSilent("the service has ended")
    answer = asyncio.wrap_future(asyncio.run_coroutine_threadsafe(work, loop))
    try:
        async with asyncio.timeout(bound_s):
            return await asyncio.shield(answer)
    except TimeoutError as error:
        raise DaemonSilent(f"the service has not answered for {bound_s:g} s. See its log") from error
