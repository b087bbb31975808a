"""The service block as it is written: at each change and each heartbeat, whole, and only while it is ours."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Awaitable, Callable
from dataclasses import replace
from typing import Any

from drivers.controller import Controller
from drivers.controller.mailbox.blocks import ServiceBlock
from service.link.ownership import Ownership
from service.link.reading import LinkReading

HEARTBEAT_PERIOD_S = 0.5  # the protocol wants a change at least once a second
HEARTBEATS = 1 << 16


class ServiceBlockWriting:
    """Keeps the service block at the controller as it was last published. ownership: whether it may be written."""

    def __init__(
        self,
        controller: Controller,
        reading: LinkReading,
        *,
        handshake: bool,
        on_found: Callable[[ServiceBlock], Awaitable[None]],
        on_publish: Callable[[], None],
        now: Callable[[], float],
    ) -> None:
        """on_found: told what stands there at the start, before it is overwritten. on_publish: told of each change."""
        self._controller = controller
        self._reading = reading
        self._handshake = handshake
        self._on_found = on_found
        self._on_publish = on_publish
        self._now = now
        self.ownership = Ownership(0, now=now)
        self.published = ServiceBlock(service_heartbeat=secrets.randbelow(HEARTBEATS))
        # Of two services with one number none falls into the other's step: each sees what it did not write.
        self._beat_step = 2 * secrets.randbelow(HEARTBEATS // 2) + 1
        self._dirty = True
        self._written = asyncio.Event()
        self._written_at_s = -1e9
        self._session = 0  # of the controller, in which the block was last written

    def begin(self) -> None:
        """A connection is there: what was written on the one before may be lost."""
        self.ownership.disconnected()
        self._dirty = True

    def publish(self, **changes: Any) -> None:
        """Change fields of the block."""
        block = replace(self.published, **changes)
        self.ownership.owner = block.owner
        if block != self.published:
            self.published = block
            self._dirty = True
            self._written.clear()
            self._on_publish()

    async def flush(self, timeout_s: float) -> bool:
        """Wait until the last `publish` was confirmed by the controller; False where that took too long."""
        if not self._dirty:
            return True
        try:
            async with asyncio.timeout(timeout_s):
                await self._written.wait()
        except TimeoutError:
            return False
        return True

    @property
    def due(self) -> bool:
        """True where a change, the heartbeat or the ownership asks for a look at the block."""
        if self.ownership.conflict:
            return False
        # On a slow line as much earlier as requests take there, else a change would come later than it must.
        ahead_s = min(self._reading.round_trip_s or 0.0, HEARTBEAT_PERIOD_S / 2)
        due = self._now() - self._written_at_s >= HEARTBEAT_PERIOD_S - ahead_s
        return self._dirty or due or not self.ownership.decided

    async def keep(self) -> None:
        """Read what stands there, and write the block where it is ours; raise ControllerError."""
        found = await self._controller.read_service()
        view = self._reading.view
        session = view.session if view is not None else self._session
        if session != self._session:
            self.ownership.controller_restarted()
        if not self.ownership.saw(found):
            return
        if not self.ownership.begun:
            if self._handshake and not session and found.owner:
                return  # in which session its job is to be taken back is not known: go on watching
            await self._on_found(found)
            if await self._controller.read_service() != found:  # making that durable may have taken long
                return
        await self._write()
        self._session = session

    async def _write(self) -> None:
        beat = (self.published.service_heartbeat + self._beat_step) % HEARTBEATS
        writing = self.published = replace(self.published, service_heartbeat=beat)
        self.ownership.writing(beat)
        await self._controller.write_service(writing)
        self.ownership.wrote()
        self._written_at_s = self._now()
        if writing is self.published:  # nothing was published while it was on its way
            self._dirty = False
            self._written.set()
