"""One service per controller: what is found in `owner`, and what may then be written."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from drivers.controller.mailbox import Answer, LinkBlock, ServiceBlock
from service.link import Link
from service.ownership import ForeignOwner, Ownership
from service.reasons import Outcome, Reason
from service.transfer import TransferSettings
from tests.service.scripted_controller import ScriptedController
from tests.service.test_link import QUICK, linked
from tests.service.transferring import JOB, transferring
from tests.service.waiting import until

OURS, THEIRS = 100, 200


class Watched:
    """An ownership on a clock that the test moves."""

    def __init__(self) -> None:
        self.time = 0.0
        self.ownership = Ownership(OURS, now=lambda: self.time)

    def see(self, owner: int, beat: int = 0, *, after_s: float = 0.1) -> bool:
        self.time += after_s
        return self.ownership.saw(ServiceBlock(owner=owner, service_heartbeat=beat))

    def see_for(self, seconds: float, owner: int, beats: Iterable[int]) -> list[bool]:
        return [self.see(owner, beat) for beat in itertools.islice(beats, round(seconds * 10))]


@pytest.mark.parametrize("owner", [0, OURS])
def test_no_number_and_our_own_are_ours_at_once(owner: int) -> None:
    watched = Watched()
    assert watched.see(owner)
    assert watched.ownership.ours


def test_before_the_first_look_nothing_may_be_sent() -> None:
    with pytest.raises(ForeignOwner, match="not been read yet"):
        Watched().ownership.check()


def test_a_foreign_owner_whose_heartbeat_moves_is_left_alone_for_good() -> None:
    watched = Watched()
    assert not any(watched.see_for(20.0, THEIRS, itertools.count()))
    assert watched.ownership.lost
    assert "Stop one of the two" in (watched.ownership.fault() or "")
    assert not any(watched.see_for(20.0, THEIRS, itertools.repeat(7))), "also when it stops: a person decides"
    assert not watched.see(OURS)


def test_a_foreign_owner_whose_heartbeat_stands_for_3_s_is_taken_over_and_ours_must_stand_for_3_s_more() -> None:
    watched = Watched()
    assert watched.see_for(3.0, THEIRS, itertools.repeat(7)) == [False] * 30
    assert not watched.ownership.ours
    while not watched.see(THEIRS, 7):  # from here on our own stands there
        assert watched.time < 3.5
    claimed_at = watched.time
    while not watched.ownership.ours:
        assert watched.see(OURS), "the heartbeat goes on meanwhile"
        with suppress(ForeignOwner):
            watched.ownership.check()
            assert watched.ownership.ours
    assert 3.0 <= watched.time - claimed_at < 3.3


def test_a_heartbeat_that_moves_in_the_last_moment_counts() -> None:
    watched = Watched()
    watched.see_for(2.9, THEIRS, itertools.repeat(7))
    watched.see(THEIRS, 8)
    assert watched.ownership.conflict


def test_another_that_writes_while_ours_must_stand_is_watched_anew() -> None:
    watched = Watched()
    while not watched.see(THEIRS, 7):
        pass
    watched.see_for(1.0, OURS, itertools.count())
    assert not any(watched.see_for(2.0, THEIRS, itertools.repeat(9)))
    assert not watched.ownership.ours
    assert not watched.see(THEIRS, 10)
    assert watched.ownership.conflict


def test_a_pause_without_a_connection_is_no_time_of_watching() -> None:
    watched = Watched()
    watched.see_for(1.0, THEIRS, itertools.repeat(7))
    watched.ownership.disconnected()
    assert not watched.see(THEIRS, 7, after_s=60.0)
    assert watched.see_for(2.9, THEIRS, itertools.repeat(7)) == [False] * 29


def test_one_reading_alone_is_not_acted_on() -> None:
    watched = Watched()
    watched.see(OURS)
    assert not watched.see(THEIRS)
    assert not watched.ownership.lost
    assert watched.see(OURS)
    assert watched.ownership.ours


def test_a_foreign_owner_later_stops_all_writing() -> None:
    watched = Watched()
    watched.see(OURS)
    watched.see(THEIRS)
    assert not watched.see(THEIRS)
    assert watched.ownership.lost
    with pytest.raises(ForeignOwner):
        watched.ownership.check()


@example([(THEIRS, 0, 0.0), (THEIRS, 0, 0.0), (THEIRS, 0, 2.9)])  # hardly ever drawn, and what the rule is about
@given(st.lists(st.tuples(st.sampled_from([0, OURS, THEIRS, 300]), st.integers(0, 1), st.floats(0, 2.9)), max_size=60))
def test_nothing_is_written_over_another_that_moved_or_was_watched_for_less_than_3_s(
    readings: list[tuple[int, int, float]],
) -> None:
    watched = Watched()
    still: tuple[int, int] | None = None
    since = 0.0
    for owner, beat, after_s in readings:
        allowed = watched.see(owner, beat, after_s=after_s)
        if (owner, beat) != still:
            still, since = (owner, beat), watched.time
        if allowed and owner not in (0, OURS):
            assert watched.time - since >= 3.0


# --- over a link ------------------------------------------------------------------------------------------------


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
    monkeypatch.setattr("service.ownership.WATCH_S", 0.3)


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

        async def on_found(block: ServiceBlock) -> None:
            assert controller.count("write_service") == 0, "told before it is overwritten"
            found.append(block)

        link.on_found = on_found
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
    assert steps[:10] == ["read", "write"] * 5


async def test_a_job_in_flight_fails_with_155_when_another_service_comes_and_nothing_more_is_written() -> None:
    controller = ScriptedController([None])
    async with transferring(controller) as run:
        run.link.publish(owner=OURS)
        task = asyncio.ensure_future(run.end())
        await until(lambda: controller.count("commit") == 1)
        controller.service = ServiceBlock(owner=THEIRS)
        settlement = await task
        after = len(controller.requests)
        await asyncio.sleep(0.2)
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.OTHER_SERVICE)
    assert written(controller) <= {"clear", "write_page", "read_page", "commit", "write_service"}
    assert len(controller.requests) == after
    assert controller.service.owner == THEIRS


async def test_a_job_is_called_accepted_only_after_the_owner_was_read_once_more() -> None:
    """The other's job may have the same number: `last_job` alone does not say whose contour was accepted."""
    controller = ScriptedController([Answer.ACCEPTED])

    def another_comes() -> None:
        controller.service = ServiceBlock(owner=THEIRS)

    controller.before_commit = another_comes
    async with transferring(controller) as run:
        run.link.publish(owner=OURS)
        settlement = await run.end()
    assert controller.link.last_job == JOB
    assert (settlement.outcome, settlement.reason) == (Outcome.FAILED, Reason.OTHER_SERVICE)


async def test_a_withdrawal_ends_when_another_service_comes() -> None:
    controller = ScriptedController([None])
    async with transferring(controller) as run:
        run.link.publish(owner=OURS)
        task = asyncio.ensure_future(run.end())
        await until(lambda: run.durable == ["sent", "withdraw controller_timeout"])
        controller.service = ServiceBlock(owner=THEIRS)
        settlement = await task
    assert settlement.reason is Reason.OTHER_SERVICE


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

        async def slow_disk(block: ServiceBlock) -> None:
            controller.service = replace(block, service_heartbeat=block.service_heartbeat + 1)

        link.on_found = slow_disk
        link.publish(owner=OURS)
        await asyncio.sleep(0.6)
    assert written(controller) == set()


async def test_what_another_left_is_not_taken_over_before_the_controllers_block_holds_still(short_watch: None) -> None:
    """In which session its job is to be taken back would not be known."""
    controller = ScriptedController()
    Another(controller, alive=False)
    sessions: list[int | None] = []
    async with linked(controller) as link:

        async def on_found(_block: ServiceBlock) -> None:
            sessions.append(link.view.session if link.view else None)

        link.on_found = on_found
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
