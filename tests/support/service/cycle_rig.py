"""A job's cycle with a real journal and a scripted controller, for tests of its way and of its end after a restart."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from contour.geometry.rings import Contour
from drivers.camera.simulated import SimulatedCamera
from drivers.controller.mailbox.pages import Page
from service.config.recipes import Recipe
from service.jobs.cycle import Cycle
from service.jobs.cycle_terms import CycleSettings, Devices, Observation, Plan, Records
from service.jobs.health import Health
from service.link.link import Link, LinkSettings
from service.link.transfer_terms import TransferCounter, TransferSettings
from service.measuring.measurement import Measurement
from service.records.evidence import Evidence
from service.records.job import Job, TriggerStamp
from service.records.journal import Journal
from service.state import StateMachine
from tests.support.controller.protocol_decoder import Contour as Decoded
from tests.support.controller.protocol_decoder import decode_contour
from tests.support.service.scripted_controller import ScriptedController

RECTANGLE = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 50.0], [0.0, 50.0]])
QUICK = TransferSettings(ready_timeout_s=0.3, ack_timeout_s=0.2, max_repeats=2, poll_period_s=0.01)
SETTINGS = CycleSettings(transfer=QUICK, camera_timeout_s=0.3)


def decoded(page: Page) -> Decoded:
    """A page as the protocol's text reads it."""
    return decode_contour([((1, *page.header), page.payload)])


def measured(**changes: object) -> Measurement:
    contour = Contour(RECTANGLE)
    good = Measurement(
        "sliding-matrix",
        "bright",
        20.0,
        pixels=contour,
        millimetres=contour,
        area_px2=5000.0,
        area_mm2=5000.0,
        thickness_mm=20.0,
    )
    return replace(good, **changes)  # type: ignore[arg-type]


class FixedMeasurer:
    """Stands in for the measurer: the tracing has its own tests."""

    def __init__(self) -> None:
        self.result: Measurement | Exception = measured()
        self.calls: list[tuple[int, float]] = []
        self.calibration_digest = None

    def measure(self, picture: object, recipe: Recipe, thickness_mm: float, camera: str = "") -> Measurement:
        self.calls.append((recipe.number, thickness_mm))
        if isinstance(self.result, Exception):
            raise self.result
        return self.result


class HeldKeeper:
    """Keeps evidence in memory; what is drafted is durable once `durable` is told so."""

    def __init__(self) -> None:
        self.drafted: list[Evidence] = []
        self.kept: list[Evidence] = []
        self.durable: Future[None] = Future()

    def draft(self, evidence: Evidence) -> Future[None]:
        self.drafted.append(evidence)
        return self.durable

    def keep(self, evidence: Evidence) -> None:
        self.kept.append(evidence)


class Rig:
    """A cycle with a real journal, a camera of the simulated kind and a scripted controller."""

    def __init__(self, folder: Path, settings: CycleSettings, *, controller: ScriptedController | None) -> None:
        self.journal = Journal(folder / "journal.sqlite")
        self.controller = controller
        self.camera = SimulatedCamera(lambda _n: np.zeros((60, 80), np.uint8))
        self.measurer = FixedMeasurer()
        self.machine = StateMachine()
        self.health = Health(self.machine)
        self.link = None
        if controller is not None:
            handshake = settings.transfer.handshake
            self.link = Link(controller, LinkSettings(handshake, poll_period_s=0.01, heartbeat_timeout_s=0.5))
        self.pool = ThreadPoolExecutor(1)
        self.seen: list[Observation] = []
        self.keeper = HeldKeeper()
        self.keeper.durable.set_result(None)
        recipes = {1: Recipe(number=1, name="one"), 2: Recipe(number=2, name="two", thickness_mm=35)}
        self.cycle = Cycle(
            Devices(self.camera, self.pool, self.link, TransferCounter(50)),
            Records(self.journal, self.health, self.keeper, self.seen.append),
            Plan(self.measurer, recipes),  # type: ignore[arg-type]
            settings,
        )

    async def job(self, trigger: TriggerStamp | None = None) -> Job:
        taken = self.journal.take(trigger or TriggerStamp("serial"))
        return await asyncio.wait_for(self.cycle.run(taken), 15)


@asynccontextmanager
async def rig(
    folder: Path, settings: CycleSettings = SETTINGS, *, controller: ScriptedController | str | None = "default"
) -> AsyncIterator[Rig]:
    built = Rig(folder, settings, controller=ScriptedController() if controller == "default" else controller)  # type: ignore[arg-type]
    built.health.start()
    task = asyncio.ensure_future(built.link.run()) if built.link else None
    try:
        if built.link is not None:
            await asyncio.wait_for(built.link.wait_connected(), 5)
        yield built
    finally:
        if task is not None:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task
        built.pool.shutdown()
        built.journal.close()
