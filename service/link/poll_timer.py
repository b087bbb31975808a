"""When the link looks again: at the common moments of the poll period, or as soon as something is to be written."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from service.poll_timing import off_beat, until_beat


class PollTimer:
    """The pause between two rounds of the link's task."""

    def __init__(self, period_s: float, *, poll_in_place: Callable[[], bool], out_of_step: Callable[[], bool]) -> None:
        """poll_in_place: True where that found nothing to do. out_of_step: True while looks must not come evenly."""
        self._period_s = period_s
        self._poll_in_place = poll_in_place
        self._out_of_step = out_of_step
        self._wake = asyncio.Event()
        self._timer: asyncio.TimerHandle
        self._turn = 0

    def wake(self) -> None:
        """End the pause, or keep the next one from beginning."""
        self._wake.set()

    async def pause(self) -> None:
        """Wait until woken, or until a moment of the poll period finds something to do."""
        self._set()
        try:
            await self._wake.wait()
        finally:
            self._timer.cancel()
        self._wake.clear()

    def _set(self) -> None:
        loop = asyncio.get_running_loop()
        pause_s = until_beat(loop.time(), self._period_s)
        if self._out_of_step():
            # A heartbeat of one bit that changes an even number of times from look to look seems to stand still.
            self._turn += 1
            pause_s = off_beat(self._turn) * self._period_s
        self._timer = loop.call_later(pause_s, self._ended)

    def _ended(self) -> None:
        """Poll in place where the controller lets us: at rest, waking the task each time costs more than the poll."""
        if self._poll_in_place():
            self._set()
        else:
            self._wake.set()
