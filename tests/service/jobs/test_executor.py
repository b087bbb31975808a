"""Triggers: one job at a time, acknowledged only once durable, refused with a reason, never repeated or invented."""

from __future__ import annotations

import asyncio
import sqlite3
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.controller.mailbox.mailbox import LinkBlock, ServiceBlock
from service.jobs.executor import ROOM, Executor, Intake, missed_between
from service.jobs.health import Fault, Health
from service.jobs.trigger_queue import TriggerRefused
from service.link.link import Link, LinkSettings
from service.reasons import Outcome, Reason
from service.records.job import Job, Progress, TriggerStamp
from service.records.journal import Journal
from service.records.journal_file import JournalError
from service.state import State, StateMachine
from tests.support.service.waiting import until


class HeldRunner:
    """Carries a job out when it is let go."""

    hindered: str | None = None

    def __init__(self, journal: Journal) -> None:
        self.journal = journal
        self.begun: list[int] = []
        self.resumed: list[int] = []
        self.sent: list[int] = []
        self.go = asyncio.Event()
        self.go.set()

    async def run(self, job: Job) -> Job:
        self.begun.append(job.job_id)
        await self.go.wait()
        return self.journal.settle(job.job_id, Outcome.ACCEPTED, None, None, Progress(report={"vertices": 4}))

    def hindrance(self, job: Job) -> str | None:
        return self.hindered

    async def resume(self, job: Job) -> Job:
        self.resumed.append(job.job_id)
        self.sent += [job.job_id] if job.sent else []
        await self.go.wait()
        return self.journal.settle(job.job_id, Outcome.FAILED, Reason.SERVICE_RESTARTED, "sent before")


class DeafController:
    """Stands in where a test sets the link's view itself."""

    connected = True


class Bench:
    """An executor with a real journal and a link whose view the test sets."""

    def __init__(self, folder: Path, *, observe: bool = False) -> None:
        self.journal = Journal(folder / "journal.sqlite")
        self.health = Health(StateMachine())
        self.runner = HeldRunner(self.journal)
        self.link = Link(DeafController(), LinkSettings(observe=observe), now=lambda: 0.0)  # type: ignore[arg-type]
        self.settled: list[Job] = []
        self.executor = Executor(self.journal, self.runner, self.health, self.link, Intake(controller=True))
        self.executor.on_settled.append(self._note)

    def _note(self, job: Job) -> None:
        self.settled.append(job)

    def controller_says(self, **fields: int) -> None:
        values = {"controller_state": 1, "session": 9, "test_echo": 0x01020305, **fields}
        self.link.reading.view = LinkBlock(**values)
        self.link.reading._beat_at_s = 0.0
        self.link.connection._up.set()
        self.link.connection.trouble = None
        self.link.reading.last_job = self.link.reading.view.last_job
        self.link.ownership.saw(ServiceBlock())
        self.link.ownership.wrote()
        self.executor.wake()


@asynccontextmanager
async def running(folder: Path, *, observe: bool = False, counter: int = 0, begun: bool = True) -> AsyncIterator[Bench]:
    """begun: what stands at the controller was seen: nobody has written there."""
    bench = Bench(folder, observe=observe)
    bench.executor._begun = bench.executor._begun or begun
    task = asyncio.ensure_future(bench.executor.run())
    bench.health.start()
    bench.controller_says(trigger_counter=counter)
    await asyncio.sleep(0)
    try:
        yield bench
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
        bench.journal.close()


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


async def by_hand(bench: Bench) -> Job:
    """A job by hand, settled."""
    return await (await bench.executor.submit(TriggerStamp("serial"))).settled


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


# --- after a service of another journal -------------------------------------------------------------------------


def left_behind(**fields: int) -> ServiceBlock:
    """The service block as a service that ended had left it in session 9."""
    values = {"owner": 4711, "job_id": 70, "settled_job": 70, "trigger_ack": 6, "session_ack": 9, **fields}
    return ServiceBlock(**values)


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


# --- our own number, and a journal that is older than what it told ---------------------------------------------


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
    async with running(tmp_path, counter=3) as bench:
        owner = bench.journal.owner
        await bench.executor.service_block_found(
            left_behind(owner=owner, job_id=before, settled_job=before, trigger_ack=2)
        )
        await asyncio.sleep(0.05)
        assert bench.settled == [], "trigger 3 stays taken"
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
