"""One job: frame -> contour -> millimetres -> accepted or refused -> mailbox page -> transfer -> settled."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor as ThreadPool
from dataclasses import dataclass, field
from typing import Any, ParamSpec, TypeVar

from contour.errors import ParameterError, PictureError
from drivers.camera import Camera, CameraError, CameraUnavailable, Frame, FrameUnusable, SceneMoved
from drivers.controller import ControllerError
from drivers.controller.mailbox import (
    ContourMessage,
    ContourTooLarge,
    MailboxError,
    Page,
    encode_pages,
    micrometres,
    withdrawal,
)
from service.config import Recipe
from service.health import Fault, Health, journal_fault
from service.journal import Job, Journal, JournalError
from service.link import Link, Stamp
from service.measure import Measurement, Measurer
from service.reasons import Outcome, Reason
from service.transfer import Settlement, Transfer, TransferCounter, TransferSettings

log = logging.getLogger("combtrace.cycle")

P = ParamSpec("P")
R = TypeVar("R")

STAMP_WAIT_S = 1.5  # a lost connection is back within that
JOURNAL_PAUSE_S = 1.0
NO_LIMIT = (0, 0)
VALID_FOR = slice(27, 29)  # in a page's header, which begins with offset 1
UNCERTAINTY_FACTOR = 1000.0  # mm to µm


@dataclass(frozen=True)
class MailboxFormat:
    """How pages are laid out for this controller."""

    word_order: Any = "big"
    payload_capacity: int = 1984


@dataclass(frozen=True)
class CycleSettings:
    """Bounds of one job. valid_for_s 0 = no limit by the controller's clock; job_timeout_s bounds it then.

    observe: the pages are made and not sent.
    """

    default_recipe: int = 1
    camera_timeout_s: float = 5.0
    valid_for_s: float = 30.0
    job_timeout_s: float = 120.0
    observe: bool = False
    mailbox: MailboxFormat = field(default_factory=MailboxFormat)
    transfer: TransferSettings = field(default_factory=TransferSettings)


@dataclass(frozen=True)
class Observation:
    """What one job saw: for whoever draws, archives or prints it."""

    job: Job
    frame: Frame
    measurement: Measurement


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
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._camera = camera
        self._measurer = measurer
        self._recipes = recipes
        self._journal = journal
        self._health = health
        self._link = link
        self._counter = counter
        self._settings = settings
        self._pool = pool
        self._observe = observe
        self._now = now

    async def run(self, job: Job) -> Job:
        """The job, settled."""
        report: dict[str, Any] = {}
        started = self._now()
        try:
            settlement = await self._carry_out(job, report, started)
        except _Stop as stop:
            settlement = stop.settlement
        except asyncio.CancelledError:
            self._abort(job)
            raise
        except Exception as error:  # the one owner of defects: a job that was taken always ends
            log.exception("job %d: internal error", job.job_id)
            settlement = await self._end_defect(job, error)
        self._health.report("in-flight", None)  # the controller has decided, however long it took
        report["total_ms"] = round((self._now() - started) * 1000, 1)
        return await self._settle(job, settlement, report)

    async def resume(self, job: Job) -> Job:
        """A job that a restart found in flight, settled: sent again bit-identical, or withdrawn (154)."""
        handshake = self._settings.transfer.handshake
        if not job.sent or self._link is None or not handshake:
            detail = "nothing of it was sent" if not job.sent else "whether it was taken cannot be known"
            return await self._settle(job, Settlement(Outcome.FAILED, Reason.SERVICE_RESTARTED, detail), {})
        assert job.session is not None
        transfer = self._transfer(self._link, job, job.session, job.pages, self._now() + self._lifetime_s, sent=True)
        if job.withdraw_reason is not None:
            settlement = await transfer.withdraw(job.withdraw_reason, "a withdrawal that the restart cut short")
        elif not job.pages:
            settlement = await transfer.withdraw(Reason.SERVICE_RESTARTED, "its pages cannot be read in the journal")
        elif job.pages[0].header[VALID_FOR] == NO_LIMIT:
            detail = "how old the contour is cannot be known after a restart, and the controller would not look"
            settlement = await transfer.withdraw(Reason.SERVICE_RESTARTED, detail)
        else:
            settlement = await transfer.run()
        return await self._settle(job, settlement, {})

    # --- the steps ----------------------------------------------------------------------------------------------

    async def _carry_out(self, job: Job, report: dict[str, Any], started: float) -> Settlement:
        recipe = self._recipe(job)
        stamp = await self._stamp(job)
        stamped_at = self._now()
        frame = await self._frame(report)
        measurement = await self._measure(frame, recipe, job)
        report.update(measurement.summary())
        self._observe(Observation(job, frame, measurement))
        if measurement.reasons:
            raise _Stop(measurement.reasons[0], "; ".join(measurement.texts))
        if self._link is None:
            return Settlement(Outcome.WRITTEN, None, "no controller is configured")
        try:
            loop = asyncio.get_running_loop()  # in the pool: a large contour would hold the heartbeat up
            pages = await loop.run_in_executor(self._pool, self._pages, job, recipe, stamp, frame, measurement)
        except ContourTooLarge as error:
            raise _Stop(Reason.TOO_MANY_POINTS, str(error)) from error
        except MailboxError as error:  # what passed the checks in float64 degenerates in whole micrometres
            raise _Stop(Reason.SELF_INTERSECTING, str(error)) from error
        if self._settings.observe:
            return Settlement(Outcome.WRITTEN, None, f"observed only: {len(pages)} page(s) made, nothing sent")
        transfer = self._transfer(self._link, job, stamp.session, pages, stamped_at + self._lifetime_s)
        before = self._now()
        settlement = await transfer.run()
        report["transfer_ms"] = round((self._now() - before) * 1000, 1)
        return settlement

    @property
    def _lifetime_s(self) -> float:
        return self._settings.valid_for_s or self._settings.job_timeout_s

    def _recipe(self, job: Job) -> Recipe:
        number = job.trigger.recipe or self._settings.default_recipe
        if number not in self._recipes:
            known = ", ".join(str(number) for number in sorted(self._recipes))
            raise _Stop(Reason.UNKNOWN_RECIPE, f"recipe {number} is not configured; there are {known}")
        return self._recipes[number]

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

    async def _measure(self, frame: Frame, recipe: Recipe, job: Job) -> Measurement:
        thickness_mm = job.trigger.thickness_um / 1000 if job.trigger.thickness_um else recipe.thickness_mm
        loop = asyncio.get_running_loop()
        try:
            return await loop.run_in_executor(
                self._pool, self._measurer.measure, frame.pixels, recipe, thickness_mm, frame.camera
            )
        except PictureError as error:
            raise _Stop(Reason.NO_FRAME, f"{frame.source}: {error}") from error
        except ParameterError as error:
            raise _Stop(Reason.INTERNAL_ERROR, f"recipe {recipe.number}: {error}. Correct the recipe") from error

    def _pages(
        self, job: Job, recipe: Recipe, stamp: Stamp, frame: Frame, measurement: Measurement
    ) -> tuple[Page, ...]:
        contour = measurement.millimetres
        if contour is None:
            raise _Stop(Reason.CALIBRATION_MISSING, "a contour in pixels cannot be sent to a controller")
        assert measurement.area_mm2 is not None
        sure = measurement.uncertainty_mm
        message = ContourMessage(
            job_id=job.job_id,
            rings_um=tuple(micrometres(ring) for ring in contour.rings),
            area_mm2=round(measurement.area_mm2),
            uncertainty_um=None if sure is None else round(sure * UNCERTAINTY_FACTOR),
            captured_at=stamp.clock_ms,
            recipe=recipe.number,
            simulated=frame.simulated,
            aligned=measurement.aligned,
            valid_for_ms=round(self._settings.valid_for_s * 1000) if stamp.clock_ms else 0,
            session=stamp.session,
            trigger=job.trigger.counter or 0 if self._settings.transfer.handshake else 0,
        )
        mailbox = self._settings.mailbox
        pages = encode_pages(message, mailbox.payload_capacity, mailbox.word_order)
        if len(pages) > 1 and not self._settings.transfer.handshake:
            # Without answers nobody knows when a page was read, so the next one would overwrite it unseen.
            raise _Stop(
                Reason.TOO_MANY_POINTS,
                f"{contour.point_count} vertices need {len(pages)} pages of {mailbox.payload_capacity} registers, "
                "a controller that cannot answer takes one: raise tolerance_mm or payload_capacity",
            )
        return pages

    def _transfer(
        self, link: Link, job: Job, session: int, pages: tuple[Page, ...], expires_at_s: float, *, sent: bool = False
    ) -> Transfer:
        async def before_sending() -> None:
            await self._durably(self._journal.store_pages, job.job_id, session, pages)

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
            expires_at_s=expires_at_s,
            before_sending=before_sending,
            before_withdrawal=before_withdrawal,
            on_stuck=on_stuck,
            sent=sent,
            now=self._now,
        )

    # --- the end ------------------------------------------------------------------------------------------------

    async def _settle(self, job: Job, settlement: Settlement, report: dict[str, Any]) -> Job:
        return await self._durably(
            self._journal.settle, job.job_id, settlement.outcome, settlement.reason, settlement.detail, report
        )

    async def _durably(self, write: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Read or write the journal, again and again until it is done: no step goes on without it."""
        told = ""
        while True:
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

    def _abort(self, job: Job) -> None:
        """At shutdown: a job of which nothing was sent ends here, one that was sent is settled by the next start."""
        try:
            known = self._journal.find(job.job_id)
            if known is not None and known.outcome is None and not known.sent:
                self._journal.settle(job.job_id, Outcome.FAILED, Reason.ABORTED, "the service was stopped", {})
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
        transfer = self._transfer(self._link, job, known.session, known.pages, self._now(), sent=True)
        return await transfer.withdraw(Reason.INTERNAL_ERROR, detail)
