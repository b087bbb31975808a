"""Whole daemons on a simulated controller over sockets: one service a controller, one journal a service."""

from __future__ import annotations

import asyncio
import logging
import shutil
from pathlib import Path

import pytest

from drivers.controller.modbus.requests import READ_REGISTERS
from drivers.controller.simulated.controller import SimulatedController
from drivers.controller.simulated.program import Pace
from service.jobs.executor import ROOM
from service.reasons import Outcome
from service.records.job import TriggerStamp
from service.state import State
from service.wiring.bounds import target
from service.wiring.errors import WiringError
from tests.support.controller.fault_proxy import Fate, FaultProxy
from tests.support.processes.processes import BOUND_S
from tests.support.processes.wired_daemon import WiredDaemon, wired
from tests.support.service.waiting import until


def tcp(port: int, **more: object) -> dict[str, object]:
    return {"kind": "modbus-tcp", "port": port, **more}


def other_door(controller: SimulatedController, writes: list[bytes] | None = None) -> FaultProxy:
    """Another address of the same controller: the lock on this machine does not see that it is the same.

    writes: gets the requests that change a register.
    """

    def let_through(request: bytes) -> Fate:
        if writes is not None and request[7] != READ_REGISTERS:
            writes.append(request)
        return Fate.PASS

    return FaultProxy(controller.port, let_through)


@pytest.fixture
def short_watch(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.link.ownership.WATCH_S", 1.2)  # longer than a heartbeat's period


async def test_a_second_daemon_of_this_machine_on_the_same_controller_does_not_start(tmp_path: Path) -> None:
    async with SimulatedController() as controller, wired(tmp_path / "one", tcp(controller.port)) as one:
        with pytest.raises(WiringError, match=r"another combtrace \(process \d+\) runs on it"):
            WiredDaemon(tmp_path / "two", tcp(controller.port))
        with pytest.raises(WiringError, match="runs on it"):
            WiredDaemon(tmp_path / "two", tcp(controller.port, host="localhost"))
        assert (await one.job()).outcome is Outcome.ACCEPTED


async def test_a_start_that_was_refused_leaves_nothing_that_makes_the_next_one_take_its_journal_for_lost(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with SimulatedController() as controller:
        async with wired(tmp_path / "one", tcp(controller.port)):
            with pytest.raises(WiringError, match="runs on it"):
                WiredDaemon(tmp_path / "two", tcp(controller.port))
        async with wired(tmp_path / "two", tcp(controller.port)) as two:
            assert (await two.job()).job_id < 3 * ROOM
    assert not any("is lost" in record.getMessage() for record in caplog.records)


async def test_two_state_folders_that_name_one_journal_are_noticed(tmp_path: Path) -> None:
    journal = {"path": str(tmp_path / "shared.sqlite")}
    async with (
        SimulatedController() as controller,
        SimulatedController() as another,
        wired(tmp_path / "one", tcp(controller.port), journal=journal),
    ):
        with pytest.raises(WiringError, match="runs on this journal"):
            WiredDaemon(tmp_path / "two", tcp(another.port), journal=journal)


async def test_beside_a_living_service_a_second_one_stays_in_error_with_155_and_writes_nothing(
    tmp_path: Path, short_watch: None
) -> None:
    writes: list[bytes] = []
    async with SimulatedController() as controller, other_door(controller, writes) as door:
        async with wired(tmp_path / "one", tcp(controller.port)) as one:
            await one.ready()
            async with wired(tmp_path / "two", tcp(door.port)) as two:
                await until(lambda: "Stop one of the two" in two.reason)
                assert two.reason.startswith("155 another service")
                assert two.parts.health.state is State.ERROR
                for _ in range(3):
                    assert (await one.job()).outcome is Outcome.ACCEPTED
            assert one.parts.health.state is State.READY, "the first never noticed"
        assert writes == []
        assert controller.verdict.counts == {}


async def test_after_a_service_that_ended_another_takes_over_with_higher_numbers(tmp_path: Path) -> None:
    async with SimulatedController() as controller, other_door(controller) as door:
        async with wired(tmp_path / "one", tcp(controller.port)) as one:
            last = await one.job()
        async with wired(tmp_path / "two", tcp(door.port)) as two:
            await two.ready()
            job = await two.job()
            assert job.outcome is Outcome.ACCEPTED
            assert job.job_id > last.job_id
            assert two.parts.link.published.owner != one.parts.link.published.owner  # type: ignore[union-attr]
        assert controller.verdict.counts == {}, "it left the other's block alone for 3 s"


async def test_a_service_that_another_one_drives_out_stops_writing_and_stays_in_error(
    tmp_path: Path, short_watch: None
) -> None:
    async with (
        SimulatedController() as controller,
        other_door(controller) as door,
        wired(tmp_path / "one", tcp(controller.port)) as one,
    ):
        await one.ready()
        assert one.parts.link is not None
        keep = one.parts.link.writing.keep

        async def frozen() -> None:
            return

        one.parts.link.writing.keep = frozen  # type: ignore[method-assign]  # its heartbeat stands still
        async with wired(tmp_path / "two", tcp(door.port)) as two:
            await two.ready()
            one.parts.link.writing.keep = keep  # type: ignore[method-assign]
            await until(lambda: "Stop one of the two" in one.reason)
            assert (await two.job()).outcome is Outcome.ACCEPTED
            assert one.parts.health.state is State.ERROR
            assert one.reason.startswith("155")


async def test_a_lost_journal_repeats_neither_a_trigger_nor_a_number(
    tmp_path: Path, short_watch: None, caplog: pytest.LogCaptureFixture
) -> None:
    async with SimulatedController() as controller:
        async with wired(tmp_path, tcp(controller.port)) as before:
            await before.ready()
            await until(lambda: controller.can_request)
            controller.request_measurement()
            await until(lambda: before.parts.executor.settled_job)
            last = before.parts.executor.settled_job
        for file in tmp_path.glob("journal.sqlite*"):
            file.unlink()
        async with wired(tmp_path, tcp(controller.port)) as after:
            await after.ready()
            await asyncio.sleep(0.2)
            assert after.parts.executor.settled_job == last, "the trigger was not taken again"
            job = await after.job()
            assert job.job_id >= last + ROOM
        assert "the journal is lost" in caplog.text
        assert set(controller.verdict.counts) <= {"second-service"}, "of our short watch"
        assert controller.verdict.accepted == 2


async def test_a_damaged_journal_is_moved_aside_with_an_alarm_and_the_job_in_flight_is_settled(
    tmp_path: Path, short_watch: None, caplog: pytest.LogCaptureFixture
) -> None:
    async with SimulatedController() as controller:
        async with wired(tmp_path, tcp(controller.port)) as before:
            await before.job()
        path = tmp_path / "journal.sqlite"
        content = path.read_bytes()
        path.write_bytes(bytes(100) + content[100:])
        async with wired(tmp_path, tcp(controller.port)) as after:
            assert (await after.job()).outcome is Outcome.ACCEPTED
        assert [record.name for record in caplog.records if record.levelno == logging.CRITICAL] == ["combtrace.journal"]
        (kept,) = (file for file in tmp_path.glob("journal.sqlite.damaged-*") if file.name.endswith("Z"))
        assert kept.read_bytes()[100:] == content[100:]


async def test_an_observer_beside_a_service_makes_every_contour_and_writes_no_register(
    tmp_path: Path, short_watch: None
) -> None:
    writes: list[bytes] = []
    async with SimulatedController() as controller, other_door(controller, writes) as door:
        observing = tcp(door.port, mode="observe")
        async with wired(tmp_path / "one", tcp(controller.port)) as one, wired(tmp_path / "two", observing) as two:
            await one.ready()
            await two.ready()
            await until(lambda: controller.can_request)
            controller.request_measurement()
            await until(lambda: one.parts.executor.settled_job and two.parts.executor.settled_job)
            seen = two.parts.journal.last_settled()
            sent = one.parts.journal.last_settled()
        assert seen is not None
        assert sent is not None
        assert (seen.outcome, seen.detail) == (Outcome.WRITTEN, "observed only: 1 page(s) made, nothing sent")
        assert (seen.trigger.session, seen.trigger.counter) == (sent.trigger.session, sent.trigger.counter)
        assert sent.outcome is Outcome.ACCEPTED
        assert writes == []
        assert controller.verdict.counts == {}


async def test_an_observer_settles_no_job_in_flight_and_says_what_to_put_back(tmp_path: Path) -> None:
    async with SimulatedController() as controller:
        async with wired(tmp_path, tcp(controller.port)) as one:
            await one.ready()
            job = one.parts.journal.take(TriggerStamp("serial"))
            one.parts.journal.store_pages(job.job_id, 9, (), target=target(one.config))
        async with wired(tmp_path, tcp(controller.port, mode="observe")) as observer:
            await until(lambda: "Put back controller.mode: send" in observer.reason)
            assert observer.parts.health.state is State.ERROR
            assert [job.outcome for job in observer.parts.journal.unsettled()] == [None]


async def test_settings_changed_while_a_job_is_in_flight_settle_it_only_once_they_are_put_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.daemon.daemon.STOP_BOUND_S", 0.2)
    async with SimulatedController(pace=Pace(check_scans=200)) as controller:
        async with wired(tmp_path, tcp(controller.port, ack_timeout_s=10)) as one:
            await one.ready()
            job = (await one.parts.executor.submit(TriggerStamp("serial"))).job
            await until(lambda: controller.registers(32, 1)[0])  # committed, and accepted while the service is down
        await until(lambda: controller.verdict.accepted)
        async with wired(tmp_path, tcp(controller.port, word_order="little")) as swapped:
            await until(lambda: "Put back controller.word_order: big" in swapped.reason)
            await asyncio.sleep(0.5)
            assert [job.outcome for job in swapped.parts.journal.unsettled()] == [None]
        async with wired(tmp_path, tcp(controller.port)) as back:
            await back.ready()
            settled = back.parts.journal.find(job.job_id)
            assert settled is not None
            assert settled.outcome is Outcome.ACCEPTED


async def test_a_job_that_a_late_write_of_another_service_met_is_settled_by_the_controllers_answer(
    tmp_path: Path, short_watch: None
) -> None:
    async with (
        SimulatedController(pace=Pace(check_scans=200)) as controller,
        wired(tmp_path, tcp(controller.port, ack_timeout_s=10)) as one,
    ):
        await one.ready()
        assert one.parts.link is not None
        ownership = one.parts.link.ownership
        ticket = await one.parts.executor.submit(TriggerStamp("serial"))
        await until(lambda: controller.registers(32, 1)[0])  # committed
        controller.write_as_another(one.parts.journal.owner % 65535 + 1, 7)
        await until(lambda: ownership.conflict)
        assert not ticket.settled.done()
        assert (await asyncio.wait_for(ticket.settled, BOUND_S)).outcome is Outcome.ACCEPTED
        assert "combtrace confirm" in one.reason
        controller.pace = controller._program._pace = Pace()
        assert one.parts.executor.confirm() == [
            "the controller is watched anew, and written to if no other service is seen"
        ]
        assert (await one.job()).outcome is Outcome.ACCEPTED


async def test_two_services_with_one_journal_never_both_write(tmp_path: Path) -> None:
    """A copied journal, or card: the second finds its own number beside a heartbeat that it did not write."""
    async with SimulatedController() as controller, other_door(controller) as door:
        async with wired(tmp_path / "one", tcp(controller.port)) as one:
            await one.job()
        shutil.copytree(tmp_path / "one", tmp_path / "two")
        async with wired(tmp_path / "one", tcp(controller.port)) as one:
            await one.ready()
            async with wired(tmp_path / "two", tcp(door.port)) as two:
                await until(lambda: "copied journal" in two.reason)
                for _ in range(3):
                    assert (await one.job()).outcome is Outcome.ACCEPTED
                assert two.parts.journal.last_taken() is not None
                assert two.parts.health.state is State.ERROR
        assert controller.verdict.accepted == 4
