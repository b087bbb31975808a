"""One job: frame -> contour -> millimetres -> accepted or refused -> mailbox page -> transfer -> settled."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import Executor as ThreadPool
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, ParamSpec, TypeVar

from contour.errors import ParameterError, PictureError
from drivers.camera import Camera, CameraError, CameraUnavailable, Frame, FrameUnusable, SceneMoved
from drivers.controller import ControllerError
from drivers.controller.mailbox.mailbox import ContourTooLarge, MailboxError, Page, crc32_of, decode_header, withdrawal
from service.config.recipes import Recipe
from service.jobs.health import Fault, Health, journal_fault
from service.link.contour_message import Envelope, contour_pages
from service.link.controller_clock import Stamp
from service.link.link import Link
from service.link.transfer import Lifetime, Settlement, Transfer, TransferCounter, TransferSettings, Validity
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.reasons import Outcome, Reason
from service.records.evidence import Evidence, Keeper, KeepsNothing
from service.records.journal import Job, Journal, JournalError, Terms

log = logging.getLogger("combtrace.cycle")

P = ParamSpec("P")
R = TypeVar("R")

STAMP_WAIT_S = 3.0  # a lost connection is back within that, and a clock has held over two heartbeats
EVIDENCE_WAIT_S = 2.0  # a slow disk has written a frame by then; one that hangs must not hold contours up
JOURNAL_PAUSE_S = 1.0


@dataclass(frozen=True)
class MailboxFormat:
    """How pages are laid out for this controller."""

    word_order: Any = "big"
    payload_capacity: int = 1984


@dataclass(frozen=True)
class CycleSettings:
    """Bounds of one job. valid_for_s 0 = no limit by the controller's clock; job_timeout_s bounds it then.

    observe: the pages are made and not sent.
    target: which controller it is and how it is laid out, by configuration key: a job in flight is settled there only.
    """

    default_recipe: int = 1
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


@dataclass
class _Course:
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

    def evidence(self, job: Job) -> Evidence:
        """What it leaves behind."""
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


class _Stop(Exception):
    """The job ends here, before anything was sent."""

    def __init__(self, reason: Reason, detail: str) -> None:
        super().__init__(detail)
        self.settlement = Settlement(reason.outcome, reason, detail)


class Cycle:
    """Carries jobs out, one at a time. Camera and tracing run in `pool`, so that the heartbeat goes on meanwhile."""

    def __init__(
        self,
        camera: Camera,
        measurer: Measurer,
        recipes: Mapping[int, Recipe],
        journal: Journal,
        health: Health,
        link: Link | None,
        counter: TransferCounter,
        settings: CycleSettings,
        pool: ThreadPool,
        *,
        observe: Callable[[Observation], None] = lambda _observation: None,
        keeper: Keeper | None = None,
        beat: Callable[[], None] = lambda: None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """keeper: is handed what a job leaves behind; None = nothing is kept."""
        self._camera = camera
        self._plan = Plan(measurer, recipes, settings.default_recipe)
        self._journal = journal
        self._health = health
        self._link = link
        self._counter = counter
        self._settings = settings
        self._pool = pool
        self._observe = observe
        self._keeper = KeepsNothing() if keeper is None else keeper
        self._beat = beat
        self._now = now

    def use(self, plan: Plan) -> None:
        """From the next job on, measure by this plan."""
        self._plan = plan

    @property
    def measurer(self) -> Measurer:
        """What traces and converts now."""
        return self._plan.measurer

    @property
    def recipes(self) -> Mapping[int, Recipe]:
        """The recipes that jobs may name now."""
        return self._plan.recipes

    async def run(self, job: Job) -> Job:
        """The job, settled."""
        course = _Course(job, self._plan)
        started = self._now()
        try:
            settlement = await self._carry_out(course)
        except _Stop as stop:
            settlement = stop.settlement
        except asyncio.CancelledError:
            self._abort(course)
            raise
        except Exception as error:  # the one owner of defects: a job that was taken always ends
            log.exception("job %d: internal error", job.job_id)
            settlement = await self._end_defect(job, error)
        self._health.report("in-flight", None)  # the controller has decided, however long it took
        course.report["total_ms"] = self._since(started)
        return await self._settle(job, settlement, course)

    async def resume(self, job: Job) -> Job:
        """A job that a restart found in flight, settled: sent again bit-identical, or withdrawn (154)."""
        course = _Course(job, self._plan, job.report, transfer=job.transfer)  # what is known of it stays its own
        handshake = self._settings.transfer.handshake
        if not job.sent or self._link is None or not handshake:
            detail = "nothing of it was sent" if not job.sent else "whether it was taken cannot be known"
            return await self._settle(job, Settlement(Outcome.FAILED, Reason.SERVICE_RESTARTED, detail), course)
        assert job.session is not None
        validity = self._validity(job.pages)
        lasts_s = validity.valid_for / 1000 or self._settings.lifetime_s
        transfer = self._transfer(self._link, job, job.session, job.pages, self._lifetime(job, lasts_s))
        if job.withdraw_reason is not None:
            detail = "a withdrawal that the restart cut short" if job.pages else "whether it was sent is not known"
            settlement = await transfer.withdraw(job.withdraw_reason, detail)
        elif not job.pages:
            settlement = await transfer.withdraw(Reason.SERVICE_RESTARTED, "its pages cannot be read in the journal")
        elif not validity.valid_for:
            detail = "how old the contour is cannot be known after a restart, and the controller would not look"
            settlement = await transfer.withdraw(Reason.SERVICE_RESTARTED, detail)
        else:
            settlement = await transfer.run()
        return await self._settle(job, settlement, course)

    def hindrance(self, job: Job) -> str | None:
        """Why a job found in flight cannot be settled as the service is configured now; None where it can."""
        if not job.sent:
            return None
        target = self._settings.target
        text = "it is in flight at a controller that the configuration does not name as it was. Put back "
        if job.target and job.target != dict(target):
            keys = [key for key in {**job.target, **target} if job.target.get(key) != target.get(key)]
            was = ", ".join(f"controller.{key}: {job.target[key]}" for key in keys if key in job.target)
            return f"{text}{was}, and start again; once the job has ended, it may be changed"
        if self._link is None or self._settings.observe:
            return f"{text}the controller with mode: send, and start again; once the job has ended, it may be changed"
        return None

    # --- the steps ----------------------------------------------------------------------------------------------

    async def _carry_out(self, course: _Course) -> Settlement:
        job = course.job
        recipe = course.recipe = _recipe(job, course.plan)
        course.thickness_mm = job.trigger.thickness_um / 1000 if job.trigger.thickness_um else recipe.thickness_mm
        course.terms = Terms(recipe.model_dump(mode="json"), course.plan.measurer.calibration_digest)
        stamp = await self._stamp(job)
        stamped_at = self._now()
        frame = course.frame = await self._frame(course.report)
        self._beat()
        measurement = course.measurement = await self._measure(course.plan.measurer, frame, recipe, course.thickness_mm)
        self._beat()
        course.report.update(measurement.summary())
        self._observe(Observation(job, frame, measurement))
        if measurement.reasons:
            raise _Stop(measurement.reasons[0], "; ".join(measurement.texts))
        if self._link is None:
            return Settlement(Outcome.WRITTEN, None, "no controller is configured")
        before = self._now()
        pages = await self._make_pages(course, stamp, frame, measurement)
        course.report["pages_ms"] = self._since(before)
        if self._settings.observe:
            return Settlement(Outcome.WRITTEN, None, f"observed only: {len(pages)} page(s) made, nothing sent")
        lasts_s = self._settings.lifetime_s
        lifetime = Lifetime(stamped_at + lasts_s, job.taken_at_s, lasts_s, self._now)
        return await self._send(self._link, course, stamp, lifetime)

    async def _send(self, link: Link, course: _Course, stamp: Stamp, lifetime: Lifetime) -> Settlement:
        """Bring the pages to the controller, all that is known of the job being durable before anything is sent."""
        job, pages, target = course.job, course.pages, self._settings.target
        course.transfer = _figures(stamp, pages)
        drafted = self._keeper.draft(course.evidence(job))

        async def before_sending() -> None:
            await self._drafted(job, drafted)  # first: with its pages in the journal a restart would send it
            known = course.terms, course.report, course.transfer
            await self._durably(self._journal.store_pages, job.job_id, stamp.session, pages, *known, target=target)

        transfer = self._transfer(link, job, stamp.session, pages, lifetime, before_sending=before_sending)
        before = self._now()
        settlement = await transfer.run()
        course.report["transfer_ms"] = self._since(before)
        return settlement

    async def _drafted(self, job: Job, drafted: Future[None] | None) -> None:
        """Return once its evidence is durable, or cannot be: a contour does not wait for a disk that hangs."""
        self._beat()
        if drafted is not None:
            _, waiting = await asyncio.wait([asyncio.wrap_future(drafted)], timeout=EVIDENCE_WAIT_S)
            if not waiting:
                return
            log.warning("job %d goes on without its evidence: the archive's disk is slow", job.job_id)

    def _since(self, started: float) -> float:
        """Milliseconds from then on, as they are told."""
        return round((self._now() - started) * 1000, 1)

    async def _make_pages(
        self, course: _Course, stamp: Stamp, frame: Frame, measurement: Measurement
    ) -> tuple[Page, ...]:
        assert course.recipe is not None
        course.envelope = self._envelope(course.job, course.recipe, stamp, frame)
        try:
            loop = asyncio.get_running_loop()  # in the pool: a large contour would hold the heartbeat up
            course.pages = await loop.run_in_executor(self._pool, self._pages, measurement, course.envelope)
        except ContourTooLarge as error:
            raise _Stop(Reason.TOO_MANY_POINTS, str(error)) from error
        except MailboxError as error:  # what passed the checks in float64 degenerates in whole micrometres
            raise _Stop(Reason.SELF_INTERSECTING, str(error)) from error
        return course.pages

    async def _stamp(self, job: Job) -> Stamp:
        """Session and clock of the controller, read before the exposure."""
        if self._link is None:
            return Stamp(0, 0)
        trouble = "the controller's clock jumps"
        give_up_at = self._now() + STAMP_WAIT_S
        while True:
            try:
                if self._link.settings.handshake:
                    await self._link.look()
            except ControllerError as error:
                trouble = str(error)
            stamp = self._link.stamp()
            if stamp is not None:
                break
            if self._now() >= give_up_at:
                raise _Stop(Reason.CONTROLLER_LOST, self._link.fault() or trouble)
            await asyncio.sleep(self._link.settings.poll_period_s)
        if job.trigger.session is not None and stamp.session != job.trigger.session:
            raise _Stop(
                Reason.CONTROLLER_RESTARTED,
                f"session {stamp.session}, the trigger came in session {job.trigger.session}",
            )
        return stamp

    async def _frame(self, report: dict[str, Any]) -> Frame:
        """A frame exposed from now on; a camera that has gone is reported as a fault besides."""
        asked_at = self._now()
        loop = asyncio.get_running_loop()
        try:
            await loop.run_in_executor(self._pool, self._camera.open)
            self._beat()
            frame = await loop.run_in_executor(self._pool, self._camera.grab, asked_at, self._settings.camera_timeout_s)
        except CameraUnavailable as error:
            self._health.report("camera", Fault(Reason.NO_FRAME, str(error)))
            raise _Stop(Reason.NO_FRAME, str(error)) from error
        except SceneMoved as error:
            raise _Stop(Reason.SCENE_MOVED, str(error)) from error
        except FrameUnusable as error:
            raise _Stop(Reason.NO_FRAME, str(error)) from error
        except CameraError as error:
            self._health.report("camera", Fault(Reason.NO_FRAME, str(error)))
            raise _Stop(Reason.NO_FRAME, str(error)) from error
        report["frame"] = frame.source
        report["frame_ms"] = round((self._now() - asked_at) * 1000, 1)
        if frame.exposed_at_s < asked_at:
            late_ms = (asked_at - frame.exposed_at_s) * 1000
            raise _Stop(Reason.STALE_FRAME, f"{frame.source}: exposed {late_ms:.0f} ms before the trigger")
        return frame

    async def _measure(self, measurer: Measurer, frame: Frame, recipe: Recipe, thickness_mm: float) -> Measurement:
        loop = asyncio.get_running_loop()
        try:
            return await loop.run_in_executor(
                self._pool, measurer.measure, frame.pixels, recipe, thickness_mm, frame.camera
            )
        except PictureError as error:
            raise _Stop(Reason.NO_FRAME, f"{frame.source}: {error}") from error
        except ParameterError as error:
            raise _Stop(Reason.INTERNAL_ERROR, f"recipe {recipe.number}: {error}. Correct the recipe") from error

    def _envelope(self, job: Job, recipe: Recipe, stamp: Stamp, frame: Frame) -> Envelope:
        return Envelope(
            job_id=job.job_id,
            recipe=recipe.number,
            captured_at=stamp.clock_ms,
            valid_for_ms=round(self._settings.valid_for_s * 1000) if stamp.clock_ms else 0,
            session=stamp.session,
            trigger=job.trigger.counter or 0 if self._settings.transfer.handshake else 0,
            simulated=frame.simulated,
            word_order=self._settings.mailbox.word_order,
            payload_capacity=self._settings.mailbox.payload_capacity,
            single_page=not self._settings.transfer.handshake,
        )

    def _pages(self, measurement: Measurement, envelope: Envelope) -> tuple[Page, ...]:
        contour = measurement.millimetres
        if contour is None:
            raise _Stop(Reason.CALIBRATION_MISSING, "a contour in pixels cannot be sent to a controller")
        return contour_pages(measurement, envelope)

    def _transfer(
        self,
        link: Link,
        job: Job,
        session: int,
        pages: tuple[Page, ...],
        lifetime: Lifetime,
        *,
        before_sending: Callable[[], Awaitable[None]] | None = None,
    ) -> Transfer:
        """before_sending: None where the job was sent before."""

        async def before_withdrawal(reason: Reason) -> None:
            await self._durably(self._journal.store_withdrawal, job.job_id, reason)

        def on_stuck(why: str) -> None:
            self._health.report("in-flight", Fault(Reason.CONTROLLER_TIMEOUT, why))

        return Transfer(
            link,
            self._settings.transfer,
            self._counter,
            job_id=job.job_id,
            session=session,
            pages=pages,
            withdrawal=withdrawal(job.job_id, session, self._settings.mailbox.word_order),
            lifetime=lifetime,
            validity=self._validity(pages),
            before_sending=before_sending or _nothing,
            before_withdrawal=before_withdrawal,
            on_stuck=on_stuck,
            sent=before_sending is None,
            beat=self._beat,
        )

    def _lifetime(self, job: Job, lasts_s: float) -> Lifetime:
        """From now on, and not longer than that since it was taken."""
        return Lifetime(self._now() + lasts_s, job.taken_at_s, lasts_s, self._now)

    def _validity(self, pages: tuple[Page, ...]) -> Validity:
        if not pages:
            return Validity()
        header = decode_header(pages[0], self._settings.mailbox.word_order)
        return Validity(header["captured_at"], header["valid_for"])

    # --- the end ------------------------------------------------------------------------------------------------

    async def _settle(self, job: Job, settlement: Settlement, course: _Course) -> Job:
        settled = await self._durably(
            self._journal.settle,
            job.job_id,
            settlement.outcome,
            settlement.reason,
            settlement.detail,
            course.report,
            course.terms,
            course.transfer,
        )
        self._keeper.keep(course.evidence(settled))
        return settled

    async def _durably(self, write: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Read or write the journal, again and again until it is done: no step goes on without it."""
        told = ""
        while True:
            self._beat()
            try:
                result = await asyncio.to_thread(write, *args, **kwargs)
            except JournalError as error:
                self._health.report("journal", journal_fault(error))
                if str(error) != told:
                    log.error("journal: %s", error)
                told = str(error)
                await asyncio.sleep(JOURNAL_PAUSE_S)
            else:
                self._health.report("journal", None)
                return result

    def _abort(self, course: _Course) -> None:
        """At shutdown: a job of which nothing was sent ends here, one that was sent is settled by the next start."""
        job = course.job
        try:
            known = self._journal.find(job.job_id)
            if known is not None and known.outcome is None and not known.sent:
                end = Outcome.FAILED, Reason.ABORTED, "the service was stopped"
                settled = self._journal.settle(job.job_id, *end, course.report, course.terms, course.transfer)
                self._keeper.keep(course.evidence(settled))
                log.warning("job %d failed: %d aborted", job.job_id, Reason.ABORTED)
                return
        except JournalError as error:
            log.error("journal: %s", error)
        log.warning("job %d stays in flight; the next start settles it", job.job_id)

    async def _end_defect(self, job: Job, error: Exception) -> Settlement:
        """A defect's settlement; a job that was sent is withdrawn first."""
        detail = f"{type(error).__name__}: {error}"
        known = await self._durably(self._journal.find, job.job_id)
        never_answered = self._link is None or not self._settings.transfer.handshake
        if known is None or not known.sent or known.session is None or never_answered:
            return Settlement(Outcome.FAILED, Reason.INTERNAL_ERROR, detail)
        assert self._link is not None
        transfer = self._transfer(
            self._link, job, known.session, known.pages, self._lifetime(job, self._settings.job_timeout_s)
        )
        return await transfer.withdraw(Reason.INTERNAL_ERROR, detail)


async def _nothing() -> None:
    return


def _figures(stamp: Stamp, pages: tuple[Page, ...]) -> dict[str, Any]:
    """What the journal keeps of a transfer."""
    return {
        "session": stamp.session,
        "captured_at": stamp.clock_ms,
        "pages": len(pages),
        "registers": sum(len(page.header) + len(page.payload) for page in pages),
        "crc32": [f"{crc32_of(page.header, page.payload):08X}" for page in pages],
    }


def _recipe(job: Job, plan: Plan) -> Recipe:
    number = job.trigger.recipe or plan.default_recipe
    if number not in plan.recipes:
        known = ", ".join(str(number) for number in sorted(plan.recipes))
        raise _Stop(Reason.UNKNOWN_RECIPE, f"recipe {number} is not configured; there are {known}")
    return plan.recipes[number]
