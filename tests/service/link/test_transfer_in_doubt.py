"""What the controller's block seems to say: values half written, blocks misread, contours too old to be sent again."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import replace

import pytest

from drivers.controller.mailbox.blocks import Answer
from service.link.transfer_terms import Lifetime
from service.reasons import Outcome, Reason
from tests.support.service.scripted_controller import ScriptedController
from tests.support.service.transferring import JOB, QUICK, transferring
from tests.support.service.waiting import until

PATIENT = replace(QUICK, ack_timeout_s=5.0, ready_timeout_s=5.0)


@pytest.mark.parametrize("torn", [JOB + 0x0001_0000, 0xFFFF_FFFD])
async def test_a_last_job_that_stands_half_written_for_a_scan_fails_no_job(torn: int) -> None:
    controller = ScriptedController([None])
    async with transferring(controller, PATIENT) as run:
        task = asyncio.ensure_future(run.end())
        await until(lambda: controller.count("commit") == 1)
        controller.beating = False  # it waits until no value is half written
        controller.link = replace(controller.link, last_result=1, last_job=torn)
        await asyncio.sleep(0.15)
        assert not task.done()
        controller.link = replace(controller.link, last_job=JOB, ack_result=1, ack_transfer=controller.transfer)
        settlement = await task
        controller.beating = True
    assert settlement.outcome is Outcome.ACCEPTED


async def test_without_our_acknowledgement_last_job_settles_only_once_it_holds() -> None:
    controller = ScriptedController([None])
    async with transferring(controller, PATIENT) as run:
        task = asyncio.ensure_future(run.end())
        await until(lambda: controller.count("commit") == 1)
        controller.beating = False
        controller.link = replace(controller.link, last_result=1, last_job=JOB)
        await asyncio.sleep(0.15)
        assert not task.done()
        controller.beating = True
        assert (await task).outcome is Outcome.ACCEPTED


@pytest.mark.parametrize(("ack_result", "last_result"), [(4, 1), (1, 4), (6, 7)])
async def test_an_acknowledgement_that_says_something_else_than_last_result_settles_nothing_at_once(
    ack_result: int, last_result: int
) -> None:
    controller = ScriptedController([None])
    async with transferring(controller, PATIENT) as run:
        task = asyncio.ensure_future(run.end())
        await until(lambda: controller.count("commit") == 1)
        controller.beating = False
        controller.link = replace(
            controller.link,
            last_result=last_result,
            last_job=JOB,
            ack_result=ack_result,
            ack_transfer=controller.transfer,
        )
        await asyncio.sleep(0.15)
        assert not task.done()
        controller.beating = True
        await task


async def test_accepted_before_is_an_acknowledgement_of_accepted() -> None:
    controller = ScriptedController([None])
    async with transferring(controller, PATIENT) as run:
        task = asyncio.ensure_future(run.end())
        await until(lambda: controller.count("commit") == 1)
        controller.beating = False
        said = {"last_result": 1, "last_job": JOB, "ack_result": 6, "ack_transfer": controller.transfer}
        controller.link = replace(controller.link, **said)
        assert (await task).outcome is Outcome.ACCEPTED
        controller.beating = True


def seems_ended(controller: ScriptedController) -> None:
    controller.link = replace(controller.link, last_job=JOB + 1)


def seems_restarted(controller: ScriptedController) -> None:
    controller.link = replace(controller.link, session=10)


def seems_accepted(controller: ScriptedController) -> None:
    controller.link = replace(controller.link, last_job=JOB, last_result=1)


@pytest.mark.parametrize(
    ("seems", "outcome"),
    [(seems_ended, Outcome.FAILED), (seems_restarted, Outcome.FAILED), (seems_accepted, Outcome.ACCEPTED)],
)
async def test_nothing_is_sent_while_the_job_may_have_ended(
    seems: Callable[[ScriptedController], None], outcome: Outcome
) -> None:
    controller = ScriptedController([Answer.NOT_READY])
    async with transferring(controller, PATIENT) as run:
        run.link.publish(job_id=JOB)
        task = asyncio.ensure_future(run.end())
        await until(lambda: controller.count("commit") == 2)
        controller.beating = False
        seems(controller)
        await asyncio.sleep(0.05)
        sent = controller.count("commit")
        await asyncio.sleep(0.1)
        assert controller.count("commit") == sent
        assert not task.done()
        controller.beating = True
        assert (await task).outcome is outcome


async def test_nothing_is_concluded_from_a_block_that_is_misread() -> None:
    """Started again with another word order: last_job is read as another number, and another session may be too."""
    controller = ScriptedController([None])
    async with transferring(controller, PATIENT) as run:
        task = asyncio.ensure_future(run.end())
        await until(lambda: controller.count("commit") == 1)
        right = controller.link
        controller.link = replace(right, test_echo=0x01030304, last_job=JOB << 16, session=77)
        await asyncio.sleep(0.2)
        controller.link = replace(right, test_echo=0x01030304, last_job=JOB, last_result=int(Answer.WITHDRAWN))
        await asyncio.sleep(0.2)
        assert not task.done()
        controller.link = replace(right, last_job=JOB, last_result=1)
        assert (await task).outcome is Outcome.ACCEPTED


@pytest.mark.parametrize("age_s", [31.0, -5.0])
async def test_what_was_taken_longer_ago_than_it_may_live_is_withdrawn_never_sent_again(age_s: float) -> None:
    """A controller put in the place of another may show the same session: only our own clock knows."""
    controller = ScriptedController([Answer.ACCEPTED])
    async with transferring(controller, PATIENT) as run:
        run.transfer._sent = True
        run.transfer._lifetime = Lifetime(time.monotonic() + 30, time.time() - age_s, 30.0)
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.EXPIRED)
    assert controller.accepted == []
    assert controller.link.last_result == Answer.WITHDRAWN


async def test_a_repeat_is_not_sent_once_the_machines_clock_says_that_it_is_too_old() -> None:
    unix_s = 1000.0
    controller = ScriptedController([Answer.BAD_CRC, Answer.ACCEPTED])

    def suspended() -> None:
        nonlocal unix_s
        unix_s += 3600.0  # which the monotonic clock does not count

    controller.before_commit = suspended
    async with transferring(controller, PATIENT) as run:
        run.transfer._lifetime = Lifetime(time.monotonic() + 30, 999.0, 30.0, unix=lambda: unix_s)
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.EXPIRED)
    assert controller.accepted == []
