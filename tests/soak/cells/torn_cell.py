"""A controller that does not write 32 bits at once: a value stands half written from one scan of 100 ms to the next.

Numbers and clocks begin just below multiples of 65536, for only there do the halves of a value that rises contradict
each other. As the protocol asks, the heartbeat stands still meanwhile.
"""

from __future__ import annotations

import asyncio
import itertools
import random
import sqlite3
from collections import Counter
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from drivers.controller.simulated.controller import SimulatedController
from drivers.controller.simulated.program import TriggerNotPossible
from service.config.config import Config
from service.records.journal import Journal
from tests.soak.cells.faulted_cell import FaultedCell, Incident, Terms
from tests.soak.promises import Evidence
from tests.support.processes.processes import jobs

HALF = 0x10000
WIDE = {4: "block_thickness", 8: "test_echo", 10: "last_job", 14: "clock"}
HEARTBEAT, ANSWER = 1, (6, 7)
FIRST_ABOVE = 1000  # a service that starts may leave so many numbers out
SLOW_SCANS_S = (0.05, 0.1, 0.1)
EXPIRED = 5
ON_ITS_WAY_S = 1.0  # from the reading of the clock to the exposure, on a busy machine


class TearingController(SimulatedController):
    """What its program writes of a 32-bit value in one scan is seen in two, one half first, where both change."""

    def __init__(self, *args: Any, chance: random.Random, torn: Counter[str], **options: Any) -> None:
        super().__init__(*args, **options)
        self._chance = chance
        self._torn = torn
        self._whole: dict[int, int] = {}  # values to be completed in the next scan, by address

    def prepare_thickness(self, thickness_um: int) -> None:
        """Write block_thickness ahead of its trigger, half of it now: it is whole from the next scan on."""
        before = self._link_block()
        self._program._set32(4, thickness_um)
        self._tear(before)

    def _scan(self) -> None:
        for address, value in self._whole.items():
            self._registers[address] = value
        self._whole.clear()
        before = self._link_block()
        super()._scan()
        self._tear(before)
        # Nor does the heartbeat change between the two of a pair.
        if self._whole or self._program._to_write:
            self._registers[self._layout.link_address + HEARTBEAT] = before[HEARTBEAT]

    def _link_block(self) -> tuple[int, ...]:
        return self.registers(self._layout.link_address, 16)

    def _tear(self, before: tuple[int, ...]) -> None:
        after = self._link_block()
        for offset, name in WIDE.items():
            if all(before[half] != after[half] for half in (offset, offset + 1)):
                late = offset + self._chance.randint(0, 1)
                self._whole[self._layout.link_address + late] = after[late]
                self._registers[self._layout.link_address + late] = before[late]
                self._torn[f"{name} half written"] += 1
                if name == "last_job":  # what is written after it is not there yet
                    self._hold_back(before, ANSWER)

    def _hold_back(self, before: tuple[int, ...], offsets: tuple[int, ...]) -> None:
        for offset in offsets:
            address = self._layout.link_address + offset
            self._whole[address] = self._registers[address]
            self._registers[address] = before[offset]


class TornCell(FaultedCell):
    """Jobs one after the other past the boundaries, with thicknesses to both sides of one."""

    valid_for_s = 4.0
    seconds_a_job = 6.0
    serial_share = 0.0
    rude_share = 0.0
    pause_s = (3.2, 4.5)
    controller_kind = TearingController
    controller: TearingController

    def __init__(self, folder: Path, terms: Terms) -> None:
        super().__init__(folder, terms)
        self.asked: dict[tuple[int, int], int] = {}
        self._left_out = itertools.cycle((0, FIRST_ABOVE))
        self._near_a_boundary()

    def more_options(self) -> dict[str, Any]:
        return {"chance": self.chance, "torn": self.restarts, "scan_s": self.chance.choice(SLOW_SCANS_S)}

    def config(self, folder: Path | None = None, **changed: Any) -> Config:
        """With patience for an answer that takes many slow scans."""
        return super().config(folder, **{"ack_timeout_s": 2.0, "ready_timeout_s": 2.0, **changed})

    def incidents(self) -> list[Incident]:
        return [self.near_the_next_boundaries] * 3 + [self.restart_program]

    def _near_a_boundary(self) -> None:
        self.clock_start_ms = (self.chance.randint(1, HALF - 1) * HALF - self.chance.randint(1000, 3000)) % 2**32

    def start_service(self) -> None:
        """Begin below a boundary, by as much as numbers go on one by one, or as a start leaves out."""
        journal = self.folder / "journal.sqlite"
        if not journal.exists():
            Journal(journal).close()
        highest = max((row["job_id"] for row in jobs(journal)), default=0)
        margin = next(self._left_out) + self.chance.randint(1, 3)
        above = (highest // HALF + 1) * HALF - margin
        with closing(sqlite3.connect(journal)) as database, database:
            database.execute("INSERT OR REPLACE INTO meta VALUES ('above', ?)", (str(above),))
        super().start_service()

    async def near_the_next_boundaries(self) -> None:
        """Both programs anew, the service at rest or not."""
        await self.in_the_midst_of_a_transfer()
        await self.end_service()
        self._near_a_boundary()
        self.controller._clock_start_ms = self.clock_start_ms
        self.controller.scan_s = self.chance.choice(SLOW_SCANS_S)
        self.controller.restart(keep_registers=self.chance.random() < 0.5)
        self.start_service()

    async def machine(self) -> None:
        """The machine is always ready: how slowly its program runs is trouble enough."""

    async def ask(self) -> None:
        """The thickness first, then, once it stands, the trigger."""
        while True:
            await asyncio.sleep(self.chance.uniform(0, 0.02))
            if self.controller.can_request:
                thickness_um = self.chance.randint(1, 40) * 10_000
                self.controller.prepare_thickness(thickness_um)
                await asyncio.sleep(2 * self.controller.scan_s)
                with suppress(TriggerNotPossible):
                    counter = self.controller.request_measurement(0, thickness_um)
                    self.asked[self.controller.registers(13, 1)[0], counter] = thickness_um

    def evidence(self, rows: list[dict[str, Any]]) -> Evidence:
        for row in rows:
            asked = self.asked.get((row["trigger_session"], row["trigger_counter"]), row["thickness_um"])
            if row["thickness_um"] != asked:
                self.findings_of_life.add(
                    "torn-or-misread", f"job {row['job_id']}: {row['thickness_um']} µm thick, {asked} µm were asked for"
                )
        for event in self.events:
            if event["event"] == "answer" and event["answer"] == EXPIRED and event["job"] in self.exposed:
                age_s = event["at_s"] - self.exposed[event["job"]]
                if age_s < self.valid_for_s - ON_ITS_WAY_S:
                    self.findings_of_life.add("expired-in-time", f"job {event['job']}, exposed {age_s:.2f} s before")
        return super().evidence(rows)
