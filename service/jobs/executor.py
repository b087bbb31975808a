"""Takes triggers, one job at a time, and sees every job to its end."""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Protocol

from drivers.controller.mailbox.blocks import TEST_VALUE, ServiceBlock
from service.jobs.health import Fault, Health, journal_fault
from service.jobs.job_log import log_end
from service.jobs.trigger_queue import Queued, Ticket, TriggerQueue, TriggerRefused
from service.link.link import Link, LinkListener
from service.reasons import Reason
from service.records.durable_journal import DurableJournal
from service.records.job import Job, TriggerStamp
from service.records.journal import Journal
from service.records.journal_file import JournalError
from service.records.journal_restart import GoneOn
from service.state import State

log = logging.getLogger("combtrace.jobs")

QUEUE_LOOK_S = 0.25  # how often those that wait are looked at where nothing else wakes the loop
IDLE_LOOK_S = 1.0  # a loop that turns shows that it lives
ROOM = 1000  # protocol: a start numbers from at least so far above all it finds, for another may hold the same journal
COUNTER_VALUES = 65535  # a trigger counter runs 1…65535; 0 means none yet


class JobRunner(Protocol):
    """What carries a job out; `service.jobs.cycle.Cycle` in the daemon."""

    async def run(self, job: Job) -> Job:
        """Bring a new job to its end; the settled job."""

    async def resume(self, job: Job) -> Job:
        """Bring a job found in flight after a start to its end; the settled job."""

    def hindrance(self, job: Job) -> str | None:
        """Why a job found in flight cannot be settled as the service is configured now; None where it can."""


@dataclass(frozen=True)
class Intake:
    """Which triggers are taken. queue: where they wait while a job is executed; without room they are refused as busy.

    controller: its own trigger too.
    """

    controller: bool = False
    queue: TriggerQueue = field(default_factory=lambda: TriggerQueue(0, 0.0))


def missed_between(last: tuple[int, int], session: int, counter: int) -> int:
    """Trigger values of the controller that were skipped between the pair last taken and (session, counter)."""
    before = last[1] if last[0] == session else 0
    return (counter - before - 1) % COUNTER_VALUES


class Executor(LinkListener):
    """One job at a time, from any trigger. Jobs found in flight come first, then the controller's trigger."""

    def __init__(
        self,
        journal: Journal,
        runner: JobRunner,
        health: Health,
        link: Link | None,
        intake: Intake,
        *,
        feed_watchdog: Callable[[], None] = lambda: None,
    ) -> None:
        self._journal = journal
        self._runner = runner
        self._health = health
        self._link = link
        self._durable = DurableJournal(self._journal_fails, on_done=partial(health.report, "journal", None))
        self._in_flight = DurableJournal(self._jobs_in_flight_unknown, feed_watchdog=feed_watchdog)
        self._controller_triggers = intake.controller and link is not None
        self._queue = intake.queue
        self.on_settled: list[Callable[[Job], None]] = []  # told of each job's end; they must not block
        self._feed_watchdog = feed_watchdog
        self._tickets: dict[int, asyncio.Future[Job]] = {}
        self.counts: Counter[tuple[str, str]] = Counter()
        self._wake = asyncio.Event()
        self._submitted: Ticket | None = None
        self._submitting: asyncio.Future[Ticket] | None = None
        self._taking = False
        self._missed = 0
        self._logged: set[str] = set()
        self.settled_job = 0
        self.last_settled: Job | None = None
        self._last_pair = journal.last_controller_trigger()
        self._found = self._settling = False
        self._begun = link is None or not link.settings.handshake or link.settings.observe
        self._numbered_above_last_job = False
        # Two that start at once with one journal find the same: by chance they number differently.
        self._room = ROOM + secrets.randbelow(ROOM)
        self._observing_since: tuple[int, int] | None = None
        self._restore_published()
        if link is not None:
            link.listen(self)

    def _restore_published(self) -> None:
        """What the service block said before the restart: it is true still."""
        taken, settled = self._journal.last_taken(), self._journal.last_settled()
        self.settled_job = settled.job_id if settled else 0
        self.last_settled = settled
        if self._link is None:
            return
        self._link.publish(
            job_id=taken.job_id if taken else 0,
            trigger_ack=self._last_pair[1],
            session_ack=self._last_pair[0],
            settled_job=self.settled_job,
            reject_reason=int(settled.reason) if settled and settled.reason else 0,
            owner=self._journal.owner,
        )
        self._link.numbers.highest_known = taken.job_id if taken else 0

    async def service_block_found(self, found: ServiceBlock) -> None:
        """Go on where the service block ends that stands at the controller, whoever wrote it.

        It may be another's, or our own of a journal that was lost or is older than it: a trigger that it shows as taken
        is not taken again, a job that had not ended there is taken back, and numbers go on well above.
        """
        assert self._link is not None
        ours = found.owner == self._link.published.owner
        if (found.protocol_version, found.test_value) != (ServiceBlock().protocol_version, TEST_VALUE):
            found = replace(found, job_id=0, settled_job=0, trigger_ack=0)  # whatever stands there, it is no service's
        view = self._link.view
        trigger = (view.session, view.trigger_counter) if view else (0, 0)
        running = self._health.job or 0
        gone_on = await self._durable.until_done(self._journal.go_on_above, found, trigger, self._room, running)
        self._numbered_above_last_job = False
        self._last_pair = await self._durable.until_done(self._journal.last_controller_trigger)
        taken = await self._durable.until_done(self._journal.last_taken)
        if taken is None or taken.job_id <= found.job_id:
            self._link.publish(job_id=found.job_id)
        if found.settled_job > self.settled_job:
            self.settled_job = found.settled_job
            self._link.publish(settled_job=found.settled_job, reject_reason=found.reject_reason)
        self._link.numbers.highest_known = max(self._link.numbers.highest_known, found.job_id, found.settled_job)
        self._link.publish(trigger_ack=self._last_pair[1], session_ack=self._last_pair[0])
        self._tell_found(gone_on, ours)
        if gone_on.in_flight is not None:
            self._report_in_flight(gone_on.in_flight)
        self._begun = self._found = True
        self._wake.set()

    def _tell_found(self, gone_on: GoneOn, ours: bool) -> None:
        """An alarm where our own number stands beside what our journal does not know: it is an old one."""
        whose = (
            "the journal is older than what this service last told the controller" if ours else "another service ran"
        )
        level = logging.CRITICAL if ours else logging.WARNING
        if gone_on.pair is not None:
            log.log(level, "%s: trigger %d of session %d counts as taken", whose, gone_on.pair[1], gone_on.pair[0])
        if gone_on.in_flight is not None:
            log.log(level, "%s: job %d, which had not ended, is taken back", whose, gone_on.in_flight)

    def _journal_fails(self, error: JournalError, _again: bool) -> None:
        self._log_once(f"journal: {error}")
        self._health.report("journal", journal_fault(error))
        if self._link is not None:
            self._link.feed_watchdog()  # its task waits here, and is alive

    def _jobs_in_flight_unknown(self, error: JournalError, _again: bool) -> None:
        self._log_once(f"journal: {error}")
        self._health.report("in-flight", journal_fault(error))

    @property
    def missed(self) -> int:
        """Triggers not taken since the start, modulo 65536."""
        return self._missed

    def wake(self) -> None:
        """Something changed that may let a job begin."""
        self._wake.set()

    def link_changed(self) -> None:
        """The controller may ask for a job, or be ready for one."""
        self.wake()

    def ignore_controller(self) -> None:
        """Take no triggers of the controller; they stay pending."""
        self._controller_triggers = False

    def confirm(self) -> list[str]:
        """A person's word for what waits for one at the controller: what that was, as sentences."""
        return [] if self._link is None else self._link.confirm()

    @property
    def idle(self) -> bool:
        """True where no job is being taken or executed."""
        return self._health.job is None and self._submitted is None and not self._taking and not self._settling

    @property
    def waiting(self) -> int:
        """Triggers that wait for their turn."""
        return len(self._queue)

    async def submit(self, trigger: TriggerStamp) -> Ticket:
        """A ticket for the job, durable in the journal; raise TriggerRefused where it cannot be taken in its turn."""
        taken = await self.ask(trigger)
        return await taken.ticket if isinstance(taken, Queued) else taken

    async def ask(self, trigger: TriggerStamp) -> Ticket | Queued:
        """A ticket for the job, or the trigger's place where it has to wait; raise TriggerRefused."""
        try:
            self._check_free()
            self._taking = True
            self._submitting = asyncio.ensure_future(self._submit(trigger))
            self._submitting.add_done_callback(lambda done: done.cancelled() or done.exception())  # seen, also alone
            return await asyncio.shield(self._submitting)  # who asks may go away; what is durable is executed
        except TriggerRefused as refused:
            if refused.reason is Reason.BUSY and not self._queue.full:
                queued = self._queue.add(trigger)
                log.info("trigger %s waits, place %d: %s", trigger.kind, queued.place, refused)
                self._wake.set()
                return queued
            self._refused(trigger, refused)
            raise

    async def _submit(self, trigger: TriggerStamp) -> Ticket:
        try:
            self._submitted = await self._ticket(trigger)
            return self._submitted
        finally:
            self._taking = False
            self._wake.set()

    def missed_by_source(self, kind: str, count: int) -> None:
        """Count triggers that a source could not even ask for."""
        self.counts[kind, Reason.BUSY.label] += count
        self._count_missed(count)

    def _refused(self, trigger: TriggerStamp, refused: TriggerRefused) -> None:
        self.counts[trigger.kind, refused.reason.label] += 1
        self._count_missed(1)
        self._log_once(f"trigger {trigger.kind} not taken: {refused.reason.label}: {refused}")

    def _log_once(self, refusal: str) -> None:
        """Log a refusal, once until a trigger is taken: at intervals it would come back all night."""
        log.log(logging.DEBUG if refusal in self._logged else logging.WARNING, refusal)
        self._logged.add(refusal)

    def _check_free(self) -> None:
        if self._health.job is not None or self._submitted is not None or self._taking:
            raise TriggerRefused(Reason.BUSY, f"job {self._health.job or 'before it'} is being executed")
        if len(self._queue):
            raise TriggerRefused(Reason.BUSY, f"{len(self._queue)} triggers wait before it")
        if self._health.state is not State.READY:
            raise self._not_ready()
        if self._pending() is not None:  # it would be answered 5 while the controller's own trigger is open
            raise TriggerRefused(Reason.BUSY, "the controller's own trigger comes first")
        why_not = self._link.controller_not_ready() if self._link else None
        if why_not is not None:
            raise TriggerRefused(Reason.NOT_READY, why_not)

    def _not_ready(self) -> TriggerRefused:
        fault = self._health.first()
        if fault is None or self._health.state is State.HALTED:
            return TriggerRefused(Reason.NOT_READY, self._health.reason or f"state {self._health.state.label}")
        # What to do about a full disk is in the reason's name.
        reason = Reason.STORAGE_FULL if fault.reason is Reason.STORAGE_FULL else Reason.NOT_READY
        return TriggerRefused(reason, fault.text)

    async def _ticket(self, trigger: TriggerStamp) -> Ticket:
        job = await self._take(trigger)
        self._tickets[job.job_id] = asyncio.get_running_loop().create_future()
        return Ticket(job, self._tickets[job.job_id])

    async def _take(self, trigger: TriggerStamp) -> Job:
        try:
            job = await asyncio.to_thread(self._journal.take, trigger, above=self._above())
        except JournalError as error:
            fault = journal_fault(error)
            self._health.report("journal", fault)
            raise TriggerRefused(fault.reason, fault.text) from error
        self._health.report("journal", None)
        self._numbered_above_last_job = True
        self._logged.clear()
        self.counts[trigger.kind, "taken"] += 1
        log.debug("job %d taken: trigger %s, recipe %s", job.job_id, trigger.kind, trigger.recipe or "default")
        if self._link is not None:
            self._link.publish(job_id=job.job_id)
        return job

    def _above(self) -> int:
        """What the controller's `last_job` has a new number be above."""
        last_job = self._link.reading.last_job if self._link else None
        if not last_job:
            return 0
        return last_job if self._numbered_above_last_job else last_job + self._room

    def _count_missed(self, count: int) -> None:
        self._missed = (self._missed + count) & 0xFFFF
        if self._link is not None:
            self._link.publish(missed_triggers=self._missed)

    # --- the loop -----------------------------------------------------------------------------------------------

    async def run(self) -> None:
        """Execute jobs for ever; first those that a restart found in flight."""
        self._found = True
        while True:
            self._feed_watchdog()
            self._wake.clear()
            if self._found and not self._taking:  # a job that is only being taken is none of before
                self._found = False
                self._settling = True
                try:
                    await self._settle_in_flight()
                finally:
                    self._settling = False
            if self._submitted is not None:
                await self._execute_submitted(self._submitted)
                continue
            trigger = self._pending()
            if trigger is not None:
                await self._take_pending(trigger)
                continue
            if not await self._serve_queue():
                await self._pause()

    async def _pause(self) -> None:
        """Wait until something changes, but not for long: triggers that wait are looked after."""
        look_s = QUEUE_LOOK_S if len(self._queue) else IDLE_LOOK_S
        timer = asyncio.get_running_loop().call_later(look_s, self._wake.set)
        try:
            await self._wake.wait()
        finally:
            timer.cancel()

    async def _execute_submitted(self, ticket: Ticket) -> None:
        try:
            await self._execute(ticket.job)
        finally:
            self._submitted = None

    async def _serve_queue(self) -> bool:
        """True where the turn of one that waits had come; those that cannot be run any more are told why."""
        for expired in self._queue.take_expired():
            self._refuse_queued(expired, self._queue.refusal_of_expired())
        if self._health.state is not State.READY:
            halted = self._health.state is State.HALTED
            refused = (
                TriggerRefused(Reason.ABORTED, self._health.reason or "state Halted") if halted else self._not_ready()
            )
            self.refuse_all_queued(refused)
        if self._taking or (self._link is not None and self._link.controller_not_ready() is not None):
            return False
        queued = self._queue.next()
        if queued is None:
            return False
        self._taking = True
        try:
            ticket = await self._ticket(queued.trigger)
        except TriggerRefused as refused:
            self._refuse_queued(queued, refused)
            return True
        finally:
            self._taking = False
        if not queued.ticket.done():
            queued.ticket.set_result(ticket)
        await self._execute(ticket.job)
        return True

    def _refuse_queued(self, queued: Queued, refused: TriggerRefused) -> None:
        self._refused(queued.trigger, refused)
        queued.refuse(refused)

    def refuse_all_queued(self, refused: TriggerRefused) -> None:
        """Tell all that wait why they will not be run."""
        for waiting in self._queue.take_all():
            self._refuse_queued(waiting, refused)

    async def _settle_in_flight(self) -> None:
        # Until they are known, no trigger is taken; in this thread, so that none may come in between.
        unsettled = await self._in_flight.until_done_here(self._journal.unsettled)
        for job in unsettled:
            if self._submitted is not None and job.job_id == self._submitted.job.job_id:
                continue
            hindrance = self._runner.hindrance(job)
            if hindrance is not None:  # no trigger is taken until the service is started again with what settles it
                log.error("job %d: %s", job.job_id, hindrance)
                self._health.report("in-flight", Fault(Reason.SERVICE_RESTARTED, hindrance))
                return
            self._report_in_flight(job.job_id)
            if not job.sent and not self._begun:  # the block at the controller may know more of it than the journal
                return
            log.warning("job %d was in flight when the service ended", job.job_id)
            await self._finish(await self._runner.resume(job))
        self._health.report("in-flight", None)

    def _report_in_flight(self, job_id: int) -> None:
        text = f"job {job_id} of before the restart is not settled yet"
        self._health.report("in-flight", Fault(Reason.SERVICE_RESTARTED, text))

    def _pending(self) -> TriggerStamp | None:
        """The controller's open trigger, where there is one and it can be taken now."""
        if not self._controller_triggers or self._link is None or self._link.view is None:
            return None
        if self._health.state is not State.READY or self._taking:
            return None
        view = self._link.view
        if view.session == 0 or self._link.fault() is not None or self._link.numbers.in_doubt() is not None:
            return None
        pair = (view.session, view.trigger_counter)
        if self._link.settings.observe and self._observing_since is None:
            self._observing_since = self._last_pair = pair  # asked before we looked: the other process has done it
        if view.trigger_counter == 0 or pair == self._last_pair:
            return None
        return TriggerStamp("controller", view.recipe, view.block_thickness, view.session, view.trigger_counter)

    async def _take_pending(self, trigger: TriggerStamp) -> None:
        assert self._link is not None
        assert trigger.session is not None
        assert trigger.counter is not None
        self._taking = True
        try:
            job = await self._take(trigger)
        except TriggerRefused as refused:  # it stays pending, and is taken once the journal works again
            self._log_once(f"trigger controller not taken yet: {refused.reason.label}: {refused}")
            return
        finally:
            self._taking = False
        skipped = missed_between(self._last_pair, trigger.session, trigger.counter)
        if skipped:
            self.missed_by_source("controller", skipped)
        self._last_pair = (trigger.session, trigger.counter)
        self._link.publish(job_id=job.job_id, trigger_ack=trigger.counter, session_ack=trigger.session)
        await self._execute(job)

    async def _execute(self, job: Job) -> Job:
        self._health.executing(job.job_id)
        try:
            return await self._finish(await self._runner.run(job))
        finally:
            self._health.executing(None)

    async def _finish(self, job: Job) -> Job:
        """Tell how the job ended: register block, log, and whoever asked to be told."""
        assert job.outcome is not None
        log_end(log, job)
        if job.job_id >= self.settled_job:  # one that another service left may be lower
            self.settled_job, self.last_settled = job.job_id, job
            if self._link is not None:
                self._link.publish(settled_job=job.job_id, reject_reason=int(job.reason or 0))
        waited_for = self._tickets.pop(job.job_id, None)
        if waited_for is not None and not waited_for.done():
            waited_for.set_result(job)
        for tell in self.on_settled:
            tell(job)
        return job
