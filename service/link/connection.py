"""The connection to the controller: opened again after each loss, and what keeps it from working."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable

from drivers.controller import Controller, ControllerError

log = logging.getLogger("combtrace.link")

# The last one again and again: with 1 s for an attempt that meets nobody, back within 2 s of the controller's return.
RETRY_PAUSES_S = (0.1, 0.2, 0.5)
REMINDER_S = 60.0  # how often a loss that lasts is told again


class Connection:
    """One connection after the other. opened: how many so far; what was confirmed on one says nothing of the next.

    trouble: why no request works, as a sentence; None once the controller has answered a whole round.
    """

    def __init__(self, controller: Controller, *, on_lost: Callable[[], None], now: Callable[[], float]) -> None:
        """on_lost: told of each loss, and of each attempt in vain."""
        self._controller = controller
        self._on_lost = on_lost
        self._now = now
        self._up = asyncio.Event()
        self.opened = 0
        self.trouble: str | None = "not connected yet"
        self._served = False
        self._lost_at: float | None = None
        self._reminded_at = 0.0
        self._failing = ""

    def fault(self) -> str | None:
        """Why nothing can be sent over it now, as a sentence; None where the controller answers."""
        if self._up.is_set() and self.trouble is None:
            return None
        return self.trouble or "the connection was lost. It is being opened again"

    def found_lost(self) -> None:
        """Another's request has found out that it is gone: `wait` waits for the next one."""
        self._up.clear()

    async def wait(self) -> None:
        """Return when there is one."""
        await self._up.wait()

    async def keep(self, serve: Callable[[], Awaitable[None]]) -> None:
        """Connect and `serve` until that raises; after a loss again, for ever, with growing pauses."""
        failures = 0
        try:
            while True:
                try:
                    await self._controller.connect()
                    self.opened += 1
                    self._up.set()
                    await serve()
                except ControllerError as error:
                    # A connection alone is no success: there are those who answer it, and then no request.
                    failures = 0 if self._served else failures
                    self._lost(error)
                await asyncio.sleep(RETRY_PAUSES_S[min(failures, len(RETRY_PAUSES_S) - 1)])
                failures += 1
        finally:
            self._up.clear()
            await self._controller.close()

    def _lost(self, error: ControllerError) -> None:
        """Note why; one line of log from one success to the next, and one a minute, however often it is tried."""
        now = self._now()
        attempt = "request" if self._up.is_set() else "connection"
        if attempt != self._failing or self._lost_at is None or now - self._reminded_at >= REMINDER_S:
            # Else the reason stays: two ways in which nobody answers would take turns in log and state all night.
            self._failing, self.trouble = attempt, str(error)
        if self._lost_at is None:
            self._lost_at = self._reminded_at = now
            log.warning("link: the controller cannot be reached; it is tried again by itself: %s", error)
        elif now - self._reminded_at >= REMINDER_S:
            self._reminded_at = now
            log.warning("link: still not reached after %.0f s: %s", now - self._lost_at, error)
        else:
            log.debug("link: %s", error)
        self._up.clear()
        self._served = False
        self._on_lost()

    def serves(self) -> bool:
        """The controller answered a whole round, so what was wrong is over; True where something was."""
        if self._served:
            return False
        if self._lost_at is not None:
            log.info("link: the controller answers again, after %.1f s", self._now() - self._lost_at)
        self._served, self.trouble, self._lost_at = True, None, None
        return True
