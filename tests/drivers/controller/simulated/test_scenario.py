"""The events of a scenario, played on a simulated controller that a client looks at."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress

import pytest

from drivers.controller.mailbox.blocks import ServiceBlock, encode_service
from drivers.controller.simulated.controller import SimulatedController
from drivers.controller.simulated.scenario import Event, MachineSettings, Play, Scenario, machine_options
from tests.support.controller.raw_client import SESSION, Client, page


@asynccontextmanager
async def played(*events: Event, **machine: object) -> AsyncIterator[SimulatedController]:
    """A started controller on which the events are played."""
    values = {"scan_ms": 1, "sessions": (SESSION, SESSION + 1, SESSION + 2), **machine}
    scenario = Scenario(machine=MachineSettings(**values))  # type: ignore[arg-type]
    async with SimulatedController(**machine_options(scenario)) as controller:
        await until(lambda: controller.registers(13, 1) == (SESSION,))
        async with befallen(controller, *events):
            yield controller


@asynccontextmanager
async def befallen(controller: SimulatedController, *events: Event) -> AsyncIterator[None]:
    """The events are played from now on."""
    playing = asyncio.ensure_future(Play(controller, Scenario(events=events)).play_for_ever())
    try:
        yield
        if playing.done():
            playing.result()
    finally:
        playing.cancel()
        with suppress(asyncio.CancelledError):
            await playing


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(60):
        while not condition():
            await asyncio.sleep(0.001)


async def ready(client: Client, **values: int) -> None:
    block = ServiceBlock(service_state=5, **values)
    await client.write(16, *encode_service(block, "big"))


async def test_a_burst_of_triggers_comes_one_after_the_other_as_the_protocol_lets_it() -> None:
    event = Event("trigger", at_s=(0.0,), burst=3, recipe=4, thickness_mm=12.5)
    async with played(event) as controller, Client(controller.port) as client:
        for counter in (1, 2, 3):
            await ready(client, job_id=counter - 1, settled_job=counter - 1)
            await until(lambda counter=counter: controller.registers(2, 1) == (counter,))
            assert controller.registers(3, 3) == (4, 0, 12_500)
            taken = {"job_id": counter, "trigger_ack": counter, "session_ack": SESSION}
            await ready(client, **taken, settled_job=counter - 1)
            await asyncio.sleep(0.01)
            assert controller.registers(2, 1) == (counter,)
            await ready(client, **taken, settled_job=counter)
            # The next may be asked for before anybody looks.
            await until(lambda counter=counter: not controller.trigger_open or controller.registers(2, 1) > (counter,))
        assert controller.verdict.clean, controller.verdict


async def test_a_forced_trigger_asks_though_nobody_is_ready_and_counters_begin_where_they_are_told() -> None:
    event = Event("trigger", at_s=(0.05,), burst=3, force=True)
    async with played(event, first_trigger=65534) as controller:
        await until(lambda: controller.registers(2, 1) == (1,))
    assert controller.trigger_open


@pytest.mark.parametrize(("do", "state"), [("busy", 2), ("not-ready", 0), ("machine-fault", 3)])
async def test_a_spell_shows_in_the_state_and_passes(do: str, state: int) -> None:
    async with played(Event(do, at_s=(0.05,), for_s=0.1)) as controller:  # type: ignore[arg-type]
        await until(lambda: controller.registers(0, 1) == (1,))
        await until(lambda: controller.registers(0, 1) == (state,))
        await until(lambda: controller.registers(0, 1) == (1,))


async def test_the_end_of_one_spell_does_not_end_another_that_goes_on() -> None:
    busy, fault = Event("busy", at_s=(0.0,), for_s=0.1), Event("machine-fault", at_s=(0.05,), for_s=60)
    async with played(busy, fault, Event("trigger", at_s=(0.2,), force=True)) as controller:
        await until(lambda: controller.registers(2, 1) == (1,))
        assert controller.registers(0, 1) == (3,)


async def test_scans_are_as_they_were_when_the_last_of_two_slow_spells_has_ended() -> None:
    first = Event("slow-scan", at_s=(0.0,), for_s=0.1, scan_ms=20)
    second = Event("slow-scan", at_s=(0.05,), for_s=0.1, scan_ms=30)
    async with played(first, second, Event("trigger", at_s=(0.3,), force=True)) as controller:
        await until(lambda: controller.registers(2, 1) == (1,))
        assert controller.scan_s == 0.001


@pytest.mark.parametrize("answer", [4, 7])
async def test_the_operator_refuses_as_often_as_told(answer: int) -> None:
    event = Event("refuse", at_s=(0.0,), answer=answer, count=2)  # type: ignore[arg-type]
    async with played(event) as controller, Client(controller.port) as client:
        for job, expected in ((1, answer), (2, answer), (3, 1)):
            await client.write_page(page(job_id=job), job)
            assert await client.read(7, 1) == (expected,)


async def test_a_slow_scan_is_slow_for_its_time() -> None:
    async with played(Event("slow-scan", at_s=(0.02,), for_s=0.1, scan_ms=50)) as controller:
        await until(lambda: controller.scan_s == 0.05)
        await until(lambda: controller.scan_s == 0.001)


async def test_a_halted_program_starts_anew_with_its_registers() -> None:
    async with played() as controller, Client(controller.port) as client:
        await client.write(40, 77)
        async with befallen(controller, Event("halt", at_s=(0.0,), for_s=0.05)):
            await until(lambda: controller.registers(13, 1) == (SESSION + 1,))
        assert controller.registers(40, 1) == (77,)


@pytest.mark.parametrize("keep", [True, False])
async def test_a_restart_keeps_what_it_is_told_to_keep(keep: bool) -> None:
    async with played() as controller, Client(controller.port) as client:
        await client.write_page(page(), 1)
        assert controller.registers(10, 2) == (0, 1)
        async with befallen(controller, Event("restart", at_s=(0.0,), keep_registers=keep, keep_memory=keep)):
            await until(lambda: controller.registers(13, 1) == (SESSION + 1,))
        assert controller.registers(10, 2) == ((0, 1) if keep else (0, 0))
        assert controller.registers(35, 1) == ((1,) if keep else (0,))


async def test_a_controller_that_is_switched_off_is_gone_and_comes_back_where_it_was() -> None:
    async with played() as controller, Client(controller.port) as client:
        port = controller.port
        async with befallen(controller, Event("switch-off", at_s=(0.0,), for_s=1)):
            assert await client.reader.read() == b""
            with pytest.raises(OSError, match=str(port)):
                await Client(port).__aenter__()
            await until(lambda: controller.registers(13, 1) == (SESSION + 1,))
            async with Client(port) as again:
                await again.read(0, 16)


async def test_an_unplugged_controller_cannot_be_reached_and_its_program_goes_on() -> None:
    async with played() as controller, Client(controller.port) as client:
        port = controller.port
        async with befallen(controller, Event("unplug", at_s=(0.0,), for_s=1)):
            assert await client.reader.read() == b""
            with pytest.raises(OSError, match=str(port)):
                await Client(port).__aenter__()
            before = controller.registers(1, 1)
            await until(lambda: controller.registers(1, 1) != before)
            async with asyncio.timeout(60):
                while True:
                    with suppress(OSError):
                        async with Client(port) as again:
                            assert (await again.read(13, 1)) == (SESSION,)
                            break
                    await asyncio.sleep(0.01)


async def test_another_service_shows_by_its_owner_and_a_moving_heartbeat() -> None:
    async with played(Event("foreign-service", at_s=(0.0,), for_s=0.4)) as controller:
        await until(lambda: controller.registers(27, 1) == (4711,))
        before = controller.registers(18, 1)
        await until(lambda: controller.registers(18, 1) != before)


async def test_what_comes_periodically_comes_again() -> None:
    told: list[dict[str, object]] = []
    async with played(Event("restart", every_s=0.01)) as controller:
        controller.verdict.on_event = told.append
        await until(lambda: sum(event["event"] == "event" for event in told) >= 3)
        assert {event["do"] for event in told if event["event"] == "event"} == {"restart"}


# --- a program that takes its time ------------------------------------------------------------------------------------


async def test_a_slow_program_answers_later_and_right() -> None:
    slow = {"copy_scans": 5, "check_scans": 7, "stepwise": True}
    async with played(**slow) as controller, Client(controller.port) as client:
        await client.write_page(page(), 1)
        assert await client.read(6, 2) == (1, 1)
        assert await client.read(10, 3) == (0, 1, 1)
        assert controller.verdict.clean, controller.verdict


async def test_what_is_written_while_a_page_is_copied_makes_a_torn_copy_and_answer_2() -> None:
    async with played(copy_scans=10, scan_ms=20) as controller, Client(controller.port) as client:
        await client.write_one(32, 0)
        await client.write(33, *page().header, *page().payload)
        await client.write_one(32, 5)
        await client.write(64, 0, 5)  # against the protocol: the ring table, while the copy is on its way
        await client.until_answered(5)
        assert await client.read(7, 1) == (2,)
        assert set(controller.verdict.counts) == {"written-while-valid"}
