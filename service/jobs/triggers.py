"""Triggers that ask the executor for a job: at intervals, and over serial ports, by text or by pulses."""

from __future__ import annotations

import asyncio
import logging
import math
from collections.abc import Callable, Coroutine
from typing import Any

from drivers.trigger import LineTrigger, PulseTrigger, TriggerUnavailable
from service.jobs.executor import Executor
from service.jobs.kept_port import KeptPort
from service.jobs.trigger_lines import (
    Malformed,
    PingRequest,
    StatusRequest,
    TriggerRequest,
    ack,
    done,
    fail,
    nak,
    parse_line,
    pong,
    wait,
)
from service.jobs.trigger_queue import Queued, Ticket, TriggerRefused
from service.reasons import Outcome, Reason
from service.records.durable_journal import DurableJournal
from service.records.job import Job, TriggerStamp
from service.records.journal import Journal
from service.records.journal_file import JournalError

log = logging.getLogger("combtrace.triggers")

MOST_OWED = 20  # ends told to a line that was away, the newest: whoever has missed more must look into the journal


async def interval_trigger(executor: Executor, period_s: float) -> None:
    """Ask for a job every `period_s`, for ever; what cannot be taken, or even asked for, is counted."""
    loop = asyncio.get_running_loop()
    due = loop.time() + period_s
    while True:
        await asyncio.sleep(max(0.0, due - loop.time()))
        due += period_s
        if due < loop.time():  # the one before waited for its turn, or the machine slept: no burst to catch up
            skipped = math.floor((loop.time() - due) / period_s) + 1
            due += skipped * period_s
            executor.missed_by_source("interval", skipped)
        try:
            await executor.submit(TriggerStamp("interval"))
        except TriggerRefused:
            continue


class SerialPulses:
    """Serves a port whose every pulse asks for a job. Nothing can be answered; the log and the counts tell."""

    def __init__(self, pulses: PulseTrigger, port: KeptPort, trigger: TriggerStamp, executor: Executor) -> None:
        self._pulses = pulses
        self._port = port
        self._trigger = trigger
        self._executor = executor

    async def run(self) -> None:
        """Serve the port for ever."""
        await self._port.serve(self._pulses.wait, self._serve)

    async def _serve(self, pulse: bool) -> None:
        while True:
            if pulse:
                try:
                    await self._executor.ask(self._trigger)
                except TriggerRefused as refused:
                    log.debug("serial %s: %s", self._port.name, refused)  # the executor has told and counted it
            pulse = await self._port.listen(self._pulses.wait)


class SerialTrigger:
    """Serves one serial line: `TRIG`, `STAT`, `PING`. The port may vanish and come back, and so may the service.

    The journal knows which jobs' ends are owed to the line: those of before a restart too, and those that ended while
    the line was away. An end is crossed off once it is written: a kill in between has it told twice, never not at all.
    """

    def __init__(
        self, line: LineTrigger, port: KeptPort, executor: Executor, journal: Journal, status: Callable[[], str]
    ) -> None:
        self._line = line
        self._port = port
        self._executor = executor
        self._journal = journal
        self._durable = DurableJournal(self._journal_fails)
        self._status = status
        self._replies: set[asyncio.Task[None]] = set()
        self._look = asyncio.Event()
        self._telling = False
        self._of_before = 0  # the highest number of jobs whose acknowledgement, if any, was somebody else's
        self._acknowledged: set[int] = set()

    @property
    def telling(self) -> bool:
        """Whether an end is about to be told; a line that is away has none."""
        return self._telling or self._look.is_set()

    def job_ended(self, job: Job) -> None:
        """Told of each job's end, which may be owed to this line."""
        if job.trigger.line == self._port.name:
            self._look.set()

    async def run(self) -> None:
        """Serve the line for ever."""
        last = await self._durable.until_done(self._journal.last_taken)
        self._of_before = last.job_id if last else 0
        try:
            async with asyncio.TaskGroup() as group:
                group.create_task(self._tell_ends())
                await self._port.serve(self._line.read_line, self._serve)
        finally:
            for task in self._replies:
                task.cancel()

    async def _serve(self, line: bytes | None) -> None:
        self._look.set()
        while True:
            if line is not None:
                await self._answer(line)
            line = await self._port.listen(self._line.read_line)

    async def _answer(self, line: bytes) -> None:
        """Reply to a line; an empty one gets none."""
        match parse_line(line):
            case None:
                return
            case PingRequest():
                await self._send(pong())
            case StatusRequest():
                await self._send(self._status())
            case Malformed(code=code, name=name):
                log.warning("serial %s: not understood: %r", self._port.name, line[:81])
                await self._send(nak(code, name))
            case TriggerRequest(recipe=recipe):
                await self._trigger(recipe)

    async def _trigger(self, recipe: int | None) -> None:
        try:
            taken = await self._executor.ask(TriggerStamp("serial", recipe or 0, line=self._port.name))
        except TriggerRefused as refused:
            await self._send(nak(int(refused.reason), refused.reason.label))
            return
        if isinstance(taken, Queued):
            await self._send(wait(taken.place))
            self._later(self._tell_its_turn(taken))
            return
        await self._acknowledge(taken)

    async def _acknowledge(self, ticket: Ticket) -> None:
        """Only after that may its end be told, even where the acknowledgement found the line gone."""
        try:
            await self._send(ack(ticket.job.job_id))
        finally:
            self._acknowledged.add(ticket.job.job_id)
            self._look.set()

    def _later(self, telling: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(telling)
        self._replies.add(task)
        task.add_done_callback(self._replies.discard)

    async def _tell_its_turn(self, queued: Queued) -> None:
        try:
            try:
                ticket = await asyncio.shield(queued.ticket)
            except TriggerRefused as refused:
                await self._send(nak(int(refused.reason), refused.reason.label))
            else:
                await self._acknowledge(ticket)
        except TriggerUnavailable as error:
            log.warning("serial %s: a trigger that waited could not be answered: %s", self._port.name, error)

    async def _tell_ends(self) -> None:
        """Tell the line, for ever, how its jobs have ended; what finds it gone is told when it is back."""
        while True:
            await self._look.wait()
            self._look.clear()
            self._telling = True
            try:
                await self._tell_owed()
            except TriggerUnavailable as error:
                log.warning("serial %s: the end of a job could not be told yet: %s", self._port.name, error)
            finally:
                self._telling = False

    async def _tell_owed(self) -> None:
        owed = [
            job
            for job in await self._durable.until_done(self._journal.owed, self._port.name)
            if job.job_id <= self._of_before or job.job_id in self._acknowledged
        ]
        if given_up := [job.job_id for job in owed[:-MOST_OWED]]:
            span = f"{given_up[0]} to {given_up[-1]}"
            log.warning(
                "serial %s: was away; %d ends are not told any more, of jobs %s", self._port.name, len(given_up), span
            )
            await self._cross_off(given_up)
        for job in owed[-MOST_OWED:]:
            await self._send(result_line(job))
            await self._cross_off([job.job_id])

    async def _cross_off(self, job_ids: list[int]) -> None:
        await self._durable.until_done(self._journal.cross_off, job_ids)
        self._acknowledged.difference_update(job_ids)

    def _journal_fails(self, error: JournalError, again: bool) -> None:
        if not again:
            log.warning("serial %s: what is owed to it: %s", self._port.name, error)
        self._port.feed_watchdog()

    async def _send(self, text: str) -> None:
        await asyncio.get_running_loop().run_in_executor(None, self._line.write_line, text)


def result_line(job: Job) -> str:
    """`DONE` or `FAIL` for a settled job."""
    if job.outcome in (Outcome.ACCEPTED, Outcome.WRITTEN):
        return done(job.job_id, job.report.get("vertices", 0), job.report.get("area_mm2") or 0.0)
    reason = job.reason or Reason.INTERNAL_ERROR
    return fail(job.job_id, int(reason), reason.label)
