"""Keeps the daemon's parts running: each is started again after it failed, with growing pauses, and its error is kept.

A part is a coroutine that runs for ever. What a part expects to go wrong it handles itself; what reaches this place is
a defect, and a service that must run unattended goes on all the same, in Error, and says so.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TypeVar

from service.jobs.health import Fault, Health
from service.reasons import Reason

log = logging.getLogger("combtrace.supervisor")

RESTART_PAUSES_S = (0.1, 0.5, 2.0, 10.0, 30.0)
SOUND_AFTER_S = 2.0  # a part that has run so long again is no fault any more
FORGIVEN_AFTER_S = 300.0  # and after that the pauses begin anew
SIGN_OF_LIFE_S = 1.0  # of a part that rests

T = TypeVar("T")


@dataclass(frozen=True)
class PartReport:
    """How often a part was started again, and its last error with the time of it."""

    name: str
    restarts: int
    last_error: str | None
    failed_at: str | None


@dataclass
class Part:
    """A part as it is kept: how often it was started again, and its last error with the time of it."""

    name: str
    run: Callable[[], Awaitable[None]]
    restarts: int = 0
    last_error: str | None = None
    failed_at: str | None = None
    failures: int = field(default=0, repr=False)
    task: asyncio.Future[None] | None = field(default=None, repr=False)
    rests: bool = field(default=False, repr=False)


class Supervisor:
    """Runs parts in one task group. A failed part is a fault of the service until it runs again."""

    def __init__(self, health: Health, *, feed_watchdog: Callable[[str], None] = lambda _name: None) -> None:
        """feed_watchdog: told of each start of a part, which is a sign of its life."""
        self._health = health
        self._feed_watchdog = feed_watchdog
        self.parts: list[Part] = []

    def add(self, name: str, run: Callable[[], Awaitable[None]]) -> None:
        """Keep a part; before `run`."""
        self.parts.append(Part(name, run))

    async def run(self) -> None:
        """Keep all parts, for ever."""
        async with asyncio.TaskGroup() as group:
            for part in self.parts:
                group.create_task(self._keep(part), name=part.name)

    def kept(self) -> tuple[PartReport, ...]:
        """How each part fared."""
        return tuple(PartReport(part.name, part.restarts, part.last_error, part.failed_at) for part in self.parts)

    def restart(self, *, but: str = "") -> None:
        """Start all parts anew, those too that wait for their next attempt. but: the one that asks for it."""
        for part in self.parts:
            if part.name == but:
                continue
            part.failures = 0
            if part.task is not None:
                part.task.cancel()

    async def without(self, name: str, work: Awaitable[T]) -> T:
        """What `work` gives while a part has ended, to begin anew after it."""
        part = next(one for one in self.parts if one.name == name)
        part.rests = True
        try:
            if part.task is not None:
                part.task.cancel()
                await asyncio.wait([part.task])
            return await work
        finally:
            part.rests = False

    async def _keep(self, part: Part) -> None:
        while True:
            if part.rests:
                self._feed_watchdog(part.name)
                await asyncio.sleep(SIGN_OF_LIFE_S)
                continue
            error = await self._run_once(part)
            if error is None:
                continue
            part.restarts += 1
            part.last_error, part.failed_at = error, datetime.now(UTC).isoformat(timespec="seconds")
            pause_s = RESTART_PAUSES_S[min(part.failures, len(RESTART_PAUSES_S) - 1)]
            part.failures += 1
            text = f"part {part.name} has failed and is started again in {pause_s:g} s: {error}"
            self._health.report(f"part {part.name}", Fault(Reason.INTERNAL_ERROR, text))
            self._feed_watchdog(part.name)
            await self._until_cancelled_or_done(part, asyncio.sleep(pause_s))

    async def _run_once(self, part: Part) -> str | None:
        """Run a part until it fails: its error; None where it was asked to start anew."""
        self._feed_watchdog(part.name)
        loop = asyncio.get_running_loop()
        sound = loop.call_later(SOUND_AFTER_S, self._health.report, f"part {part.name}", None)
        begun = loop.time()
        try:
            await self._until_cancelled_or_done(part, part.run())
        except Exception as error:  # the owner of defects in parts: the service outlives them, and tells
            log.exception("part %s has failed", part.name)
            if loop.time() - begun >= FORGIVEN_AFTER_S:
                part.failures = 0
            return f"{type(error).__name__}: {error}"
        finally:
            sound.cancel()
        assert part.task is not None
        return None if part.task.cancelled() else "it ended, expected it to run for ever"

    @staticmethod
    async def _until_cancelled_or_done(part: Part, work: Awaitable[None]) -> None:
        """Wait for `work`, which `restart` may cancel without cancelling us; raise what it raises."""
        part.task = asyncio.ensure_future(work)
        try:
            await asyncio.wait([part.task])
        except asyncio.CancelledError:
            part.task.cancel()
            await asyncio.wait([part.task])
            raise
        if not part.task.cancelled():
            part.task.result()
