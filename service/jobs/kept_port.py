"""A serial port that comes and goes, kept open for whoever serves it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from concurrent.futures import Executor as ThreadPool
from typing import Protocol, TypeVar

from drivers.trigger import TriggerUnavailable
from service.jobs.health import Fault, Health
from service.reasons import Reason

log = logging.getLogger("combtrace.triggers")

READ_TIMEOUT_S = 0.25  # how long a stop waits for the thread that reads
RETRY_PAUSES_S = (0.2, 0.5, 1.0)

T = TypeVar("T")


class Port(Protocol):
    """What all serial triggers can: open, also while open, and close."""

    def open(self) -> None:
        """Open it; raise TriggerUnavailable."""

    def close(self) -> None:
        """Let it go; never raises."""


class KeptPort:
    """A serial port that is served for ever; while it is away its fault is told, and it is opened again."""

    def __init__(
        self,
        port: Port,
        name: str,
        health: Health,
        pool: ThreadPool,
        *,
        feed_watchdog: Callable[[], None] = lambda: None,
    ) -> None:
        """pool: in which it is opened and listened to."""
        self._port = port
        self.name = name
        self._health = health
        self._pool = pool
        self.feed_watchdog = feed_watchdog

    async def listen(self, call: Callable[[float], T]) -> T:
        """What is heard within a moment by `call`, which blocks."""
        self.feed_watchdog()
        return await asyncio.get_running_loop().run_in_executor(self._pool, call, READ_TIMEOUT_S)

    async def serve(self, call: Callable[[float], T], serve: Callable[[T], Awaitable[None]]) -> None:
        """Keep it open with growing pauses, listening by `call`.

        serve: gets what was heard first, and goes on until the port is lost.
        """
        part = f"serial {self.name}"
        failures = 0
        try:
            while True:
                try:
                    await asyncio.get_running_loop().run_in_executor(self._pool, self._port.open)
                    heard = await self.listen(call)  # a port that opens and then cannot be read is not back
                    if failures:
                        log.info("serial %s: is back", self.name)
                    failures = 0
                    self._health.report(part, None)
                    await serve(heard)
                except TriggerUnavailable as error:
                    if failures == 0:
                        log.warning("serial: %s", error)
                    self._health.report(part, Fault(Reason.NOT_READY, str(error)))
                    self._port.close()
                    await asyncio.sleep(RETRY_PAUSES_S[min(failures, len(RETRY_PAUSES_S) - 1)])
                    failures += 1
        finally:
            self._port.close()
