"""One policy for every source: run, wait for its turn, or be refused with a reason; counted, never lost in silence."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest

from service.jobs.executor import Executor, Intake
from service.jobs.health import Fault, Health
from service.jobs.trigger_queue import Queued, Ticket, TriggerQueue, TriggerRefused
from service.jobs.triggers import interval_trigger
from service.reasons import Outcome, Reason
from service.records.job import TriggerStamp
from service.records.journal import Journal
from service.state import StateMachine
from tests.support.service.executor_rig import HeldRunner
from tests.support.service.waiting import until


class Queueing:
    """An executor with a queue and a clock of the test's, without a controller."""

    def __init__(self, folder: Path, depth: int) -> None:
        self.now_s = 0.0
        self.health = Health(StateMachine())
        self.journal = Journal(folder / "journal.sqlite")
        self.runner = HeldRunner(self.journal)
        queue = TriggerQueue(depth, 30.0, now=lambda: self.now_s)
        self.executor = Executor(self.journal, self.runner, self.health, None, Intake(queue=queue))

    async def hold(self) -> Ticket:
        """A job that goes on until the runner may go."""
        self.runner.go.clear()
        ticket = await self.executor.submit(TriggerStamp("serial"))
        await until(lambda: self.runner.begun == [ticket.job.job_id])
        return ticket

    async def waits(self, kind: str = "byte") -> Queued:
        queued = await self.executor.ask(TriggerStamp(kind))
        assert isinstance(queued, Queued)
        return queued


@asynccontextmanager
async def queueing(folder: Path, depth: int = 2) -> AsyncIterator[Queueing]:
    made = Queueing(folder, depth)
    made.health.start()
    task = asyncio.ensure_future(made.executor.run())
    try:
        yield made
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
        made.journal.close()


async def test_triggers_wait_in_order_up_to_the_depth_and_are_durable_when_their_turn_comes(tmp_path: Path) -> None:
    async with queueing(tmp_path) as made:
        await made.hold()
        first, second = await made.waits(), await made.waits("signal")
        assert [first.place, second.place, made.executor.waiting] == [1, 2, 2]
        with pytest.raises(TriggerRefused) as refused:
            await made.executor.submit(TriggerStamp("interval"))
        assert refused.value.reason is Reason.BUSY
        assert made.journal.last_taken().job_id == 1, "those that wait are no jobs yet"
        made.runner.go.set()
        for number, queued in ((2, first), (3, second)):
            ticket = await queued.ticket
            assert ticket.job.job_id == number
            assert (await ticket.settled).outcome is Outcome.ACCEPTED
        assert made.runner.begun == [1, 2, 3]
        assert made.executor.missed == 1
        assert made.executor.counts == {
            ("serial", "taken"): 1,
            ("byte", "taken"): 1,
            ("signal", "taken"): 1,
            ("interval", "busy"): 1,
        }


async def test_a_trigger_that_waited_longer_than_a_contour_may_be_old_is_told_156(tmp_path: Path) -> None:
    async with queueing(tmp_path) as made:
        await made.hold()
        late = await made.waits()
        made.now_s = 20.0
        in_time = await made.waits()
        made.now_s = 30.5
        made.runner.go.set()
        with pytest.raises(TriggerRefused, match="more than 30 s") as refused:
            await late.ticket
        assert refused.value.reason is Reason.EXPIRED
        assert (await (await in_time.ticket).settled).job_id == 2
        assert made.executor.missed == 1


@pytest.mark.parametrize("halted", [False, True])
async def test_those_that_wait_are_told_at_once_where_the_service_is_not_ready_any_more(
    tmp_path: Path, halted: bool
) -> None:
    async with queueing(tmp_path) as made:
        running = await made.hold()
        waiting = [await made.waits(), await made.waits()]
        if halted:
            made.health.halt("by a person")
        else:
            made.health.report("camera", Fault(Reason.NO_FRAME, "camera silent"))
        made.runner.go.set()
        await running.settled
        for queued in waiting:
            with pytest.raises(TriggerRefused, match="by a person" if halted else "camera silent") as refused:
                await queued.ticket
            assert refused.value.reason is (Reason.ABORTED if halted else Reason.NOT_READY)
        assert made.executor.missed == 2
        assert made.runner.begun == [1]


async def test_a_new_trigger_does_not_overtake_those_that_wait(tmp_path: Path) -> None:
    async with queueing(tmp_path) as made:
        running = await made.hold()
        first = await made.waits()
        made.runner.go.set()
        await running.settled
        second = await made.executor.submit(TriggerStamp("serial"))  # between two jobs, or during the next
        assert (await first.ticket).job.job_id < second.job.job_id


async def test_an_interval_shorter_than_a_job_counts_the_periods_that_it_could_not_even_ask_for(
    tmp_path: Path,
) -> None:
    async with queueing(tmp_path, depth=1) as made:
        running = await made.hold()
        task = asyncio.ensure_future(interval_trigger(made.executor, 0.02))
        await until(lambda: made.executor.waiting == 1)
        await asyncio.sleep(0.2)
        made.runner.go.set()
        await running.settled
        await until(lambda: made.executor.counts["interval", "busy"] >= 5)
        task.cancel()


async def test_a_storm_of_triggers_is_all_accounted_for(tmp_path: Path) -> None:
    async with queueing(tmp_path, depth=3) as made:
        asked = [TriggerStamp(kind) for kind in ("serial", "byte", "signal", "interval", "manual") for _ in range(40)]
        results = await asyncio.gather(*(made.executor.submit(stamp) for stamp in asked), return_exceptions=True)
        taken = [result for result in results if isinstance(result, Ticket)]
        refused = [result for result in results if isinstance(result, TriggerRefused)]
        assert len(taken) + len(refused) == len(asked)
        assert len(taken) >= 4
        assert made.executor.missed == len(refused)
        assert sum(made.executor.counts.values()) == len(asked)
        for ticket in taken:
            assert (await ticket.settled).outcome is Outcome.ACCEPTED
