"""Cells of a plant in one process: real journal, executor, health and telemetry; the picture's part is drawn by chance.

`python -m tests.support.processes.plant_cells PORT FOLDER FIRST COUNT PERIOD_S [HOST]`, until SIGTERM. What each cell
told its own page, its changes of state, stands in FOLDER/cell-N/changes.json then, its jobs in its journal.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import random
import signal
import sys
import time
from pathlib import Path

from service.config.plant import Telemetry
from service.jobs.executor import Executor, Intake
from service.jobs.health import Health
from service.reasons import Outcome, Reason
from service.records.job import Job, Progress, TriggerStamp
from service.records.journal import Journal
from service.state import State, StateMachine
from service.telemetry.sender import Sender
from service.telemetry.sources import DaemonSources


class DrawnRunner:
    """Settles each job at once, one in ten refused."""

    def __init__(self, journal: Journal, chance: random.Random) -> None:
        self._journal, self._chance = journal, chance

    async def run(self, job: Job) -> Job:
        quality = {"blur_px": self._chance.uniform(0.8, 1.2), "level": self._chance.uniform(150, 200)}
        report = {"area_mm2": 5e4, "uncertainty_mm": self._chance.uniform(0.05, 0.1), "quality": quality}
        refused = self._chance.random() < 0.1
        outcome, reason = (Outcome.REFUSED, Reason.NO_BLOCK_FOUND) if refused else (Outcome.ACCEPTED, None)
        return self._journal.settle(job.job_id, outcome, reason, None, Progress(report=report))

    async def resume(self, job: Job) -> Job:
        return self._journal.settle(job.job_id, Outcome.FAILED, Reason.SERVICE_RESTARTED, "killed before its end")

    def hindrance(self, _job: Job) -> str | None:
        return None


class PlantCell:
    """One of them."""

    def __init__(self, folder: Path, settings: Telemetry, seed: int) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self._chance = folder, random.Random(seed)
        self.journal = Journal(folder / "journal.sqlite")
        self.health = Health(StateMachine())
        self.executor = Executor(
            self.journal, DrawnRunner(self.journal, self._chance), self.health, None, Intake(controller=False)
        )
        self.changes: list[tuple[int, str]] = []
        self.sender = Sender(
            settings, DaemonSources("1.0", self.health, self.executor), folder / "journal.sqlite", folder
        )

    def _note(self, state: State, _reason: str | None) -> None:
        self.changes.append((round(time.time() * 1000), state.label))

    async def run(self, period_s: float) -> None:
        """A job each period or so, until cancelled."""
        executing = asyncio.create_task(self.executor.run())
        self.health.listen(self._note)
        self.sender.start()
        self.health.start()
        try:
            while True:
                await asyncio.sleep(period_s * self._chance.uniform(0.5, 1.5))
                await (await self.executor.submit(TriggerStamp("manual"))).settled
        finally:
            executing.cancel()
            await asyncio.gather(executing, return_exceptions=True)

    def close(self) -> None:
        """Let telemetry say the last, then the rest go."""
        self.health.halt("the service is being stopped")
        self.sender.close()
        self.journal.close()
        (self.folder / "changes.json").write_text(json.dumps(self.changes))


async def main(port: int, folder: Path, first: int, count: int, period_s: float, *host: str) -> None:
    """Until SIGTERM."""
    stop = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, stop.set)
    cells = []
    for number in range(first, first + count):
        settings = Telemetry(port=port, group="plant", node=f"cell-{number}", primary_host=next(iter(host), None))
        cells.append(PlantCell(folder / f"cell-{number}", settings, number))
    running = [asyncio.create_task(cell.run(period_s)) for cell in cells]
    print("ready", count, flush=True)
    await stop.wait()
    for task in running:
        task.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await asyncio.gather(*running, return_exceptions=True)
    await asyncio.gather(*(asyncio.to_thread(cell.close) for cell in cells))


if __name__ == "__main__":
    words = sys.argv[1:]
    asyncio.run(main(int(words[0]), Path(words[1]), int(words[2]), int(words[3]), float(words[4]), *words[5:]))
