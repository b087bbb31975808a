"""What the cycle is given, and what a job comes to in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor as ThreadPool
from dataclasses import dataclass, field
from typing import Any

from drivers.camera import Camera, Frame
from drivers.controller.mailbox.pages import Page
from service.config.recipes import Recipe
from service.jobs.health import Health
from service.link.contour_message import Envelope
from service.link.link import Link
from service.link.transfer_terms import TransferCounter, TransferSettings
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.records.evidence import Evidence, Keeper, KeepsNothing
from service.records.job import Job, Progress, Terms
from service.records.journal import Journal


@dataclass(frozen=True)
class MailboxFormat:
    """How pages are laid out for this controller. part_capacity: None = it has no part block."""

    word_order: Any = "big"
    payload_capacity: int = 1984
    part_capacity: int | None = None


@dataclass(frozen=True)
class CycleSettings:
    """Bounds of one job. valid_for_s 0 = no limit by the controller's clock; job_timeout_s bounds it then.

    observe: the pages are made and not sent.
    target: which controller it is and how it is laid out, by configuration key: a job in flight is settled there only.
    """

    camera_timeout_s: float = 5.0
    valid_for_s: float = 30.0
    job_timeout_s: float = 120.0
    observe: bool = False
    mailbox: MailboxFormat = field(default_factory=MailboxFormat)
    transfer: TransferSettings = field(default_factory=TransferSettings)
    target: Mapping[str, Any] = field(default_factory=dict)

    @property
    def lifetime_s(self) -> float:
        """How old a contour may become, by whichever bound there is."""
        return self.valid_for_s or self.job_timeout_s


@dataclass(frozen=True)
class Plan:
    """What jobs are measured by. A job keeps the plan that it began with."""

    measurer: Measurer
    recipes: Mapping[int, Recipe]
    default_recipe: int = 1


@dataclass(frozen=True)
class Observation:
    """What one job saw: for whoever draws, archives or prints it."""

    job: Job
    frame: Frame
    measurement: Measurement


@dataclass(frozen=True)
class Devices:
    """What a job is carried out with. link: None where no controller is configured."""

    camera: Camera
    pool: ThreadPool  # in which camera and tracing run, so that the heartbeat goes on meanwhile
    link: Link | None
    counter: TransferCounter


@dataclass(frozen=True)
class Records:
    """Where it is told what becomes of jobs. keeper: is handed what a job leaves behind. observe: what it saw."""

    journal: Journal
    health: Health
    keeper: Keeper = field(default_factory=KeepsNothing)
    observe: Callable[[Observation], None] = lambda _observation: None


@dataclass
class JobInProgress:
    """What a job has come to so far; what it did not come to stays None."""

    job: Job
    plan: Plan
    report: dict[str, Any] = field(default_factory=dict)
    recipe: Recipe | None = None
    thickness_mm: float = 0.0
    frame: Frame | None = None
    measurement: Measurement | None = None
    envelope: Envelope | None = None
    pages: tuple[Page, ...] = ()
    transfer: dict[str, Any] = field(default_factory=dict)
    terms: Terms | None = None

    @property
    def progress(self) -> Progress:
        """What the journal keeps of it."""
        return Progress(self.terms, self.report, self.transfer)

    def evidence(self, job: Job) -> Evidence:
        """What it leaves behind; `job` as it is now."""
        return Evidence(
            job,
            self.plan.measurer,
            self.recipe,
            self.thickness_mm,
            self.frame,
            self.measurement,
            self.envelope,
            self.pages,
        )
