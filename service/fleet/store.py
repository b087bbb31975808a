"""Figures of jobs and the cells that were ever heard of, in SQLite; what is lost with the file is the past alone."""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from service.fleet.cells import Cell, Name, number, text
from service.telemetry.payload import Value

VERSION = 1
DAY_MS = 86_400_000
LEAST_JOBS = 10  # of which a mean says something
_TABLES = """
CREATE TABLE cells (grp TEXT, node TEXT, told TEXT NOT NULL, heard_ms INTEGER NOT NULL, PRIMARY KEY (grp, node)) STRICT;
CREATE TABLE jobs (
    grp TEXT, node TEXT, number INTEGER, settled_ms INTEGER, outcome TEXT, uncertainty_mm REAL, blur_px REAL,
    PRIMARY KEY (grp, node, number, settled_ms)
) STRICT, WITHOUT ROWID;
CREATE INDEX jobs_by_time ON jobs (settled_ms, grp, node, outcome, uncertainty_mm, blur_px);
"""


class StoreError(Exception):
    """The file cannot be used: which, why, what to do."""


@dataclass(frozen=True)
class Drift:
    """The mean of a day, and by how much it is worse than that of the week before; None where too few say."""

    mean: float | None = None
    worse_percent: float | None = None


@dataclass(frozen=True)
class Figures:
    """Of one cell: jobs of the shift by outcome, and how uncertainty and blur fare."""

    outcomes: dict[str, int]
    uncertainty: Drift
    blur: Drift


class Store:
    """The file; one thread uses it."""

    def __init__(self, path: Path) -> None:
        """Raise StoreError."""
        self._path = path
        try:
            self._database = sqlite3.connect(path, check_same_thread=False, isolation_level=None)
            version = self._database.execute("PRAGMA user_version").fetchone()[0]
            if version == 0 and not self._database.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
                self._database.executescript(
                    f"PRAGMA journal_mode = WAL; BEGIN; {_TABLES} PRAGMA user_version = {VERSION}; COMMIT;"
                )
            elif version != VERSION:
                raise StoreError(f"{path}: is no fleet's file, version {VERSION}. Name another store")
            self._database.execute("PRAGMA synchronous = NORMAL")
        except (sqlite3.Error, OSError) as error:
            raise StoreError(f"{path}: cannot be used: {error}. Check the path, or move the file away") from error

    def cells(self) -> list[Cell]:
        """Those that were ever heard of, as they were last; not born. Raise StoreError."""
        try:
            rows = self._database.execute("SELECT grp, node, told, heard_ms FROM cells").fetchall()
            return [Cell((group, node), dict(json.loads(told)), heard_ms=at) for group, node, told, at in rows]
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise StoreError(f"{self._path}: is damaged: {error}. Move it away; the past alone is lost") from error

    def keep(self, cells: Iterable[Cell], jobs: Iterable[tuple[Name, dict[str, Value | None]]], before_ms: int) -> None:
        """Note what is new, and let go what was settled before; raise StoreError."""
        rows = [(*name, *_row(job)) for name, job in jobs]
        known = [(*cell.name, json.dumps(cell.values), cell.heard_ms) for cell in cells]
        try:
            self._database.execute("BEGIN IMMEDIATE")
            try:
                self._database.executemany("INSERT OR IGNORE INTO jobs VALUES (?, ?, ?, ?, ?, ?, ?)", rows)
                self._database.executemany("INSERT OR REPLACE INTO cells VALUES (?, ?, ?, ?)", known)
                self._database.execute("DELETE FROM jobs WHERE settled_ms < ?", (before_ms,))
                self._database.execute("COMMIT")
            finally:
                if self._database.in_transaction:  # else no later one could begin
                    self._database.execute("ROLLBACK")
        except sqlite3.Error as error:
            raise StoreError(f"{self._path}: cannot be written: {error}. Free space, or see who may write") from error

    def figures(self, shift_ms: int, now_ms: int) -> dict[Name, Figures]:
        """Of each cell with jobs in the last eight days; raise StoreError. shift_ms: when the shift began."""
        try:
            return self._figures(shift_ms, now_ms)
        except sqlite3.Error as error:
            raise StoreError(f"{self._path}: cannot be read: {error}. Move it away and start again") from error

    def _figures(self, shift_ms: int, now_ms: int) -> dict[Name, Figures]:
        outcomes: dict[Name, dict[str, int]] = {}
        query = "SELECT grp, node, outcome, count(*) FROM jobs WHERE settled_ms >= ? GROUP BY 1, 2, 3"
        for group, node, outcome, count in self._database.execute(query, (shift_ms,)):
            outcomes.setdefault((group, node), {})[outcome] = count
        means = self._means(now_ms - DAY_MS, now_ms + DAY_MS)
        before = self._means(now_ms - 8 * DAY_MS, now_ms - DAY_MS)
        return {
            name: Figures(outcomes.get(name, {}), *_drifts(means.get(name), before.get(name)))
            for name in outcomes.keys() | means.keys()
        }

    def _means(self, begin_ms: int, end_ms: int) -> dict[Name, tuple[int, float | None, int, float | None]]:
        query = (
            "SELECT grp, node, count(uncertainty_mm), avg(uncertainty_mm), count(blur_px), avg(blur_px) FROM jobs"
            " WHERE settled_ms >= ? AND settled_ms < ? GROUP BY 1, 2"
        )
        return {(row[0], row[1]): row[2:] for row in self._database.execute(query, (begin_ms, end_ms))}

    def close(self) -> None:
        """Close the file."""
        self._database.close()


_Means = tuple[int, float | None, int, float | None]


def _drifts(now: _Means | None, before: _Means | None) -> tuple[Drift, Drift]:
    none: _Means = (0, None, 0, None)
    found = [_drift(*pair) for pair in zip(_pairs(now or none), _pairs(before or none), strict=True)]
    return found[0], found[1]


def _pairs(means: _Means) -> list[tuple[int, float | None]]:
    return [(means[0], means[1]), (means[2], means[3])]


def _drift(now: tuple[int, float | None], before: tuple[int, float | None]) -> Drift:
    enough = min(now[0], before[0]) >= LEAST_JOBS
    if not enough or not now[1] or not before[1]:
        return Drift(now[1])
    return Drift(now[1], 100 * (now[1] / before[1] - 1))


def _row(job: dict[str, Value | None]) -> tuple[int, int, str, float | None, float | None]:
    """As the table has it; what does not fit there is not known."""
    figures = [number(job, name) for name in ("Job/Uncertainty mm", "Job/Blur px")]
    kept = [float(figure) if figure is not None and math.isfinite(figure) else None for figure in figures]
    return (_signed(job["Job/Number"]), _signed(job["Job/Settled"]), text(job, "Job/Outcome"), kept[0], kept[1])


def _signed(value: Value | None) -> int:
    """SQLite's whole numbers end at 2^63."""
    return min(int(value or 0), 2**63 - 1)
