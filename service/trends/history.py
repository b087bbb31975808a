"""How jobs fared over a time: counts and figures by buckets of equal length, added up by SQLite.

Each bucket is one query by the index on time, in a read of its own: it takes what jobs lie in it, holds no more rows
than it has kinds of ends, and lets the journal's log be taken over in between. While SQLite adds up, other threads run.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import count
from typing import Any

from service.measuring.trend_file import COLUMNS, TrendLine
from service.reasons import Outcome
from service.records.journal_file import stamp
from service.records.journal_reader import JournalReader

QUANTITIES = {
    "uncertainty_mm": "$.uncertainty_mm",
    "blur_px": "$.quality.blur_px",
    "level": "$.quality.level",
    "area_mm2": "$.area_mm2",
    "total_ms": "$.total_ms",
    "pitch_px": "$.quality.pitch_px",
}
"""What is followed, and where a job's report has it."""

STEPS_S = (60, 300, 600, 1800, 3600, 3 * 3600, 6 * 3600, 12 * 3600, 86_400, 2 * 86_400, 7 * 86_400, 30 * 86_400)
MOST_BUCKETS = 200
LONGEST = timedelta(days=10 * 365)
MOST_CHECKS = 500
SINCE = 5  # version of the journal that keeps checks and missed triggers

_COLUMNS = ", ".join(
    f"json_extract(CASE WHEN json_valid(report) THEN report END, '{path}') AS {name}"
    for name, path in QUANTITIES.items()
)
_SUMS = ", ".join(f"count({name}), sum({name}), min({name}), max({name})" for name in QUANTITIES)
# Materialized: else each figure of a report would be read out of its text four times over.
_BUCKET = (
    f"WITH seen AS MATERIALIZED (SELECT taken_at, outcome, reason, recipe_digest, calibration, {_COLUMNS} FROM jobs"
    " WHERE taken_at >= ? AND taken_at < ? AND outcome IS NOT NULL)"
    f" SELECT outcome, reason, recipe_digest, calibration, count(*), min(taken_at), max(taken_at), {_SUMS} FROM seen"
    " GROUP BY 1, 2, 3, 4"
)


@dataclass(frozen=True)
class Span:
    """From `begin` until before `end`."""

    begin: datetime
    end: datetime

    def __post_init__(self) -> None:
        if not timedelta(minutes=1) <= self.end - self.begin <= LONGEST:
            raise ValueError(f"from {self.begin} to {self.end}: expected a minute to ten years, the later time last")

    @property
    def step_s(self) -> int:
        """The shortest usual step by which there are no more than MOST_BUCKETS."""
        seconds = (self.end - self.begin).total_seconds()
        return next(step for step in STEPS_S if seconds <= step * MOST_BUCKETS)


@dataclass
class Figure:
    """One quantity of several jobs: of how many it is known, its sum, least and most."""

    known: int = 0
    total: float = 0.0
    least: float = float("inf")
    most: float = float("-inf")

    @property
    def mean(self) -> float:
        """Nan where it is known of none."""
        return self.total / self.known if self.known else float("nan")

    def add(self, known: int, total: float | None, least: float | None, most: float | None) -> None:
        """Take in those of others."""
        if known and total is not None and least is not None and most is not None:
            self.known += known
            self.total += total
            self.least, self.most = min(self.least, least), max(self.most, most)


class Bucket:
    """Jobs that were taken at `begin` or in the time until the next bucket, and have ended."""

    def __init__(self, begin: datetime) -> None:
        self.begin = begin
        self.outcomes: Counter[str] = Counter()
        self.reasons: Counter[int] = Counter()
        self.figures = {name: Figure() for name in QUANTITIES}

    def add(self, row: tuple[Any, ...]) -> None:
        """Take in jobs that ended alike."""
        outcome, reason, _digest, _calibration, jobs = row[:5]
        self.outcomes[outcome] += jobs
        if reason is not None:
            self.reasons[reason] += jobs
        for place, name in enumerate(QUANTITIES):
            self.figures[name].add(*row[7 + 4 * place : 11 + 4 * place])


@dataclass
class Use:
    """How many jobs were carried out with something, and when the first and the last of them were taken."""

    jobs: int
    first: str
    last: str


@dataclass(frozen=True)
class RecipeUsed:
    """A recipe's settings, as jobs were carried out with them."""

    number: int
    name: str
    settings: dict[str, Any]
    use: Use


@dataclass(frozen=True)
class CalibrationUsed:
    """A calibration by which jobs were carried out."""

    digest: str
    use: Use


@dataclass(frozen=True)
class History:
    """What a journal says of a span. recipes and calibrations come as they first were used.

    whole: all buckets as one. missed: triggers not taken, by kind and name of the reason. checks: the newest
    MOST_CHECKS, oldest first.
    """

    span: Span
    buckets: tuple[Bucket, ...]
    whole: Bucket
    recipes: tuple[RecipeUsed, ...]
    calibrations: tuple[CalibrationUsed, ...]
    missed: dict[tuple[str, str], int]
    checks: tuple[TrendLine, ...]

    @property
    def accepted(self) -> int:
        """Jobs that ended well."""
        return self.whole.outcomes[Outcome.ACCEPTED] + self.whole.outcomes[Outcome.WRITTEN]


def history(journal: JournalReader, span: Span, recipe: int | None = None) -> History:
    """What the journal says of the span. recipe: its jobs only, None = all; raise JournalUnreadable."""
    used = _Used(journal, recipe)
    whole = Bucket(span.begin)
    buckets = []
    for number in count():
        begin = span.begin + timedelta(seconds=number * span.step_s)
        if begin >= span.end:
            break
        bucket = Bucket(begin)
        end = min(begin + timedelta(seconds=span.step_s), span.end)
        for row in journal.rows(_BUCKET, (stamp(begin), stamp(end))):
            if used.counts(row):
                bucket.add(row)
                whole.add(row)
        buckets.append(bucket)
    return History(
        span, tuple(buckets), whole, used.recipes(), used.calibrations(), _missed(journal, span), _checks(journal, span)
    )


class _Used:
    """With which recipes and calibrations the jobs were carried out."""

    def __init__(self, journal: JournalReader, only: int | None) -> None:
        self._journal = journal
        self._only = only
        self._settings: dict[str, dict[str, Any]] = {}
        self._recipes: dict[str, Use] = {}
        self._calibrations: dict[str, Use] = {}

    def counts(self, row: tuple[Any, ...]) -> bool:
        """Whether jobs that ended alike are among those asked for; they are noted then."""
        _outcome, _reason, digest, calibration, jobs, first, last = row[:7]
        if self._only is not None and self._settings_of(digest).get("number") != self._only:
            return False
        for key, seen in ((digest, self._recipes), (calibration, self._calibrations)):
            if key is not None:
                use = seen.setdefault(key, Use(0, first, last))
                use.jobs += jobs
                use.first, use.last = min(use.first, first), max(use.last, last)
        return True

    def _settings_of(self, digest: str | None) -> dict[str, Any]:
        if digest is None:
            return {}
        if digest not in self._settings:
            query = "SELECT settings FROM recipe_settings WHERE digest = ?"
            found = self._journal.rows(query, (digest,), since=2)
            try:
                settings = json.loads(found[0][0]) if found else {}
            except ValueError:  # damaged: its jobs are counted, its limits are not known
                settings = {}
            self._settings[digest] = settings if isinstance(settings, dict) else {}
        return self._settings[digest]

    def recipes(self) -> tuple[RecipeUsed, ...]:
        """In the order in which they were first used."""
        told = [(self._settings_of(digest), use) for digest, use in _in_order(self._recipes)]
        return tuple(
            RecipeUsed(int(settings["number"]), str(settings.get("name", "")), settings, use)
            for settings, use in told
            if "number" in settings
        )

    def calibrations(self) -> tuple[CalibrationUsed, ...]:
        """In the order in which they were first used."""
        return tuple(CalibrationUsed(digest, use) for digest, use in _in_order(self._calibrations))


def _in_order(used: dict[str, Use]) -> list[tuple[str, Use]]:
    return sorted(used.items(), key=lambda one: one[1].first)


def _missed(journal: JournalReader, span: Span) -> dict[tuple[str, str], int]:
    query = "SELECT kind, reason, SUM(count) FROM missed WHERE at >= ? AND at < ? GROUP BY 1, 2 ORDER BY 3 DESC"
    found = journal.rows(query, (stamp(span.begin), stamp(span.end)), SINCE)
    return {(kind, reason): number for kind, reason, number in found}


def _checks(journal: JournalReader, span: Span) -> tuple[TrendLine, ...]:
    query = f"SELECT at, kind, {', '.join(COLUMNS[2:])} FROM checks WHERE at >= ? AND at < ? ORDER BY at DESC LIMIT ?"
    found = journal.rows(query, (stamp(span.begin), stamp(span.end), MOST_CHECKS), SINCE)
    return tuple(TrendLine(datetime.fromisoformat(row[0]), *row[1:]) for row in reversed(found))
