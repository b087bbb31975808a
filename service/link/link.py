"""The link to the controller: connection, heartbeats, polling, and what its block says.

Policy is here; one attempt is the driver's.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from operator import attrgetter
from typing import Any

from drivers.controller import Controller, ControllerError, ControllerUnavailable
from drivers.controller.mailbox.mailbox import LinkBlock, ServiceBlock
from service.link.controller_clock import BEATS_TO_HOLD, ControllerClock, Stamp
from service.link.ownership import WATCH_OWN_S, Ownership
from service.poll_timing import off_beat, until_beat
from service.reasons import Reason

log = logging.getLogger("combtrace.link")

# The last one again and again: with 1 s for an attempt that meets nobody, back within 2 s of the controller's return.
RETRY_PAUSES_S = (0.1, 0.2, 0.5)
HEARTBEAT_PERIOD_S = 0.5  # the protocol wants a change at least once a second
BEAT_DUE_S = 1.0  # within which the protocol wants the controller's heartbeat to change
REMINDER_S = 60.0  # how often a loss that lasts is told again
READS_FOR_TWO_ALIKE = 20
LARGEST_JOB = (1 << 32) - 1
LARGEST_STEP = 1_000_000  # protocol: a last_job further above all that is known is a fault of the controller
HEARTBEATS = 1 << 16
STEADY_FIELDS = attrgetter(
    *(field.name for field in fields(LinkBlock) if field.name not in ("controller_heartbeat", "clock", "test_echo"))
)


class LinkUnsteady(ControllerError):
    """The controller's block did not show the same content twice in a row."""


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


async def _nothing(_block: ServiceBlock) -> None:
    return


def steady(block: LinkBlock) -> tuple[int, ...]:
    """The part of a block that two reads in a row must show alike: all but heartbeat, clock and test echo."""
    return STEADY_FIELDS(block)


class Link:
    """Keeps one connection to the controller, reads its block, writes ours.

    view: the controller's block as two reads in a row showed it, None while there is none to act on.
    last_job: as it last held, None until it did.
    on_found: told of the service block that stands there at the start, whoever wrote it; before it is overwritten.
    """

    def __init__(
        self,
        controller: Controller,
        settings: LinkSettings,
        *,
        on_look: Callable[[], None] = lambda: None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self.controller = controller
        self.settings = settings
        self.view: LinkBlock | None = None
        self.on_look = on_look
        self.on_round: Callable[[], None] = lambda: None  # after each round or attempt, well or not
        self.on_found: Callable[[ServiceBlock], Awaitable[None]] = _nothing
        self.ownership = Ownership(0, now=now)
        self._now = now
        self._up = asyncio.Event()
        self._wake = asyncio.Event()
        self._timer: asyncio.TimerHandle
        self._written = asyncio.Event()
        self._block = ServiceBlock(service_heartbeat=secrets.randbelow(HEARTBEATS))
        # Of two services with one number none falls into the other's step: each sees what it did not write.
        self._beat_step = 2 * secrets.randbelow(HEARTBEATS // 2) + 1
        self._dirty = True
        self._written_at = -1e9
        self._trouble: str | None = "not connected yet"
        self._served = False
        self.connections = 0  # opened so far: what was confirmed on one says nothing of the controller on the next
        self.round_trip_s: float | None = None  # of the last read of the controller's block
        self._connected_at = 0.0
        self._heard_at = 0.0
        self._lost_at: float | None = None
        self._told_at = 0.0
        self._failing = ""
        self._clock = ControllerClock()
        self.last_job: int | None = None
        self.highest_known = 0  # job number in the journal, or found in the service block
        self._confirmed_last_job: int | None = None
        self._session_written = 0  # the session in which the service block was last written
        self._reading = 0  # reads whose reply was not looked at yet
        self._well_or_failed = False
        self._since: float | None = None
        self._turn = 0
        self._forget()

    def _forget(self) -> None:
        """Drop all that an earlier connection said: nothing of it may be combined with what comes next."""
        self.view = None
        self._previous: tuple[int, ...] | None = None
        self._unsteady: str | None = None
        self._beat_at: float | None = None
        self._beat: int | None = None
        self._beats_alike = 0  # changes of the heartbeat over which all reads showed the same
        self._clock.disconnected()
        self.ownership.disconnected()

    # --- what it says -------------------------------------------------------------------------------------------

    @property
    def starting(self) -> bool:
        """True until the link was well or failed for the first time, or that takes too long."""
        if self._well_or_failed or self._since is None or self.ownership.conflict:
            return not (self._well_or_failed or self.ownership.conflict)
        return self._now() - self._since < self.settings.heartbeat_timeout_s + WATCH_OWN_S

    def fault(self) -> str | None:
        """Why nothing can be sent now, as a sentence; None when contours can be sent."""
        fault = self._fault()
        self._well_or_failed = self._well_or_failed or fault is None
        return fault

    def _fault(self) -> str | None:
        if not self._up.is_set() or self._trouble is not None:
            return self._trouble or "the connection was lost. It is being opened again"
        owned = None if self.settings.observe else self.ownership.fault()
        if owned is not None or not self.settings.handshake:
            return owned
        view = self.view
        if view is None or view.session == 0:
            return self._unsteady or "the controller's program is starting (session 0)"
        # What is observed echoes what we never wrote, and numbers nothing of ours.
        of_ours = None if self.settings.observe else self.echo_fault(view) or self._number_fault()
        return self._beat_fault() or of_ours or self._clock.fault(view.session)

    @property
    def fault_reason(self) -> Reason:
        """The code that goes with `fault`."""
        other = self._trouble is None and self.ownership.foreign
        return Reason.OTHER_SERVICE if other else Reason.CONTROLLER_LOST

    def _beat_fault(self) -> str | None:
        if self._silent_s() > self.settings.heartbeat_timeout_s:
            if self._now() - self._heard_at > self.settings.heartbeat_timeout_s:
                return f"the controller has not answered for {self.settings.heartbeat_timeout_s:g} s. Check its cable"
            return (
                f"the controller's heartbeat has not changed for {self.settings.heartbeat_timeout_s:g} s: "
                "its program does not run"
            )
        return "the controller's heartbeat has not changed yet" if self._beat_at is None else None

    def _silent_s(self) -> float:
        """How long the controller's heartbeat has not changed."""
        return self._now() - (self._connected_at if self._beat_at is None else self._beat_at)

    def _number_fault(self) -> str | None:
        """Why no job can be numbered above `last_job`."""
        if self.last_job is None:
            return "last_job has not held over two changes of the controller's heartbeat yet"
        known = self.highest_number
        if self.last_job >= LARGEST_JOB:
            return f"last_job is {self.last_job}: no higher job number is left. Correct it at the controller"
        if self.last_job > known + LARGEST_STEP and self.last_job != self._confirmed_last_job:
            return (
                f"last_job is {self.last_job}, expected {known} or little more: this looks like a fault of the "
                "controller. Correct it there; where it is right, `combtrace confirm`"
            )
        return None

    def number_in_doubt(self) -> str | None:
        """Why a number that is given now may not be above `last_job`, as a sentence; None where it is."""
        view = self.view
        if view is None or self.last_job is None or view.last_job <= max(self.highest_number, self.last_job):
            return None
        return f"last_job seems to be {view.last_job}: whether that holds is being watched"

    @property
    def highest_number(self) -> int:
        """The highest job number that is known on our side."""
        return max(self.highest_known, self._block.job_id)

    def echo_fault(self, view: LinkBlock) -> str | None:
        """Why what is read is misread, as a sentence; None where it is read as it is meant."""
        expected = self._block.test_value + 1
        if view.test_echo == expected:
            return None
        swapped = (view.test_echo & 0xFFFF) << 16 | view.test_echo >> 16
        swapped_value = (self._block.test_value & 0xFFFF) << 16 | self._block.test_value >> 16
        hint = (
            "the word order differs: change controller.word_order"
            if swapped == swapped_value + 1
            else "check controller.word_order and the register addresses"
        )
        return f"test_echo is 0x{view.test_echo:08X}, expected 0x{expected:08X}: {hint}"

    def controller_not_ready(self) -> str | None:
        """Why the controller would not take a contour at this moment; None where it would."""
        fault = self.fault()
        if fault is not None or not self.settings.handshake or self.settings.observe:
            return fault
        if (doubt := self.number_in_doubt()) is not None:
            return doubt
        assert self.view is not None
        states = {0: "not ready", 2: "busy", 3: "in fault"}
        state = self.view.controller_state
        return None if state == 1 else f"the controller is {states.get(state, f'in unknown state {state}')}"

    def stamp(self) -> Stamp | None:
        """Session and clock as last read, None where the reading does not count (no session, or the clock jumped)."""
        if not self.settings.handshake:
            return Stamp(0, 0)
        return None if self.view is None or self.view.session == 0 else self._clock.stamp(self.view.session)

    # --- reading ------------------------------------------------------------------------------------------------

    @property
    def holds(self) -> bool:
        """True where all reads over two changes of the controller's heartbeat showed the view: nothing is half written.

        What rests on `last_job` needs that; two reads alike may show a 32-bit value between its halves.
        """
        return self.view is not None and self._beats_alike >= BEATS_TO_HOLD

    async def look(self) -> LinkBlock:
        """The controller's block, as two reads in a row show it; raise ControllerError."""
        for _ in range(READS_FOR_TWO_ALIKE):
            asked_at = self._now()
            self._reading += 1
            try:
                block = await self.controller.read_link()
            finally:
                self._reading -= 1
            if self._shows_the_same(block, asked_at):
                return block
        self.view = None
        text = (
            f"the controller's block changed at each of {READS_FOR_TWO_ALIKE} reads, expected two alike in a row. "
            "Check controller.link_address"
        )
        log.log(logging.DEBUG if self._unsteady else logging.WARNING, "link: %s", text)
        self._unsteady = text
        raise LinkUnsteady(text)

    def _shows_the_same(self, block: LinkBlock, asked_at: float) -> bool:
        """True where `block` is like the one read before it, so that it is the view."""
        beat_changed = self._heard(block)
        self.round_trip_s = self._heard_at - asked_at
        shown = steady(block)
        previous, self._previous = self._previous, shown
        if previous is None or previous != shown:
            self._beats_alike = 0
            return False
        self._beats_alike += beat_changed
        before, self.view = self.view, block
        if self.holds and block.session and self.echo_fault(block) is None:
            self.last_job = block.last_job
        self._unsteady = None
        if before is None or steady(before) != shown:
            self.on_look()
        return True

    def _heard(self, block: LinkBlock) -> bool:
        """Take note of heartbeat and clock; True where the heartbeat has changed."""
        now = self._heard_at = self._now()
        changed = self._beat is not None and block.controller_heartbeat != self._beat
        if changed:
            self._beat_at = now
        self._beat = block.controller_heartbeat
        self._clock.heard(block, now)
        return changed

    # --- writing ------------------------------------------------------------------------------------------------

    def publish(self, **changes: Any) -> None:
        """Change fields of the service block; it is written at once, whole."""
        block = replace(self._block, **changes)
        self.ownership.owner = block.owner
        if block != self._block:
            self._block = block
            self._dirty = True
            self._written.clear()
            self._wake.set()

    @property
    def published(self) -> ServiceBlock:
        """The service block as it stands, or will stand with the next write."""
        return self._block

    async def flush(self, timeout_s: float) -> bool:
        """Wait until the last `publish` was confirmed by the controller; False where that took too long."""
        if not self._dirty or self.settings.observe:  # which writes nothing
            return True
        try:
            async with asyncio.timeout(timeout_s):
                await self._written.wait()
        except TimeoutError:
            return False
        return True

    def confirm(self) -> list[str]:
        """A person's word for what this link waits for with: what that was, as sentences."""
        said = []
        if self.ownership.conflict:
            said.append("the controller is watched anew, and written to if no other service is seen")
            self.ownership.begin()
        if self.last_job is not None and self._number_fault() is not None and self.last_job < LARGEST_JOB:
            said.append(f"last_job {self.last_job} is taken as right: jobs are numbered above it")
            self._confirmed_last_job = self.last_job
        self._wake.set()
        return said

    def _service_due(self) -> bool:
        if self.settings.observe or self.ownership.conflict:
            return False
        # On a slow line as much earlier as requests take there, else a change would come later than it must.
        ahead_s = min(self.round_trip_s or 0.0, HEARTBEAT_PERIOD_S / 2)
        due = self._now() - self._written_at >= HEARTBEAT_PERIOD_S - ahead_s
        return self._dirty or due or not self.ownership.decided

    async def _keep_service(self) -> None:
        """Write the service block where a change, the heartbeat or the ownership asks for it, and where it is ours."""
        if not self._service_due():
            return
        found = await self.controller.read_service()
        session = self.view.session if self.view is not None else self._session_written
        if session != self._session_written:
            self.ownership.controller_restarted()
        if not self.ownership.saw(found):
            return
        if not self.ownership.begun:
            if self.settings.handshake and not session and found.owner:
                return  # in which session its job is to be taken back is not known: go on watching
            await self.on_found(found)
            if await self.controller.read_service() != found:  # making that durable may have taken long
                return
        await self._write_service()
        self._session_written = session

    async def _write_service(self) -> None:
        beat = (self._block.service_heartbeat + self._beat_step) % HEARTBEATS
        self._block = replace(self._block, service_heartbeat=beat)
        writing = self._block
        self.ownership.writing(beat)
        await self.controller.write_service(writing)
        self.ownership.wrote()
        self._written_at = self._now()
        if writing is self._block:  # nothing was published while it was on its way
            self._dirty = False
            self._written.set()

    # --- the loop -----------------------------------------------------------------------------------------------

    async def wait_connected(self) -> None:
        """Return when there is a connection; ask for one where there is none."""
        if not self.controller.connected:
            self._up.clear()
            self._wake.set()
        await self._up.wait()

    async def run(self) -> None:
        """Keep the link for ever: connect, poll, beat; after a loss again, with growing pauses."""
        failures = 0
        self._since = self._now()
        try:
            while True:
                try:
                    await self.controller.connect()
                    self._forget()
                    self.connections += 1
                    self._connected_at = self._now()
                    self._dirty = True
                    self._up.set()
                    await self._serve()
                except ControllerError as error:
                    # A connection alone is no success: there are those who answer it, and then no request.
                    failures = 0 if self._served else failures
                    self._lost(error)
                self.on_round()
                await asyncio.sleep(RETRY_PAUSES_S[min(failures, len(RETRY_PAUSES_S) - 1)])
                failures += 1
        finally:
            self._up.clear()
            await self.controller.close()

    def _lost(self, error: ControllerError) -> None:
        """Note why; one line of log from one success to the next, and one a minute, however often it is tried."""
        now = self._now()
        attempt = "request" if self._up.is_set() else "connection"
        if attempt != self._failing or self._lost_at is None or now - self._told_at >= REMINDER_S:
            # Else the reason stays: two ways in which nobody answers would take turns in log and state all night.
            self._failing, self._trouble = attempt, str(error)
        if self._lost_at is None:
            self._lost_at = self._told_at = now
            log.warning("link: the controller cannot be reached; it is tried again by itself: %s", error)
        elif now - self._told_at >= REMINDER_S:
            self._told_at = now
            log.warning("link: still not reached after %.0f s: %s", now - self._lost_at, error)
        else:
            log.debug("link: %s", error)
        self._up.clear()
        self._forget()
        self._served = False
        self._well_or_failed = True
        self.on_look()

    def _serves(self) -> None:
        """The controller answered a whole round: what was wrong before is over."""
        if self._served:
            return
        if self._lost_at is not None:
            log.info("link: the controller answers again, after %.1f s", self._now() - self._lost_at)
        self._served, self._trouble, self._lost_at = True, None, None
        self.on_look()

    async def _serve(self) -> None:
        while True:
            if not self.controller.connected:  # another's request has found it out
                raise ControllerUnavailable("the connection was lost. It is being opened again")
            if self.settings.handshake:
                with suppress(LinkUnsteady):  # told by `fault`; our heartbeat goes on
                    await self.look()
            await self._keep_service()
            self._serves()
            self.on_round()
            await self._pause()

    async def _pause(self) -> None:
        """Wait until something is published, or a beat of the poll period finds something to do."""
        self._set_timer()
        try:
            await self._wake.wait()
        finally:
            self._timer.cancel()
        self._wake.clear()

    def _set_timer(self) -> None:
        loop = asyncio.get_running_loop()
        period_s = self.settings.poll_period_s
        pause_s = until_beat(loop.time(), period_s)
        if self.settings.handshake and self._silent_s() > min(BEAT_DUE_S, self.settings.heartbeat_timeout_s / 2):
            # A heartbeat of one bit that changes an even number of times from look to look seems to stand still.
            self._turn += 1
            pause_s = off_beat(self._turn) * period_s
        self._timer = loop.call_later(pause_s, self._beat_of_poll)

    def _beat_of_poll(self) -> None:
        """Poll in place where the controller lets us: at rest, waking the task each time costs more than the poll."""
        if self._nothing_new():
            self.on_round()
            self._set_timer()
        else:
            self._wake.set()

    def _nothing_new(self) -> bool:
        """True where nothing is to be written and the controller's block, read now, shows what it showed."""
        if not self.settings.handshake or self.view is None or self._reading or self._service_due():
            return False  # what another task has read and not yet looked at comes first
        asked_at = self._now()
        block = self.controller.glance()
        return block is not None and self._shows_the_same(block, asked_at)
