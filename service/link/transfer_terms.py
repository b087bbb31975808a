"""What a transfer is given, and what it comes to."""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from drivers.controller.mailbox.pages import Page
from service.reasons import Outcome, Reason


@dataclass(frozen=True)
class TransferSettings:
    """Bounds of one transfer; names and meaning as in the configuration's `controller`."""

    handshake: bool = True
    readback: bool = True
    ready_timeout_s: float = 30.0
    ack_timeout_s: float = 5.0
    max_repeats: int = 3
    poll_period_s: float = 0.05


@dataclass(frozen=True)
class Settlement:
    """How a job ended: outcome, reason where it was not accepted or written, and a sentence of detail."""

    outcome: Outcome
    reason: Reason | None = None
    detail: str | None = None


@dataclass(frozen=True)
class Lifetime:
    """Until when a job may be sent: by the monotonic clock, and by the machine's own, which a suspended machine keeps.

    ends_at_s: monotonic. taken_at_s: Unix time, None where it is not known; lasts_s: from then on.
    """

    ends_at_s: float
    taken_at_s: float | None = None
    lasts_s: float = 0.0
    now: Callable[[], float] = time.monotonic
    unix: Callable[[], float] = time.time

    @property
    def left_s(self) -> float:
        """Seconds that are left, 0 where it is over; so it is, too, where the machine's clock went back."""
        left_s = self.ends_at_s - self.now()
        if self.taken_at_s is not None:
            age_s = self.unix() - self.taken_at_s
            left_s = min(left_s, self.lasts_s - age_s if age_s >= 0 else 0.0)
        return max(0.0, left_s)

    @property
    def over(self) -> bool:
        """True where the job must not be sent, or sent again."""
        return self.left_s == 0.0


@dataclass(frozen=True)
class Validity:
    """What the controller accepts the contour by: `captured_at` and `valid_for`, ms on its clock; 0 = no limit."""

    captured_at: int = 0
    valid_for: int = 0


@dataclass(frozen=True)
class Outgoing:
    """What is sent of one job, and what takes it back, in one session of the controller.

    sent: a request of it may have been sent before.
    """

    job_id: int
    session: int
    pages: tuple[Page, ...]
    withdrawal: Page
    validity: Validity = Validity()
    sent: bool = False


async def _nothing() -> None:
    return


async def _no_reason(_reason: Reason) -> None:
    return


@dataclass(frozen=True)
class TransferSteps:
    """What is done besides, at which step of a transfer.

    before_sending: once, before the first request that carries any of the job; before_withdrawal: before the first that
    takes it back. Both make it durable. on_stuck: told why a withdrawal gets no decision. feed_watchdog: at each sign
    of life.
    """

    before_sending: Callable[[], Awaitable[None]] = _nothing
    before_withdrawal: Callable[[Reason], Awaitable[None]] = _no_reason
    on_stuck: Callable[[str], None] = lambda _why: None
    feed_watchdog: Callable[[], None] = lambda: None


class TransferCounter:
    """Values for the commit register: the next one at each attempt, never 0, never the one last answered."""

    def __init__(self, start: int) -> None:
        self._last = start & 0xFFFF

    def next(self, ack_transfer: int) -> int:
        """A value that is neither 0, nor `ack_transfer`, nor the one given before."""
        value = self._last
        while value in (0, ack_transfer, self._last):
            value = (value + 1) & 0xFFFF
        self._last = value
        return value
