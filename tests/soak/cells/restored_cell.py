"""A journal that a copy of earlier replaces while the service is down, as after a restored backup or a power cut."""

from __future__ import annotations

import asyncio
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

from tests.soak.cells.faulted_cell import FaultedCell, Incident, Terms
from tests.soak.promises import Evidence
from tests.support.processes.processes import jobs

SERIAL_SHARES = (0.1, 0.5, 1.0)  # the last: no trigger of the controller tells how far it had come


def copy_journal(journal: Path, copy: Path) -> None:
    """A sound copy of a journal that may be written meanwhile."""
    with closing(sqlite3.connect(journal)) as source, closing(sqlite3.connect(copy)) as target:
        source.backup(target)


def put_back(copy: Path, journal: Path) -> None:
    """The copy instead of the journal, without what the journal's own log held beyond it."""
    for file in journal.parent.glob(f"{journal.name}*"):
        if file.suffix != ".lock":
            file.unlink()
    shutil.copyfile(copy, journal)


class RestoredCell(FaultedCell):
    """A cell whose journal goes back in time. What each of its lives said is kept, and judged together."""

    other_service = True  # what the copy does not know may have ended above its own job in flight
    pause_s = (0.3, 2.0)

    def __init__(self, folder: Path, terms: Terms) -> None:
        super().__init__(folder, terms)
        self.serial_share = SERIAL_SHARES[terms.seed % 3]
        self.lost: list[dict[str, Any]] = []

    def incidents(self) -> list[Incident]:
        return [self.back_up] * 2 + [self.restore] * 3 + [self.restart_service, self.restart_program]

    async def back_up(self) -> None:
        """A copy at any moment, also in the midst of a transfer."""
        await self.in_the_midst_of_a_transfer()
        self.restarts["journal copied"] += 1
        (self.folder / "copy.sqlite").unlink(missing_ok=True)
        copy_journal(self.folder / "journal.sqlite", self.folder / "copy.sqlite")

    async def restore(self) -> None:
        """The last copy, which may have been put back before."""
        if not (self.folder / "copy.sqlite").exists():
            await self.back_up()
            return
        await self.in_the_midst_of_a_transfer()
        self.restarts["journal put back"] += 1
        await self.end_service()
        self.lost += jobs(self.folder / "journal.sqlite")
        put_back(self.folder / "copy.sqlite", self.folder / "journal.sqlite")
        await asyncio.sleep(self.chance.choice((0.0, self.chance.uniform(0, 1.0))))
        self.start_service()
        await self.serves()  # a controller that lost its registers before they were read could tell nobody

    def rows(self) -> list[dict[str, Any]]:
        """What all lives said, once each; a later life's word of a job that a lost one left open is its end."""
        now = super().rows()
        told = {(row["job_id"], row["taken_at"], row["outcome"]): row for row in self.lost + now}
        ended = {row["job_id"] for row in told.values() if row["outcome"] is not None}
        acknowledged = {event["job"] for event in self.events if event["event"] == "acknowledged"}
        still_open = {row["job_id"] for row in now if row["outcome"] is None}
        kept = []
        for row in told.values():
            job = row["job_id"]
            known = job in still_open or job in acknowledged or row["session"] is not None
            if row["outcome"] is not None or (job not in ended and known):
                kept.append(row)
        kept.sort(key=lambda row: (row["trigger_kind"] != "found", row["session"] is not None))  # the fullest last
        return [self._with_its_trigger(row) for row in kept]

    def evidence(self, rows: list[dict[str, Any]]) -> Evidence:
        found = super().evidence(rows)
        # The copy's job in flight is brought to its end, also where a later one of the lost life was never answered.
        del found.verdict_kinds["job-went-down"]
        return found

    def _with_its_trigger(self, row: dict[str, Any]) -> dict[str, Any]:
        """A job that was found at the controller, with what the life that took it said of it."""
        if row["trigger_kind"] != "found":
            return row
        asked = ("trigger_session", "trigger_counter")
        before = next((lost for lost in self.lost if lost["job_id"] == row["job_id"]), row)
        return {**row, **{key: before[key] for key in asked}}
