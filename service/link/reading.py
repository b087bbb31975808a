"""The controller's block as it is read: what counts of it, and what holds."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import fields
from operator import attrgetter

from drivers.controller import Controller, ControllerError
from drivers.controller.mailbox.blocks import TEST_VALUE, LinkBlock
from service.link.controller_clock import BEATS_TO_HOLD, ControllerClock

log = logging.getLogger("combtrace.link")

READS_FOR_TWO_ALIKE = 20
TEST_ECHO = TEST_VALUE + 1
STEADY_FIELDS = attrgetter(
    *(field.name for field in fields(LinkBlock) if field.name not in ("controller_heartbeat", "clock", "test_echo"))
)


class LinkUnsteady(ControllerError):
    """The controller's block did not show the same content twice in a row."""


def steady(block: LinkBlock) -> tuple[int, ...]:
    """The part of a block that two reads in a row must show alike: all but heartbeat, clock and test echo."""
    return STEADY_FIELDS(block)


def echo_fault(block: LinkBlock) -> str | None:
    """Why what is read is misread, as a sentence; None where it is read as it is meant."""
    if block.test_echo == TEST_ECHO:
        return None
    swapped = (block.test_echo & 0xFFFF) << 16 | block.test_echo >> 16
    swapped_value = (TEST_VALUE & 0xFFFF) << 16 | TEST_VALUE >> 16
    hint = (
        "the word order differs: change controller.word_order"
        if swapped == swapped_value + 1
        else "check controller.word_order and the register addresses"
    )
    return f"test_echo is 0x{block.test_echo:08X}, expected 0x{TEST_ECHO:08X}: {hint}"


class LinkReading:
    """Reads the controller's block over one connection after the other.

    view: the block as two reads in a row showed it, None while there is none to act on.
    last_job: as it last held, None until it did.
    unsteady: why there is no view, as a sentence. round_trip_s: of the last read.
    """

    def __init__(self, controller: Controller, *, on_change: Callable[[], None], now: Callable[[], float]) -> None:
        """on_change: told of each view that differs from the one before."""
        self._controller = controller
        self._on_change = on_change
        self._now = now
        self.clock = ControllerClock()
        self.last_job: int | None = None
        self.round_trip_s: float | None = None
        self._begun_at_s = 0.0
        self._heard_at_s = 0.0
        self._under_way = 0  # reads whose reply was not looked at yet
        self.forget()

    def forget(self) -> None:
        """Drop all that an earlier connection said: nothing of it may be combined with what comes next."""
        self.view: LinkBlock | None = None
        self.unsteady: str | None = None
        self._previous: tuple[int, ...] | None = None
        self._beat: int | None = None
        self._beat_at_s: float | None = None
        self._beats_alike = 0  # changes of the heartbeat over which all reads showed the same
        self.clock.disconnected()

    def begin(self) -> None:
        """A connection is there, on which nothing was said yet."""
        self.forget()
        self._begun_at_s = self._now()

    @property
    def holds(self) -> bool:
        """True where all reads over two changes of the controller's heartbeat showed the view: nothing is half written.

        What rests on `last_job` needs that; two reads alike may show a 32-bit value between its halves.
        """
        return self.view is not None and self._beats_alike >= BEATS_TO_HOLD

    @property
    def silent_s(self) -> float:
        """How long the controller's heartbeat has not changed."""
        return self._now() - (self._begun_at_s if self._beat_at_s is None else self._beat_at_s)

    def beat_fault(self, timeout_s: float) -> str | None:
        """Why the controller's program does not run, or is not known to, as a sentence; None where it does."""
        if self.silent_s > timeout_s:
            if self._now() - self._heard_at_s > timeout_s:
                return f"the controller has not answered for {timeout_s:g} s. Check its cable"
            return f"the controller's heartbeat has not changed for {timeout_s:g} s: its program does not run"
        return "the controller's heartbeat has not changed yet" if self._beat_at_s is None else None

    async def look(self) -> LinkBlock:
        """The controller's block, as two reads in a row show it; raise ControllerError."""
        for _ in range(READS_FOR_TWO_ALIKE):
            asked_at = self._now()
            self._under_way += 1
            try:
                block = await self._controller.read_link()
            finally:
                self._under_way -= 1
            if self._shows_the_same(block, asked_at):
                return block
        self.view = None
        text = (
            f"the controller's block changed at each of {READS_FOR_TWO_ALIKE} reads, expected two alike in a row. "
            "Check controller.link_address"
        )
        log.log(logging.DEBUG if self.unsteady else logging.WARNING, "link: %s", text)
        self.unsteady = text
        raise LinkUnsteady(text)

    def shows_nothing_new(self) -> bool:
        """True where the block could be read in place, now, and shows what it showed."""
        if self.view is None or self._under_way:  # what another task has read and not yet looked at comes first
            return False
        asked_at = self._now()
        block = self._controller.glance()
        return block is not None and self._shows_the_same(block, asked_at)

    def _shows_the_same(self, block: LinkBlock, asked_at: float) -> bool:
        """True where `block` is like the one read before it, so that it is the view."""
        beat_changed = self._heard(block)
        self.round_trip_s = self._heard_at_s - asked_at
        shown = steady(block)
        previous, self._previous = self._previous, shown
        if previous is None or previous != shown:
            self._beats_alike = 0
            return False
        self._beats_alike += beat_changed
        before, self.view = self.view, block
        if self.holds and block.session and echo_fault(block) is None:
            self.last_job = block.last_job
        self.unsteady = None
        if before is None or steady(before) != shown:
            self._on_change()
        return True

    def _heard(self, block: LinkBlock) -> bool:
        """Take note of heartbeat and clock; True where the heartbeat has changed."""
        now = self._heard_at_s = self._now()
        changed = self._beat is not None and block.controller_heartbeat != self._beat
        if changed:
            self._beat_at_s = now
        self._beat = block.controller_heartbeat
        self.clock.heard(block, now)
        return changed
