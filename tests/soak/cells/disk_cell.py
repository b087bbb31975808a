"""A disk that is full or takes no writes, while jobs are on their way and when the service starts."""

from __future__ import annotations

import asyncio
from pathlib import Path

from tests.soak.cells.killed_cell import KilledCell, Killing, Sniper, Toll
from tests.support.processes.processes import Process
from tests.support.processes.small_disk import fill, mounted, remount

MEGABYTES = 24


class DiskCell(KilledCell):
    """Journal, state and evidence lie on a small disk; what the service answers for is read there."""

    def __init__(self, folder: Path, killing: Killing) -> None:
        super().__init__(folder, killing)
        self.disk = folder / "disk"
        self.journal = self.disk / "journal.sqlite"
        spare_bytes = (0, 4_000_000)[killing.seed % 2]
        self.state = self.disk / "state"
        self.storage = (
            f"journal: {{path: {self.journal}, min_free_bytes: {spare_bytes}}}\n"
            f"archive: {{path: {self.disk}/archive, min_free_bytes: {2 * spare_bytes}}}\n"
        )

    async def kill_service(self) -> Toll:
        with mounted(self.disk, MEGABYTES):
            return await super().kill_service()

    async def _kill_once(self, controller: Sniper) -> None:
        """Not the service: its disk. Some jobs, then one of three faults for some time."""
        await self._served(controller, len(self.taken) + self.chance.randint(0, 2))
        fault = self.chance.choice(("full", "full at the start", "read-only at the start"))
        self.kills[f"disk {fault}"] += 1
        for_s = self.chance.uniform(0.3, 3.0)
        if fault == "full":
            theirs = fill(self.disk, 0)
            await asyncio.sleep(for_s)
            theirs.unlink()
            return
        self.service.kill()
        if fault == "full at the start":
            theirs = fill(self.disk, 0)
        else:
            remount(self.disk, "ro")
        said = self.service.log.stat().st_size
        self.service = self.start_service()
        while self.service.running and self.service.log.stat().st_size == said:
            await asyncio.sleep(0.05)
        await asyncio.sleep(for_s)
        if fault == "full at the start":
            theirs.unlink()
        else:
            remount(self.disk, "rw")

    async def bring_back(self, process: Process, _forgets: bool = False) -> Process:
        if process.running:
            return process
        self.life.add("ended", f"the service ended by itself, for its disk: {process.text.splitlines()[-1:]}")
        return self.start_service()
