"""A daemon as wired from a configuration, in this process, but for its tracing: a rectangle is always seen."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import numpy as np

from contour.geometry.rings import Contour
from drivers.camera.simulated import SimulatedCamera
from service.config.config import Config
from service.daemon.daemon import Daemon, Parts
from service.measuring.measurement import Measurement
from service.records.job import Job, TriggerStamp
from service.state import State
from service.wiring.daemon import build
from tests.support.processes.processes import BOUND_S
from tests.support.service.waiting import until

RECTANGLE = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 50.0], [0.0, 50.0]])
CALIBRATION = (
    "version: 1\nkind: simple\nimage_width: 8\nimage_height: 6\nmm_per_pixel: 1\nplane_height_mm: 0\n"
    "origin_px: [0, 0]\nrotation_deg: 0\n"
)
QUICK = {"timeout_s": 0.2, "poll_period_s": 0.01, "ready_timeout_s": 1.0, "ack_timeout_s": 0.5}


def measure(*_: object, **__: object) -> Measurement:
    """Stands in for the measurer's tracing."""
    contour = Contour(RECTANGLE)
    return Measurement("find-contours", pixels=contour, millimetres=contour, area_mm2=5000.0)


class WiredDaemon:
    """Its parts, and what a test does with them."""

    def __init__(self, folder: Path, controller: dict[str, Any], **sections: Any) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "calibration.yaml").write_text(CALIBRATION)
        self.config = Config.model_validate(
            {
                "camera": {"kind": "files", "path": str(folder)},
                "calibration": {"file": str(folder / "calibration.yaml")},
                "controller": controller if controller.get("kind") == "none" else {**QUICK, **controller},
                "triggers": [{"kind": "controller"}],
                "service": {"state_dir": str(folder / "state")},
                "journal": {"path": str(folder / "journal.sqlite")},
                "archive": {"path": str(folder / "archive")},
                **sections,
            }
        )
        self.parts: Parts = build(self.config)
        cycle: Any = self.parts.executor._runner
        cycle._plan.measurer.measure = measure
        cycle._camera = self.parts.camera = SimulatedCamera(lambda _number: np.zeros((6, 8), np.uint8))

    @property
    def reason(self) -> str:
        """What keeps it from being ready, "" where nothing does."""
        fault = self.parts.health.first()
        return "" if fault is None else f"{int(fault.reason)} {fault.text}"

    async def ready(self, bound_s: float = BOUND_S) -> None:
        await until(lambda: self.parts.health.state is State.READY, bound_s)

    async def job(self) -> Job:
        """One job by hand, settled."""
        await self.ready()
        return await (await self.parts.executor.submit(TriggerStamp("serial"))).settled


@asynccontextmanager
async def wired(folder: Path, controller: dict[str, Any], **sections: Any) -> AsyncIterator[WiredDaemon]:
    """The daemon, running."""
    built = WiredDaemon(folder, controller, **sections)
    daemon = Daemon(built.parts)
    task = asyncio.ensure_future(daemon.run())
    try:
        yield built
    finally:
        daemon.stop()
        await asyncio.wait([task])
        task.result()
