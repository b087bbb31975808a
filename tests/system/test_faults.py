"""Service and controller in one process, every request at risk, both restarted at random: what always holds, holds."""

from __future__ import annotations

import asyncio
import logging
import random
import time
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from contour.geometry import Contour
from drivers.camera import CameraUnavailable
from drivers.camera.simulated import SimulatedCamera
from drivers.controller.modbus import ModbusTcpController
from drivers.controller.simulated import AcceptedContour, SimulatedController, TriggerNotPossible
from service.config import Recipe
from service.cycle import Cycle, CycleSettings, Observation
from service.daemon import Daemon, Parts
from service.executor import Executor, TriggerRefused
from service.health import Health
from service.journal import Job, Journal, TriggerStamp
from service.link import Link, LinkSettings
from service.lock import Lock
from service.measure import Measurement
from service.reasons import Reason
from service.state import State, StateMachine
from service.transfer import TransferCounter, TransferSettings
from tests.drivers.controller.fault_proxy import Fate, FaultProxy

READ = 3
VALID_FOR_S = 0.6
SLACK_S = 0.3  # a busy machine lets the controller's scan wait
FAULTS = (Fate.LOSE_REQUEST, Fate.LOSE_REPLY, Fate.CUT_BEFORE, Fate.CUT_AFTER, Fate.LATE)
SETTINGS = CycleSettings(
    camera_timeout_s=0.3,
    valid_for_s=VALID_FOR_S,
    job_timeout_s=VALID_FOR_S,
    transfer=TransferSettings(ready_timeout_s=0.4, ack_timeout_s=0.12, max_repeats=3, poll_period_s=0.005),
)


class Plan:
    """Stands in for the measurer: a rectangle, of another size each time."""

    def __init__(self, chance: random.Random) -> None:
        self._chance = chance

    def measure(self, _picture: object, _recipe: Recipe, _thickness_mm: float) -> Measurement:
        width, height = self._chance.uniform(20, 200), self._chance.uniform(20, 200)
        contour = Contour(np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]]))
        area = width * height
        return Measurement("direct-scan", "bright", 20.0, contour, contour, area, area, thickness_mm=20.0)


class Proxy(FaultProxy):
    """A proxy that refuses connections while the controller is not there."""

    down = False

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self.down:
            writer.close()
            return
        await super()._accept(reader, writer)


class KilledCycle(Cycle):
    """A cycle whose process is killed, not stopped: nobody tidies up."""

    def _abort(self, job: Job) -> None:
        return


class Campaign:
    """Both sides, what befalls them, and what the controller took."""

    def __init__(self, folder: Path, seed: int, *, risk: float, has_clock: bool) -> None:
        self.chance = random.Random(seed)
        self.folder = folder
        self.risk = risk
        self.has_clock = has_clock
        self.accepted: list[tuple[int, float]] = []
        self.exposed: dict[int, float] = {}
        self.forgot = False
        self.triggers = 0

    # --- the parts ----------------------------------------------------------------------------------------------

    def fate(self, request: bytes) -> Fate:
        risk = self.risk / 20 if request[7] == READ else self.risk  # most requests only look
        return self.chance.choice(FAULTS) if self.chance.random() < risk else Fate.PASS

    def judge(self, _contour: AcceptedContour) -> int:
        return self.chance.choices((1, 4, 7), (8, 1, 1))[0]

    def note_accepted(self, contour: AcceptedContour) -> None:
        self.accepted.append((contour.job_id, time.monotonic()))

    def note_exposed(self, seen: Observation) -> None:
        self.exposed[seen.job.job_id] = seen.frame.exposed_at_s

    def picture(self, _number: int) -> np.ndarray:
        if self.risk and self.chance.random() < 0.03:
            raise CameraUnavailable("unplugged")
        return np.zeros((6, 8), np.uint8)

    def new_controller(self) -> SimulatedController:
        return SimulatedController(
            scan_s=0.002,
            memory_path=self.folder / "memory.json",
            has_clock=self.has_clock,
            judge=self.judge,
            on_accepted=self.note_accepted,
        )

    def new_daemon(self) -> Daemon:
        controller = ModbusTcpController("127.0.0.1", self.proxy.port, timeout_s=0.08)
        link = Link(controller, LinkSettings(poll_period_s=0.005, heartbeat_timeout_s=1.0))
        journal = Journal(self.folder / "journal.sqlite")
        health = Health(StateMachine(lambda state, _reason: link.publish(service_state=int(state))))
        pool = ThreadPoolExecutor(1)
        camera = SimulatedCamera(self.picture)
        cycle = KilledCycle(
            camera,
            Plan(self.chance),  # type: ignore[arg-type]
            {1: Recipe(number=1, name="one")},
            journal,
            health,
            link,
            TransferCounter(self.chance.randrange(1, 65536)),
            SETTINGS,
            pool,
            observe=self.note_exposed,
        )
        executor = Executor(journal, cycle, health, link, controller_triggers=True)
        link.on_look = executor.wake
        self.parts = Parts(camera, journal, health, executor, link, pool, Lock(self.folder / "lock"))
        return Daemon(self.parts)

    # --- what befalls them --------------------------------------------------------------------------------------

    async def ask(self) -> None:
        """The machine's person: triggers from the controller, and now and then one of another kind."""
        while True:
            await asyncio.sleep(self.chance.uniform(0, 0.03))
            if self.chance.random() < 0.2:
                with suppress(TriggerRefused):
                    await self.parts.executor.submit(TriggerStamp("serial"))
            with suppress(TriggerNotPossible):
                self.controller.request_measurement()
                self.triggers += 1

    async def machine(self) -> None:
        """The machine is busy at times."""
        while True:
            await asyncio.sleep(self.chance.uniform(0.1, 1.0))
            self.controller.set_state(self.chance.choice((0, 2, 3)))
            await asyncio.sleep(self.chance.uniform(0, 0.2 * bool(self.risk)))
            self.controller.set_state(1)

    async def in_the_midst_of_a_transfer(self) -> None:
        for _ in range(200):
            if any(job.sent for job in self.parts.journal.unsettled()):
                break
            await asyncio.sleep(0.001)
        await asyncio.sleep(self.chance.uniform(0, 0.015))

    async def restart_service(self) -> None:
        await self.in_the_midst_of_a_transfer()
        self.running.cancel()
        with suppress(asyncio.CancelledError):
            await self.running
        self.running = asyncio.ensure_future(self.new_daemon().run())

    async def restart_controller(self) -> None:
        if self.chance.random() < 0.5:
            self.controller.restart(keep_registers=self.chance.random() < 0.3)
            return
        self.proxy.down = True
        verdict = self.controller.verdict
        await self.controller.stop()
        await asyncio.sleep(self.chance.uniform(0, 0.2))
        self.controller = self.new_controller()
        self.controller.verdict = self.controller._watch._verdict = verdict
        await self.controller.start()
        self.proxy._target = self.controller.port
        self.proxy.down = False

    async def forget(self) -> None:
        self.forgot = True
        self.controller.restart(forget=True)

    async def run(self, duration_s: float, *, forgetful: bool) -> None:
        self.controller = self.new_controller()
        await self.controller.start()
        events: list[Callable[[], Awaitable[None]]] = [self.restart_service, self.restart_controller]
        events += [self.forget] * forgetful
        async with Proxy(self.controller.port, self.fate) as self.proxy:
            self.running = asyncio.ensure_future(self.new_daemon().run())
            people = [asyncio.ensure_future(self.ask()), asyncio.ensure_future(self.machine())]
            enough_at = time.monotonic() + duration_s
            while time.monotonic() < enough_at or (len(self.accepted) < 3 and time.monotonic() < enough_at + 30):
                # That there is no clock shows only after a second.
                await asyncio.sleep(self.chance.uniform(0.1, 1.0) + (0 if self.has_clock else 1.2))
                await self.chance.choice(events)()
                for task in (*people, self.running):
                    if task.done():
                        task.result()
            for person in people:
                person.cancel()
            await asyncio.wait(people)
            self.risk = 0.0
            self.controller.set_state(1)
            await self.quiet()
            self.running.cancel()
            with suppress(asyncio.CancelledError):
                await self.running
        await self.controller.stop()

    async def quiet(self) -> None:
        """Wait until all is settled and the service is ready again."""
        async with asyncio.timeout(30):
            while (
                self.parts.health.state is not State.READY
                or self.parts.journal.unsettled()
                or self.controller.trigger_open
                or self.parts.executor._pending() is not None
            ):
                if self.running.done():
                    self.running.result()
                await asyncio.sleep(0.02)

    # --- what always holds --------------------------------------------------------------------------------------

    def check(self) -> None:
        journal = Journal(self.folder / "journal.sqlite")
        jobs = [job for number in range(1, 100_000) if (job := journal.find(number))]
        journal.close()
        accepted = [job_id for job_id, _ in self.accepted]
        assert len(accepted) == len(set(accepted)), "accepted twice"
        claimed = {job.job_id for job in jobs if job.outcome == "accepted"}
        unknown = {job.job_id for job in jobs if job.reason is Reason.CONTROLLER_RESTARTED}
        assert claimed <= set(accepted), "accepted in the journal, not at the controller"
        denied = set(accepted) - claimed
        assert denied <= (unknown if self.forgot else set()), "accepted at the controller, denied in the journal"
        pairs = [(job.trigger.session, job.trigger.counter) for job in jobs if job.trigger.counter]
        assert len(pairs) == len(set(pairs)), "one trigger gave two jobs"
        assert len(pairs) <= self.triggers, "a trigger was invented"
        ages_s = [at - self.exposed[job_id] for job_id, at in self.accepted]
        assert max(ages_s, default=0) <= VALID_FOR_S + SLACK_S, "accepted too late"
        verdict = self.controller.verdict
        texts = [text for kind in set(verdict.texts) - {"heartbeat-stalled"} for text in verdict.texts[kind]]
        assert texts == [], "lost replies may hold our heartbeat back, nothing else"


@pytest.mark.parametrize(
    ("seed", "risk", "has_clock", "forgetful"),
    [(1, 0.04, True, False), (2, 0.1, True, True), (3, 0.04, False, False)],
)
async def test_what_always_holds_holds(
    tmp_path: Path, seed: int, risk: float, has_clock: bool, forgetful: bool, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.CRITICAL, "pymodbus")
    campaign = Campaign(tmp_path, seed, risk=risk, has_clock=has_clock)
    await campaign.run(2.5, forgetful=forgetful)
    campaign.check()
    assert len(campaign.accepted) >= 3, "nothing was tried"
