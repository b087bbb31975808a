"""The trend of the weekly check: one CSV line a check, so that a slow drift is seen before it matters."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

COLUMNS = ("time", "check", "calibration", "pictures", "mean_mm", "p95_mm", "worst_mm", "limit_mm", "verdict")


class TrendFileError(Exception):
    """A trend file cannot be read or written: the file, and why."""


@dataclass(frozen=True)
class TrendLine:
    """One check: `check` is verify or repeat, `calibration` the hash of its file, `verdict` pass or fail."""

    time: datetime
    check: str
    calibration: str
    pictures: int
    mean_mm: float
    p95_mm: float
    worst_mm: float
    limit_mm: float
    verdict: str


def append_trend(path: Path, line: TrendLine) -> float | None:
    """Add a line; the worst_mm of the same check before it, None where there is none. Raise TrendFileError."""
    before = _last_worst(path, line.check)
    values = (
        line.time.isoformat(timespec="seconds"),
        line.check,
        line.calibration,
        line.pictures,
        *(f"{value:.4f}" for value in (line.mean_mm, line.p95_mm, line.worst_mm)),
        f"{line.limit_mm:g}",
        line.verdict,
    )
    try:
        new = not path.exists() or path.stat().st_size == 0
        with path.open("a", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            if new:
                writer.writerow(COLUMNS)
            writer.writerow(values)
    except OSError as error:
        raise TrendFileError(f"{path}: cannot be written: {error.strerror}. Name another file") from error
    return before


def _last_worst(path: Path, check: str) -> float | None:
    try:
        if not path.exists() or path.stat().st_size == 0:
            return None
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise TrendFileError(f"{path}: cannot be read: {error}. Name another file") from error
    if rows and tuple(rows[0]) != COLUMNS:
        raise TrendFileError(f"{path}: is no trend file, its columns are {', '.join(map(str, rows[0]))}. Name another")
    same = [row for row in rows if row["check"] == check]
    try:
        return float(same[-1]["worst_mm"]) if same else None
    except ValueError as error:
        raise TrendFileError(f"{path}: line {len(rows) + 1} is broken. Restore the file, or name another") from error
