"""Other services at the same controller: a stranger's block for a moment or for good, and a copy of the own journal."""

from __future__ import annotations

import asyncio
import sqlite3
import time
from collections import Counter
from contextlib import closing, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from drivers.controller.simulated.program import TriggerNotPossible
from service.daemon.daemon import Daemon, Parts
from service.jobs.cycle_terms import Observation
from service.jobs.trigger_queue import TriggerRefused
from service.records.job import TriggerStamp
from tests.soak.cells.faulted_cell import CALIBRATION, RECOVERY_S, FaultedCell, Incident, Outcome, Terms
from tests.soak.cells.restored_cell import copy_journal, put_back
from tests.soak.promises import Evidence, Findings, Rings, Side, judge_twins, micrometres
from tests.support.processes.processes import free_port, jobs

NOTICED_S = 5.0  # watching the own number (1.5 s), then two heartbeats of the other's, and a busy machine
PATIENCE_S = 5.0  # for a commit
SEEN_S = 2.0  # how long it is looked at who goes on


class ForeignCell(FaultedCell):
    """Another service's number appears in the service block while a job is on its way; later a person starts ours anew.

    The controller's program stands still meanwhile, so that it answers what was committed after the stranger was seen.
    """

    other_service = True
    pause_s = (0.05, 0.3)
    seconds_a_job = 15.0

    def incidents(self) -> list[Incident]:
        return [self.late_write_after_the_commit] * 2 + [self.late_write_before_it, self.stranger_for_good]

    async def late_write_after_the_commit(self) -> None:
        """One write of a service that is dead: its block stands still."""
        if await self.commit(PATIENCE_S):
            await self._intrude("after the commit", beats=0)

    async def late_write_before_it(self) -> None:
        """The same while the page is written."""
        await self.in_the_midst_of_a_transfer()
        await self._intrude("before the commit", beats=0)

    async def stranger_for_good(self) -> None:
        """A service that lives, at any step."""
        await (self.commit(PATIENCE_S) if self.chance.random() < 0.5 else self.in_the_midst_of_a_transfer())
        await self._intrude("with a moving heartbeat", beats=self.chance.randint(5, 20))

    async def _intrude(self, told: str, beats: int) -> None:
        self.restarts[f"foreign owner {told}"] += 1
        own = self.parts.journal.owner
        stranger = own % 65535 + 1
        self.controller.halt()
        self.controller.write_as_another(stranger, 1)
        await asyncio.sleep(self.chance.uniform(0.05, 0.4))
        self.controller._halted = False
        for beat in range(beats):
            self.controller.write_as_another(stranger, beat + 2)
            await asyncio.sleep(0.2)
        await asyncio.sleep(self.chance.uniform(0, 1.5))
        await self.end_service()  # the person's word
        self.start_service()
        await self.serves()


@dataclass
class Twin:
    """One of two services: its parts, what it measured, and which of its journal's rows are its own."""

    parts: Parts
    running: asyncio.Future[Any]
    journal: Path
    measured: dict[int, Rings] = field(default_factory=dict)
    common: set[tuple[int, str]] = field(default_factory=set)

    def side(self) -> Side:
        rows = [row for row in jobs(self.journal) if (row["job_id"], row["taken_at"]) not in self.common]
        return Side(rows, self.measured)


class TwinCell(FaultedCell):
    """A journal that was copied with its number: two services that take one another for themselves.

    `jobs` of its terms are encounters: both started together, or one later, on what was copied now or before.
    """

    other_service = True
    seconds_a_job = 60.0
    judges = False  # two clients at once are against the protocol: who of them wrote what, the verdict cannot tell
    host = ("127.0.0.1", "127.0.0.2")  # the lock on this machine does not see that both are one controller

    def __init__(self, folder: Path, terms: Terms) -> None:
        super().__init__(folder, terms)
        self.met: list[dict[str, Any]] = []  # the first one's rows of encounters
        self.findings = Findings()
        self.counted: Counter[str] = Counter()

    async def run(self, bound_s: float) -> Outcome:
        started = time.monotonic()
        self.port = free_port()
        (self.folder / "calibration.yaml").write_text(CALIBRATION)
        (self.folder / "twin").mkdir()
        await self.start_controller()
        try:
            self.start_service()
            for _ in range(self.terms.jobs):
                await self._alone(3)
                await self._meet()
                if self.findings_of_life.counts or time.monotonic() - started > bound_s:
                    break
            await self._alone(2)
            await self._rest()
        finally:
            await self.end_service()
            await self.controller.stop()
        outcome = self.outcome(started)
        for kind, count in self.findings.counts.items():
            outcome.findings.counts[kind] += count
        outcome.findings.texts += self.findings.texts
        outcome.outcomes += self.counted
        return outcome

    def rows(self) -> list[dict[str, Any]]:
        """The first one's journal; encounters are judged by themselves, as each ends."""
        met = {row["job_id"] for row in self.met}
        return [row for row in super().rows() if row["job_id"] not in met]

    def evidence(self, rows: list[dict[str, Any]]) -> Evidence:
        known = {row["job_id"] for row in rows}
        found = super().evidence(rows)
        found.taken = [taken for taken in self.taken if taken.job_id in known]
        found.events = [event for event in self.events if event["event"] == "trigger"]
        return found

    def _twin(self, folder: Path, host: str) -> Twin:
        measured: dict[int, Rings] = {}

        def observe(seen: Observation) -> None:
            assert seen.measurement.millimetres is not None
            measured[seen.job.job_id] = micrometres([ring.tolist() for ring in seen.measurement.millimetres.rings])
            self.exposed[seen.job.job_id] = seen.frame.exposed_at_s
            self.measured[seen.job.job_id] = measured[seen.job.job_id]

        parts = self.wired(self.config(folder, host=host), observe)
        twin = Twin(parts, asyncio.ensure_future(Daemon(parts).run()), folder / "journal.sqlite", measured)
        twin.common = {(row["job_id"], row["taken_at"]) for row in jobs(twin.journal)}
        return twin

    async def _alone(self, count: int) -> None:
        """Some jobs of the first service."""
        before, give_up_at = len(self.taken), time.monotonic() + RECOVERY_S
        while len(self.taken) < before + count:
            if time.monotonic() > give_up_at or self.running.done():
                why = self.parts.health.first()
                self.findings_of_life.add("ended", f"no job accepted within {RECOVERY_S:g} s of its start: {why}")
                return
            await self._asked(self.parts)

    async def _asked(self, parts: Parts) -> None:
        await asyncio.sleep(self.chance.uniform(0, 0.05))
        with suppress(TriggerNotPossible):
            self.controller.request_measurement()
        with suppress(TriggerRefused):
            await parts.executor.submit(TriggerStamp("serial"))

    async def _meet(self) -> None:
        together, old = self.chance.random() < 0.5, self.chance.random() < 0.5
        self.restarts[f"copied journal, {'together' if together else 'one later'}"] += 1
        copy, journal = self.folder / "copy.sqlite", self.folder / "journal.sqlite"
        if not old or not copy.exists():
            copy.unlink(missing_ok=True)
            copy_journal(journal, copy)
        put_back(copy, self.folder / "twin" / "journal.sqlite")
        self._in_flight_at_the_twins_address()
        if together:
            await self.in_the_midst_of_a_transfer()
        await self.end_service()
        before = dict(self.measured)
        first = self._twin(self.folder, "127.0.0.1")
        self.parts, self.running = first.parts, first.running
        if not together:
            await self._alone(1)
            await self.in_the_midst_of_a_transfer()
        second = self._twin(self.folder / "twin", "127.0.0.2")
        began, noticed_at = time.monotonic(), datetime.now(UTC) + timedelta(seconds=NOTICED_S)
        while time.monotonic() - began < NOTICED_S + SEEN_S:
            await self._asked(self.chance.choice((first, second)).parts)
        await self._both_come_to_an_end(first, second)
        sides = first.side(), second.side()
        self.met.extend(sides[0].rows)
        self.counted.update(str(row["outcome"]) for side in sides for row in side.rows)
        judge_twins(sides, self.taken, self.events, noticed_at, self._valid_for_s, self.findings, before)
        await self._person_decides(first, second)

    def _in_flight_at_the_twins_address(self) -> None:
        """Both addresses are one controller: else what was copied in flight would wait for a person."""
        with closing(sqlite3.connect(self.folder / "twin" / "journal.sqlite")) as journal, journal:
            first, second = (f'"host": "{host}"' for host in self.host)
            journal.execute("UPDATE jobs SET target = replace(target, ?, ?) WHERE outcome IS NULL", (first, second))

    @property
    def _valid_for_s(self) -> float | None:
        return self.valid_for_s if self.terms.has_clock else None

    async def _both_come_to_an_end(self, *twins: Twin) -> None:
        """Also one that must not write any more: by `valid_for` and `ack_timeout`."""
        give_up_at = time.monotonic() + 5.0
        while time.monotonic() < give_up_at and (
            self.controller.trigger_open or any(twin.parts.journal.unsettled() for twin in twins)
        ):
            await asyncio.sleep(0.02)

    async def _person_decides(self, first: Twin, second: Twin) -> None:
        for twin in (first, second):
            twin.running.cancel()
            with suppress(asyncio.CancelledError):
                await twin.running
        self.start_service()
