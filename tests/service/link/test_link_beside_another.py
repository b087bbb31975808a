"""A link whose controller another service writes too: what is still written, and what becomes of the job."""

from __future__ import annotations

import asyncio
import itertools
from dataclasses import replace

import pytest

from drivers.controller.mailbox.blocks import Answer, LinkBlock, ServiceBlock
from service.link.link import Link, LinkListener
from service.link.transfer_terms import Settlement, TransferSettings, Validity
from service.reasons import Outcome, Reason
from tests.support.service.linked import QUICK, linked
from tests.support.service.scripted_controller import ScriptedController
from tests.support.service.transferring import JOB, Run, transferring
from tests.support.service.transferring import QUICK as STEPS
from tests.support.service.waiting import until

OURS, THEIRS = 100, 200


class Another:
    """Another service: its number stands in the block, its heartbeat moves while it lives."""

    def __init__(self, controller: ScriptedController, *, alive: bool) -> None:
        self.alive = alive
        self._controller = controller
        self._read_service = controller.read_service
        controller.read_service = self.read_service  # type: ignore[method-assign]
        controller.service = ServiceBlock(owner=THEIRS, service_heartbeat=1)

    async def read_service(self) -> ServiceBlock:
        block = await self._read_service()
        if self.alive and block.owner == THEIRS:
            block = replace(block, service_heartbeat=(block.service_heartbeat + 1) & 0xFFFF)
            self._controller.service = block
        return block


@pytest.fixture
def short_watch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.link.ownership.WATCH_S", 0.3)
    monkeypatch.setattr("service.link.ownership.WATCH_OWN_S", 0.2)


def written(controller: ScriptedController) -> set[str]:
    return {name for name, _ in controller.requests}


async def test_beside_a_living_service_nothing_at_all_is_written(short_watch: None) -> None:
    controller = ScriptedController()
    Another(controller, alive=True)
    async with linked(controller) as link:
        link.publish(owner=OURS)
        await until(lambda: link.ownership.conflict)
        link.publish(job_id=4)
        await asyncio.sleep(0.3)
        assert "another service (owner 200, this one is 100)" in (link.fault() or "")
        assert link.fault_reason is Reason.OTHER_SERVICE
    assert written(controller) == set()


async def test_what_stands_still_is_not_overwritten_before_it_was_watched() -> None:
    controller = ScriptedController()
    Another(controller, alive=False)
    async with linked(controller) as link:
        link.publish(owner=OURS)
        await until(lambda: link.view is not None and "watching whether the other" in (link.fault() or ""))
        await asyncio.sleep(0.2)
    assert written(controller) == set()


async def test_after_a_service_that_ended_ours_takes_over_and_says_what_it_found(short_watch: None) -> None:
    controller = ScriptedController()
    Another(controller, alive=False)
    controller.service = replace(controller.service, job_id=41)
    async with linked(controller) as link:
        found: list[ServiceBlock] = []

        class Found(LinkListener):
            async def service_block_found(self, block: ServiceBlock) -> None:
                assert controller.count("write_service") == 0, "told before it is overwritten"
                found.append(block)

        link.listen(Found())
        link.publish(owner=OURS)
        await until(lambda: link.fault() is None)
        assert [block.job_id for block in found] == [41]
        assert controller.service.owner == OURS


async def test_owner_is_read_before_each_write_of_the_service_block() -> None:
    controller = ScriptedController()
    steps: list[str] = []
    read, write = controller.read_service, controller.write_service

    async def read_service() -> ServiceBlock:
        steps.append("read")
        return await read()

    async def write_service(block: ServiceBlock) -> None:
        steps.append("write")
        await write(block)

    controller.read_service, controller.write_service = read_service, write_service  # type: ignore[method-assign]
    async with linked(controller) as link:
        for number in range(5):
            link.publish(job_id=number + 1)
            assert await link.flush(2.0)
    assert steps[:3] == ["read", "read", "write"], "at the start once more, after what was found is durable"
    assert steps[3:11] == ["read", "write"] * 4


def page_of(valid_for_ms: int) -> Validity:
    return Validity(captured_at=1000, valid_for=valid_for_ms)  # the scripted clock begins at 1000


async def another_comes(run: Run, controller: ScriptedController) -> tuple[asyncio.Task[Settlement], int]:
    """The run after its commit, which nobody answers, beside another service's number; and how much was written."""
    run.link.publish(owner=OURS)
    task = asyncio.ensure_future(run.end())
    await until(lambda: controller.count("commit") == 1)
    controller.service = ServiceBlock(owner=THEIRS)
    await until(lambda: run.link.ownership.conflict)
    return task, len(controller.requests)


async def test_a_job_that_was_sent_stays_in_flight_beside_another_service_and_its_acceptance_settles_it() -> None:
    controller = ScriptedController([None])
    async with transferring(controller, replace(STEPS, ack_timeout_s=5), validity=page_of(30_000)) as run:
        task, written_so_far = await another_comes(run, controller)
        await asyncio.sleep(0.3)
        assert not task.done(), "it may be accepted still"
        controller.link = replace(controller.link, last_result=1, last_job=JOB)
        settlement = await task
    assert settlement.outcome is Outcome.ACCEPTED
    assert len(controller.requests) == written_so_far, "nothing more is written, not even a withdrawal"
    assert controller.service.owner == THEIRS


@pytest.mark.parametrize("says", [{"last_job": JOB + 1, "last_result": 1}, {"session": 10}])
async def test_beside_another_service_a_higher_last_job_or_another_session_ends_the_job_with_155(
    says: dict[str, int],
) -> None:
    controller = ScriptedController([None])
    async with transferring(controller) as run:
        task, written_so_far = await another_comes(run, controller)
        controller.link = replace(controller.link, **says)
        settlement = await task
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.OTHER_SERVICE)
    assert len(controller.requests) == written_so_far


async def test_beside_another_service_a_job_ends_with_155_once_the_controller_would_not_accept_it_any_more() -> None:
    controller = ScriptedController([None])
    async with transferring(controller, validity=page_of(400)) as run:
        task, _ = await another_comes(run, controller)
        settlement = await task
        age_ms = controller.shown().clock - 1000
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.OTHER_SERVICE)
    assert "too old to be accepted" in (settlement.detail or "")
    assert age_ms > 400 + 100, "valid_for and then ack_timeout"


async def test_beside_another_service_and_without_a_limit_it_ends_after_job_timeout_and_says_so() -> None:
    controller = ScriptedController([None])
    async with transferring(controller, lifetime_s=0.5, validity=Validity()) as run:
        task, _ = await another_comes(run, controller)
        settlement = await task
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.OTHER_SERVICE)
    assert "may have accepted it" in (settlement.detail or "")


async def test_a_job_of_which_nothing_was_sent_fails_with_155_at_once() -> None:
    controller = ScriptedController([None])
    controller.link = replace(controller.link, controller_state=2)
    async with transferring(controller, replace(STEPS, ready_timeout_s=5), validity=page_of(30_000)) as run:
        run.link.publish(owner=OURS)
        task = asyncio.ensure_future(run.end())
        await until(lambda: run.link.ownership.ours)
        controller.service = ServiceBlock(owner=THEIRS)
        settlement = await task
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.OTHER_SERVICE)
    assert run.durable == []


async def test_after_a_persons_word_the_job_in_flight_goes_on(short_watch: None) -> None:
    controller = ScriptedController([None, Answer.ACCEPTED])
    async with transferring(controller) as run:
        task, _ = await another_comes(run, controller)
        assert run.link.confirm() == ["the controller is watched anew, and written to if no other service is seen"]
        settlement = await task
    assert settlement.outcome is Outcome.ACCEPTED
    assert controller.count("commit") == 2


async def test_a_withdrawal_waits_beside_another_service_and_the_controllers_answer_ends_it() -> None:
    controller = ScriptedController([None])
    async with transferring(controller) as run:
        run.link.publish(owner=OURS)
        task = asyncio.ensure_future(run.end())
        await until(lambda: run.durable == ["sent", "withdraw controller_timeout"])
        controller.service = ServiceBlock(owner=THEIRS)
        await until(lambda: run.link.ownership.conflict)
        await asyncio.sleep(0.1)
        assert not task.done()
        controller.link = replace(controller.link, last_result=int(Answer.WITHDRAWN), last_job=JOB)
        settlement = await task
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.CONTROLLER_TIMEOUT)


async def test_without_handshake_a_foreign_owner_ends_the_job_with_155_and_nothing_is_written() -> None:
    controller = ScriptedController()
    Another(controller, alive=True)
    async with transferring(controller, TransferSettings(handshake=False)) as run:
        run.link.publish(owner=OURS)
        await until(lambda: run.link.ownership.conflict)
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.OTHER_SERVICE)
    assert written(controller) == set()


async def test_an_observing_link_reads_and_never_writes() -> None:
    controller = ScriptedController()
    controller.link = replace(controller.link, test_echo=0)  # nobody wrote a test value that it could echo
    Another(controller, alive=True)
    async with linked(controller, replace(QUICK, observe=True)) as link:
        link.publish(owner=OURS, job_id=3)
        await until(lambda: link.fault() is None)
        await asyncio.sleep(0.6)
        assert link.fault() is None
        assert isinstance(link, Link)
    assert written(controller) == set()


async def test_another_that_writes_while_what_it_left_is_made_durable_is_not_overwritten(short_watch: None) -> None:
    controller = ScriptedController()
    Another(controller, alive=False)
    async with linked(controller) as link:

        class SlowDisk(LinkListener):
            async def service_block_found(self, found: ServiceBlock) -> None:
                controller.service = replace(found, service_heartbeat=found.service_heartbeat + 1)

        link.listen(SlowDisk())
        link.publish(owner=OURS)
        await asyncio.sleep(0.6)
    assert written(controller) == set()


async def test_what_another_left_is_not_taken_over_before_the_controllers_block_holds_still(short_watch: None) -> None:
    """In which session its job is to be taken back would not be known."""
    controller = ScriptedController()
    Another(controller, alive=False)
    sessions: list[int | None] = []
    async with linked(controller) as link:

        class Found(LinkListener):
            async def service_block_found(self, _found: ServiceBlock) -> None:
                sessions.append(link.view.session if link.view else None)

        link.listen(Found())
        read_link, numbers, unsteady = controller.read_link, itertools.count(), True

        async def changing() -> LinkBlock:
            block = await read_link()
            return replace(block, recipe=next(numbers) & 0xFFFF) if unsteady else block

        link.publish(owner=OURS)
        controller.read_link = changing  # type: ignore[method-assign]
        await asyncio.sleep(0.8)
        assert sessions == []
        unsteady = False
        await until(lambda: link.ownership.ours)
    assert sessions == [9]
