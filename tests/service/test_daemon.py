"""The daemon: its parts run on whatever is lost, it stops in any stage, and what it promised is kept."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.camera import CameraUnavailable
from drivers.camera.simulated import SimulatedCamera
from drivers.controller.mailbox import Answer
from service.config import Recipe
from service.cycle import Cycle, CycleSettings
from service.daemon import Daemon, Parts
from service.executor import Executor
from service.health import Health
from service.journal import Job, Journal, TriggerStamp
from service.link import Link, LinkSettings
from service.lock import Lock, LockError
from service.reasons import Outcome, Reason
from service.state import State, StateMachine
from service.transfer import TransferCounter, TransferSettings
from service.trigger_queue import TriggerRefused
from tests.service.scripted_controller import ScriptedController
from tests.service.test_cycle import Plan

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
            self.camera,
            Plan(),  # type: ignore[arg-type]
            {1: Recipe(number=1, name="one")},
            journal,
            health,
            link,
            TransferCounter(50),
            settings,
            pool,
        )
        executor = Executor(journal, cycle, health, link, controller_triggers=True)
        if link is not None:
            link.on_look = executor.wake
        self.parts = Parts(self.camera, journal, health, executor, link, pool, Lock(folder / "lock"))
        self.daemon = Daemon(self.parts)

    async def until(self, condition: Callable[[], object]) -> None:
        async with asyncio.timeout(10):
            while not condition():
                await asyncio.sleep(0.005)

    async def ready(self) -> None:
        await self.until(lambda: self.parts.health.state is State.READY)

    async def stop(self, running: asyncio.Future[None]) -> list[Job]:
        """Stop it; the jobs of its journal then."""
        self.daemon.stop()
        await asyncio.wait_for(running, 15)
        Lock(self.folder / "lock").release()  # it let go
        journal = Journal(self.folder / "journal.sqlite")
        jobs = [job for number in range(1, 20) if (job := journal.find(number))]
        journal.close()
        return jobs


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


async def test_without_a_controller_it_runs_until_it_is_stopped(tmp_path: Path) -> None:
    async with running(tmp_path, None) as (built, task):
        await built.ready()
        for _ in range(2):
            ticket = await built.parts.executor.submit(TriggerStamp("interval"))
            assert (await asyncio.wait_for(ticket.settled, 5)).outcome is Outcome.WRITTEN
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
    assert (job.job_id, job.trigger.kind) == (1, "manual")
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


async def test_a_part_that_ends_by_a_defect_ends_the_service_and_says_so(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    built = Built(tmp_path, ScriptedController())

    async def broken(_block: object) -> None:
        raise ZeroDivisionError("a defect")

    built.controller.write_service = broken  # type: ignore[method-assign,assignment]
    with pytest.raises(ZeroDivisionError):
        await asyncio.wait_for(built.daemon.run(), 10)
    assert "a part of the service has ended" in caplog.text
    Lock(tmp_path / "lock").release()


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
    monkeypatch.setattr("service.daemon.STOP_BOUND_S", 0.2)
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
