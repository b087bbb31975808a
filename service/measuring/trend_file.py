"""The trend of the weekly check: one CSV line a check, so that a slow drift is seen before it matters."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

COLUMNS = ("time", "check", "calibration", "pictures", "mean_mm", "p95_mm", "worst_mm", "limit_mm", "verdict")
CHECKS = ("verify", "repeat")
VERDICTS = ("pass", "fail")


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


@dataclass(frozen=True)
class Trend:
    """The lines of a trend file in its order, and a sentence for each that is none: they are left out, and stay."""

    lines: tuple[TrendLine, ...]
    skipped: tuple[str, ...]

    def last(self, check: str) -> TrendLine | None:
        """The last line of a check, None where there is none."""
        return next((line for line in reversed(self.lines) if line.check == check), None)


def append_trend(path: Path, line: TrendLine) -> None:
    """Add a line; raise TrendFileError where it cannot be written."""
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
        torn = not new and not path.read_bytes().endswith(b"\n")
        with path.open("a", encoding="utf-8", newline="") as file:
            if torn:
                file.write("\r\n")
            writer = csv.writer(file)
            if new:
                writer.writerow(COLUMNS)
            writer.writerow(values)
    except OSError as error:
        raise TrendFileError(f"{path}: cannot be written: {error.strerror}. Name another file") from error


def read_trend(path: Path) -> Trend:
    """What a trend file holds, nothing where there is none; raise TrendFileError where it is no trend file."""
    try:
        if not path.exists() or path.stat().st_size == 0:
            return Trend((), ())
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise TrendFileError(f"{path}: cannot be read: {error.strerror}. Name another file") from error
    numbered = [(number, row) for number, row in enumerate(text.splitlines(), 1) if row.strip()]
    columns = _cells(numbered[0][1]) if numbered else []
    if tuple(columns) != COLUMNS:
        raise TrendFileError(f"{path}: is no trend file, its columns are {', '.join(columns)}. Name another")
    lines, skipped = [], []
    for number, row in numbered[1:]:
        try:
            lines.append(_line(_cells(row)))
        except (ValueError, csv.Error) as error:
            skipped.append(f"{path}: line {number} is left out: {error}")
    return Trend(tuple(lines), tuple(skipped))


def _cells(row: str) -> list[str]:
    return [cell.strip() for cell in next(csv.reader([row]))]


def _line(cells: list[str]) -> TrendLine:
    """The line of its cells; ValueError with a sentence."""
    if len(cells) != len(COLUMNS):
        raise ValueError(f"{len(cells)} columns, expected {len(COLUMNS)}")
    value = dict(zip(COLUMNS, cells, strict=True))
    for name, known in (("check", CHECKS), ("verdict", VERDICTS)):
        if value[name] not in known:
            raise ValueError(f"{name} is {value[name]!r}, expected {' or '.join(known)}")
    try:
        time = datetime.fromisoformat(value["time"])
    except ValueError:
        raise ValueError(f"time is {value['time']!r}, expected one such as 2026-03-01T08:00:00+00:00") from None
    return TrendLine(
        time if time.tzinfo is not None else time.replace(tzinfo=UTC),
        value["check"],
        value["calibration"],
        int(_number("pictures", value["pictures"])),
        _number("mean_mm", value["mean_mm"]),
        _number("p95_mm", value["p95_mm"]),
        _number("worst_mm", value["worst_mm"]),
        _number("limit_mm", value["limit_mm"]),
        value["verdict"],
    )


def _number(name: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number >= 0):
        raise ValueError(f"{name} is {text!r}, expected a number from 0 on")
    return number
