"""What was taken before a start, here or by a service of another journal, is never taken again; numbers go on."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from drivers.controller.mailbox.blocks import ServiceBlock
from service.jobs.executor import ROOM
from service.jobs.trigger_queue import TriggerRefused
from service.reasons import Reason
from service.records.job import TriggerStamp
from service.state import State
from tests.support.service.executor_rig import HeldRunner, by_hand, left_behind, running
from tests.support.service.waiting import until


async def test_a_trigger_that_a_lost_journal_held_is_not_taken_again(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        await bench.executor.service_block_found(left_behind())
        bench.controller_says(trigger_counter=6)
        published = bench.link.published
        assert (published.trigger_ack, published.session_ack) == (6, 9)
        assert (published.job_id, published.settled_job) == (70, 70)
        job = await by_hand(bench)  # it would be refused, were the controller's trigger still open
        assert job.job_id >= 70 + ROOM, "numbers go on well above what was found"
        bench.controller_says(trigger_counter=7)
        await until(lambda: len(bench.settled) == 2)


async def test_a_job_that_a_lost_journal_held_in_flight_is_settled_before_any_trigger(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.runner.go.clear()
        await bench.executor.service_block_found(left_behind(settled_job=69))
        assert bench.health.state is State.ERROR
        bench.controller_says(trigger_counter=7)
        await until(lambda: bench.runner.resumed == [70])
        with pytest.raises(TriggerRefused):
            await bench.executor.submit(TriggerStamp("serial"))
        (job,) = bench.journal.unsettled()
        assert (job.sent, job.session, job.withdraw_reason) == (True, 9, Reason.SERVICE_RESTARTED)
        bench.runner.go.set()
        await until(lambda: len(bench.settled) == 2)
        assert bench.settled[0].job_id == 70
        assert bench.settled[1].job_id >= 70 + ROOM


async def test_what_was_found_is_known_after_the_next_restart_too(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        await bench.executor.service_block_found(left_behind())
    async with running(tmp_path) as bench:
        assert bench.journal.last_controller_trigger() == (9, 6)
        bench.controller_says(trigger_counter=6)
        await asyncio.sleep(0.05)
        assert bench.settled == []
        ticket = await bench.executor.submit(TriggerStamp("serial"))
        assert ticket.job.job_id >= 70 + ROOM
        await ticket.settled


async def test_registers_that_hold_no_service_block_are_not_believed(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        await bench.executor.service_block_found(left_behind(test_value=99, job_id=4_000_000_000))
        ticket = await bench.executor.submit(TriggerStamp("serial"))
        assert ROOM <= ticket.job.job_id < 3 * ROOM
        await ticket.settled


async def test_a_job_of_a_service_whose_numbers_were_lower_is_taken_back_and_ours_stay(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.controller_says(last_job=200)
        ours = (await (await bench.executor.submit(TriggerStamp("serial"))).settled).job_id
        await bench.executor.service_block_found(left_behind(settled_job=69))
        await until(lambda: bench.runner.resumed == [70])
        await until(lambda: bench.journal.unsettled() == ())
        assert (bench.link.published.job_id, bench.link.published.settled_job) == (ours, ours)


async def after_a_restore(tmp_path: Path, bench_jobs: int = 3) -> int:
    """A journal in which triggers 1 to 3 of session 9 were taken; the last job's number."""
    async with running(tmp_path) as bench:
        for counter in range(1, bench_jobs + 1):
            bench.controller_says(trigger_counter=counter)
            await until(lambda counter=counter: len(bench.settled) == counter)
        return bench.settled[-1].job_id


async def test_a_restored_journal_repeats_no_trigger_and_no_number(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    before = await after_a_restore(tmp_path)
    async with running(tmp_path) as bench:
        owner = bench.journal.owner
        gone_on = before + 3  # three more jobs, which the restored journal does not hold
        await bench.executor.service_block_found(left_behind(owner=owner, job_id=gone_on, settled_job=gone_on))
        bench.controller_says(trigger_counter=6)
        await asyncio.sleep(0.05)
        assert bench.settled == [], "trigger 6 was done"
        bench.controller_says(trigger_counter=7)
        await until(lambda: bench.settled)
        assert bench.settled[0].job_id >= gone_on + ROOM
    assert "the journal is older" in caplog.text
    assert [record.levelname for record in caplog.records if "counts as taken" in record.message] == ["CRITICAL"]


async def test_a_job_that_only_the_service_block_knows_is_taken_back(tmp_path: Path) -> None:
    before = await after_a_restore(tmp_path)
    async with running(tmp_path) as bench:
        found = left_behind(owner=bench.journal.owner, job_id=before + 1, settled_job=before, trigger_ack=4)
        await bench.executor.service_block_found(found)
        await until(lambda: bench.runner.resumed == [before + 1])
        assert bench.link.published.settled_job == before + 1, "so that its trigger ends"


async def test_a_job_that_the_journal_calls_unsent_is_settled_by_the_controller_where_the_block_knows_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A copy of the journal was taken after the trigger and before the contour was sent, and put back afterwards."""
    async with running(tmp_path) as bench:
        bench.runner.go.clear()
        job = (await bench.executor.submit(TriggerStamp("serial"))).job
    async with running(tmp_path, begun=False) as bench:
        await asyncio.sleep(0.05)
        assert bench.runner.resumed == [], "what the controller knows is asked first"
        assert bench.health.state is State.ERROR
        owner = bench.journal.owner
        await bench.executor.service_block_found(
            left_behind(owner=owner, job_id=job.job_id, settled_job=0, trigger_ack=0)
        )
        await until(lambda: bench.runner.resumed == [job.job_id])
        assert bench.runner.sent == [job.job_id], "as one that may have been sent"
    assert caplog.text.count("was in flight when the service ended") == 1


async def test_a_job_that_the_journal_calls_unsent_and_the_block_does_not_know_was_never_sent(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.runner.go.clear()
        job = (await bench.executor.submit(TriggerStamp("serial"))).job
    async with running(tmp_path) as bench:
        await until(lambda: bench.runner.resumed == [job.job_id])
        assert bench.runner.sent == []


async def test_an_earlier_trigger_in_the_service_block_takes_nothing_back(tmp_path: Path) -> None:
    before = await after_a_restore(tmp_path)
    async with running(tmp_path) as bench:
        found = left_behind(owner=bench.journal.owner, job_id=before, settled_job=before, trigger_ack=2)
        gone_on = bench.journal.go_on_above(found, (9, 4), ROOM, 0)  # trigger 4 is still to be taken
        assert gone_on.pair is None
        assert bench.journal.last_controller_trigger() == (9, 3), "trigger 3 stays taken"


async def test_the_controllers_newest_trigger_stays_taken_whatever_else_the_service_block_shows(tmp_path: Path) -> None:
    """Killed before it was acknowledged, at a controller in place of another with the same session and other counts."""
    before = await after_a_restore(tmp_path)
    async with running(tmp_path, counter=3) as bench:
        owner = bench.journal.owner
        await bench.executor.service_block_found(
            left_behind(owner=owner, job_id=before, settled_job=before, trigger_ack=230)
        )
        await asyncio.sleep(0.05)
        assert bench.settled == []
        assert (bench.link.published.session_ack, bench.link.published.trigger_ack) == (9, 3)


async def test_each_start_numbers_from_a_thousand_above_all_in_the_journal(tmp_path: Path) -> None:
    numbers = []
    for _ in range(4):
        async with running(tmp_path) as bench:
            await bench.executor.service_block_found(ServiceBlock())
            numbers.append((await by_hand(bench)).job_id)
            numbers.append((await by_hand(bench)).job_id)
    starts, seconds = numbers[::2], numbers[1::2]
    assert [second - start for start, second in zip(starts, seconds, strict=True)] == [1] * 4
    assert all(later - earlier >= ROOM for earlier, later in zip([0, *seconds], starts, strict=False))


async def test_a_start_without_a_job_uses_up_no_numbers(tmp_path: Path) -> None:
    for _ in range(5):
        async with running(tmp_path) as bench:
            await bench.executor.service_block_found(ServiceBlock())
    async with running(tmp_path) as bench:
        await bench.executor.service_block_found(ServiceBlock())
        assert (await by_hand(bench)).job_id < 3 * ROOM


async def test_the_first_number_after_a_start_is_a_thousand_above_last_job(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        await bench.executor.service_block_found(ServiceBlock())
        bench.controller_says(last_job=500_000)
        assert (await by_hand(bench)).job_id >= 500_000 + ROOM


async def test_a_job_in_flight_elsewhere_keeps_every_trigger_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with running(tmp_path) as bench:
        bench.runner.go.clear()
        ticket = await bench.executor.submit(TriggerStamp("serial"))
        bench.journal.store_pages(ticket.job.job_id, 9, ())
    monkeypatch.setattr(HeldRunner, "hindered", "Put back controller.word_order: big")
    async with running(tmp_path) as bench:
        bench.controller_says(trigger_counter=4)
        await until(lambda: "word_order" in (bench.health.reason or ""))
        await asyncio.sleep(0.05)
        assert bench.health.state is State.ERROR
        assert bench.settled == []
        assert bench.runner.resumed == []


async def test_a_reason_that_the_service_block_shows_of_an_older_job_is_not_told_of_ours(tmp_path: Path) -> None:
    """Ours had ended in the journal, and the kill came before the block was written."""
    async with running(tmp_path) as bench:
        job = await by_hand(bench)
    async with running(tmp_path) as bench:
        owner = bench.journal.owner
        found = left_behind(owner=owner, job_id=job.job_id, settled_job=job.job_id - 1, reject_reason=112)
        await bench.executor.service_block_found(found)
        assert (bench.link.published.settled_job, bench.link.published.reject_reason) == (job.job_id, 0)


async def test_a_persons_word_leaves_the_job_that_runs_what_it_is(tmp_path: Path) -> None:
    async with running(tmp_path) as bench:
        bench.runner.go.clear()
        job = (await bench.executor.submit(TriggerStamp("serial"))).job
        await until(lambda: bench.health.job == job.job_id)
        await bench.executor.service_block_found(left_behind(job_id=job.job_id + 5, settled_job=job.job_id + 5))
        running_still = bench.journal.find(job.job_id)
        assert running_still is not None
        assert not running_still.sent
        bench.runner.go.set()
