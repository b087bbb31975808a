"""The service's state as server-sent events: one look for all viewers, the newest only, nobody waited for."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable

from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from service.web.daemon_access import DaemonAccess, DaemonSilent
from service.web.models import ServiceState

log = logging.getLogger("combtrace.page")

PERIOD_S = 1.0  # a viewer that hears nothing for some of these says that the connection is lost
LEAST_GAP_S = 0.2  # between two looks, however fast jobs follow one another; and from a change to its look
MOST_VIEWERS = 16
STALLED_S = 10.0  # a viewer who does not read that long is let go


class Live:
    """Looks while somebody watches. All in the page's loop, but for `close`."""

    def __init__(self, daemon: DaemonAccess, *, period_s: float = PERIOD_S) -> None:
        self._daemon = daemon
        self._period_s = period_s
        self._viewers = 0
        self._latest = b""
        self._news = asyncio.Event()  # replaced by each look
        self._nudge = asyncio.Event()
        self._looking: asyncio.Task[None] | None = None
        self._closed = False
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def watched(self) -> bool:
        """True where anybody watches; from any thread."""
        return self._viewers > 0 and not self._closed

    def look_soon(self) -> None:
        """Something is new; from any thread."""
        if self._loop is not None:
            _from_elsewhere(self._loop, self._nudge)

    @property
    def full(self) -> bool:
        """True where no more viewers are taken."""
        return self._viewers >= MOST_VIEWERS or self._closed

    def close(self) -> None:
        """Let all viewers go; from any thread."""
        self._closed = True
        self._daemon.on_change = lambda: None

    async def watch(self, show: Callable[[bytes], Awaitable[None]]) -> None:
        """Have each new state shown, as long as `show` takes it in time."""
        self._viewers += 1
        if self._looking is None:
            self._loop = asyncio.get_running_loop()
            self._daemon.on_change = self.look_soon
            self._looking = asyncio.create_task(self._look())
        try:
            shown = self._latest  # which may be a second old: a look is due at once
            self._nudge.set()
            while not self._closed:
                if self._latest is shown:
                    await self._news.wait()
                    continue
                shown = self._latest
                async with asyncio.timeout(STALLED_S):
                    await show(shown)
        except TimeoutError:
            log.info("page: a viewer does not read and is let go")
        finally:
            self._viewers -= 1

    async def _look(self) -> None:
        """Look soon after a change, else each period; end with the last viewer."""
        while self._viewers and not self._closed:
            self._nudge.clear()
            try:
                state = ServiceState.model_validate(await self._daemon.state())
            except DaemonSilent as silent:
                log.debug("page: %s", silent)
            else:
                self._latest = b"data: " + state.model_dump_json().encode() + b"\n\n"
                self._tell()
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(self._period_s - LEAST_GAP_S):
                    await self._nudge.wait()
            await asyncio.sleep(LEAST_GAP_S)  # after a change, not before: a job that begins has the processor first
        self._looking = None
        self._tell()

    def _tell(self) -> None:
        """Wake all who wait; the next wait is for the next news."""
        self._news.set()
        self._news = asyncio.Event()


def _from_elsewhere(loop: asyncio.AbstractEventLoop, nudge: asyncio.Event) -> None:
    with contextlib.suppress(RuntimeError):  # the page's loop has ended
        loop.call_soon_threadsafe(nudge.set)


class EventStream(Response):
    """The answer that does not end. What the viewer has not read when a newer state comes is not sent."""

    media_type = "text/event-stream"

    def __init__(self, live: Live) -> None:
        super().__init__(headers={"cache-control": "no-store"})
        del self.headers["content-length"]
        self._live = live

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send states until the viewer goes."""
        await send({"type": "http.response.start", "status": 200, "headers": self.raw_headers})

        async def show(event: bytes) -> None:
            await send({"type": "http.response.body", "body": event, "more_body": True})

        watching = asyncio.ensure_future(self._live.watch(show))
        leaving = asyncio.ensure_future(_left(receive))
        try:
            await asyncio.wait([watching, leaving], return_when=asyncio.FIRST_COMPLETED)
        finally:
            watching.cancel()
            leaving.cancel()
            await asyncio.gather(watching, leaving, return_exceptions=True)
        with contextlib.suppress(OSError):
            await send({"type": "http.response.body", "body": b"", "more_body": False})


async def _left(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass
