"""A job, what asked for it, and with what it was carried out: as the journal keeps them."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from drivers.controller.mailbox.pages import Page
from service.reasons import Outcome, Reason


@dataclass(frozen=True)
class TriggerStamp:
    """Where a job came from. `session` and `counter` are set for triggers of the controller only.

    line: the serial port over which it is acknowledged and told its end, as configured; None where nobody is told.
    recipe 0 means the configured default, thickness_um 0 the recipe's.
    """

    kind: str
    recipe: int = 0
    thickness_um: int = 0
    session: int | None = None
    counter: int | None = None
    line: str | None = None


@dataclass(frozen=True)
class Terms:
    """With what a job was carried out: its recipe's settings in whole, and the hash of the calibration's content."""

    recipe: dict[str, Any]
    calibration: str | None = None


@dataclass(frozen=True)
class Progress:
    """What is known of a job so far, as the journal keeps it.

    terms: None where it came to no recipe. report: what was measured, and the times it took. transfer: figures of it,
    empty where nothing was to be sent.
    """

    terms: Terms | None = None
    report: dict[str, Any] = field(default_factory=dict)
    transfer: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Job:
    """One job as the journal holds it.

    session: set once any request of a transfer may have been sent, and pages with it, until the job has ended.
    terms: None where it came to no recipe. transfer: figures of it, empty where nothing was to be sent.
    target: at which controller it was sent and how laid out there, by configuration key; empty where that is not known.
    """

    job_id: int
    taken_at: str
    trigger: TriggerStamp
    session: int | None = None
    pages: tuple[Page, ...] = ()
    withdraw_reason: Reason | None = None
    outcome: Outcome | None = None
    reason: Reason | None = None
    detail: str | None = None
    settled_at: str | None = None
    report: dict[str, Any] = field(default_factory=dict)
    terms: Terms | None = None
    transfer: dict[str, Any] = field(default_factory=dict)
    target: dict[str, Any] = field(default_factory=dict)

    @property
    def taken_at_s(self) -> float:
        """When it was taken, Unix time by the machine's own clock."""
        return datetime.fromisoformat(self.taken_at).timestamp()

    @property
    def sent(self) -> bool:
        """True where a request of a transfer may have been sent: such a job is never called failed by ourselves."""
        return self.session is not None
