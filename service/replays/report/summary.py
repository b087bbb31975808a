"""What a table of rows comes to: flips, shifts, what was left out; by reason, cell, recipe and month."""

from __future__ import annotations

import heapq
from array import array
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Final

import numpy as np

from service.reasons import Outcome
from service.records.evidence import Flaw
from service.replays.rows import Row

WORST: Final = 20
SHOWN_FLIPS: Final = 3  # of each reason
SHOWN_LEFT_OUT: Final = 3  # of each kind
ROWS_AT_ONCE: Final = 10_000
GROUPS: Final = ("cell", "recipe", "month")
_READ: Final = (
    *("cell", "job_id", "archived_as", "taken_at", "recipe", "recipe_name", "flipped", "identical", "outcome_after"),
    *("reason_before", "reason_after", "text_after", "distance_mm", "distance_px", "left_out", "left_out_text"),
    *("total_ms_before", "total_ms_after", "read_ms", "combtrace_before", "combtrace_after", "worker"),
)


@dataclass
class Group:
    """Some of the jobs."""

    jobs: int = 0
    changed: int = 0
    sent_to_refused: int = 0
    refused_to_sent: int = 0
    left_out: int = 0
    shifts_mm: array[float] = field(default_factory=lambda: array("d"))

    def add(self, row: Row) -> None:
        """Count the row."""
        self.jobs += 1
        if row["left_out"] is not None:
            self.left_out += row["left_out"] != Flaw.NOTHING_MEASURED
            return
        self.changed += not row["identical"]
        self.sent_to_refused += row["flipped"] and _refused(row)
        self.refused_to_sent += row["flipped"] and not _refused(row)
        if row["distance_mm"] is not None:
            self.shifts_mm.append(row["distance_mm"])

    @property
    def flips(self) -> int:
        """Verdicts that are the other way round."""
        return self.sent_to_refused + self.refused_to_sent

    def shift_mm(self, percent: float) -> float | None:
        """So many per cent of the outlines are no farther away; None without any."""
        return float(np.percentile(np.frombuffer(self.shifts_mm), percent)) if self.shifts_mm else None


@dataclass
class Summary:
    """All of a table, in memory that does not grow with it but for eight bytes a shift and grouping."""

    whole: Group = field(default_factory=Group)
    groups: dict[str, dict[str, Group]] = field(default_factory=lambda: {name: defaultdict(Group) for name in GROUPS})
    flips: dict[tuple[int, bool], list[Row]] = field(default_factory=lambda: defaultdict(list))
    flip_counts: Counter[tuple[int, bool]] = field(default_factory=Counter)
    left_out: Counter[str] = field(default_factory=Counter)
    left_out_rows: dict[str, list[Row]] = field(default_factory=lambda: defaultdict(list))
    worst: list[Row] = field(default_factory=list)
    versions: Counter[tuple[str, str]] = field(default_factory=Counter)
    workers: Counter[str] = field(default_factory=Counter)
    times_ms: dict[str, array[float]] = field(default_factory=lambda: defaultdict(lambda: array("d")))

    @classmethod
    def of(cls, table: Path) -> Summary:
        """Read the table piece by piece."""
        import pyarrow.parquet as pq

        found = cls()
        far: list[tuple[float, int, Row]] = []
        order = count()
        with pq.ParquetFile(table) as file:
            for batch in file.iter_batches(ROWS_AT_ONCE, columns=list(_READ)):
                for row in batch.to_pylist():
                    found._add(row)
                    distance = row["distance_mm"] or row["distance_px"]
                    if distance:
                        heapq.heappush(far, (distance, -next(order), row))
                        if len(far) > WORST:
                            heapq.heappop(far)
        found.worst = [row for _, _, row in sorted(far, key=lambda one: one[:2], reverse=True)]
        return found

    def _add(self, row: Row) -> None:
        self.whole.add(row)
        month = "–" if row["taken_at"] is None else f"{row['taken_at']:%Y-%m}"
        recipe = "–" if row["recipe"] is None else f"{row['recipe']} {row['recipe_name']}"
        for group, value in zip(GROUPS, (row["cell"], recipe, month), strict=True):
            self.groups[group][value].add(row)
        if row["left_out"] is not None:
            self.left_out[row["left_out"]] += 1
            if len(self.left_out_rows[row["left_out"]]) < SHOWN_LEFT_OUT:
                self.left_out_rows[row["left_out"]].append(row)
            return
        self.versions[row["combtrace_before"], row["combtrace_after"]] += 1
        self.workers[row["worker"]] += 1
        for name in ("total_ms_before", "total_ms_after", "read_ms"):
            if row[name] is not None:
                self.times_ms[name].append(row[name])
        if row["flipped"]:
            key = (row["reason_after"] if _refused(row) else row["reason_before"]) or 0, _refused(row)
            self.flip_counts[key] += 1
            if len(self.flips[key]) < SHOWN_FLIPS:
                self.flips[key].append(row)

    def figures(self) -> dict[str, float | None]:
        """What conditions may ask for; None where there is nothing that it could be told by."""
        whole = self.whole
        done = whole.jobs - sum(self.left_out.values())
        return {
            "jobs": whole.jobs,
            "left_out": whole.left_out,
            "changed": whole.changed,
            "flips": whole.flips,
            "flips_share": whole.flips / done if done else None,
            "sent_to_refused": whole.sent_to_refused,
            "refused_to_sent": whole.refused_to_sent,
            "p50_shift_mm": whole.shift_mm(50),
            "p95_shift_mm": whole.shift_mm(95),
            "p99_shift_mm": whole.shift_mm(99),
            "max_shift_mm": whole.shift_mm(100),
        }


def _refused(row: Row) -> bool:
    return bool(row["outcome_after"] == Outcome.REFUSED)
