"""What the protocol asks of a controller, tried on a real one (`make hil`) or, without one, on the simulated one.

All but the last tests send withdrawals, pages that no controller may accept, and page 1 of 2 alone: no whole contour is
ever there, so nothing can move, also where the controller is wrong. Those that send whole contours need MOVE=yes.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

from drivers.controller.mailbox.pages import Page, withdrawal
from service.commissioning.hil import Bench

ACCEPTED, BAD_CRC, BAD_LAYOUT, EXPIRED, ACCEPTED_BEFORE, OUTDATED = 1, 2, 3, 5, 6, 8
PAGE_MISSING, NOT_READY, WITHDRAWN = 9, 10, 11
HOLE_UM = ((20_000, 20_000), (20_000, 40_000), (40_000, 40_000), (40_000, 20_000))
READY_S = 30.0


@pytest.fixture
def job(hil: Bench) -> Iterator[int]:
    """A new job, withdrawn at the end, so that the controller holds no page of it."""
    hil.wait_for(lambda link: link.controller_state == 1, "controller_state 1 (ready)", READY_S)
    new = hil.new_job()
    yield new
    if hil.link().last_job < new:
        assert hil.withdraw(new).result == WITHDRAWN


# --- the link block -------------------------------------------------------------------------------------------------


def test_there_is_a_session_and_a_state_that_the_protocol_knows(hil: Bench) -> None:
    link = hil.link()
    assert link.session != 0
    assert link.controller_state in (0, 1, 2, 3)


def test_the_heartbeat_changes_at_least_once_a_second(hil: Bench) -> None:
    before = hil.link().controller_heartbeat
    hil.wait_for(lambda link: link.controller_heartbeat != before, "another controller_heartbeat", 1.0)


def test_the_echo_is_the_test_value_plus_one_as_a_32_bit_number(hil: Bench) -> None:
    hil.wait_for(lambda link: link.test_echo == 0x01020305, "test_echo 0x01020305: check word_order", 2.0)


def test_the_clock_runs_in_milliseconds_or_is_0_for_ever(hil: Bench) -> None:
    before, started = hil.link().clock, time.monotonic()
    time.sleep(0.5)
    after = hil.link().clock
    passed_ms = (time.monotonic() - started) * 1000
    if before or after:
        assert abs((after - before) % 2**32 - passed_ms) < 250
    else:
        time.sleep(1)
        assert hil.link().clock == 0


def test_a_page_reads_back_as_it_was_written(hil: Bench) -> None:
    page = hil.first_of_two(hil.new_job())
    hil.place(page)
    assert hil.read_back(page) == page
    hil.clear()


def test_transfer_0_is_not_answered(hil: Bench) -> None:
    before = hil.link()
    hil.clear()
    time.sleep(0.3)
    after = hil.link()
    assert (after.ack_transfer, after.ack_result) == (before.ack_transfer, before.ack_result)


# --- answers that move nothing --------------------------------------------------------------------------------------


def test_a_withdrawal_is_answered_11_and_becomes_the_last_job(hil: Bench, job: int) -> None:
    answered = hil.withdraw(job)
    assert answered.result == WITHDRAWN
    assert (answered.link.last_job, answered.link.last_result) == (job, WITHDRAWN)


def test_a_withdrawal_is_answered_while_the_machine_is_in_any_state_and_again_the_same(hil: Bench) -> None:
    new = hil.new_job()
    assert [hil.withdraw(new).result for _ in range(2)] == [WITHDRAWN, WITHDRAWN]


def test_a_page_of_a_withdrawn_job_is_answered_11_ever_after(hil: Bench, job: int) -> None:
    hil.withdraw(job)
    assert hil.send(hil.first_of_two(job)).result == WITHDRAWN


def refused(hil: Bench, page: Page, answer: int) -> None:
    """The page gets the answer, and the last job stays as it was."""
    before = hil.link()
    answered = hil.send(page)
    assert answered.result == answer
    assert (answered.link.last_job, answered.link.last_result) == (before.last_job, before.last_result)


@pytest.mark.parametrize("place", ["header", "payload"])
def test_a_torn_page_is_answered_2(hil: Bench, job: int, place: str) -> None:
    page = hil.first_of_two(job)
    if place == "header":
        torn = Page((*page.header[:25], page.header[25] ^ 1, *page.header[26:]), page.payload)
    else:
        torn = Page(page.header, (*page.payload[:-1], page.payload[-1] ^ 1))
    refused(hil, torn, BAD_CRC)


def test_a_layout_that_nobody_knows_is_answered_3(hil: Bench, job: int) -> None:
    refused(hil, hil.sealed(hil.first_of_two(job), {1: 7}), BAD_LAYOUT)


def test_a_payload_longer_than_the_block_is_answered_3(hil: Bench, job: int) -> None:
    too_long = hil.layout.payload_capacity + 2
    refused(hil, hil.sealed(hil.first_of_two(job), {7: too_long}), BAD_LAYOUT)


def test_a_page_of_another_session_is_answered_8(hil: Bench, job: int) -> None:
    other = hil.link().session % 0xFFFF + 1
    refused(hil, hil.first_of_two(job, session=other), OUTDATED)


def test_a_withdrawal_of_another_session_is_answered_8_too(hil: Bench, job: int) -> None:
    other = hil.link().session % 0xFFFF + 1
    refused(hil, withdrawal(job, other, hil.layout.word_order), OUTDATED)


def test_a_job_older_than_the_last_one_is_answered_8(hil: Bench, job: int) -> None:
    hil.withdraw(job)
    hil.withdraw(job + 1)
    refused(hil, hil.first_of_two(job), OUTDATED)


def test_an_expired_page_is_answered_5_and_that_is_final(hil: Bench, job: int) -> None:
    clock = hil.link().clock
    if clock == 0:
        pytest.skip("the controller has no clock, so it does not judge ages")
    answered = hil.send(hil.first_of_two(job, captured_at=(clock - 10_000) % 2**32, valid_for_ms=2_000))
    assert answered.result == EXPIRED
    assert (answered.link.last_job, answered.link.last_result) == (job, EXPIRED)


def test_a_page_for_a_trigger_that_is_not_the_last_one_is_answered_5(hil: Bench, job: int) -> None:
    other = hil.link().trigger_counter % 0xFFFF + 1
    assert hil.send(hil.first_of_two(job, trigger=other)).result == EXPIRED


def test_page_2_without_page_1_is_answered_9(hil: Bench, job: int) -> None:
    page = hil.sealed(hil.first_of_two(job), {4: 2, 5: 3})
    refused(hil, page, PAGE_MISSING)


def test_page_1_of_2_is_held_and_its_repeat_too_until_the_job_is_withdrawn(hil: Bench, job: int) -> None:
    page = hil.first_of_two(job)
    refused(hil, page, ACCEPTED)
    refused(hil, page, ACCEPTED)
    assert hil.withdraw(job).result == WITHDRAWN


def test_a_commit_value_that_was_answered_already_is_not_answered_again(hil: Bench, job: int) -> None:
    page = hil.first_of_two(job)
    hil.send(page)
    before = hil.link()
    hil.place(hil.sealed(page, {1: 7}))
    hil.write_transfer(before.ack_transfer)
    time.sleep(0.3)
    assert hil.link().ack_result == before.ack_result
    hil.clear()


# --- whole contours: the machine may move ---------------------------------------------------------------------------


def test_a_contour_is_accepted_once_and_its_repeat_is_answered_6(hil_moves: Bench, job: int) -> None:
    hil = hil_moves
    (page,) = hil.pages(job, (((0, 0), (100_000, 0), (100_000, 50_000), (0, 50_000)), HOLE_UM))
    answered = hil.send(page)
    assert answered.result == ACCEPTED
    assert (answered.link.last_job, answered.link.last_result) == (job, ACCEPTED)
    assert hil.send(page).result == ACCEPTED_BEFORE
    assert hil.withdraw(job).result == ACCEPTED_BEFORE


def test_a_contour_whose_box_contradicts_its_points_is_not_accepted(hil_moves: Bench, job: int) -> None:
    hil = hil_moves
    (page,) = hil.pages(job)
    refused(hil, hil.sealed(page, {18: 3}), BAD_LAYOUT)


def test_a_contour_of_two_pages_is_accepted_with_the_second(hil_moves: Bench, job: int) -> None:
    hil = hil_moves
    (page,) = hil.pages(job)
    first = hil.first_of_two(job)
    second = hil.sealed(Page(page.header, page.payload[len(first.payload) :]), {4: 2, 5: 2, 7: 8})
    assert hil.send(first).result == ACCEPTED
    assert hil.link().last_job < job
    answered = hil.send(second)
    assert answered.result == ACCEPTED
    assert (answered.link.last_job, answered.link.last_result) == (job, ACCEPTED)
