"""A job that an earlier process left in flight is brought to its end, by what the journal holds of it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from drivers.controller.mailbox.blocks import Answer, ServiceBlock
from drivers.controller.mailbox.pages import Page
from service.reasons import Outcome, Reason
from service.records.job import Job, Progress, Terms, TriggerStamp
from tests.support.service.cycle_rig import QUICK, SETTINGS, Rig, rig
from tests.support.service.scripted_controller import ScriptedController
from tests.support.service.transferring import page


async def resumed(built: Rig, prepare: Callable[[int], None]) -> Job:
    """A job that an earlier process left in flight, brought to its end."""
    taken = built.journal.take(TriggerStamp("controller", session=9, counter=5))
    prepare(taken.job_id)
    (job,) = built.journal.unsettled()
    return await asyncio.wait_for(built.cycle.resume(job), 15)


async def test_a_job_of_which_nothing_was_sent_ends_with_154(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        job = await resumed(built, lambda _job: None)
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.SERVICE_RESTARTED)
        assert built.controller.count("write_page") == 0


async def test_a_sent_job_is_sent_again_bit_identical(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        job = await resumed(built, lambda job_id: built.journal.store_pages(job_id, 9, (page(job_id),)))
        assert job.outcome is Outcome.ACCEPTED
        assert built.controller.accepted == [page(job.job_id)]


async def test_what_was_known_of_a_job_before_the_restart_stays_its_own(tmp_path: Path) -> None:
    report, figures, terms = {"vertices": 4, "area_mm2": 5000.0}, {"pages": 1}, Terms({"number": 1}, "sha256:aa")
    async with rig(tmp_path) as built:
        prepare = built.journal.store_pages
        job = await resumed(built, lambda job_id: prepare(job_id, 9, (page(job_id),), Progress(terms, report, figures)))
        assert job.outcome is Outcome.ACCEPTED
        assert (job.report, job.transfer, job.terms) == (report, figures, terms)
        assert [(kept.job, kept.frame) for kept in built.keeper.kept] == [(job, None)], "the archive has the rest"


async def test_a_job_that_was_accepted_before_the_crash_is_accepted_without_being_sent(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:

        def prepare(job_id: int) -> None:
            built.journal.store_pages(job_id, 9, (page(job_id),))
            built.controller.link = replace(built.controller.link, last_job=job_id, last_result=1)

        job = await resumed(built, prepare)
        assert job.outcome is Outcome.ACCEPTED
        assert built.controller.count("write_page") == 0


async def test_a_job_of_an_earlier_session_ends_with_153_and_is_not_sent(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        job = await resumed(built, lambda job_id: built.journal.store_pages(job_id, 8, (page(job_id),)))
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.CONTROLLER_RESTARTED)
        assert built.controller.count("write_page") == 0


async def test_a_withdrawal_that_was_cut_short_is_finished_with_its_first_reason(tmp_path: Path) -> None:
    async with rig(tmp_path, controller=ScriptedController([Answer.WITHDRAWN])) as built:

        def prepare(job_id: int) -> None:
            built.journal.store_pages(job_id, 9, (page(job_id),))
            built.journal.store_withdrawal(job_id, Reason.EXPIRED)

        job = await resumed(built, prepare)
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.EXPIRED)
        assert built.controller.accepted == []


async def test_without_handshake_a_sent_job_found_in_flight_ends_with_154(tmp_path: Path) -> None:
    settings = replace(SETTINGS, transfer=replace(QUICK, handshake=False))
    async with rig(tmp_path, settings) as built:
        job = await resumed(built, lambda job_id: built.journal.store_pages(job_id, 0, (page(job_id),)))
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.SERVICE_RESTARTED)


async def test_a_sent_job_without_a_limit_of_its_own_is_taken_back_after_a_restart(tmp_path: Path) -> None:
    """How long the service was away cannot be known, and a controller without a clock would take it at any age."""
    async with rig(tmp_path, controller=ScriptedController([Answer.WITHDRAWN])) as built:

        def prepare(job_id: int) -> None:
            sent = page(job_id)
            endless = Page((*sent.header[:27], 0, 0, *sent.header[29:]), sent.payload)
            built.journal.store_pages(job_id, 9, (endless,))

        job = await resumed(built, prepare)
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.SERVICE_RESTARTED)
        assert built.controller.link.last_result == Answer.WITHDRAWN


async def test_a_job_that_was_found_without_its_pages_is_withdrawn_with_154(tmp_path: Path) -> None:
    async with rig(tmp_path, controller=ScriptedController([Answer.WITHDRAWN])) as built:
        built.journal.go_on_above(ServiceBlock(job_id=70, trigger_ack=6, session_ack=9), (9, 6), 1000)
        (job,) = built.journal.unsettled()
        settled = await asyncio.wait_for(built.cycle.resume(job), 15)
        assert (settled.outcome, settled.reason) == (Outcome.FAILED, Reason.SERVICE_RESTARTED)
        assert built.controller.link.last_job == 70


async def test_a_job_that_was_found_and_had_been_accepted_is_accepted(tmp_path: Path) -> None:
    async with rig(tmp_path) as built:
        built.controller.link = replace(built.controller.link, last_job=70, last_result=1)
        built.journal.go_on_above(ServiceBlock(job_id=70, trigger_ack=6, session_ack=9), (9, 6), 1000)
        (job,) = built.journal.unsettled()
        settled = await asyncio.wait_for(built.cycle.resume(job), 15)
        assert settled.outcome is Outcome.ACCEPTED
        assert built.controller.count("write_page") == 0


async def test_a_sent_job_whose_pages_cannot_be_read_any_more_is_withdrawn_with_154(tmp_path: Path) -> None:
    async with rig(tmp_path, controller=ScriptedController([Answer.WITHDRAWN])) as built:
        taken = built.journal.take(TriggerStamp("serial"))
        built.journal.store_pages(taken.job_id, 9, (Page((0,) * 31, ()),))
        built.journal._file.db.execute("UPDATE jobs SET pages = 'rotten' || substr(pages, 7)")
        (job,) = built.journal.unsettled()
        settled = await asyncio.wait_for(built.cycle.resume(job), 15)
        assert (settled.outcome, settled.reason) == (Outcome.FAILED, Reason.SERVICE_RESTARTED)
        assert built.controller.link.last_result == Answer.WITHDRAWN


@pytest.mark.parametrize("hours", [6, -6])
async def test_a_job_taken_longer_ago_than_it_is_valid_is_taken_back_after_a_restart_not_sent_again(
    tmp_path: Path, hours: int
) -> None:
    """The controller may be a spare one by now, which never saw it, with the same session; it need not be there yet."""
    async with rig(tmp_path) as built:

        def prepare(job_id: int) -> None:
            built.journal.store_pages(job_id, 9, (page(job_id),))
            then = (datetime.now(UTC) - timedelta(hours=hours)).isoformat(timespec="milliseconds")
            built.journal._file.db.execute("UPDATE jobs SET taken_at = ?", (then,))
            built.controller.reachable = False
            asyncio.get_running_loop().call_later(0.2, lambda: setattr(built.controller, "reachable", True))

        job = await resumed(built, prepare)
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.EXPIRED)
        assert built.controller.accepted == []
        assert built.controller.link.last_result == Answer.WITHDRAWN


@pytest.mark.parametrize(
    ("was", "put_back"),
    [
        ({"kind": "modbus-tcp", "word_order": "little"}, "Put back controller.word_order: little, "),
        ({"kind": "modbus-rtu", "port": "/dev/ttyS0"}, "controller.kind: modbus-rtu, controller.port: /dev/ttyS0"),
    ],
)
async def test_a_job_sent_to_another_controller_is_settled_by_nothing_else(
    tmp_path: Path, was: dict[str, str], put_back: str
) -> None:
    async with rig(tmp_path) as built:
        built.cycle._settings = replace(built.cycle._settings, target={"kind": "modbus-tcp", "word_order": "big"})
        job = built.journal.take(TriggerStamp("serial"))
        assert built.cycle.hindrance(job) is None, "nothing of it was sent"
        built.journal.store_pages(job.job_id, 9, (page(job.job_id),), target=was)
        (sent,) = built.journal.unsettled()
        assert put_back in (built.cycle.hindrance(sent) or "")
        built.cycle._settings = replace(built.cycle._settings, target=was)
        assert built.cycle.hindrance(sent) is None
