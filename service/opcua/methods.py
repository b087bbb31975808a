"""What clients may ask for: a result by its number; users also to halt and to go on, as the page's people may."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from asyncua import ua

from service.daemon.control import CommandRefused
from service.daemon.operations import Operations
from service.opcua.results import made, result_fields
from service.opcua.session import MethodRefused
from service.records.journal import Journal
from service.records.journal_file import JournalError
from service.web.daemon_access import DaemonSilent, answered

log = logging.getLogger("combtrace.opcua")

DONE, NOT_FOUND = 0, 1
LARGEST_REASON = 200


@dataclass(frozen=True)
class Methods:
    """Each takes the arguments and who asks, and gives the outputs; all run in the server's loop."""

    daemon_loop: asyncio.AbstractEventLoop
    operations: Operations
    journal: Journal

    async def get_result(self, arguments: list[ua.Variant], _who: str) -> list[ua.Variant]:
        """GetResultById: handle (0: nothing is held), result, error; raise ValueError where it is no number."""
        job_id = int(arguments[0].Value.Id)
        try:
            job = await asyncio.to_thread(self.journal.find, job_id) if 0 < job_id < 2**32 else None
        except JournalError as error:
            raise MethodRefused(str(error)) from error
        there = job is not None and job.outcome is not None
        result = made("ResultDataType", **(result_fields(job) if there and job is not None else {}))
        return [
            ua.Variant(0, ua.VariantType.UInt32),
            ua.Variant(result, ua.VariantType.ExtensionObject),
            ua.Variant(DONE if there else NOT_FOUND, ua.VariantType.Int32),
        ]

    async def halt(self, arguments: list[ua.Variant], who: str) -> list[ua.Variant]:
        """Halt: no trigger is taken until Reset. Done also where it cannot be noted: to stop is always safe."""
        reason = str(arguments[1].Value or "")[:LARGEST_REASON]
        return await self._carried_out(who, "halt", lambda: self.operations.halt({"reason": reason}, who), reason)

    async def reset(self, arguments: list[ua.Variant], who: str) -> list[ua.Variant]:
        """Reset: a halt ends; raise MethodRefused where there is none."""
        reason = str(arguments[1].Value or "")[:LARGEST_REASON]
        return await self._carried_out(who, "resume", lambda: self.operations.resume({}, who), reason)

    async def _carried_out(
        self, who: str, action: str, do: Callable[[], Awaitable[dict[str, object]]], detail: str
    ) -> list[ua.Variant]:
        """Noted, done in the daemon's loop, and what became of it noted; raise MethodRefused."""
        name, _, address = who.partition(" from ")
        try:
            number: int | None = await asyncio.to_thread(self.journal.note, name, address, action, detail or None)
        except JournalError as error:
            if action != "halt":
                raise MethodRefused(f"the journal cannot be written: {error}") from error
            log.warning("opcua: %s by %s is not in the journal: %s", action, who, error)
            number = None

        async def work() -> str:
            return str((await do())["state"])

        try:
            result = await answered(self.daemon_loop, work())
        except (CommandRefused, DaemonSilent) as refused:
            await self._noted(number, f"refused: {refused}")
            raise MethodRefused(str(refused)) from refused
        await self._noted(number, result)
        return [ua.Variant(DONE, ua.VariantType.Int32)]

    async def _noted(self, number: int | None, result: str) -> None:
        if number is None:
            return
        try:
            await asyncio.to_thread(self.journal.note_result, number, result)
        except JournalError as error:
            log.warning("opcua: the result is not in the journal: %s: %s", result, error)
