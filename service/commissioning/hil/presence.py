"""A service on a controller, alone there and alive, for as long as a test takes."""

from __future__ import annotations

import asyncio
import secrets
import time
from contextlib import suppress
from dataclasses import replace

from drivers.controller import Controller, ControllerError, ControllerRefused, ControllerUnavailable, ServiceBlock
from service.link.ownership import WATCH_S

HEARTBEAT_S = 0.4
STARTED_S = 5.0
RETRY_S = 0.2
LOOK_S = 0.02
READY = 5


class HilError(Exception):
    """The controller cannot be tested: seen, expected, next step."""


class Presence:
    """Connection, owner and heartbeat, in an event loop.

    block: as it is written next. trouble: what ended the heartbeat. highest_job: of those that stood in the service
    block when it came.
    """

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.block = ServiceBlock(service_state=READY, owner=1 + secrets.randbelow(0xFFFF))
        self.trouble: ControllerUnavailable | HilError | None = None
        self.highest_job = 0
        self._beating: asyncio.Task[None] | None = None

    async def begin(self) -> None:
        """Connect, and write the service block from now on; raise ControllerError, HilError."""
        await self.controller.connect()
        await self._watch_owner()
        await self._serve()

    async def again(self, timeout_s: float) -> None:
        """Connect anew, as soon as the controller is there; raise ControllerError, HilError."""
        await self._stop_beating()
        give_up_at = time.monotonic() + timeout_s
        while True:
            try:
                await self.controller.connect()
                await self._check_owner()
                await self._serve()
                return
            except ControllerError:
                await self._stop_beating()
                if time.monotonic() >= give_up_at:
                    raise
            await asyncio.sleep(RETRY_S)

    async def _serve(self) -> None:
        """Write the service block from now on; return when the controller's program runs."""
        await self.controller.write_service(self.block)
        self._beating = asyncio.create_task(self._beat_for_ever())
        give_up_at = time.monotonic() + STARTED_S
        while (await self.controller.read_link()).session == 0:
            if time.monotonic() >= give_up_at:
                raise HilError(f"session is 0 for {STARTED_S:g} s: the program does not start. Check link_address")
            await asyncio.sleep(LOOK_S)

    async def _watch_owner(self) -> None:
        """Raise HilError where another service lives; what a dead one left behind is taken over."""
        block = await self.controller.read_service()
        self.highest_job = max(block.job_id, block.settled_job)
        if block.owner == 0:
            return
        await asyncio.sleep(WATCH_S)
        after = await self.controller.read_service()
        if after.service_heartbeat != block.service_heartbeat:
            raise HilError(f"another service (owner {after.owner}) writes to this controller. Stop it before the test")

    async def _check_owner(self) -> None:
        """Raise HilError where another service has written: nothing is written over it."""
        found = await self.controller.read_service()
        if found.owner not in (0, self.block.owner):
            raise HilError(f"another service (owner {found.owner}) came meanwhile. Stop it before the test")

    async def beat(self) -> None:
        """Write the service block with its next heartbeat."""
        await self._check_owner()
        self.block = replace(self.block, service_heartbeat=(self.block.service_heartbeat + 1) & 0xFFFF)
        await self.controller.write_service(self.block)

    async def _beat_for_ever(self) -> None:
        try:
            while True:
                with suppress(ControllerRefused):  # busy for once; one that always refuses is told by `publish`
                    await self.beat()
                await asyncio.sleep(HEARTBEAT_S)
        except (ControllerUnavailable, HilError) as error:
            self.trouble = error

    async def _stop_beating(self) -> None:
        if self._beating is not None:
            self._beating.cancel()
            with suppress(asyncio.CancelledError):
                await self._beating

    async def end(self) -> None:
        """Stop the heartbeat, and close the connection."""
        await self._stop_beating()
        await self.controller.close()
