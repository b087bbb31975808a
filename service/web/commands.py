"""Commands from the page: who gives them is proved by token or PIN, how often is bounded, and the journal keeps it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TypeVar

from service.daemon.control import CommandRefused
from service.jobs.trigger_queue import TriggerRefused
from service.reasons import Reason
from service.records.journal import Journal
from service.records.journal_file import JournalError
from service.web.daemon_access import DaemonAccess, DaemonSilent
from service.web.models import TriggerRequest
from service.web.people.lease import LEAST_WORD
from service.web.people.pins import FREE_TRIES, FREE_TRIES_OF_ADDRESS, PeopleFile, Tries
from service.web.people.tokens import (
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
    """A command is not carried out: HTTP status, why, the reason where the table has one, when to try again.

    holder: who has the word, where that is why.
    """

    def __init__(
        self,
        status: int,
        text: str,
        reason: Reason | None = None,
        *,
        again_s: float | None = None,
        holder: str | None = None,
    ) -> None:
        super().__init__(text)
        self.status = status
        self.reason = reason
        self.again_s = again_s
        self.holder = holder


@dataclass(frozen=True)
class Known:
    """Files of those who may give commands; None = nobody by that way."""

    tokens: TokenFile | None = None
    people: PeopleFile | None = None

    def read(self) -> None:
        """Raise TokenFileError where one of them cannot be used."""
        for file in (self.tokens, self.people):
            if file is not None:
                file.read()


@dataclass(frozen=True)
class Order:
    """What is asked for, as the journal keeps it. otherwise: what is said to be so where the journal cannot.

    take_over: why, where another person has the word.
    """

    action: str
    detail: str | None
    otherwise: str
    take_over: str = ""


class Commands:
    """Checks who asks, notes it, has it done. All methods raise RequestRefused."""

    def __init__(self, daemon: DaemonAccess, journal: Journal, known: Known) -> None:
        self._daemon = daemon
        self._journal = journal
        self._known = known
        self._guesses = Rate(GUESSES, GUESSES_WITHIN_S)
        self._rate = Rate(COMMANDS, COMMANDS_WITHIN_S)
        self._tries = {"person": Tries(FREE_TRIES), "address": Tries(FREE_TRIES_OF_ADDRESS)}
        self._one_try = asyncio.Lock()  # tries that come at once are counted one after the other

    async def holder(self, authorization: str | None, address: str, *, by_pin: bool = True) -> str:
        """Who gives the command, by `Bearer TOKEN`, or where that is enough by `Pin NAME:PIN`."""
        if self._known.tokens is None and self._known.people is None:
            raise RequestRefused(403, "the page can only be looked at: set page.token_file or page.people_file")
        kind, _, given = (authorization or "").partition(" ")
        name, _, pin = given.strip().partition(":")
        if kind.lower() == "pin" and by_pin and self._known.people is not None:
            async with self._one_try:
                who = await self._by_pin(self._known.people, name, pin, address)
        else:
            who = await self._by_token(given.strip() if kind.lower() == "bearer" else "", address)
        wait_s = self._rate.wait_s(who)
        if wait_s > 0:
            raise RequestRefused(429, f"{COMMANDS} commands within {COMMANDS_WITHIN_S:g} s are allowed", again_s=wait_s)
        self._rate.add(who)
        return who

    async def people(self) -> list[str]:
        """Names of those who have a PIN."""
        if self._known.people is None:
            return []
        try:
            return [person.name for person in await asyncio.to_thread(self._known.people.read)]
        except TokenFileError as error:
            raise _unusable(error) from error

    async def _by_token(self, token: str, address: str) -> str:
        """Whose token it is. Each wrong one counts against the address, and a right one too while it waits."""
        network = network_of(address)
        wait_s = self._guesses.wait_s(network)
        if wait_s > 0:
            raise RequestRefused(429, f"too many wrong tokens from {network}", again_s=wait_s)
        if not token or self._known.tokens is None:
            raise RequestRefused(401, "a token is needed: Authorization: Bearer …")
        self._guesses.add(network)  # before it is looked at: many at once would all pass
        try:
            who = await asyncio.to_thread(self._known.tokens.holder, token)
        except TokenFileError as error:
            self._guesses.take_back(network)
            raise _unusable(error) from error
        if who is None:
            log.warning("page: a wrong token from %s", address)
            await self._noted(None, address, "wrong token", None)
            raise RequestRefused(401, "the token is not known")
        self._guesses.take_back(network)
        return who

    async def _by_pin(self, people: PeopleFile, name: str, pin: str, address: str) -> str:
        """The person whose PIN it is. Each wrong one counts against the person and the address, and locks them longer.

        A right one clears the person, not the address: whoever knows one PIN could else go on guessing another's.
        """
        try:
            is_known = name in {person.name for person in await asyncio.to_thread(people.read)}
            keys = {"address": network_of(address), **({"person": name} if is_known else {})}
            wait_s = max(self._tries[what].wait_s(key) for what, key in keys.items())
            if wait_s > 0:
                raise RequestRefused(429, "too many wrong PINs", again_s=wait_s)
            is_right = await asyncio.to_thread(people.holds, name, pin)
        except TokenFileError as error:
            raise _unusable(error) from error
        if is_right:
            self._tries["person"].right(name)
            return name
        for what, key in keys.items():
            self._tries[what].wrong(key)
        log.warning("page: a wrong PIN from %s", address)
        await self._noted(None, address, "wrong PIN", f"of {name}" if is_known else None)
        raise RequestRefused(401, "the PIN is not right")

    async def _has_the_word(self, who: str, address: str, taking_over: str) -> None:
        """Let them have it, where nobody else does or they say why they take it; without people nobody needs it."""
        lease = self._daemon.lease
        if self._known.people is None:
            return
        held = lease.other_than(who)
        if held is not None:
            word = taking_over.strip()
            if len(word) < LEAST_WORD:
                raise RequestRefused(409, f"{held.who} gives orders now: say why you take over", holder=held.who)
            if await self._noted(who, address, "take over", f"from {held.who}: {word}") is None:
                raise RequestRefused(503, "the journal cannot be written, so nobody takes over", Reason.STORAGE_FULL)
            log.warning("page: %s from %s takes over from %s: %s", who, address, held.who, word)
        lease.take(who)
        self._daemon.on_change()

    async def trigger(self, who: str, address: str, asked: TriggerRequest) -> int | None:
        """The number of the job; None where it waits for its turn. Not done where it cannot be noted."""
        recipe, thickness_mm = asked.recipe, asked.thickness_mm
        detail = f"recipe {recipe or 'default'}" + (f", thickness {thickness_mm:g} mm" if thickness_mm else "")

        async def do() -> tuple[int | None, str]:
            job = await self._daemon.trigger(recipe, round(thickness_mm * 1000))
            return job, "waits for its turn" if job is None else f"job {job}"

        return await self.carry_out(who, address, Order("trigger", detail, "nothing is triggered", asked.take_over), do)

    async def halt(self, who: str, address: str, reason: str) -> str:
        """The state after it. Done also where it cannot be noted, or another has the word: to stop is always safe."""
        number = await self._noted(who, address, "halt", reason or None)

        async def do() -> tuple[str, str]:
            state = await self._daemon.halt(f"{who} from {address}", reason)
            return state, state

        return await self._done(number, do)

    async def resume(self, who: str, address: str, taking_over: str) -> str:
        """The state after it. Not done where it cannot be noted."""

        async def do() -> tuple[str, str]:
            state = await self._daemon.resume(f"{who} from {address}")
            return state, state

        return await self.carry_out(who, address, Order("resume", None, "the halt stays", taking_over), do)

    async def carry_out(self, who: str, address: str, order: Order, do: Callable[[], Awaitable[tuple[T, str]]]) -> T:
        """What `do` gives, with its words for the note. Not done where another has the word, or it cannot be noted."""
        return await self._done(await self.begun(who, address, order), do)

    async def begun(self, who: str, address: str, order: Order) -> int:
        """The number of the note that they begin this; whoever carries it out notes its result."""
        await self._has_the_word(who, address, order.take_over)
        number = await self._noted(who, address, order.action, order.detail)
        if number is None:
            raise RequestRefused(503, f"the journal cannot be written, so {order.otherwise}", Reason.STORAGE_FULL)
        log.info("page: %s by %s from %s: %s", order.action, who, address, order.detail or "")
        return number

    async def _done(self, number: int | None, do: Callable[[], Awaitable[tuple[T, str]]]) -> T:
        """What `do` gives; what became of it is noted, however it ends."""
        try:
            given, result = await do()
        except TriggerRefused as refused:
            await self.note_result(number, f"refused: {refused.reason.label}: {refused}")
            raise RequestRefused(409, str(refused), refused.reason) from refused
        except CommandRefused as refused:
            await self.note_result(number, f"refused: {refused}")
            raise RequestRefused(409, str(refused)) from refused
        except DaemonSilent as silent:
            await self.note_result(number, f"not known: {silent}")
            raise RequestRefused(503, str(silent)) from silent
        await self.note_result(number, result)
        return given

    async def note_result(self, number: int | None, result: str) -> None:
        """What became of it, where it is noted."""
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


def _unusable(error: TokenFileError) -> RequestRefused:
    log.warning("page: %s", error)
    return RequestRefused(503, "the service's token file cannot be used; its log says why")
