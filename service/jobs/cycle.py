"""One job: frame -> contour -> millimetres -> accepted or refused -> mailbox page -> transfer -> settled."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import Future
from functools import partial
from typing import Any

from contour.errors import ParameterError, PictureError
from drivers.camera import CameraError, CameraUnavailable, Frame, FrameUnusable, SceneMoved
from drivers.controller import ControllerError
from drivers.controller.errors import ContourTooLarge, MailboxError
from drivers.controller.mailbox.pages import Page, crc32_of, decode_header, withdrawal
from service.config.recipes import Recipe
from service.jobs.cycle_terms import CycleSettings, Devices, JobInProgress, Observation, Plan, Records
from service.jobs.health import Fault, journal_fault
from service.link.contour_message import Envelope, contour_pages
from service.link.controller_clock import Stamp
from service.link.link import Link
from service.link.transfer import Transfer
from service.link.transfer_terms import Lifetime, Outgoing, Settlement, TransferSteps, Validity
from service.measuring.measure import Measurer
from service.measuring.measurement import Measurement
from service.reasons import Outcome, Reason
from service.records.durable_journal import DurableJournal
from service.records.job import Job, Terms
from service.records.journal_file import JournalError

log = logging.getLogger("combtrace.cycle")

STAMP_WAIT_S = 3.0  # a lost connection is back within that, and a clock has held over two heartbeats
EVIDENCE_WAIT_S = 2.0  # a slow disk has written a frame by then; one that hangs must not hold contours up


class _Stop(Exception):
    """The job ends here, before anything was sent."""

    def __init__(self, reason: Reason, detail: str) -> None:
        super().__init__(detail)
        self.settlement = Settlement(reason.outcome, reason, detail)


class Cycle:
    """Carries jobs out, one at a time."""

    def __init__(
        self,
        devices: Devices,
        records: Records,
        plan: Plan,
        settings: CycleSettings,
        *,
        feed_watchdog: Callable[[], None] = lambda: None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._camera = devices.camera
        self._pool = devices.pool
        self._link = devices.link
        self._counter = devices.counter
        self._journal = records.journal
        self._health = records.health
        self._keeper = records.keeper
        self._observe = records.observe
        self._durable = DurableJournal(
            self._journal_fails, on_done=partial(records.health.report, "journal", None), feed_watchdog=feed_watchdog
        )
        self._plan = plan
        self._settings = settings
        self._feed_watchdog = feed_watchdog
        self._now = now

    def use(self, plan: Plan) -> None:
        """From the next job on, measure by this plan."""
        self._plan = plan

    @property
    def plan(self) -> Plan:
        """What the next job is measured by."""
        return self._plan

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
        ongoing = JobInProgress(job, self._plan)
        started = self._now()
        try:
            settlement = await self._carry_out(ongoing)
        except _Stop as stop:
            settlement = stop.settlement
        except asyncio.CancelledError:
            self._abort(ongoing)
            raise
        except Exception as error:  # the one owner of defects: a job that was taken always ends
            log.exception("job %d: internal error", job.job_id)
            settlement = await self._end_defect(job, error)
        self._health.report("in-flight", None)  # the controller has decided, however long it took
        ongoing.report["total_ms"] = self._since(started)
        return await self._settle(job, settlement, ongoing)

    async def resume(self, job: Job) -> Job:
        """A job that a restart found in flight, settled: sent again bit-identical, or withdrawn (154)."""
        ongoing = JobInProgress(job, self._plan, job.report, transfer=job.transfer)  # what is known of it stays its own
        handshake = self._settings.transfer.handshake
        if not job.sent or self._link is None or not handshake:
            detail = "nothing of it was sent" if not job.sent else "whether it was taken cannot be known"
            return await self._settle(job, Settlement(Outcome.FAILED, Reason.SERVICE_RESTARTED, detail), ongoing)
        assert job.session is not None
        validity = self._validity(job.pages)
        lasts_s = validity.valid_for / 1000 or self._settings.lifetime_s
        lifetime = self._lifetime(job, lasts_s)
        transfer = self._transfer(self._link, job, job.session, job.pages, lifetime)
        if job.withdraw_reason is not None:
            detail = "a withdrawal that the restart cut short" if job.pages else "whether it was sent is not known"
            settlement = await transfer.withdraw(job.withdraw_reason, detail)
        elif not job.pages:
            settlement = await transfer.withdraw(Reason.SERVICE_RESTARTED, "its pages cannot be read in the journal")
        elif not validity.valid_for:
            detail = "how old the contour is cannot be known after a restart, and the controller would not look"
            settlement = await transfer.withdraw(Reason.SERVICE_RESTARTED, detail)
        elif lifetime.over:
            detail = "the contour became too old while the service was away, or the machine's clock went back"
            settlement = await transfer.withdraw(Reason.EXPIRED, detail)
        else:
            settlement = await transfer.run()
        return await self._settle(job, settlement, ongoing)

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

    async def _carry_out(self, ongoing: JobInProgress) -> Settlement:
        job = ongoing.job
        recipe = ongoing.recipe = _recipe(job, ongoing.plan)
        given_mm = job.trigger.thickness_um / 1000
        thickness_mm = ongoing.thickness_mm = given_mm or recipe.thickness_mm
        ongoing.terms = Terms(recipe.model_dump(mode="json"), ongoing.plan.measurer.calibration_digest)
        stamp = await self._stamp(job)
        stamped_at = self._now()
        frame = ongoing.frame = await self._frame(ongoing.report)
        self._feed_watchdog()
        measurement = ongoing.measurement = await self._measure(ongoing.plan.measurer, frame, recipe, thickness_mm)
        self._feed_watchdog()
        ongoing.report.update(measurement.summary())
        self._observe(Observation(job, frame, measurement))
        if measurement.reasons:
            raise _Stop(measurement.reasons[0], "; ".join(measurement.texts))
        if self._link is None:
            return Settlement(Outcome.WRITTEN, None, "no controller is configured")
        before = self._now()
        pages = await self._make_pages(ongoing, stamp, frame, measurement)
        ongoing.report["pages_ms"] = self._since(before)
        if self._settings.observe:
            return Settlement(Outcome.WRITTEN, None, f"observed only: {len(pages)} page(s) made, nothing sent")
        lifetime = self._lifetime(job, self._settings.lifetime_s, stamped_at)
        return await self._send(self._link, ongoing, stamp, lifetime)

    async def _send(self, link: Link, ongoing: JobInProgress, stamp: Stamp, lifetime: Lifetime) -> Settlement:
        """Bring the pages to the controller, all that is known of the job being durable before anything is sent."""
        job, pages, target = ongoing.job, ongoing.pages, self._settings.target
        ongoing.transfer = _figures(stamp, pages)
        drafted = self._keeper.draft(ongoing.evidence(job))

        async def before_sending() -> None:
            await self._drafted(job, drafted)  # first: with its pages in the journal a restart would send it
            known = stamp.session, pages, ongoing.progress
            await self._durable.until_done(self._journal.store_pages, job.job_id, *known, target=target)

        transfer = self._transfer(link, job, stamp.session, pages, lifetime, before_sending=before_sending)
        before = self._now()
        settlement = await transfer.run()
        ongoing.report["transfer_ms"] = self._since(before)
        return settlement

    async def _drafted(self, job: Job, drafted: Future[None] | None) -> None:
        """Return once its evidence is durable, or cannot be: a contour does not wait for a disk that hangs."""
        self._feed_watchdog()
        if drafted is not None:
            _, waiting = await asyncio.wait([asyncio.wrap_future(drafted)], timeout=EVIDENCE_WAIT_S)
            if not waiting:
                return
            log.warning("job %d goes on without its evidence: the archive's disk is slow", job.job_id)

    def _since(self, started: float) -> float:
        """Milliseconds from then on, as they are told."""
        return round((self._now() - started) * 1000, 1)

    async def _make_pages(
        self, ongoing: JobInProgress, stamp: Stamp, frame: Frame, measurement: Measurement
    ) -> tuple[Page, ...]:
        assert ongoing.recipe is not None
        ongoing.envelope = self._envelope(ongoing.job, ongoing.recipe, stamp, frame)
        try:
            loop = asyncio.get_running_loop()  # in the pool: a large contour would hold the heartbeat up
            ongoing.pages = await loop.run_in_executor(self._pool, self._pages, measurement, ongoing.envelope)
        except ContourTooLarge as error:
            raise _Stop(Reason.TOO_MANY_POINTS, str(error)) from error
        except MailboxError as error:  # what passed the checks in float64 degenerates in whole micrometres
            raise _Stop(Reason.SELF_INTERSECTING, str(error)) from error
        return ongoing.pages

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
            self._feed_watchdog()
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
            part_capacity=self._settings.mailbox.part_capacity,
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
            await self._durable.until_done(self._journal.store_withdrawal, job.job_id, reason)

        def on_stuck(why: str) -> None:
            self._health.report("in-flight", Fault(Reason.CONTROLLER_TIMEOUT, why))

        back = withdrawal(job.job_id, session, self._settings.mailbox.word_order)
        sent = before_sending is None
        outgoing = Outgoing(job.job_id, session, pages, back, self._validity(pages), sent)
        steps = TransferSteps(before_sending or _nothing, before_withdrawal, on_stuck, self._feed_watchdog)
        return Transfer(link, self._settings.transfer, self._counter, outgoing, lifetime, steps)

    def _lifetime(self, job: Job, lasts_s: float, since_s: float | None = None) -> Lifetime:
        """From `since_s` on, monotonic, or from now on, and not longer than that since it was taken."""
        since_s = self._now() if since_s is None else since_s
        return Lifetime(since_s + lasts_s, job.taken_at_s, lasts_s, self._now)

    def _validity(self, pages: tuple[Page, ...]) -> Validity:
        if not pages:
            return Validity()
        header = decode_header(pages[0], self._settings.mailbox.word_order)
        return Validity(header["captured_at"], header["valid_for"])

    # --- the end ------------------------------------------------------------------------------------------------

    async def _settle(self, job: Job, settlement: Settlement, ongoing: JobInProgress) -> Job:
        settled = await self._durable.until_done(
            self._journal.settle,
            job.job_id,
            settlement.outcome,
            settlement.reason,
            settlement.detail,
            ongoing.progress,
        )
        self._keeper.keep(ongoing.evidence(settled))
        return settled

    def _journal_fails(self, error: JournalError, again: bool) -> None:
        self._health.report("journal", journal_fault(error))
        if not again:
            log.error("journal: %s", error)

    def _abort(self, ongoing: JobInProgress) -> None:
        """At shutdown: a job of which nothing was sent ends here, one that was sent is settled by the next start."""
        job = ongoing.job
        try:
            known = self._journal.find(job.job_id)
            if known is not None and known.outcome is None and not known.sent:
                end = Outcome.FAILED, Reason.ABORTED, "the service was stopped"
                settled = self._journal.settle(job.job_id, *end, ongoing.progress)
                self._keeper.keep(ongoing.evidence(settled))
                log.warning("job %d failed: %d aborted", job.job_id, Reason.ABORTED)
                return
        except JournalError as error:
            log.error("journal: %s", error)
        log.warning("job %d stays in flight; the next start settles it", job.job_id)

    async def _end_defect(self, job: Job, error: Exception) -> Settlement:
        """A defect's settlement; a job that was sent is withdrawn first."""
        detail = f"{type(error).__name__}: {error}"
        known = await self._durable.until_done(self._journal.find, job.job_id)
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
        "registers": sum(len(page.header) + len(page.payload) + len(page.part) for page in pages),
        "crc32": [f"{crc32_of(page.header, page.payload):08X}" for page in pages],
    }


def _recipe(job: Job, plan: Plan) -> Recipe:
    number = job.trigger.recipe or plan.default_recipe
    if number not in plan.recipes:
        known = ", ".join(str(number) for number in sorted(plan.recipes))
        raise _Stop(Reason.UNKNOWN_RECIPE, f"recipe {number} is not configured; there are {known}")
    return plan.recipes[number]
