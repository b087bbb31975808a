"""A contour of several pages: page after page, what each answer leads to, repeats bit-identical."""

from __future__ import annotations

import asyncio
from dataclasses import replace

import numpy as np
import pytest

from drivers.controller.mailbox.blocks import Answer
from drivers.controller.mailbox.pages import ContourMessage, Page, encode_pages, withdrawal
from service.link.transfer_terms import Settlement
from service.reasons import Outcome, Reason
from tests.support.service.scripted_controller import ScriptedController
from tests.support.service.transferring import JOB, QUICK, SESSION, transferring


def pages(count: int) -> tuple[Page, ...]:
    """A square of `count` pages, each of at most 8 registers: ring table and a point, then two points a page."""
    points = 1 + 2 * (count - 1)
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    ring = np.rint(100_000 * np.column_stack([np.cos(angle), np.sin(angle)])).astype(np.int64)
    made = encode_pages(ContourMessage(JOB, (ring,), 5000, None, 1, 1, False, False, 30_000, SESSION), 8, "big")
    assert len(made) == count
    return made


def sent(controller: ScriptedController) -> list[Page]:
    return [value for name, value in controller.requests if name == "write_page"]  # type: ignore[misc]


async def test_pages_are_sent_in_order_each_under_a_cleared_and_then_a_new_transfer() -> None:
    controller = ScriptedController()
    made = pages(12)
    async with transferring(controller, pages=made) as run:
        assert await run.end() == Settlement(Outcome.ACCEPTED)
    assert sent(controller) == list(made)
    steps = [name for name, _ in controller.requests if name != "write_service"]
    assert steps == ["clear", "write_page", "read_page", "commit"] * 12
    commits = [value for name, value in controller.requests if name == "commit"]
    assert len(set(commits)) == 12
    assert run.durable == ["sent"], "all pages in one step, before the first request"


@pytest.mark.parametrize("answer", [Answer.BAD_CRC, Answer.BAD_LAYOUT, None])
async def test_after_2_3_or_silence_the_same_page_comes_again_bit_identical(answer: int | None) -> None:
    controller = ScriptedController([Answer.ACCEPTED, answer, Answer.ACCEPTED])
    made = pages(3)
    async with transferring(controller, pages=made) as run:
        assert (await run.end()).outcome is Outcome.ACCEPTED
    assert sent(controller) == [made[0], made[1], made[1], made[2]]


async def test_after_9_it_begins_with_page_1_again() -> None:
    controller = ScriptedController([Answer.ACCEPTED, Answer.ACCEPTED, Answer.PAGE_MISSING, Answer.ACCEPTED])
    made = pages(4)
    async with transferring(controller, pages=made) as run:
        assert (await run.end()).outcome is Outcome.ACCEPTED
    assert sent(controller) == [*made[:3], *made]


async def test_after_10_it_waits_and_sends_the_same_page_again_as_often_as_it_takes() -> None:
    controller = ScriptedController([Answer.ACCEPTED, *[Answer.NOT_READY] * 5, Answer.ACCEPTED])
    made = pages(2)
    async with transferring(controller, pages=made) as run:
        assert (await run.end()).outcome is Outcome.ACCEPTED
    assert sent(controller) == [made[0], *[made[1]] * 6]


async def test_a_controller_that_becomes_busy_between_two_pages_is_waited_for() -> None:
    controller = ScriptedController()
    made = pages(3)
    async with transferring(controller, pages=made) as run:

        def busy_after_the_first() -> None:
            if controller.count("commit") == 1:
                controller.link = replace(controller.link, controller_state=2)

        controller.before_commit = busy_after_the_first
        task = asyncio.ensure_future(run.end())
        await asyncio.sleep(0.15)
        assert sent(controller) == [made[0]]
        controller.link = replace(controller.link, controller_state=1)
        assert (await task).outcome is Outcome.ACCEPTED


async def test_a_page_that_is_missing_again_and_again_is_no_progress_and_the_job_is_withdrawn() -> None:
    """Page 1 is taken each time; counting from it anew would go round until the contour is too old."""
    controller = ScriptedController([Answer.ACCEPTED, Answer.PAGE_MISSING] * 20)
    made = pages(2)
    async with transferring(controller, pages=made) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.CONTROLLER_TIMEOUT)
    assert "answer 9 page_missing" in (settlement.detail or "")
    assert sent(controller) == [*made, *made, *made, withdrawal(JOB, SESSION, "big")]


async def test_each_page_that_is_taken_gives_the_next_one_its_own_three_attempts() -> None:
    controller = ScriptedController([None, None, Answer.ACCEPTED, None, None, Answer.ACCEPTED])
    made = pages(2)
    async with transferring(controller, pages=made) as run:
        assert (await run.end()).outcome is Outcome.ACCEPTED
    assert sent(controller) == [*[made[0]] * 3, *[made[1]] * 3]


async def test_a_job_is_not_accepted_before_its_last_page_is() -> None:
    controller = ScriptedController([Answer.ACCEPTED, Answer.ACCEPTED, None])
    controller.withdraws = True
    async with transferring(controller, pages=pages(3)) as run:
        settlement = await run.end()
    assert settlement.reason is Reason.CONTROLLER_TIMEOUT
    assert run.durable == ["sent", "withdraw controller_timeout"]


@pytest.mark.parametrize("answer", [Answer.EXPIRED, Answer.OPERATOR_REFUSED, Answer.GEOMETRY_REFUSED])
async def test_a_final_answer_to_any_page_ends_the_job(answer: Answer) -> None:
    controller = ScriptedController([Answer.ACCEPTED, answer])
    made = pages(4)
    async with transferring(controller, pages=made) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.REFUSED, Reason.CONTROLLER_REFUSED)
    assert sent(controller) == list(made[:2])


@pytest.mark.parametrize("request_name", ["clear", "write_page", "commit"])
@pytest.mark.parametrize("fault", ["request", "reply"])
async def test_a_connection_lost_between_pages_goes_on_where_it_was(request_name: str, fault: str) -> None:
    controller = ScriptedController()
    controller.faults[request_name] = ["", fault]
    made = pages(3)
    async with transferring(controller, pages=made) as run:
        assert await run.end() == Settlement(Outcome.ACCEPTED)
    assert controller.accepted == [made[-1]]
    assert set(sent(controller)) == set(made)


async def test_pages_that_outlive_the_contour_are_withdrawn() -> None:
    controller = ScriptedController([Answer.ACCEPTED, Answer.NOT_READY])
    controller.withdraws = True
    async with transferring(controller, QUICK, lifetime_s=0.2, pages=pages(3)) as run:
        settlement = await run.end()
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.EXPIRED)
