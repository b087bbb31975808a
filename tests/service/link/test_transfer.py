"""Each rule of "A transfer", alone: what is sent next, what settles the job, and that nothing else does."""

from __future__ import annotations

import asyncio
import itertools
from dataclasses import replace

import pytest

from drivers.controller.mailbox.blocks import Answer, LinkBlock, ServiceBlock
from drivers.controller.mailbox.pages import Page, withdrawal
from service.link.reading import READS_FOR_TWO_ALIKE
from service.link.transfer_terms import Settlement, TransferCounter, TransferSettings
from service.reasons import Outcome, Reason
from tests.support.service.scripted_controller import ScriptedController
from tests.support.service.transferring import JOB, QUICK, SESSION, page, transferring
from tests.support.service.waiting import until


async def test_a_page_is_cleared_written_read_back_and_committed_in_this_order() -> None:
    controller = ScriptedController()
    async with transferring(controller) as run:
        assert await run.end() == Settlement(Outcome.ACCEPTED)
    steps = [name for name, _ in controller.requests if name != "write_service"]
    assert steps == ["clear", "write_page", "read_page", "commit"]
    assert controller.accepted == [page()]
    assert run.durable == ["sent"]


async def test_without_readback_nothing_is_read_back() -> None:
    controller = ScriptedController()
    async with transferring(controller, TransferSettings(readback=False)) as run:
        await run.end()
    assert controller.count("read_page") == 0


async def test_a_readback_that_differs_starts_again_without_a_commit() -> None:
    controller = ScriptedController()
    controller.faults["readback_differs"] = ["once"]
    async with transferring(controller) as run:
        assert (await run.end()).outcome is Outcome.ACCEPTED
    steps = [name for name, _ in controller.requests if name != "write_service"]
    assert steps == ["clear", "write_page", "read_page", "clear", "write_page", "read_page", "commit"]


@pytest.mark.parametrize("request_name", ["clear", "write_page", "read_page", "commit"])
@pytest.mark.parametrize("fault", ["request", "reply"])
async def test_one_lost_request_or_reply_costs_a_reconnect_and_nothing_else(request_name: str, fault: str) -> None:
    controller = ScriptedController()
    controller.faults[request_name] = [fault]
    async with transferring(controller) as run:
        assert await run.end() == Settlement(Outcome.ACCEPTED)
    assert controller.accepted == [page()]
    assert controller.connects >= (1 if (request_name, fault) == ("read_page", "reply") else 2)


async def test_after_a_lost_commit_reply_the_answer_is_looked_for_before_anything_is_sent_again() -> None:
    controller = ScriptedController()
    controller.faults["commit"] = ["reply"]
    async with transferring(controller) as run:
        await run.end()
    assert controller.count("commit") == 1


async def test_after_a_lost_commit_reply_a_slow_answer_is_waited_for() -> None:
    """The commit may have been done: sending the page again would only be right after ack_timeout."""
    controller = ScriptedController([None])
    controller.faults["commit"] = ["reply"]

    def answer_later() -> None:
        accepted = replace(controller.link, last_job=JOB, last_result=1, ack_result=1, ack_transfer=controller.transfer)
        asyncio.get_running_loop().call_later(0.3, lambda: setattr(controller, "link", accepted))

    controller.before_commit = answer_later
    async with transferring(controller, replace(QUICK, ack_timeout_s=5)) as run:
        assert await run.end() == Settlement(Outcome.ACCEPTED)
    assert (controller.count("clear"), controller.count("commit")) == (1, 1)


async def test_every_attempt_commits_a_new_value_that_is_neither_0_nor_the_one_last_answered() -> None:
    controller = ScriptedController([Answer.BAD_CRC, None, Answer.ACCEPTED])
    async with transferring(controller) as run:
        assert (await run.end()).outcome is Outcome.ACCEPTED
    values = [value for name, value in controller.requests if name == "commit"]
    assert len(set(values)) == 3
    assert 0 not in values


def test_the_counter_never_gives_0_nor_what_was_last_answered() -> None:
    counter = TransferCounter(0xFFFD)
    assert [counter.next(0xFFFF), counter.next(0), counter.next(2), counter.next(2)] == [0xFFFE, 0xFFFF, 1, 3]


async def test_repeats_are_bit_identical() -> None:
    controller = ScriptedController([Answer.BAD_CRC, Answer.BAD_LAYOUT, Answer.ACCEPTED])
    async with transferring(controller) as run:
        await run.end()
    pages = {value for name, value in controller.requests if name == "write_page"}
    assert pages == {page()}


@pytest.mark.parametrize("answer", [Answer.BAD_CRC, Answer.BAD_LAYOUT, Answer.PAGE_MISSING, None])
async def test_after_three_attempts_in_vain_the_job_is_withdrawn_and_failed_with_150(answer: int | None) -> None:
    controller = ScriptedController([answer, answer, answer, Answer.WITHDRAWN])
    async with transferring(controller) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.CONTROLLER_TIMEOUT)
    assert run.durable == ["sent", "withdraw controller_timeout"]
    pages = [value for name, value in controller.requests if name == "write_page"]
    assert pages == [page()] * 3 + [withdrawal(JOB, SESSION, "big")]


async def test_a_job_that_was_accepted_before_its_withdrawal_arrived_is_accepted() -> None:
    controller = ScriptedController([None])
    async with transferring(controller) as run:

        def accept_late() -> None:
            if controller.count("commit") == 4:
                controller.link = type(controller.link)(
                    **{**vars(controller.link), "last_job": JOB, "last_result": int(Answer.ACCEPTED)}
                )

        controller.before_commit = accept_late
        assert await run.end() == Settlement(Outcome.ACCEPTED)


@pytest.mark.parametrize("answer", [Answer.GEOMETRY_REFUSED, Answer.EXPIRED, Answer.OPERATOR_REFUSED])
async def test_a_refusal_of_the_controller_settles_the_job_as_refused_with_its_answer(answer: Answer) -> None:
    async with transferring(ScriptedController([answer])) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.REFUSED, Reason.CONTROLLER_REFUSED)
    assert (settlement.detail or "").startswith(f"answer {int(answer)} {answer.name.lower()}")


async def test_an_acknowledgement_alone_settles_nothing() -> None:
    """ack_result 1 without last_job is no acceptance: the controller may have answered another's page."""
    controller = ScriptedController([None])

    def acknowledge_only() -> None:
        controller.link = type(controller.link)(
            **{**vars(controller.link), "ack_transfer": controller.transfer, "ack_result": int(Answer.OPERATOR_REFUSED)}
        )

    controller.before_commit = acknowledge_only
    async with transferring(controller) as run:
        task = asyncio.ensure_future(run.end())
        await asyncio.sleep(0.8)
        assert not task.done()
        controller.before_commit = lambda: None
        controller.answers = [Answer.WITHDRAWN]
        settlement = await task
    assert settlement.reason is Reason.CONTROLLER_TIMEOUT


async def test_not_ready_answers_are_waited_out_and_not_counted() -> None:
    controller = ScriptedController([Answer.NOT_READY] * 6 + [Answer.ACCEPTED])
    async with transferring(controller) as run:
        assert (await run.end()).outcome is Outcome.ACCEPTED


class Restless(ScriptedController):
    """Its block changes at each of the next `changes` reads."""

    changes = 0

    def shown(self) -> LinkBlock:
        self.changes -= 1
        return replace(super().shown(), recipe=self.changes if self.changes > 0 else 0)


async def test_a_block_that_is_never_twice_the_same_is_waited_out_and_is_no_attempt_in_vain() -> None:
    controller = Restless()
    async with transferring(controller) as run:
        controller.changes = 5 * READS_FOR_TWO_ALIKE
        controller.before_commit = lambda: setattr(controller, "changes", 5 * READS_FOR_TWO_ALIKE)
        assert (await run.end()).outcome is Outcome.ACCEPTED
    assert controller.count("commit") == 1


async def test_nothing_is_written_to_the_contour_block_while_the_controller_is_busy() -> None:
    controller = ScriptedController()
    controller.link = type(controller.link)(**{**vars(controller.link), "controller_state": 2})
    async with transferring(controller) as run:
        task = asyncio.ensure_future(run.end())
        await asyncio.sleep(0.1)
        assert controller.count("clear") == 0
        controller.link = type(controller.link)(**{**vars(controller.link), "controller_state": 1})
        assert (await task).outcome is Outcome.ACCEPTED


async def test_a_controller_that_does_not_become_ready_has_the_job_withdrawn() -> None:
    controller = ScriptedController()
    controller.link = type(controller.link)(**{**vars(controller.link), "controller_state": 2})
    async with transferring(controller) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.CONTROLLER_TIMEOUT)
    assert "busy" in (settlement.detail or "")
    assert controller.accepted == []


async def test_a_job_that_expires_while_it_waits_is_withdrawn_with_156() -> None:
    controller = ScriptedController()
    controller.link = type(controller.link)(**{**vars(controller.link), "controller_state": 2})
    async with transferring(controller, lifetime_s=0.1) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.EXPIRED)


async def test_contours_are_sent_only_while_the_test_echo_is_right() -> None:
    controller = ScriptedController()
    controller.link = type(controller.link)(**{**vars(controller.link), "test_echo": 0x01030304})
    async with transferring(controller) as run:
        task = asyncio.ensure_future(run.end())
        await asyncio.sleep(0.15)
        assert "word order differs" in (run.link.fault() or "")
        assert controller.count("clear") == 0
        controller.link = type(controller.link)(**{**vars(controller.link), "test_echo": 0x01020305})
        assert (await task).outcome is Outcome.ACCEPTED


async def test_a_restart_of_the_controller_without_memory_fails_the_job_with_153_and_sends_it_never_again() -> None:
    controller = ScriptedController([None])
    async with transferring(controller) as run:
        task = asyncio.ensure_future(run.end())
        await asyncio.sleep(0.05)
        controller.restart(10, memory=False)
        settlement = await task
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.CONTROLLER_RESTARTED)
    assert controller.accepted == []


async def test_a_restart_of_the_controller_after_it_accepted_settles_the_job_by_its_memory() -> None:
    controller = ScriptedController()
    controller.faults["commit"] = ["reply"]
    async with transferring(controller) as run:
        controller.reachable = True

        def restart_soon() -> None:
            asyncio.get_running_loop().call_later(0.01, lambda: controller.restart(10, memory=True))

        controller.before_commit = restart_soon
        assert await run.end() == Settlement(Outcome.ACCEPTED)


async def test_a_session_of_0_is_disregarded() -> None:
    controller = ScriptedController([None, Answer.ACCEPTED])
    kept = controller.link

    def blank_for_a_while() -> None:
        controller.link = type(kept)(test_echo=0x01020305, last_job=JOB + 5, last_result=1)
        asyncio.get_running_loop().call_later(0.3, lambda: setattr(controller, "link", kept))

    async with transferring(controller, replace(QUICK, ready_timeout_s=5)) as run:
        controller.before_commit = blank_for_a_while
        task = asyncio.ensure_future(run.end())
        await asyncio.sleep(0.2)  # over many heartbeats, so that it would hold
        controller.before_commit = lambda: None
        assert (await task).outcome is Outcome.ACCEPTED


async def test_a_higher_last_job_means_that_another_service_was_here() -> None:
    controller = ScriptedController()
    controller.link = type(controller.link)(**{**vars(controller.link), "last_job": JOB + 1, "last_result": 1})
    async with transferring(controller) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.OTHER_SERVICE)


async def test_a_sent_job_stays_in_flight_while_the_controller_is_away_and_is_settled_when_it_is_back() -> None:
    controller = ScriptedController([None])
    async with transferring(controller, lifetime_s=0.3) as run:
        task = asyncio.ensure_future(run.end())
        await asyncio.sleep(0.05)
        controller.reachable = False
        await asyncio.sleep(0.8)
        assert not task.done()
        controller.answers = [Answer.WITHDRAWN]
        controller.reachable = True
        settlement = await task
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.CONTROLLER_LOST)
    assert controller.link.last_job == JOB


async def test_a_job_of_which_nothing_was_sent_fails_when_the_controller_stays_away() -> None:
    controller = ScriptedController()
    controller.reachable = False
    async with transferring(controller, lifetime_s=0.2) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.CONTROLLER_LOST)
    assert run.durable == []


async def test_exception_responses_are_tried_again_and_then_withdrawn() -> None:
    controller = ScriptedController([Answer.WITHDRAWN])
    controller.faults["write_page"] = ["exception"] * 3
    async with transferring(controller) as run:
        settlement = await run.end()
    assert settlement.reason is Reason.CONTROLLER_TIMEOUT
    assert "exception 4" in (settlement.detail or "")


async def test_without_handshake_a_job_ends_as_written_never_as_accepted() -> None:
    controller = ScriptedController()
    async with transferring(controller, TransferSettings(handshake=False)) as run:
        assert await run.end() == Settlement(Outcome.WRITTEN)
    assert [name for name, _ in controller.requests if name != "write_service"] == [
        "clear",
        "write_page",
        "read_page",
        "commit",
    ]


async def test_without_handshake_repeats_carry_the_same_transfer_value() -> None:
    controller = ScriptedController()
    controller.faults["commit"] = ["request", "reply"]
    async with transferring(controller, TransferSettings(handshake=False)) as run:
        assert (await run.end()).outcome is Outcome.WRITTEN
    values = [value for name, value in controller.requests if name == "commit"]
    assert len(values) == 3
    assert len(set(values)) == 1


@pytest.mark.parametrize(
    ("result", "said"),
    [
        (1, "answer 1 accepted, but last_job is not 7"),
        (7, "answer 7 operator_refused, but last_job is not 7"),
        (99, "answer 99 unknown, which the protocol does not know"),
        (None, "no answer within 0.1 s"),
    ],
)
async def test_an_answer_that_last_job_does_not_confirm_is_none_and_told_as_what_it_is(
    result: int | None, said: str
) -> None:
    controller = ScriptedController([None])

    def acknowledge_only() -> None:
        if controller.count("commit") <= 3:
            if result is not None:
                controller.link = replace(controller.link, ack_transfer=controller.transfer, ack_result=result)
        else:
            controller.answers = [Answer.WITHDRAWN]

    controller.before_commit = acknowledge_only
    async with transferring(controller) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.CONTROLLER_TIMEOUT)
    assert said in (settlement.detail or "")


async def test_a_controller_that_says_ready_and_answers_not_ready_is_not_flooded() -> None:
    controller = ScriptedController([Answer.NOT_READY])
    async with transferring(controller, replace(QUICK, poll_period_s=0.05), lifetime_s=0.4) as run:
        task = asyncio.ensure_future(run.end())
        await asyncio.sleep(0.3)
        assert controller.count("commit") <= 8
        controller.answers = [Answer.WITHDRAWN]
        assert (await task).reason in (Reason.EXPIRED, Reason.CONTROLLER_REFUSED)


async def test_a_contour_that_became_too_old_while_it_was_made_durable_is_not_committed() -> None:
    controller = ScriptedController([Answer.WITHDRAWN])
    async with transferring(controller, lifetime_s=0.1) as run:

        async def slow_disk() -> None:
            await asyncio.sleep(0.2)

        run.transfer._steps = replace(run.transfer._steps, before_sending=slow_disk)
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.EXPIRED)
    assert controller.page == withdrawal(JOB, SESSION, "big")
    assert controller.count("commit") == 1, "of the withdrawal"


async def test_a_contour_that_nobody_answers_is_taken_back_as_soon_as_it_is_too_old() -> None:
    controller = ScriptedController([None, Answer.WITHDRAWN])
    async with transferring(controller, replace(QUICK, ack_timeout_s=60), lifetime_s=0.2) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.EXPIRED)


async def test_a_job_that_never_left_ends_though_the_controllers_program_stands_still() -> None:
    controller = ScriptedController()
    controller.beating = False
    async with transferring(controller) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.CONTROLLER_TIMEOUT)
    assert "heartbeat" in (settlement.detail or "")
    assert run.durable == []
    assert controller.count("clear") == 0


async def test_a_connection_lost_after_the_commit_is_no_reason_to_send_again() -> None:
    controller = ScriptedController([None])

    def lose_the_connection() -> None:
        controller.faults["read_link"] = ["request"]
        kept = controller.link
        asyncio.get_running_loop().call_later(
            0.25, lambda: setattr(controller, "link", replace(kept, last_job=JOB, last_result=1))
        )

    controller.before_commit = lose_the_connection
    async with transferring(controller, replace(QUICK, ack_timeout_s=5)) as run:
        assert await run.end() == Settlement(Outcome.ACCEPTED)
    assert controller.count("commit") == 1


async def test_a_withdrawal_that_nobody_decides_is_told() -> None:
    controller = ScriptedController([None])
    stuck: list[str] = []
    async with transferring(controller, replace(QUICK, max_repeats=1)) as run:
        run.transfer._steps = replace(run.transfer._steps, on_stuck=stuck.append)
        task = asyncio.ensure_future(run.end())
        while not stuck:
            await asyncio.sleep(0.02)
        assert stuck == ["job 7 cannot be taken back: no answer within 0.1 s"]
        assert not task.done()
        controller.answers = [Answer.WITHDRAWN]
        assert (await task).reason is Reason.CONTROLLER_TIMEOUT


async def test_no_contour_is_sent_before_the_service_block_is_confirmed() -> None:
    """It carries the acknowledgement of the trigger that the contour answers."""
    controller = ScriptedController()
    async with transferring(controller, replace(QUICK, ack_timeout_s=5)) as run:
        while run.link.fault() is not None:
            await asyncio.sleep(0.01)
        write_service, let_go = controller.write_service, asyncio.Event()

        async def slow(block: ServiceBlock) -> None:
            await let_go.wait()
            await write_service(block)

        controller.write_service = slow  # type: ignore[method-assign]
        run.link.publish(trigger_ack=5, session_ack=SESSION)
        task = asyncio.ensure_future(run.end())
        await asyncio.sleep(0.1)
        assert controller.count("clear") == 0
        let_go.set()
        assert await task == Settlement(Outcome.ACCEPTED)
        assert controller.service.trigger_ack == 5


async def test_without_handshake_a_contour_that_became_too_old_on_its_way_is_not_committed() -> None:
    controller = ScriptedController()
    async with transferring(controller, TransferSettings(handshake=False), lifetime_s=0.1) as run:

        async def slow_disk() -> None:
            await asyncio.sleep(0.2)

        run.transfer._steps = replace(run.transfer._steps, before_sending=slow_disk)
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.EXPIRED)
    assert controller.count("commit") == 0


@pytest.mark.parametrize("handshake", [True, False])
async def test_a_connection_that_was_opened_anew_begins_again_with_transfer_0(handshake: bool) -> None:
    """What was confirmed before says nothing of a controller that may have started again meanwhile."""
    controller = ScriptedController()
    async with transferring(controller, replace(QUICK, handshake=handshake)) as run:

        async def slow_disk() -> None:
            await controller.close()  # a heartbeat finds it out, while the transfer waits for the disk
            await until(lambda: controller.connects == 2 and run.link.fault() is None)

        run.transfer._steps = replace(run.transfer._steps, before_sending=slow_disk)
        settlement = await run.end()
    assert settlement.outcome in (Outcome.ACCEPTED, Outcome.WRITTEN)
    steps = [name for name, _ in controller.requests if name in ("clear", "write_page", "commit")]
    assert steps == ["clear", "clear", "write_page", "commit"]


async def test_a_block_that_does_not_hold_still_between_page_and_commit_is_no_attempt_in_vain() -> None:
    controller = ScriptedController([Answer.ACCEPTED])
    numbers = itertools.count(1)
    moving = 0
    async with transferring(controller) as run:
        write_page, read_link = controller.write_page, controller.read_link

        async def then_it_moves(page: Page) -> None:
            nonlocal moving
            await write_page(page)
            if controller.count("write_page") <= 2 * QUICK.max_repeats:
                # As after a look of the link's own that failed.
                run.link.reading.view, moving = None, 3 * READS_FOR_TWO_ALIKE

        async def moved() -> LinkBlock:
            nonlocal moving
            block, moving = await read_link(), max(0, moving - 1)
            return replace(block, recipe=next(numbers) & 0xFFFF) if moving else block

        controller.write_page, controller.read_link = then_it_moves, moved  # type: ignore[method-assign]
        settlement = await run.end()
    assert settlement.outcome is Outcome.ACCEPTED
    assert controller.count("write_page") == 2 * QUICK.max_repeats + 1
