"""Triggers over the control socket: a shell asks for a job and hears its end, in the words of the serial line."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Mapping
from typing import Any

from service.daemon.control import CommandRefused, Stream
from service.jobs.executor import Executor
from service.jobs.trigger_lines import LARGEST_RECIPE, UNKNOWN_RECIPE, ack, nak, wait
from service.jobs.trigger_queue import Queued, TriggerRefused
from service.jobs.triggers import result_line
from service.records.job import Job, TriggerStamp
from service.records.journal import Journal
from service.records.journal_file import JournalError

log = logging.getLogger("combtrace.control")

KIND = "shell"
LARGEST_THICKNESS_UM = 10_000_000
LOOK_S = 0.25


class ControlTriggers:
    """The commands of the control socket that answer with several lines. All run in the loop."""

    def __init__(self, executor: Executor, journal: Journal) -> None:
        self._executor = executor
        self._journal = journal

    def streams(self) -> dict[str, Stream]:
        """By name."""
        return {"trigger": self.trigger, "end": self.end}

    async def trigger(self, request: Mapping[str, Any], who: str) -> AsyncIterator[dict[str, Any]]:
        """`WAIT`, `ACK`, and `DONE` or `FAIL`; or `NAK`. With those that tell of no contour goes why."""
        recipe = _number(request, "recipe")
        thickness_um = _number(request, "thickness_um")
        if recipe > LARGEST_RECIPE:
            yield {"line": nak(*UNKNOWN_RECIPE)}
            return
        if thickness_um > LARGEST_THICKNESS_UM:
            raise CommandRefused(f"thickness_um is {thickness_um}, expected {LARGEST_THICKNESS_UM} at most")
        log.info("trigger by %s", who)
        try:
            taken = await self._executor.ask(TriggerStamp(KIND, recipe, thickness_um))
            if isinstance(taken, Queued):
                yield {"line": wait(taken.place)}
                taken = await asyncio.shield(taken.ticket)
        except TriggerRefused as refused:
            yield {"line": nak(int(refused.reason), refused.reason.label), "why": str(refused)}
            return
        yield {"line": ack(taken.job.job_id), "job": taken.job.job_id}
        yield _ended(await asyncio.shield(taken.settled))

    async def end(self, request: Mapping[str, Any], _who: str) -> AsyncIterator[dict[str, Any]]:
        """`DONE` or `FAIL` of a job, once it has ended: for whoever was cut off by a restart."""
        job_id = _number(request, "job")
        while True:
            try:
                job = await asyncio.to_thread(self._journal.find, job_id)
            except JournalError as error:
                log.debug("journal: %s", error)
            else:
                if job is None:
                    raise CommandRefused(f"there is no job {job_id}, or no longer")
                if job.outcome is not None:
                    yield _ended(job)
                    return
            await asyncio.sleep(LOOK_S)


def _ended(job: Job) -> dict[str, Any]:
    answer = {"line": result_line(job), "job": job.job_id}
    return answer if job.reason is None else {**answer, "why": job.detail}


def _number(request: Mapping[str, Any], name: str) -> int:
    """A whole number from 0 on, 0 where none is given; raise CommandRefused."""
    value = request.get(name, 0)
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise CommandRefused(f"{name} is {value!r}, expected a whole number from 0 on")
    return value
