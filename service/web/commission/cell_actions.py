"""Table and controller: what `combtrace teach-table` and `combtrace probe` do."""

from __future__ import annotations

from datetime import UTC, datetime

from service.atomic_file import write_whole
from service.calibrating.teaching import TableRefused, taught_table
from service.config.controllers import NoController
from service.config.keys import KeysNotSet, with_keys
from service.daemon.control import CommandRefused
from service.measuring.table_file import TableFileError, TableRecord, save_table
from service.web.commission import models
from service.web.commission.bench import Bench, not_writable
from service.web.commission.session import KeptLine, StepRefused
from service.web.daemon_access import DaemonSilent

TABLE_FRAMES = 8


class CellActions:
    """Each gives what the journal is to say; raises StepRefused."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench

    async def teach(self, _asked: models.ActionRequest) -> str:
        """The empty table, in force for the next job."""
        settings = self.bench.config.table
        if settings is None:
            raise StepRefused("the configuration names no table.file. Name one")

        def work() -> str:
            frames = []
            for number in range(TABLE_FRAMES):
                self.bench.go_on(f"{number + 1} of {TABLE_FRAMES}")
                frames.append(self.bench.frame())
            try:
                table = taught_table([frame.pixels for frame in frames])
                when = datetime.now(UTC).isoformat(timespec="seconds")
                save_table(settings.file, TableRecord(table, frames[0].camera, len(frames), when))
            except (TableRefused, TableFileError) as error:
                raise StepRefused(not_writable(error)) from error
            return f"noise {table.noise:.1f} grey levels"

        told = await self.bench.in_thread(work)
        await self.bench.take_effect()
        return told

    async def probe(self, asked: models.ProbeRequest) -> str:
        """What the controller can do; meanwhile the service leaves it alone."""
        settings = self.bench.config.controller
        if isinstance(settings, NoController) or self.bench.daemon.sources.commission.probe is None:
            raise StepRefused("controller.kind is none, so there is nothing to probe. Set a controller")
        if asked.write and settings.mode == "observe":
            raise StepRefused("controller.mode is observe: another process writes there. Probe without writing")
        try:
            found = await self.bench.daemon.probe(asked.write)
        except (CommandRefused, DaemonSilent) as error:
            raise StepRefused(str(error)) from error
        notes = self.bench.session.notes
        notes.probe = [KeptLine(part=one.part, well=one.well, text=one.text) for one in found.results]
        notes.changes = {key: value for key, value in found.changes.items() if isinstance(value, str | int | float)}
        return f"{sum(one.well for one in found.results)} of {len(found.results)} well"

    async def apply(self, _asked: models.ActionRequest) -> str:
        """What the probe would change, in the configuration's file; it counts from the next start on."""
        notes, path = self.bench.session.notes, self.bench.daemon.sources.commission.path
        if not notes.changes or path is None:
            raise StepRefused("the probe found nothing to change")

        def work() -> str:
            try:
                write_whole(path, with_keys(path.read_text(encoding="utf-8"), "controller", notes.changes).encode())
            except (KeysNotSet, OSError) as error:
                raise StepRefused(not_writable(f"{path}: not changed: {error}")) from error
            return ", ".join(notes.changes)

        return await self.bench.in_thread(work)
