"""What no broker has confirmed yet: jobs, which the journal keeps anyway, and changes of state, kept in memory.

Sent again on the next connection, so that each arrives once or more often, never not at all, within the bound.
"""

from __future__ import annotations

import itertools
import logging
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from service.records.job import Job
from service.records.journal_reader import JournalReader, JournalUnreadable, reading
from service.telemetry.cell_metrics import Values

log = logging.getLogger("combtrace.telemetry")


@dataclass(frozen=True)
class Change:
    """What a change of state made of it, and when; number: counted from the start, so a gap tells what was let go."""

    number: int
    at_ms: int
    values: Values


class Changes:
    """Changes of state, the newest `most`; added in the daemon's loop, all else in the sender's thread."""

    def __init__(self, most: int) -> None:
        self._kept: deque[Change] = deque(maxlen=most)
        self._numbers = itertools.count()
        self._sent = self._confirmed = self._gone = -1
        self.dropped = 0

    def add(self, at_ms: int, values: Values) -> None:
        """Keep one more; the oldest goes where there are too many."""
        self._kept.append(Change(next(self._numbers), at_ms, values))

    def again(self) -> None:
        """On a new connection: what was not confirmed is to be sent once more."""
        self._sent = max(self._confirmed, self._gone)

    def unsent(self, most: int) -> list[Change]:
        """The oldest that are not sent yet; they count as sent."""
        waiting = [change for change in self._kept.copy() if change.number > self._sent]
        if waiting:
            gone = waiting[0].number - 1
            self.dropped += gone - self._sent
            self._gone = max(self._gone, gone)
            self._sent = waiting[:most][-1].number
        return waiting[:most]

    def mark(self) -> int:
        """What `confirm` takes once the broker has answered for all that is sent."""
        return self._sent

    def confirm(self, mark: int) -> None:
        """All up to there has arrived."""
        self._confirmed = max(self._confirmed, mark)
        while self._kept and self._kept[0].number <= self._confirmed:
            self._kept.popleft()


class Jobs:
    """Settled jobs above the last confirmed one, read from the journal."""

    def __init__(self, journal: Path, most: int, confirmed: int) -> None:
        """confirmed: number of the last job that a broker has taken."""
        self._journal, self._most = journal, most
        self.confirmed = self._sent = self._gone = confirmed
        self.due = True  # there may be some; set by whoever knows of a new one
        self.dropped = 0

    def again(self) -> None:
        """On a new connection: what was not confirmed is to be sent once more."""
        self._sent = max(self.confirmed, self._gone)
        self.due = True

    def unsent(self, most: int) -> list[Job]:
        """The oldest that are not sent yet; they count as sent. None where none is due, or none can be read now."""
        if not self.due:
            return []
        self.due = False
        try:
            with reading(self._journal) as journal:
                found = self._next(journal, most)
        except JournalUnreadable as error:
            log.debug("telemetry: %s", error)
            self.due = True
            return []
        self.due |= len(found) == most
        return found

    def _next(self, journal: JournalReader, most: int) -> list[Job]:
        query = "SELECT job_id FROM jobs WHERE job_id > ? ORDER BY job_id DESC LIMIT 1 OFFSET ?"
        beyond = journal.rows(query, (self._sent, self._most))
        if beyond:  # more wait than are kept
            query = "SELECT count(*) FROM jobs WHERE job_id > ? AND job_id <= ?"
            self.dropped += journal.rows(query, (self._sent, beyond[0][0]))[0][0]
            self._sent = self._gone = beyond[0][0]
        found = []
        query = "SELECT job_id FROM jobs WHERE job_id > ? ORDER BY job_id LIMIT ?"
        for (number,) in journal.rows(query, (self._sent, most)):
            job = _found(journal.find, number)
            if job is not None and job.outcome is None:  # it is being executed, and the next come after it
                break
            self._sent = number
            found += [] if job is None else [job]
        return found

    def mark(self) -> int:
        """What `confirm` takes once the broker has answered for all that is sent."""
        return self._sent

    def confirm(self, mark: int) -> None:
        """All up to there has arrived."""
        self.confirmed = max(self.confirmed, mark)


def _found(find: Callable[[int], Job | None], number: int) -> Job | None:
    """The job, None where its row is damaged: those after it are told nevertheless."""
    try:
        return find(number)
    except JournalUnreadable as error:
        log.warning("telemetry: job %d is not told: %s", number, error)
        return None
