"""The link to the controller: its parts put together, and what they say together.

Policy is here; one attempt is the driver's.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from drivers.controller import Controller, ControllerUnavailable
from drivers.controller.mailbox.blocks import LinkBlock, ServiceBlock
from service.link.connection import Connection
from service.link.controller_clock import Stamp
from service.link.job_numbers import JobNumbers
from service.link.ownership import WATCH_OWN_S
from service.link.poll_timer import PollTimer
from service.link.reading import LinkReading, LinkUnsteady, echo_fault
from service.link.writing import ServiceBlockWriting
from service.reasons import Reason

BEAT_DUE_S = 1.0  # within which the protocol wants the controller's heartbeat to change


@dataclass(frozen=True)
class LinkSettings:
    """How the link is kept.

    handshake: False is a controller that cannot answer: its block is not read.
    observe: nothing is ever written.
    """

    handshake: bool = True
    poll_period_s: float = 0.05
    heartbeat_timeout_s: float = 3.0
    observe: bool = False


class LinkListener:
    """What is told of a link; whoever listens says what it does then. This one does nothing."""

    def link_changed(self) -> None:
        """The controller's block shows something else, or the connection was lost or is back. Must not block."""

    async def service_block_found(self, found: ServiceBlock) -> None:
        """What stands in the service block at the start, whoever wrote it; it is overwritten after that."""


class Link:
    """Keeps one connection to the controller, reads its block, writes ours.

    connection, reading, writing, numbers: its parts; each says in its own file what it does.
    """

    def __init__(
        self,
        controller: Controller,
        settings: LinkSettings,
        *,
        feed_watchdog: Callable[[], None] = lambda: None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """feed_watchdog: called after each round or attempt, well or not."""
        self.controller = controller
        self.settings = settings
        self.feed_watchdog = feed_watchdog
        self._now = now
        self._listener = LinkListener()
        self.connection = Connection(controller, on_lost=self._lost, now=now)
        self.reading = LinkReading(controller, on_change=self._changed, now=now)
        self._timer = PollTimer(
            settings.poll_period_s, poll_in_place=self._poll_in_place, out_of_step=self._beat_is_overdue
        )
        self.writing = ServiceBlockWriting(
            controller,
            self.reading,
            handshake=settings.handshake,
            on_found=self._found,
            on_publish=self._timer.wake,
            now=now,
        )
        self.ownership = self.writing.ownership
        self.numbers = JobNumbers(self.reading, self.writing)
        self._well_or_failed = False
        self._since: float | None = None

    def listen(self, listener: LinkListener) -> None:
        """Tell `listener` from now on, and nobody else."""
        self._listener = listener

    def _changed(self) -> None:
        self._listener.link_changed()

    async def _found(self, found: ServiceBlock) -> None:
        await self._listener.service_block_found(found)

    # --- what it says -------------------------------------------------------------------------------------------

    @property
    def starting(self) -> bool:
        """True until the link was well or failed for the first time, or that takes too long."""
        if self._well_or_failed or self._since is None or self.ownership.conflict:
            return not (self._well_or_failed or self.ownership.conflict)
        return self._now() - self._since < self.settings.heartbeat_timeout_s + WATCH_OWN_S

    def fault(self) -> str | None:
        """Why nothing can be sent now, as a sentence; None when contours can be sent."""
        fault = self.connection.fault() or self._fault()
        self._well_or_failed = self._well_or_failed or fault is None
        return fault

    def _fault(self) -> str | None:
        """The same of a controller that answers."""
        owned = None if self.settings.observe else self.ownership.fault()
        if owned is not None or not self.settings.handshake:
            return owned
        view = self.view
        if view is None or view.session == 0:
            return self.reading.unsteady or "the controller's program is starting (session 0)"
        # What is observed echoes what we never wrote, and numbers nothing of ours.
        of_ours = None if self.settings.observe else echo_fault(view) or self.numbers.fault()
        silent = self.reading.beat_fault(self.settings.heartbeat_timeout_s)
        return silent or of_ours or self.reading.clock.fault(view.session)

    @property
    def fault_reason(self) -> Reason:
        """The code that goes with `fault`."""
        other = self.connection.trouble is None and self.ownership.foreign
        return Reason.OTHER_SERVICE if other else Reason.CONTROLLER_LOST

    def controller_not_ready(self) -> str | None:
        """Why the controller would not take a contour at this moment; None where it would."""
        fault = self.fault()
        if fault is not None or not self.settings.handshake or self.settings.observe:
            return fault
        if (doubt := self.numbers.in_doubt()) is not None:
            return doubt
        assert self.view is not None
        states = {0: "not ready", 2: "busy", 3: "in fault"}
        state = self.view.controller_state
        return None if state == 1 else f"the controller is {states.get(state, f'in unknown state {state}')}"

    def stamp(self) -> Stamp | None:
        """Session and clock as last read, None where the reading does not count (no session, or the clock jumped)."""
        if not self.settings.handshake:
            return Stamp(0, 0)
        view = self.view
        return None if view is None or view.session == 0 else self.reading.clock.stamp(view.session)

    @property
    def view(self) -> LinkBlock | None:
        """The controller's block as two reads in a row showed it, None while there is none to act on."""
        return self.reading.view

    async def look(self) -> LinkBlock:
        """The controller's block, as two reads in a row show it; raise ControllerError."""
        return await self.reading.look()

    # --- what it is told ----------------------------------------------------------------------------------------

    def publish(self, **changes: Any) -> None:
        """Change fields of the service block; it is written at once, whole."""
        self.writing.publish(**changes)

    @property
    def published(self) -> ServiceBlock:
        """The service block as it stands, or will stand with the next write."""
        return self.writing.published

    async def flush(self, timeout_s: float) -> bool:
        """Wait until the last `publish` was confirmed by the controller; False where that took too long."""
        return self.settings.observe or await self.writing.flush(timeout_s)  # an observer writes nothing

    def confirm(self) -> list[str]:
        """A person's word for what this link waits for with: what that was, as sentences."""
        said = []
        if self.ownership.conflict:
            said.append("the controller is watched anew, and written to if no other service is seen")
            self.ownership.begin()
        if (number := self.numbers.confirm()) is not None:
            said.append(number)
        self._timer.wake()
        return said

    # --- the loop -----------------------------------------------------------------------------------------------

    async def wait_connected(self) -> None:
        """Return when there is a connection; ask for one where there is none."""
        if not self.controller.connected:
            self.connection.found_lost()
            self._timer.wake()
        await self.connection.wait()

    async def run(self) -> None:
        """Keep the link for ever: connect, poll, beat; after a loss again, with growing pauses."""
        self._since = self._now()
        await self.connection.keep(self._serve)

    async def _serve(self) -> None:
        self.reading.begin()
        self.writing.begin()
        while True:
            if not self.controller.connected:  # another's request has found it out
                raise ControllerUnavailable("the connection was lost. It is being opened again")
            if self.settings.handshake:
                with suppress(LinkUnsteady):  # told by `fault`; our heartbeat goes on
                    await self.look()
            if self._must_write():
                await self.writing.keep()
            if self.connection.serves():
                self._changed()
            self.feed_watchdog()
            await self._timer.pause()

    def _lost(self) -> None:
        self.reading.forget()
        self.ownership.disconnected()
        self._well_or_failed = True
        self._changed()
        self.feed_watchdog()

    def _must_write(self) -> bool:
        return not self.settings.observe and self.writing.due

    def _beat_is_overdue(self) -> bool:
        limit_s = min(BEAT_DUE_S, self.settings.heartbeat_timeout_s / 2)
        return self.settings.handshake and self.reading.silent_s > limit_s

    def _poll_in_place(self) -> bool:
        """True where nothing is to be written and the controller's block, read now, shows what it showed."""
        if not self.settings.handshake or self._must_write() or not self.reading.shows_nothing_new():
            return False
        self.feed_watchdog()
        return True
