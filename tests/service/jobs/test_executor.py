"""Triggers: one job at a time, acknowledged only once durable, refused with a reason, never repeated or invented."""

from __future__ import annotations

import asyncio
import sqlite3
import threading
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.jobs.executor import ROOM, missed_between
from service.jobs.health import Fault
from service.jobs.trigger_queue import TriggerRefused
from service.reasons import Outcome, Reason
from service.records.job import Job, TriggerStamp
from service.records.journal import Journal
from service.records.journal_file import JournalError
from service.state import State
from tests.support.service.executor_rig import Bench, by_hand, running
from tests.support.service.waiting import until


async def test_a_trigger_becomes_a_durable_job_before_the_ticket_is_handed_out(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.runner.go.clear()
        ticket = await bench.executor.submit(TriggerStamp("serial", recipe=2))
        reader = sqlite3.connect(tmp_path / "journal.sqlite")
        assert reader.execute("SELECT recipe, outcome FROM jobs WHERE job_id = ?", (ticket.job.job_id,)).fetchall() == [
            (2, None)
        ]
        reader.close()
        bench.runner.go.set()
        assert (await ticket.settled).outcome is Outcome.ACCEPTED


async def test_a_trigger_during_a_job_is_refused_as_busy_and_counted(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.runner.go.clear()
        ticket = await bench.executor.submit(TriggerStamp("serial"))
        for _ in range(3):
            with pytest.raises(TriggerRefused) as refusal:
                await bench.executor.submit(TriggerStamp("interval"))
            assert refusal.value.reason is Reason.BUSY
        assert bench.link.published.missed_triggers == 3
        bench.runner.go.set()
        await ticket.settled
        assert bench.runner.begun == [ticket.job.job_id]


async def test_a_job_that_is_durable_is_executed_though_who_asked_for_it_went_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with running(tmp_path) as bench:
        taking, may_take, take = threading.Event(), threading.Event(), bench.journal.take

        def slow_take(*args: Any, **kwargs: Any) -> Job:
            taking.set()
            assert may_take.wait(30)
            return take(*args, **kwargs)

        monkeypatch.setattr(bench.journal, "take", slow_take)
        asking = asyncio.ensure_future(bench.executor.submit(TriggerStamp("serial")))
        await until(taking.is_set)
        asking.cancel()
        with suppress(asyncio.CancelledError):
            await asking
        assert not bench.executor.idle
        may_take.set()
        await until(lambda: bench.settled)
        assert bench.journal.unsettled() == ()
        await until(lambda: bench.executor.idle)


async def test_two_triggers_at_the_same_instant_give_one_job(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        results = await asyncio.gather(
            bench.executor.submit(TriggerStamp("serial")),
            bench.executor.submit(TriggerStamp("interval")),
            return_exceptions=True,
        )
        refused = [result for result in results if isinstance(result, TriggerRefused)]
        assert [refusal.reason for refusal in refused] == [Reason.BUSY]
        await until(lambda: len(bench.settled) == 1)


async def test_a_trigger_in_error_is_refused_as_not_ready_with_the_fault(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.health.report("camera", Fault(Reason.NO_FRAME, "camera silent"))
        with pytest.raises(TriggerRefused, match="camera silent") as refusal:
            await bench.executor.submit(TriggerStamp("serial"))
        assert refusal.value.reason is Reason.NOT_READY


async def test_a_trigger_of_ours_is_refused_while_the_controller_cuts(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(controller_state=2)
        with pytest.raises(TriggerRefused, match="busy") as refusal:
            await bench.executor.submit(TriggerStamp("interval"))
        assert refusal.value.reason is Reason.NOT_READY


async def test_a_trigger_of_the_controller_is_acknowledged_with_its_pair_and_job(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(trigger_counter=1, recipe=3, block_thickness=25_000)
        await until(lambda: bench.settled)
        block = bench.link.published
        assert (block.trigger_ack, block.session_ack, block.job_id, block.settled_job) == (1, 9, 1, 1)
        assert bench.settled[0].trigger == TriggerStamp("controller", 3, 25_000, 9, 1)
        assert block.missed_triggers == 0


async def test_one_trigger_of_the_controller_gives_one_job_also_after_a_restart(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(trigger_counter=4)
        await until(lambda: bench.settled)
    async with running(tmp_path) as bench:
        assert bench.link.published.trigger_ack == 4
        bench.controller_says(trigger_counter=4)
        await by_hand(bench)  # it would be refused, were the controller's trigger still open
        assert [job.trigger.kind for job in bench.settled] == ["serial"]
        bench.controller_says(trigger_counter=5)
        await until(lambda: len(bench.settled) == 2)


async def test_the_same_counter_in_another_session_is_another_trigger(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(trigger_counter=4)
        await until(lambda: len(bench.settled) == 1)
        bench.controller_says(trigger_counter=4, session=10)
        await until(lambda: len(bench.settled) == 2)


async def test_triggers_skipped_over_count_as_missed(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(trigger_counter=1)
        await until(lambda: len(bench.settled) == 1)
        bench.controller_says(trigger_counter=4)
        await until(lambda: len(bench.settled) == 2)
        assert bench.link.published.missed_triggers == 2


async def test_a_trigger_of_the_controller_waits_for_the_job_in_flight(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.runner.go.clear()
        await bench.executor.submit(TriggerStamp("serial"))
        bench.controller_says(trigger_counter=1)
        await asyncio.sleep(0.05)
        assert bench.link.published.trigger_ack == 0
        bench.runner.go.set()
        await until(lambda: len(bench.settled) == 2)
        assert bench.settled[1].trigger.kind == "controller"


async def test_a_trigger_of_the_controller_is_not_taken_in_error(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.health.report("camera", Fault(Reason.NO_FRAME, "camera silent"))
        bench.controller_says(trigger_counter=1)
        await asyncio.sleep(0.05)
        assert bench.journal.last_taken() is None
        bench.health.report("camera", None)
        bench.executor.wake()
        await until(lambda: bench.settled)


async def test_a_job_in_flight_at_the_start_is_settled_before_any_trigger_is_taken(tmp_path: Path) -> None:
    before = Journal(tmp_path / "journal.sqlite")
    old = before.take(TriggerStamp("controller", session=9, counter=6))
    before.close()
    bench = Bench(tmp_path)
    bench.executor._begun = True
    bench.runner.go.clear()
    bench.health.start()
    bench.controller_says(trigger_counter=7)
    task = asyncio.ensure_future(bench.executor.run())
    try:
        await until(lambda: bench.runner.resumed == [old.job_id])
        assert bench.health.state is State.ERROR
        assert not bench.executor.idle, "or a reset would start the parts anew in the midst of it"
        with pytest.raises(TriggerRefused):
            await bench.executor.submit(TriggerStamp("serial"))
        assert bench.link.published.trigger_ack == 6
        bench.runner.go.set()
        await until(lambda: len(bench.settled) == 2)
        assert [job.job_id for job in bench.settled] == [old.job_id, old.job_id + 1]
        assert bench.link.published.settled_job == old.job_id + 1
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
        bench.journal.close()


async def test_a_job_id_is_above_the_controllers_last_job(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(last_job=70_000, last_result=1)
        ticket = await bench.executor.submit(TriggerStamp("serial"))
        assert ticket.job.job_id >= 70_000 + ROOM
        await ticket.settled


async def test_a_journal_that_cannot_be_written_acknowledges_nothing(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.journal._file.db.execute("PRAGMA query_only = ON")
        with pytest.raises(TriggerRefused):
            await bench.executor.submit(TriggerStamp("serial"))
        assert bench.health.state is State.ERROR
        bench.controller_says(trigger_counter=1)
        await asyncio.sleep(0.05)
        assert bench.link.published.trigger_ack == 0
        with pytest.raises(JournalError):
            bench.journal.probe()
        bench.journal._file.db.execute("PRAGMA query_only = OFF")
        assert bench.journal.last_taken() is None
        bench.journal.probe()
        bench.health.report("journal", None)
        bench.executor.wake()
        await until(lambda: bench.settled)


@given(st.integers(1, 65535), st.integers(1, 65535))
def test_missed_counts_the_values_between_on_a_ring_without_zero(last: int, new: int) -> None:
    expected, value = 0, last
    while (value := value % 65535 + 1) != new:
        expected += 1
    assert missed_between((3, last), 3, new) == expected


def test_missed_in_a_new_session_counts_from_its_beginning() -> None:
    assert missed_between((3, 17), 4, 1) == 0
    assert missed_between((3, 17), 4, 3) == 2


async def test_a_refusal_that_comes_back_at_intervals_is_logged_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with running(tmp_path) as bench:
        bench.health.report("camera", Fault(Reason.NO_FRAME, "camera silent"))
        for _ in range(5):
            with pytest.raises(TriggerRefused):
                await bench.executor.submit(TriggerStamp("interval"))
        assert sum("not taken" in record.message for record in caplog.records) == 1
        assert bench.link.published.missed_triggers == 5
        bench.health.report("camera", None)
        await (await bench.executor.submit(TriggerStamp("interval"))).settled
        bench.health.report("camera", Fault(Reason.NO_FRAME, "camera silent"))
        with pytest.raises(TriggerRefused):
            await bench.executor.submit(TriggerStamp("interval"))
        assert sum("not taken" in record.message for record in caplog.records) == 2


async def test_an_open_trigger_of_the_controller_goes_before_a_trigger_of_ours(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(trigger_counter=1)
        with pytest.raises(TriggerRefused, match="comes first") as refusal:
            await bench.executor.submit(TriggerStamp("serial"))
        assert refusal.value.reason is Reason.BUSY
        await until(lambda: bench.settled)


async def test_no_trigger_is_taken_before_the_journal_has_told_what_is_in_flight(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.records.durable_journal.PAUSE_S", 0.02)
    bench = Bench(tmp_path)
    unsettled, failures = bench.journal.unsettled, [JournalError("disk I/O error")] * 2

    def unreadable() -> tuple[Job, ...]:
        if failures:
            raise failures.pop()
        return unsettled()

    monkeypatch.setattr(bench.journal, "unsettled", unreadable)
    bench.health.start()
    bench.controller_says(trigger_counter=1)
    task = asyncio.ensure_future(bench.executor.run())
    try:
        await asyncio.sleep(0)
        with pytest.raises(TriggerRefused, match="disk I/O error"):
            await bench.executor.submit(TriggerStamp("serial"))
        await until(lambda: bench.settled)
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
        bench.journal.close()


async def test_a_last_job_that_has_not_held_numbers_nothing(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(trigger_counter=1)
        await until(lambda: bench.settled)
        assert bench.link.view is not None
        bench.link.reading.view = replace(bench.link.view, last_job=0x0001_FFFF, trigger_counter=2)  # half written
        bench.executor.wake()
        await asyncio.sleep(0.05)
        assert len(bench.settled) == 1, "the trigger stays pending"
        bench.controller_says(last_job=0x0001_0000, trigger_counter=2)
        await until(lambda: len(bench.settled) == 2)
        assert 0x0001_0000 < bench.settled[1].job_id < 0x0001_0000 + 3 * ROOM


# --- observing --------------------------------------------------------------------------------------------------


async def test_an_observer_takes_triggers_that_come_while_it_looks_and_not_the_one_before(tmp_path: Path) -> None:
    async with running(tmp_path, observe=True, counter=3) as bench:
        await asyncio.sleep(0.05)
        assert bench.settled == [], "the old process has done it"
        bench.controller_says(trigger_counter=4)
        await until(lambda: bench.settled)


async def test_an_observer_needs_no_ready_controller(tmp_path: Path) -> None:
    """The old process keeps the machine busy; a contour can be made all the same."""
    async with running(tmp_path, observe=True) as bench:
        bench.controller_says(controller_state=2)
        assert (await (await bench.executor.submit(TriggerStamp("serial"))).settled).outcome is Outcome.ACCEPTED


# --- counters that do not behave --------------------------------------------------------------------------------


async def test_a_counter_that_is_stuck_gives_one_job_a_session(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        for _ in range(5):
            bench.controller_says(trigger_counter=77)
            await asyncio.sleep(0.01)
        await until(lambda: bench.settled)
        assert len(bench.settled) == 1
        for _ in range(5):
            bench.controller_says(trigger_counter=77, session=10)
            await asyncio.sleep(0.01)
        await until(lambda: len(bench.settled) == 2)


async def test_a_counter_that_falls_back_to_0_asks_for_nothing(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(trigger_counter=5)
        await until(lambda: bench.settled)
        bench.controller_says(trigger_counter=0)
        await asyncio.sleep(0.05)
        assert len(bench.settled) == 1


async def test_after_65535_comes_1(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(trigger_counter=65535)
        await until(lambda: len(bench.settled) == 1)
        missed = bench.link.published.missed_triggers
        bench.controller_says(trigger_counter=1)
        await until(lambda: len(bench.settled) == 2)
        assert bench.link.published.missed_triggers == missed
