"""The journal for those who cannot go on without it: what they ask for is tried again and again until it is done."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import ParamSpec, TypeVar

from service.records.journal_file import JournalError

P = ParamSpec("P")
R = TypeVar("R")

PAUSE_S = 1.0


class DurableJournal:
    """One way to wait for the journal; what is told meanwhile, and to whom, is the user's."""

    def __init__(
        self,
        on_trouble: Callable[[JournalError, bool], None],
        *,
        on_done: Callable[[], None] = lambda: None,
        feed_watchdog: Callable[[], None] = lambda: None,
    ) -> None:
        """on_trouble: told of each attempt in vain, and whether it says what the one before said.

        feed_watchdog: called before each attempt.
        """
        self._on_trouble = on_trouble
        self._on_done = on_done
        self._feed_watchdog = feed_watchdog

    async def until_done(self, access: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """What `access` to the journal gives, made in a thread."""
        return await self._until_done(lambda: asyncio.to_thread(access, *args, **kwargs))

    async def until_done_here(self, access: Callable[[], R]) -> R:
        """The same in this thread: nothing comes between what the journal holds and what is done with it."""

        async def attempt() -> R:
            return access()

        return await self._until_done(attempt)

    async def _until_done(self, attempt: Callable[[], Awaitable[R]]) -> R:
        said = None
        while True:
            self._feed_watchdog()
            try:
                result = await attempt()
            except JournalError as error:
                self._on_trouble(error, str(error) == said)
                said = str(error)
                await asyncio.sleep(PAUSE_S)
            else:
                self._on_done()
                return result
