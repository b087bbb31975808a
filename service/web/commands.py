"""Commands from the page: who gives them is proved by a token, how often is bounded, and the journal keeps it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import TypeVar

from service.daemon.control import CommandRefused
from service.jobs.trigger_queue import TriggerRefused
from service.reasons import Reason
from service.records.journal import Journal
from service.records.journal_file import JournalError
from service.web.daemon_access import DaemonAccess, DaemonSilent
from service.web.tokens import (
    COMMANDS,
    COMMANDS_WITHIN_S,
    GUESSES,
    GUESSES_WITHIN_S,
    Rate,
    TokenFile,
    TokenFileError,
    network_of,
)

log = logging.getLogger("combtrace.page")

T = TypeVar("T")


class RequestRefused(Exception):
    """A command is not carried out: HTTP status, why, the reason where the table has one, when to try again."""

    def __init__(self, status: int, text: str, reason: Reason | None = None, *, again_s: float | None = None) -> None:
        super().__init__(text)
        self.status = status
        self.reason = reason
        self.again_s = again_s


class Commands:
    """Checks who asks, notes it, has it done. All methods raise RequestRefused."""

    def __init__(self, daemon: DaemonAccess, journal: Journal, tokens: TokenFile | None) -> None:
        self._daemon = daemon
        self._journal = journal
        self._tokens = tokens
        self._guesses = Rate(GUESSES, GUESSES_WITHIN_S)
        self._rate = Rate(COMMANDS, COMMANDS_WITHIN_S)

    async def holder(self, authorization: str | None, address: str) -> str:
        """Who gives the command. Each wrong token counts against the address, and a right one too while it waits."""
        if self._tokens is None:
            raise RequestRefused(403, "the page can only be looked at: set page.token_file")
        network = network_of(address)
        wait_s = self._guesses.wait_s(network)
        if wait_s > 0:
            raise RequestRefused(429, f"too many wrong tokens from {network}", again_s=wait_s)
        kind, _, token = (authorization or "").partition(" ")
        if kind.lower() != "bearer" or not token.strip():
            raise RequestRefused(401, "a token is needed: Authorization: Bearer …")
        self._guesses.add(network)  # before it is looked at: many at once would all pass
        try:
            who = await asyncio.to_thread(self._tokens.holder, token.strip())
        except TokenFileError as error:
            self._guesses.take_back(network)
            log.warning("page: %s", error)
            raise RequestRefused(503, "the service's token file cannot be used; its log says why") from error
        if who is None:
            log.warning("page: a wrong token from %s", address)
            await self._noted(None, address, "wrong token", None)
            raise RequestRefused(401, "the token is not known")
        self._guesses.take_back(network)
        wait_s = self._rate.wait_s(who)
        if wait_s > 0:
            raise RequestRefused(429, f"{COMMANDS} commands within {COMMANDS_WITHIN_S:g} s are allowed", again_s=wait_s)
        self._rate.add(who)
        return who

    async def trigger(self, who: str, address: str, recipe: int, thickness_mm: float) -> int | None:
        """The number of the job; None where it waits for its turn. Not done where it cannot be noted."""
        detail = f"recipe {recipe or 'default'}" + (f", thickness {thickness_mm:g} mm" if thickness_mm else "")
        number = await self._noted(who, address, "trigger", detail)
        if number is None:
            raise RequestRefused(503, "the journal cannot be written, so nothing is triggered", Reason.STORAGE_FULL)
        log.info("page: trigger by %s from %s, %s", who, address, detail)

        async def do() -> tuple[int | None, str]:
            job = await self._daemon.trigger(recipe, round(thickness_mm * 1000))
            return job, "waits for its turn" if job is None else f"job {job}"

        return await self._done(number, do)

    async def halt(self, who: str, address: str, reason: str) -> str:
        """The state after it. Done also where it cannot be noted: to stop is always safe."""
        number = await self._noted(who, address, "halt", reason or None)

        async def do() -> tuple[str, str]:
            state = await self._daemon.halt(f"{who} from {address}", reason)
            return state, state

        return await self._done(number, do)

    async def resume(self, who: str, address: str) -> str:
        """The state after it. Not done where it cannot be noted."""
        number = await self._noted(who, address, "resume", None)
        if number is None:
            raise RequestRefused(503, "the journal cannot be written, so the halt stays", Reason.STORAGE_FULL)

        async def do() -> tuple[str, str]:
            state = await self._daemon.resume(f"{who} from {address}")
            return state, state

        return await self._done(number, do)

    async def _done(self, number: int | None, do: Callable[[], Awaitable[tuple[T, str]]]) -> T:
        """What `do` gives; what became of it is noted, however it ends."""
        try:
            given, result = await do()
        except TriggerRefused as refused:
            await self._note_result(number, f"refused: {refused.reason.label}: {refused}")
            raise RequestRefused(409, str(refused), refused.reason) from refused
        except CommandRefused as refused:
            await self._note_result(number, f"refused: {refused}")
            raise RequestRefused(409, str(refused)) from refused
        except DaemonSilent as silent:
            await self._note_result(number, f"not known: {silent}")
            raise RequestRefused(503, str(silent)) from silent
        await self._note_result(number, result)
        return given

    async def _note_result(self, number: int | None, result: str) -> None:
        if number is None:
            return
        try:
            await asyncio.to_thread(self._journal.note_result, number, result)
        except JournalError as error:
            log.warning("page: the result is not in the journal: %s: %s", result, error)

    async def _noted(self, who: str | None, address: str, action: str, detail: str | None) -> int | None:
        """The note's number; None where the journal cannot be written, which the log says."""
        try:
            return await asyncio.to_thread(self._journal.note, who, address, action, detail)
        except JournalError as error:
            log.warning("page: %s by %s from %s is not in the journal: %s", action, who, address, error)
            return None
