"""Triggers that ask the executor for a job: at intervals, and by hand over a serial line."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import Executor as ThreadPool

from drivers.trigger import LineTrigger, TriggerUnavailable
from service.executor import Executor, Ticket, TriggerRefused
from service.health import Fault, Health
from service.journal import Job, TriggerStamp
from service.reasons import Outcome, Reason
from service.trigger_lines import (
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
)

log = logging.getLogger("combtrace.triggers")

READ_TIMEOUT_S = 0.25  # how long a stop waits for the thread that reads
RETRY_PAUSES_S = (0.2, 0.5, 1.0)


async def interval_trigger(executor: Executor, period_s: float) -> None:
    """Ask for a job every `period_s`, for ever. One that cannot be taken is counted and told by the executor."""
    loop = asyncio.get_running_loop()
    due = loop.time() + period_s
    while True:
        await asyncio.sleep(max(0.0, due - loop.time()))
        due += period_s
        if due < loop.time():  # the machine slept, or a period is shorter than a step: no burst to catch up
            due = loop.time() + period_s
        try:
            await executor.submit(TriggerStamp("interval"))
        except TriggerRefused:
            continue


class SerialTrigger:
    """Serves one serial line: `TRIG`, `STAT`, `PING`. The port may vanish and come back."""

    def __init__(
        self,
        port: LineTrigger,
        name: str,
        executor: Executor,
        health: Health,
        status: Callable[[], str],
        pool: ThreadPool,
    ) -> None:
        self._port = port
        self._name = name
        self._executor = executor
        self._health = health
        self._status = status
        self._pool = pool
        self._replies: set[asyncio.Task[None]] = set()

    async def run(self) -> None:
        """Serve the line for ever."""
        loop = asyncio.get_running_loop()
        failures = 0
        try:
            while True:
                try:
                    await loop.run_in_executor(self._pool, self._port.open)
                    line = await self._read()  # a port that opens and then cannot be read is not back
                    if failures:
                        log.info("serial %s: is back", self._name)
                    failures = 0
                    self._health.report(self._part, None)
                    await self._serve(line)
                except TriggerUnavailable as error:
                    if failures == 0:
                        log.warning("serial: %s", error)
                    self._health.report(self._part, Fault(Reason.NOT_READY, str(error)))
                    self._port.close()
                    await asyncio.sleep(RETRY_PAUSES_S[min(failures, len(RETRY_PAUSES_S) - 1)])
                    failures += 1
        finally:
            for task in self._replies:
                task.cancel()
            self._port.close()

    @property
    def _part(self) -> str:
        return f"serial {self._name}"

    async def _read(self) -> bytes | None:
        return await asyncio.get_running_loop().run_in_executor(self._pool, self._port.read_line, READ_TIMEOUT_S)

    async def _serve(self, line: bytes | None) -> None:
        while True:
            if line is not None:
                await self._answer(line)
            line = await self._read()

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
                log.warning("serial %s: not understood: %r", self._name, line[:81])
                await self._send(nak(code, name))
            case TriggerRequest(recipe=recipe):
                await self._trigger(recipe)

    async def _trigger(self, recipe: int | None) -> None:
        try:
            ticket = await self._executor.submit(TriggerStamp("serial", recipe or 0))
        except TriggerRefused as refused:
            await self._send(nak(int(refused.reason), refused.reason.label))
            return
        await self._send(ack(ticket.job.job_id))  # before the task exists that may tell the end
        task = asyncio.get_running_loop().create_task(self._tell_the_end(ticket))
        self._replies.add(task)
        task.add_done_callback(self._replies.discard)

    async def _tell_the_end(self, ticket: Ticket) -> None:
        job = await asyncio.shield(ticket.settled)
        try:
            await self._send(result_line(job))
        except TriggerUnavailable as error:
            log.warning("serial %s: could not tell the end of job %d: %s", self._name, job.job_id, error)

    async def _send(self, text: str) -> None:
        await asyncio.get_running_loop().run_in_executor(None, self._port.write_line, text)


def result_line(job: Job) -> str:
    """`DONE` or `FAIL` for a settled job."""
    if job.outcome in (Outcome.ACCEPTED, Outcome.WRITTEN):
        return done(job.job_id, job.report.get("vertices", 0), job.report.get("area_mm2") or 0.0)
    reason = job.reason or Reason.INTERNAL_ERROR
    return fail(job.job_id, int(reason), reason.label)
