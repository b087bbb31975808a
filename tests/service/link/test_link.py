"""The link: two reads alike, heartbeats both ways, the clock that must fit, losses found and resumed alone."""

from __future__ import annotations

import asyncio
import itertools
import logging
from dataclasses import replace
from typing import Any

import pytest

from drivers.controller.mailbox.blocks import LinkBlock
from service.link.link import Link, LinkListener, LinkSettings
from service.link.reading import LinkUnsteady, steady
from tests.support.service.linked import QUICK, linked
from tests.support.service.scripted_controller import ScriptedController
from tests.support.service.waiting import until


class Reading:
    """A controller whose link block is read from a list, one a read, each at its time."""

    connected = True

    def __init__(self, *blocks: LinkBlock, times: list[float] | None = None) -> None:
        self.blocks = list(blocks)
        self._times = iter(times or ())
        self.now = 0.0

    async def read_link(self) -> LinkBlock:
        self.now = next(self._times, self.now)
        return self.blocks.pop(0)


def link_over(*blocks: LinkBlock, times: list[float] | None = None) -> Link:
    reading = Reading(*blocks, times=times)
    return Link(reading, QUICK, now=lambda: reading.now)  # type: ignore[arg-type]


async def test_a_block_counts_only_when_two_reads_in_a_row_show_it() -> None:
    half = LinkBlock(session=9, last_result=1)
    whole = LinkBlock(session=9, last_result=1, last_job=7)
    link = link_over(LinkBlock(session=9), half, whole, whole)
    assert await link.look() == whole
    assert link.view == whole


async def test_heartbeat_clock_and_echo_may_differ_between_the_two_reads() -> None:
    first = LinkBlock(session=9, controller_heartbeat=1, clock=10, test_echo=5)
    second = replace(first, controller_heartbeat=2, clock=20, test_echo=6)
    assert await link_over(first, second).look() == second


@pytest.mark.parametrize(
    "field", ["controller_state", "trigger_counter", "recipe", "block_thickness", "ack_transfer", "last_job", "session"]
)
def test_every_other_field_must_be_alike(field: str) -> None:
    assert steady(LinkBlock(**{field: 1})) != steady(LinkBlock(**{field: 2}))


async def test_a_block_that_changes_at_every_read_is_never_acted_on() -> None:
    link = link_over(*(LinkBlock(session=9, last_job=n) for n in range(40)))
    with pytest.raises(LinkUnsteady, match="two alike"):
        await link.look()
    assert link.view is None


async def test_what_an_earlier_connection_said_does_not_count_as_one_of_the_two() -> None:
    controller = ScriptedController()
    async with linked(controller) as link:
        await until(lambda: link.view is not None)
        controller.reachable = False
        await until(lambda: link.view is None)
        assert link.reading._previous is None


async def test_our_heartbeat_changes_at_least_once_a_second_and_the_block_is_written_whole() -> None:
    controller = ScriptedController()
    async with linked(controller) as link:
        link.publish(job_id=41, missed_triggers=3)
        await until(lambda: controller.count("write_service") >= 3)
        beats = [block.service_heartbeat for name, block in controller.requests if name == "write_service"]
        assert len(set(beats)) == len(beats)
        assert (controller.service.job_id, controller.service.missed_triggers) == (41, 3)


async def test_a_change_is_written_at_once_and_flush_waits_for_it() -> None:
    controller = ScriptedController()
    slow = replace(QUICK, poll_period_s=5.0)
    async with linked(controller, slow) as link:
        await until(lambda: controller.count("write_service") == 1)
        link.publish(job_id=42)
        assert await link.flush(2.0)
        assert controller.service.job_id == 42


async def test_on_a_line_that_takes_its_time_our_heartbeat_still_changes_once_a_second() -> None:
    request_s, now_s, written_at_s = 0.2, 0.0, []

    class Slow(ScriptedController):
        def _meet(self, *request: Any) -> bool:
            nonlocal now_s
            now_s += request_s
            if request[0] == "write_service":
                written_at_s.append(now_s)
            return super()._meet(*request)

    link = Link(Slow(), QUICK, now=lambda: now_s)
    task = asyncio.ensure_future(link.run())
    await until(lambda: len(written_at_s) > 5)
    task.cancel()
    await asyncio.wait([task])
    assert max(after - before for before, after in itertools.pairwise(written_at_s)) < 1.0 - 1e-9


async def test_flush_gives_up_when_the_controller_is_away() -> None:
    controller = ScriptedController()
    controller.reachable = False
    async with linked(controller) as link:
        link.publish(job_id=42)
        assert not await link.flush(0.05)


async def test_a_service_block_whose_reply_was_lost_is_written_again() -> None:
    controller = ScriptedController()
    async with linked(controller) as link:
        await until(lambda: link.fault() is None)
        controller.faults["write_service"] = ["reply"]
        link.publish(settled_job=8)
        assert await link.flush(3.0)
        assert controller.connects == 2


async def test_a_heartbeat_that_stands_still_is_a_fault_though_the_server_answers() -> None:
    controller = ScriptedController()
    async with linked(controller) as link:
        await until(lambda: link.fault() is None)
        controller.beating = False
        await until(lambda: "heartbeat" in (link.fault() or ""))
        controller.beating = True
        await until(lambda: link.fault() is None)
        assert controller.connects == 1


async def test_a_heartbeat_of_one_bit_in_step_with_our_looks_does_not_seem_to_stand_still() -> None:
    looks = 0

    class InStep(ScriptedController):
        def shown(self) -> LinkBlock:
            nonlocal looks
            looks += 1
            scans = int(2 * asyncio.get_running_loop().time() / settings.poll_period_s + 0.5)
            return replace(super().shown(), controller_heartbeat=scans % 2)

    settings = LinkSettings(poll_period_s=0.05, heartbeat_timeout_s=0.3)
    async with linked(InStep(), settings) as link:
        await until(lambda: looks > 20 and link.fault() is None)


async def test_a_controller_that_never_beat_is_not_trusted() -> None:
    controller = ScriptedController()
    controller.beating = False
    async with linked(controller) as link:
        await until(lambda: link.view is not None)
        assert "heartbeat" in (link.fault() or "")


async def test_a_lost_controller_is_found_and_taken_up_again_alone(caplog: pytest.LogCaptureFixture) -> None:
    controller = ScriptedController()
    async with linked(controller) as link:
        await until(lambda: link.fault() is None)
        controller.reachable = False
        await until(lambda: link.fault() is not None)
        await asyncio.sleep(0.3)
        controller.reachable = True
        await until(lambda: link.fault() is None)
    warnings = [record for record in caplog.records if record.levelname == "WARNING"]
    assert len(warnings) == 1, "one line a loss, however many attempts it takes"


async def test_swapped_words_are_named_as_such() -> None:
    controller = ScriptedController()
    controller.link = replace(controller.link, test_echo=0x01030304)
    async with linked(controller) as link:
        await until(lambda: link.view is not None and link.reading._beat_at_s is not None)
        assert "change controller.word_order" in (link.fault() or "")


@pytest.mark.parametrize(
    ("state", "text"), [(0, "not ready"), (2, "busy"), (3, "in fault"), (77, "unknown state 77"), (1, None)]
)
async def test_the_controllers_state_is_told_in_words(state: int, text: str | None) -> None:
    controller = ScriptedController()
    controller.link = replace(controller.link, controller_state=state)
    async with linked(controller) as link:
        await until(lambda: link.fault() is None)
        told = link.controller_not_ready()
        assert told is None if text is None else text in (told or "")


async def test_without_handshake_the_controllers_block_is_not_read() -> None:
    controller = ScriptedController()

    async def never() -> LinkBlock:
        raise AssertionError("read")

    controller.read_link = never  # type: ignore[method-assign]
    async with linked(controller, LinkSettings(handshake=False, poll_period_s=0.01)) as link:
        await until(lambda: controller.count("write_service") >= 2)
        assert link.fault() is None
        assert link.stamp() == type(link.stamp())(0, 0)


async def test_a_controller_that_connects_and_refuses_is_tried_ever_less_often_and_told_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO)
    controller = ScriptedController()
    controller.faults["write_service"] = ["exception"] * 1000
    async with linked(controller) as link:
        told = set()
        for _ in range(100):
            await asyncio.sleep(0.01)
            told.add(link.fault())
    assert controller.connects <= 5, "a connection alone is no success: the pauses must grow"
    assert told <= {"not connected yet", "write_service: exception 4"}, "one reason, not two by turns"
    assert [record.levelname for record in caplog.records] == ["WARNING"]


async def test_a_block_that_never_holds_still_is_told_once_and_as_what_it_is(caplog: pytest.LogCaptureFixture) -> None:
    controller = ScriptedController()
    numbers = itertools.count()

    async def never_the_same() -> LinkBlock:
        return replace(controller.link, recipe=next(numbers))

    controller.read_link = never_the_same  # type: ignore[method-assign]
    async with linked(controller) as link:
        await until(lambda: next(numbers) > 200)
        assert "expected two alike" in (link.fault() or "")
        assert controller.count("write_service") > 0, "our own heartbeat goes on"
    assert len(caplog.records) == 1


async def test_a_heartbeat_is_called_silent_only_after_the_time_it_has(caplog: pytest.LogCaptureFixture) -> None:
    controller = ScriptedController()
    controller.beating = False
    async with linked(controller, LinkSettings(poll_period_s=0.01, heartbeat_timeout_s=3.0)) as link:
        await until(lambda: link.view is not None and link.fault() != "not connected yet")
        assert link.fault() == "the controller's heartbeat has not changed yet"


class Glanced(ScriptedController):
    """A prompt controller: its block can be had in place. torn: what is seen there, where it is not what it holds."""

    def __init__(self) -> None:
        super().__init__()
        self.glances = 0
        self.torn: LinkBlock | None = None

    def glance(self) -> LinkBlock | None:
        self.glances += 1
        return (self.torn or self.shown()) if self.reachable else None


async def at_rest(controller: Glanced, link: Link) -> None:
    """Until the block is looked at in place."""
    seen = controller.glances
    await until(lambda: link.fault() is None and controller.glances >= seen + 5)


async def test_at_rest_the_block_is_looked_at_in_place_and_the_heartbeat_goes_on() -> None:
    controller = Glanced()
    async with linked(controller) as link:
        await at_rest(controller, link)
        beat = controller.service.service_heartbeat
        await until(lambda: controller.service.service_heartbeat != beat)


async def test_a_change_seen_in_place_is_acted_on_and_so_is_what_is_published() -> None:
    controller = Glanced()
    async with linked(controller) as link:
        await at_rest(controller, link)
        controller.link = replace(controller.link, trigger_counter=5)
        await until(lambda: link.view is not None and link.view.trigger_counter == 5)
        await at_rest(controller, link)
        link.publish(job_id=9)
        await until(lambda: controller.service.job_id == 9)


async def test_what_one_look_in_place_shows_counts_only_when_a_second_read_shows_it() -> None:
    controller = Glanced()
    async with linked(controller) as link:
        views: list[int] = []

        class Views(LinkListener):
            def link_changed(self) -> None:
                views.append(link.view.last_job if link.view else 0)

        link.listen(Views())
        await at_rest(controller, link)
        controller.torn = replace(controller.link, last_job=77)
        seen = controller.glances
        await until(lambda: controller.glances >= seen + 10)
        assert 77 not in views
        assert link.view is not None
        assert link.view.last_job == 0


async def test_a_loss_seen_in_place_is_told_and_the_link_comes_back() -> None:
    controller = Glanced()
    async with linked(controller) as link:
        await at_rest(controller, link)
        controller.reachable = False
        await until(lambda: link.fault() is not None)
        controller.reachable = True
        await at_rest(controller, link)


async def test_an_observer_has_nothing_to_wait_for_that_would_be_written() -> None:
    async with linked(ScriptedController(), replace(QUICK, observe=True)) as link:
        link.publish(job_id=9)
        assert await link.flush(3600)


# --- last_job ---------------------------------------------------------------------------------------------------


async def test_last_job_is_known_once_it_held_over_two_changes_of_the_heartbeat() -> None:
    controller = ScriptedController()
    controller.link = replace(controller.link, last_job=70)
    controller.beating = False
    async with linked(controller, replace(QUICK, heartbeat_timeout_s=5.0)) as link:
        await until(lambda: link.view is not None)
        await asyncio.sleep(0.1)
        assert link.reading.last_job is None
        assert link.fault() is not None
        controller.beating = True
        await until(lambda: link.fault() is None)
        assert link.reading.last_job == 70


async def test_a_misread_last_job_is_not_kept() -> None:
    controller = ScriptedController()
    controller.link = replace(controller.link, last_job=70 << 16, test_echo=0x01030304)
    async with linked(controller) as link:
        await until(lambda: link.reading.holds)
        assert link.reading.last_job is None


async def test_a_last_job_that_leaps_is_a_fault_until_it_is_corrected() -> None:
    controller = ScriptedController()
    async with linked(controller) as link:
        link.publish(job_id=7)
        await until(lambda: link.fault() is None)
        controller.link = replace(controller.link, last_job=0xFFFF_FFFD)
        await until(lambda: "looks like a fault of the controller" in (link.fault() or ""))
        assert "expected 7 or little more" in (link.fault() or "")
        controller.link = replace(controller.link, last_job=7)
        await until(lambda: link.fault() is None)


async def test_a_last_job_that_leaps_is_taken_as_right_on_a_persons_word() -> None:
    controller = ScriptedController()
    async with linked(controller) as link:
        link.publish(job_id=7)
        controller.link = replace(controller.link, last_job=5_000_000)
        await until(lambda: "confirm" in (link.fault() or ""))
        assert link.confirm() == ["last_job 5000000 is taken as right: jobs are numbered above it"]
        assert link.fault() is None
        assert link.confirm() == []
        controller.link = replace(controller.link, last_job=9_000_000)
        await until(lambda: link.fault() is not None), "another leap needs another word"


async def test_no_person_can_give_numbers_that_a_register_does_not_hold() -> None:
    controller = ScriptedController()
    controller.link = replace(controller.link, last_job=0xFFFF_FFFF)
    async with linked(controller) as link:
        await until(lambda: "no higher job number is left" in (link.fault() or ""))
        assert link.confirm() == []


async def test_our_heartbeat_begins_anywhere_and_never_falls_into_anothers_step() -> None:
    beats: list[set[int]] = []
    for _ in range(2):
        controller = ScriptedController()
        async with linked(controller) as link:
            for number in range(20):
                link.publish(job_id=number + 1)
                assert await link.flush(2.0)
        beats.append({block.service_heartbeat for name, block in controller.requests if name == "write_service"})
    assert len(beats[0]) >= 20
    assert len(beats[0] & beats[1]) <= 2


@pytest.mark.parametrize("observe", [True, False])
async def test_a_link_that_only_looks_shows_that_it_lives(observe: bool) -> None:
    """Also beside another service: the watchdog must not start anew what waits for a person."""
    controller = Glanced()
    async with linked(controller, replace(QUICK, observe=observe)) as link:
        rounds: list[int] = []
        link.feed_watchdog = lambda: rounds.append(1)
        if not observe:
            link.publish(owner=100)
            await until(lambda: link.fault() is None)
            controller.service = replace(controller.service, owner=200)
            await until(lambda: link.ownership.conflict)
        seen, glances = len(rounds), controller.glances
        await until(lambda: controller.glances > glances + 10)
        assert len(rounds) > seen
