"""What is exchanged between two starts of the service: the controller for a spare one, or the link's settings."""

from __future__ import annotations

import asyncio
from collections import Counter
from pathlib import Path
from typing import Any

from service.config.config import Config
from tests.soak.cells.faulted_cell import FaultedCell, Incident, Terms
from tests.soak.promises import Evidence
from tests.support.processes.processes import jobs

MODULUS = 2**32
CAPTURED_AT = 24  # offset in the header
PATIENCE_S = 5.0  # for a commit, while the machine is busy or its program slow
SESSION = 1  # of a controller that neither counts its starts nor draws a number


class SpareCell(FaultedCell):
    """The controller is exchanged for one without memory that shows the same session, and whose clock fits.

    To exchange it takes longer than a contour is valid. What the old one had accepted and could not say any more is
    lost with it; what it was sent must not be accepted by the new one.
    """

    seconds_a_job = 6.0
    serial_share = 0.8  # the spare one does not have the trigger of before, and refuses what answers it
    pause_s = (0.1, 0.8)

    def __init__(self, folder: Path, terms: Terms) -> None:
        super().__init__(folder, terms)
        self.first_trigger = 65535 - 9
        self.gone: set[int] = set()

    def more_options(self) -> dict[str, Any]:
        return {"session_source": lambda: SESSION, "first_trigger": self.first_trigger}

    def incidents(self) -> list[Incident]:
        return [self.crash_and_spare] * 3 + [self.spare, self.restart_service]

    async def crash_and_spare(self) -> None:
        """The service crashes just after a commit, and finds another controller."""
        await self._exchange(crashes=True)

    async def spare(self) -> None:
        """The service lives on, and finds another controller."""
        await self._exchange(crashes=False)

    async def _exchange(self, crashes: bool) -> None:
        if not await self.commit(PATIENCE_S):
            return
        await asyncio.sleep(self.chance.choice((0.0, 0.0, self.chance.uniform(0, 0.02))))
        self.restarts[f"spare controller, service {'crashed' if crashes else 'running'}"] += 1
        if crashes:
            await self.end_service()
        captured_at = self._captured_at()
        await self.controller.stop()
        open_jobs = {row["job_id"] for row in jobs(self.folder / "journal.sqlite") if row["outcome"] is None}
        self.gone |= open_jobs & {taken.job_id for taken in self.taken}
        (self.folder / "memory.json").unlink(missing_ok=True)
        await asyncio.sleep(self.valid_for_s + self.chance.uniform(0.05, 0.5))
        self.clock_start_ms = (captured_at + self.chance.randint(-300, 500)) % MODULUS
        self.first_trigger = self.chance.randint(1, 65535)
        await self.start_controller()
        if crashes:
            self.start_service()

    def _captured_at(self) -> int:
        words = self.controller.registers(self.layout.contour_address + CAPTURED_AT, 2)
        first, second = words if self.terms.word_order == "big" else words[::-1]
        return first << 16 | second

    def evidence(self, rows: list[dict[str, Any]]) -> Evidence:
        found = super().evidence(rows)
        found.gone = frozenset(self.gone)
        # Which of two controllers of one session gave a trigger, nobody can tell.
        del found.verdict_kinds["unknown-trigger-acknowledged"]
        return found


class SettingsCell(FaultedCell):
    """The link's settings are changed and the service started while a job is on its way; later they are put back."""

    valid_for_s = 3.0  # so that most wait for their settings, and are not taken back
    seconds_a_job = 15.0
    pause_s = (0.1, 0.8)

    def __init__(self, folder: Path, terms: Terms) -> None:
        super().__init__(folder, terms)
        self.changed: dict[str, Any] = {}
        self.excused: Counter[str] = Counter()

    def config(self, folder: Path | None = None, **changed: Any) -> Config:
        return super().config(folder, **{**self.changed, **changed})

    def incidents(self) -> list[Incident]:
        found: list[Incident] = [self.change_word_order] * 2
        return [*found, self.change_kind, self.move_contour, self.swap_blocks, self.restart_service]

    async def change_word_order(self) -> None:
        """The halves of each 32-bit value change places."""
        await self._change("word_order", word_order="little" if self.terms.word_order == "big" else "big")

    async def change_kind(self) -> None:
        """Frames that the controller does not understand."""
        await self._change("kind", kind="modbus-rtu-over-tcp" if self.terms.transport == "tcp" else "modbus-tcp")

    async def move_contour(self) -> None:
        """A wrong address for the pages."""
        await self._change("contour_address", contour_address=self.layout.contour_address + 2)

    async def swap_blocks(self) -> None:
        """Link and service block take one another's place."""
        await self._change("link and service address", link_address=16, service_address=0)

    async def _change(self, told: str, **changed: Any) -> None:
        """What is written by wrong settings is not held against the service, only what it makes of the job."""
        while True:  # what begins by wrong settings can be settled by these only
            await (self.commit(PATIENCE_S) if self.chance.random() < 0.8 else self.in_the_midst_of_a_transfer())
            await self.end_service()
            if self._sent():
                break
            self.start_service()
            await self.serves()
        self.changed = changed
        self.restarts[f"{told} changed"] += 1
        before = self.controller.verdict.counts.copy()
        self.start_service()
        await asyncio.sleep(self.chance.uniform(0.3, 2.5))
        await self.end_service()
        self.excused += self.controller.verdict.counts - before
        self.controller._watch._settled = 0  # as it was misread
        self.changed = {}
        self.start_service()

    def _sent(self) -> bool:
        return any(row["outcome"] is None and row["session"] is not None for row in self.rows())

    def evidence(self, rows: list[dict[str, Any]]) -> Evidence:
        found = super().evidence(rows)
        found.verdict_kinds = found.verdict_kinds - self.excused
        return found
