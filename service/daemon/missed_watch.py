"""Has the journal keep what the executor counts in memory: triggers that were not taken, and why."""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime

from service.records.journal import Journal
from service.records.journal_file import JournalError
from service.trends.kept import keep_missed, missed_since

log = logging.getLogger("combtrace.journal")

PERIOD_S = 10.0


class MissedWatch:
    """Looks at `counts`, by kind and what became of it, which only grow."""

    def __init__(
        self,
        journal: Journal,
        counts: Counter[tuple[str, str]],
        *,
        now: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self._journal = journal
        self._counts = counts
        self._now = now
        self._kept: Counter[tuple[str, str]] = Counter()

    async def run(self) -> None:
        """Keep them each ten seconds, where there are any: those of the last ten an end may cost."""
        while True:
            await asyncio.sleep(PERIOD_S)
            await asyncio.to_thread(self.keep)

    def keep(self) -> None:
        """Make durable what came since the last time; what the journal refuses is added the next time."""
        counts = Counter(self._counts)
        try:
            keep_missed(self._journal, self._now(), missed_since(counts, self._kept))
        except JournalError as error:
            log.debug("missed triggers are not kept yet: %s", error)
        else:
            self._kept = counts
