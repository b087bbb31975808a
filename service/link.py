"""The link to the controller: connection, heartbeats, polling, and what its block says.

Policy is here; one attempt is the driver's.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from operator import attrgetter
from typing import Any

from drivers.controller import Controller, ControllerError, ControllerUnavailable
from drivers.controller.mailbox import LinkBlock, ServiceBlock
from service.beat import off_beat, until_beat
from service.ownership import Ownership
from service.reasons import Reason

log = logging.getLogger("combtrace.link")

# The last one again and again: with 1 s for an attempt that meets nobody, back within 2 s of the controller's return.
RETRY_PAUSES_S = (0.1, 0.2, 0.5)
HEARTBEAT_PERIOD_S = 0.5  # the protocol wants a change at least once a second
BEAT_DUE_S = 1.0  # within which the protocol wants the controller's heartbeat to change
REMINDER_S = 60.0  # how often a loss that lasts is told again
CLOCK_TOLERANCE_MS = 1000  # protocol: a clock reading counts only if it fits the one before within 1 s
READS_FOR_TWO_ALIKE = 20
CLOCK_MODULUS = 1 << 32
LARGEST_JOB = (1 << 32) - 1
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


@dataclass(frozen=True)
class Stamp:
    """What the controller's clock said, and in which session; clock_ms 0 where it has no clock."""

    session: int
    clock_ms: int


def steady(block: LinkBlock) -> tuple[int, ...]:
    """The part of a block that two reads in a row must show alike: all but heartbeat, clock and test echo."""
    return STEADY_FIELDS(block)


class Link:
    """Keeps one connection to the controller, reads its block, writes ours.

    view: the controller's block as two reads in a row showed it, None while there is none to act on.
    on_found: told of the service block that another service, which runs no more, left behind; before it is overwritten.
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
        self._block = ServiceBlock()
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
        self._clock_ran_in = 0  # the session in which the clock was seen at another value than 0
        self._zero: tuple[int, float] = (0, 0.0)  # session, and when its clock was first seen at 0
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
        self._clock: tuple[int, int, float] | None = None  # session, clock in ms, when it was read
        self._clock_fits = False
        self.ownership.disconnected()

    # --- what it says -------------------------------------------------------------------------------------------

    @property
    def starting(self) -> bool:
        """True until the link was well or failed for the first time, or that takes too long."""
        if self._well_or_failed or self._since is None or self.ownership.conflict:
            return not (self._well_or_failed or self.ownership.conflict)
        return self._now() - self._since < self.settings.heartbeat_timeout_s

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
        if view.last_job >= LARGEST_JOB:
            return f"last_job is {view.last_job}: no higher job number is left. Correct it at the controller"
        echo_fault = None if self.settings.observe else self._echo_fault(view)  # it echoes what we never wrote
        return self._beat_fault() or echo_fault or self._clock_fault()

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

    def _clock_fault(self) -> str | None:
        undecided = self._clock is not None and self._clock_runs(self._clock) is None
        return "the controller's clock shows 0: whether it runs is not known yet" if undecided else None

    def _clock_runs(self, reading: tuple[int, int, float]) -> bool | None:
        """True, False where it has shown 0 for longer than a clock can, None where that is not known yet."""
        session, clock_ms, read_at = reading
        if clock_ms or session == self._clock_ran_in:
            return True
        return False if (read_at - self._zero[1]) * 1000 > CLOCK_TOLERANCE_MS else None

    def _echo_fault(self, view: LinkBlock) -> str | None:
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
        assert self.view is not None
        states = {0: "not ready", 2: "busy", 3: "in fault"}
        state = self.view.controller_state
        return None if state == 1 else f"the controller is {states.get(state, f'in unknown state {state}')}"

    def stamp(self) -> Stamp | None:
        """Session and clock as last read, None where the reading does not count (no session, or the clock jumped)."""
        if not self.settings.handshake:
            return Stamp(0, 0)
        if self.view is None or self.view.session == 0 or self._clock is None:
            return None
        session, clock_ms, _ = self._clock
        if session != self.view.session:
            return None
        runs = self._clock_runs(self._clock)
        if not runs:
            return Stamp(session, 0) if runs is False else None
        # A running clock that wraps to 0 is told as 1 ms earlier: 0 would say that there is none.
        return Stamp(session, clock_ms or CLOCK_MODULUS - 1) if self._clock_fits else None

    # --- reading ------------------------------------------------------------------------------------------------

    async def look(self) -> LinkBlock:
        """The controller's block, as two reads in a row show it; raise ControllerError."""
        for _ in range(READS_FOR_TWO_ALIKE):
            asked_at = self._now()
            block = await self.controller.read_link()
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
        self._heard(block)
        self.round_trip_s = self._heard_at - asked_at
        shown = steady(block)
        previous, self._previous = self._previous, shown
        if previous is None or previous != shown:
            return False
        before, self.view = self.view, block
        self._unsteady = None
        if before is None or steady(before) != shown:
            self.on_look()
        return True

    def _heard(self, block: LinkBlock) -> None:
        now = self._heard_at = self._now()
        if self._beat is not None and block.controller_heartbeat != self._beat:
            self._beat_at = now
        self._beat = block.controller_heartbeat
        self._heard_clock(block, now)

    def _heard_clock(self, block: LinkBlock, now: float) -> None:
        before, self._clock = self._clock, (block.session, block.clock, now)
        if block.clock:
            self._clock_ran_in = block.session
        elif self._zero[0] != block.session:
            self._zero = (block.session, now)
        if before is None or before[0] != block.session:
            self._clock_fits = False
            return
        passed_ms = (block.clock - before[1]) % CLOCK_MODULUS
        off_ms = passed_ms - (now - before[2]) * 1000
        off_ms = (off_ms + CLOCK_MODULUS / 2) % CLOCK_MODULUS - CLOCK_MODULUS / 2
        self._clock_fits = abs(off_ms) <= CLOCK_TOLERANCE_MS

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

    async def owner_stands(self) -> bool:
        """True where `owner`, read now, is ours or nobody's; a foreign one must show in two reads in a row."""
        for _ in range(2):
            if not self.ownership.is_foreign(await self.controller.read_service()):
                return True
        return False

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
        if not self.ownership.saw(found):
            return
        if self.ownership.is_foreign(found):
            if self.settings.handshake and self.view is None:
                return  # in which session its job is to be taken back is not known: watch anew
            await self.on_found(found)
            if await self.controller.read_service() != found:  # making that durable may have taken long
                return
        await self._write_service()

    async def _write_service(self) -> None:
        self._block = replace(self._block, service_heartbeat=(self._block.service_heartbeat + 1) & 0xFFFF)
        writing = self._block
        await self.controller.write_service(writing)
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
            self._set_timer()
        else:
            self._wake.set()

    def _nothing_new(self) -> bool:
        """True where nothing is to be written and the controller's block, read now, shows what it showed."""
        if not self.settings.handshake or self.view is None or self._service_due():
            return False
        asked_at = self._now()
        block = self.controller.glance()
        return block is not None and self._shows_the_same(block, asked_at)
