"""The daemon: its parts run on whatever is lost, it stops in any stage, and what it promised is kept."""

from __future__ import annotations

import asyncio
import os
import socket
import threading
import time
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.camera import CameraUnavailable
from drivers.camera.simulated import SimulatedCamera
from drivers.controller.mailbox.blocks import Answer, ServiceBlock
from service.config.recipes import Recipe
from service.daemon.daemon import Daemon, Parts
from service.daemon.lock import Lock, LockError
from service.daemon.systemd import Notifier, Watchdog
from service.jobs.cycle import Cycle
from service.jobs.cycle_terms import CycleSettings, Devices, Plan, Records
from service.jobs.executor import Executor, Intake
from service.jobs.health import Health
from service.jobs.trigger_queue import TriggerRefused
from service.link.link import Link, LinkSettings
from service.link.transfer_terms import TransferCounter, TransferSettings
from service.reasons import Outcome, Reason
from service.records.job import Job, TriggerStamp
from service.records.journal import Journal
from service.state import State, StateMachine
from tests.support.service.cycle_rig import FixedMeasurer
from tests.support.service.scripted_controller import ScriptedController

QUICK = TransferSettings(ready_timeout_s=0.3, ack_timeout_s=0.2, max_repeats=2, poll_period_s=0.01)


class Built:
    """A daemon with a scripted controller (or none) and a simulated camera."""

    def __init__(self, folder: Path, controller: ScriptedController | None) -> None:
        self.folder = folder
        self.controller = controller
        self.camera = SimulatedCamera(lambda _n: np.zeros((6, 8), np.uint8))
        journal = Journal(folder / "journal.sqlite")
        link = None
        if controller is not None:
            link = Link(controller, LinkSettings(poll_period_s=0.01, heartbeat_timeout_s=0.5))
        health = Health(StateMachine(lambda state, _: link.publish(service_state=int(state)) if link else None))
        pool = ThreadPoolExecutor(1)
        settings = CycleSettings(transfer=QUICK, camera_timeout_s=0.3)
        cycle = Cycle(
            Devices(self.camera, pool, link, TransferCounter(50)),
            Records(journal, health),
            Plan(FixedMeasurer(), {1: Recipe(number=1, name="one")}),  # type: ignore[arg-type]
            settings,
        )
        executor = Executor(journal, cycle, health, link, Intake(controller=True))
        self.parts = Parts(self.camera, journal, health, executor, link, pool, Lock(folder / "lock"))
        self.daemon = Daemon(self.parts)

    async def until(self, condition: Callable[[], object]) -> None:
        async with asyncio.timeout(60):
            while not condition():
                await asyncio.sleep(0.005)

    async def ready(self) -> None:
        await self.until(lambda: self.parts.health.state is State.READY)

    async def stop(self, running: asyncio.Future[None]) -> list[Job]:
        """Stop it; the jobs of its journal then."""
        self.daemon.stop()
        await asyncio.wait_for(running, 60)
        Lock(self.folder / "lock").release()  # it let go
        journal = Journal(self.folder / "journal.sqlite")
        jobs = journal._jobs("ORDER BY job_id")
        journal.close()
        return list(jobs)


class Systemd:
    """The far end of systemd's socket, with a watchdog that wants a sign every 0.1 s or so."""

    def __init__(self, folder: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._folder = os.open(folder, os.O_PATH)
        self._address = f"/proc/self/fd/{self._folder}/notify"  # addresses hold 107 bytes, however long the path is
        self._heard: list[str] = []

    def __enter__(self) -> Systemd:
        self._socket.bind(self._address)
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        os.close(self._folder)

    def joined(self, built: Built) -> Parts:
        """The parts, joined to this."""
        parts = built.parts
        parts.notifier = Notifier({"NOTIFY_SOCKET": self._address, "WATCHDOG_USEC": "300000"})
        parts.watchdog = Watchdog(parts.notifier)
        parts.executor._feed_watchdog = lambda: parts.watchdog.feed("jobs")
        if parts.link is not None:
            parts.link.feed_watchdog = lambda: parts.watchdog.feed("link")
        return parts

    def heard(self) -> list[str]:
        """What was told so far."""
        with suppress(BlockingIOError):
            while True:
                self._heard.append(self._socket.recv(4096).decode())
        return self._heard

    def forget(self) -> None:
        self.heard()
        self._heard = []


@asynccontextmanager
async def running(
    folder: Path, controller: ScriptedController | None
) -> AsyncIterator[tuple[Built, asyncio.Future[None]]]:
    built = Built(folder, controller)
    task = asyncio.ensure_future(built.daemon.run())
    try:
        yield built, task
    finally:
        built.daemon.stop()
        await asyncio.wait([task])


async def test_it_rehearses_once_the_camera_is_open_but_not_before_a_single_job(tmp_path: Path) -> None:
    (tmp_path / "once").mkdir()
    rehearsed = []
    once = Built(tmp_path / "once", None)
    once.parts.rehearse = lambda: rehearsed.append("once")
    await once.daemon.run_once(10.0)
    built = Built(tmp_path, None)
    built.parts.rehearse = lambda: rehearsed.append("daemon")
    task = asyncio.ensure_future(built.daemon.run())
    await built.until(lambda: rehearsed)
    await built.stop(task)
    assert rehearsed == ["daemon"]


async def test_without_a_controller_it_runs_until_it_is_stopped(tmp_path: Path) -> None:
    async with running(tmp_path, None) as (built, task):
        await built.ready()
        for _ in range(2):
            ticket = await built.parts.executor.submit(TriggerStamp("interval"))
            assert (await asyncio.wait_for(ticket.settled, 60)).outcome is Outcome.WRITTEN
        assert not task.done()
        assert len(await built.stop(task)) == 2


async def test_once_gives_the_job_of_one_manual_trigger(tmp_path: Path) -> None:
    built = Built(tmp_path, ScriptedController())
    job = await asyncio.wait_for(built.daemon.run_once(5.0), 10)
    assert (job.trigger.kind, job.outcome) == ("manual", Outcome.ACCEPTED)
    assert built.controller.service.settled_job == job.job_id, "told to the controller before the end"
    assert built.controller.service.service_state == State.HALTED


async def test_once_takes_no_trigger_of_the_controller(tmp_path: Path) -> None:
    controller = ScriptedController()
    controller.link = replace(controller.link, trigger_counter=4)
    built = Built(tmp_path, controller)
    job = await asyncio.wait_for(built.daemon.run_once(5.0), 10)
    assert job.trigger.kind == "manual"
    journal = Journal(tmp_path / "journal.sqlite")
    assert journal.last_taken() == job
    assert journal.last_controller_trigger() == (0, 0)
    journal.close()


async def test_once_says_why_no_job_was_begun(tmp_path: Path) -> None:
    controller = ScriptedController()
    controller.reachable = False
    built = Built(tmp_path, controller)
    with pytest.raises(TriggerRefused, match="nobody listens"):
        await asyncio.wait_for(built.daemon.run_once(0.2), 10)


async def test_a_camera_that_goes_and_comes_back_is_error_and_ready_again(tmp_path: Path) -> None:
    async with running(tmp_path, ScriptedController()) as (built, _task):
        await built.ready()
        good = built.camera._make_picture

        def gone(_number: int) -> np.ndarray:
            raise CameraUnavailable("unplugged")

        built.camera._make_picture = gone
        job = await (await built.parts.executor.submit(TriggerStamp("serial"))).settled
        assert job.reason is Reason.NO_FRAME
        built.camera._make_picture = good
        await built.ready()
        job = await (await built.parts.executor.submit(TriggerStamp("serial"))).settled
        assert job.outcome is Outcome.ACCEPTED


async def test_a_part_that_fails_by_a_defect_is_started_again_and_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.daemon.supervisor.SOUND_AFTER_S", 0.1)
    controller = ScriptedController()
    write, failures = controller.write_service, [ZeroDivisionError("a defect")]

    async def broken(block: ServiceBlock) -> None:
        if failures:
            raise failures.pop()
        await write(block)

    controller.write_service = broken  # type: ignore[method-assign]
    async with running(tmp_path, controller) as (built, _task):
        await built.until(lambda: built.parts.health.fault("part link"))
        assert built.parts.health.state is State.ERROR
        await built.ready()
        (link,) = (part for part in built.daemon.supervisor.parts if part.name == "link")
        assert (link.restarts, link.last_error) == (1, "ZeroDivisionError: a defect")
        job = await (await built.parts.executor.submit(TriggerStamp("serial"))).settled
        assert job.outcome is Outcome.ACCEPTED
    assert "part link has failed" in caplog.text


async def test_a_stop_does_not_wait_for_a_camera_call_that_hangs_and_the_job_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("service.daemon.daemon.STOP_BOUND_S", 0.2)
    monkeypatch.setattr("service.daemon.daemon.THREADS_END_S", 0.2)
    let_go = threading.Event()
    async with running(tmp_path, ScriptedController()) as (built, task):
        await built.ready()
        built.camera._make_picture = lambda _n: let_go.wait() and np.zeros((6, 8), np.uint8)
        await built.parts.executor.submit(TriggerStamp("serial"))
        await built.until(lambda: built.parts.health.job)
        (job,) = await built.stop(task)
        assert (job.outcome, job.reason) == (Outcome.FAILED, Reason.ABORTED)
        assert built.daemon.abandoned
    assert "a call to the camera has not returned" in caplog.text
    let_go.set()


async def test_systemd_hears_nothing_while_a_camera_call_hangs_and_again_after_it(tmp_path: Path) -> None:
    with Systemd(tmp_path) as systemd:
        built = Built(tmp_path, ScriptedController())
        let_go = threading.Event()
        built.daemon = Daemon(systemd.joined(built))
        task = asyncio.ensure_future(built.daemon.run())
        await built.ready()
        await built.until(lambda: systemd.heard().count("WATCHDOG=1") >= 3)
        assert any(text.startswith("READY=1\nSTATUS=") for text in systemd.heard())
        good = built.camera._make_picture
        built.camera._make_picture = lambda _n: let_go.wait() and np.zeros((6, 8), np.uint8)
        ticket = await built.parts.executor.submit(TriggerStamp("serial"))
        await built.until(lambda: built.parts.health.job)
        await built.until(lambda: built.parts.watchdog.silent == {"jobs"})
        systemd.forget()
        await asyncio.sleep(0.5)  # it heard three in less
        assert "WATCHDOG=1" not in systemd.heard()
        built.camera._make_picture = good
        let_go.set()
        await ticket.settled
        await built.until(lambda: "WATCHDOG=1" in systemd.heard())
        built.daemon.stop()
        await asyncio.wait([task])
        assert "STOPPING=1" in systemd.heard()


async def test_it_stops_before_anything_is_there(tmp_path: Path) -> None:
    controller = ScriptedController()
    controller.reachable = False
    async with running(tmp_path, controller) as (built, task):
        assert await built.stop(task) == []


async def test_stopped_during_an_exposure_the_job_is_brought_to_its_end(tmp_path: Path) -> None:
    async with running(tmp_path, ScriptedController()) as (built, task):
        await built.ready()
        built.camera._make_picture = lambda _n: time.sleep(0.2) or np.zeros((6, 8), np.uint8)
        ticket = await built.parts.executor.submit(TriggerStamp("serial"))
        await built.until(lambda: built.parts.health.job)
        (job,) = await built.stop(task)
        assert (job.job_id, job.outcome) == (ticket.job.job_id, Outcome.ACCEPTED)
        assert built.controller.service.settled_job == job.job_id


async def test_stopped_while_the_controller_is_silent_the_job_stays_in_flight_and_the_next_start_settles_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.daemon.daemon.STOP_BOUND_S", 0.2)
    controller = ScriptedController([None])
    async with running(tmp_path, controller) as (built, task):
        await built.ready()
        controller.link = replace(controller.link, trigger_counter=3)
        await built.until(lambda: controller.count("commit"))
        (job,) = await built.stop(task)
        assert (job.outcome, job.sent) == (None, True)
    controller.answers = [Answer.ACCEPTED]
    async with running(tmp_path, controller) as (built, task):
        await built.ready()
        (job,) = await built.stop(task)
        assert job.outcome is Outcome.ACCEPTED
        assert len(controller.accepted) == 1
        assert (controller.service.trigger_ack, controller.service.settled_job) == (3, job.job_id)


async def test_a_ticket_handed_out_at_the_moment_of_the_stop_is_settled(tmp_path: Path) -> None:
    async with running(tmp_path, ScriptedController()) as (built, task):
        await built.ready()
        await built.parts.executor.submit(TriggerStamp("serial"))
        (job,) = await built.stop(task)
        assert job.outcome is Outcome.ACCEPTED


def test_the_lock_holds_on_a_full_disk_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.pwrite", full)
    held = Lock(tmp_path / "lock")
    with pytest.raises(LockError, match="process unknown"):
        Lock(tmp_path / "lock")
    held.release()
