"""Whether `session` changes when the controller's program starts anew, watched while a person restarts it."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable

from drivers.controller import ControllerError, ControllerUnavailable, LinkBlock
from drivers.controller.modbus.client import ModbusController

RESTART_WAIT_S = 180.0
LOOK_S = 0.05
CONVINCED = 3  # changes of the heartbeat after the restart


class RestartWatch:
    """One restart of the controller, from `begin`, with the program running, to `end`."""

    def __init__(
        self,
        controller: ModbusController,
        *,
        sleep: Callable[[float], Awaitable[None]] = asyncio.sleep,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._controller = controller
        self._sleep = sleep
        self._now = now
        self._before = LinkBlock()

    async def begin(self) -> int:
        """The session before; raise ControllerUnavailable where there is none."""
        link = await self._look()
        if link is None or not link.session:
            raise ControllerUnavailable("the controller shows no session: its program does not run. Start it first")
        self._before = link
        return link.session

    async def end(self) -> tuple[bool, str]:
        """Whether all is well, and a sentence of what was seen; at the restart, or after `RESTART_WAIT_S`."""
        before, sign, beats = self._before, "", set[int]()
        until = self._now() + RESTART_WAIT_S
        while self._now() < until:
            link = await self._look()
            if link is None:
                sign = "it could not be reached for a while"
            elif link.session == 0:
                sign = "it was 0 for a while"
            elif link.session != before.session:
                return True, f"{link.session} after the restart, {before.session} before. {self._memory(link)}"
            elif sign or link.clock < before.clock:
                beats.add(link.controller_heartbeat)
            else:
                beats.clear()  # the clock was but half written
            if len(beats) > CONVINCED:
                text = f"still {before.session} after the restart ({sign or 'the clock began anew'})"
                return False, f"{text}. Let each start set another, from a retained counter or a real-time clock"
            await self._sleep(LOOK_S)
        return False, f"no restart was seen in {RESTART_WAIT_S:g} s: it is {before.session} as before"

    def _memory(self, link: LinkBlock) -> str:
        kept = (link.last_job, link.last_result) == (self._before.last_job, self._before.last_result)
        if not self._before.last_job:
            return "There was no last_job to retain"
        return "last_job is retained" if kept else f"last_job was {self._before.last_job} and is {link.last_job}: lost"

    async def _look(self) -> LinkBlock | None:
        try:
            if not self._controller.connected:
                await self._controller.connect()
            return await self._controller.read_link()
        except ControllerError:
            return None
