"""What a cell tells a plant: names and types of its metrics, and their values now or of one job. Never a contour."""

from __future__ import annotations

import hashlib
import json
import time
from collections import Counter
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from service.config.recipes import Recipe
from service.jobs.health import Fault
from service.reasons import Outcome
from service.records.job import Job
from service.telemetry.kept import Kept
from service.telemetry.payload import DataType, Metric, Value
from service.telemetry.sources import DaemonSources

Values = dict[str, Value | None]
JOB = "Job/"
STATE, STATE_CODE, REASON, REASON_CODE = "State/Name", "State/Code", "State/Reason", "State/Reason Code"
UPTIME = "Service/Uptime s"
DROPPED = "Counters/Not Sent"
LONGEST_TEXT = 500
_STRING, _COUNT, _REAL, _TIME = DataType.STRING, DataType.UINT64, DataType.DOUBLE, DataType.DATETIME

TYPES: dict[str, DataType] = {
    STATE: _STRING,
    STATE_CODE: _COUNT,
    REASON: _STRING,
    REASON_CODE: _COUNT,
    "Alarms/Count": _COUNT,
    "Alarms/Texts": _STRING,
    "Warnings/Count": _COUNT,
    "Warnings/Texts": _STRING,
    "Counters/Accepted": _COUNT,
    "Counters/Written": _COUNT,
    "Counters/Refused": _COUNT,
    "Counters/Failed": _COUNT,
    "Counters/Missed Triggers": _COUNT,
    DROPPED: _COUNT,
    "Controller/Up": DataType.BOOLEAN,
    "Controller/Round Trip ms": _REAL,
    "Storage/Journal Free Bytes": _COUNT,
    "Storage/Archive Bytes": _COUNT,
    "Calibration/Hash": _STRING,
    "Calibration/Since": _TIME,
    "Calibration/Made": _TIME,
    "Calibration/Age days": _REAL,
    "Calibration/Max Age days": _REAL,
    "Recipes/Hash": _STRING,
    "Recipes/Since": _TIME,
    "Service/Version": _STRING,
    "Service/Since": _TIME,
    UPTIME: _COUNT,
    "Service/Page": _STRING,
    "Job/Number": _COUNT,
    "Job/Taken": _TIME,
    "Job/Settled": _TIME,
    "Job/Outcome": _STRING,
    "Job/Reason": _STRING,
    "Job/Reason Code": _COUNT,
    "Job/Detail": _STRING,
    "Job/Recipe": _COUNT,
    "Job/Recipe Hash": _STRING,
    "Job/Calibration Hash": _STRING,
    "Job/Area mm2": _REAL,
    "Job/Vertices": _COUNT,
    "Job/Uncertainty mm": _REAL,
    "Job/Thickness mm": _REAL,
    "Job/Total ms": _REAL,
    "Job/Blur px": _REAL,
    "Job/Level": _REAL,
    "Job/Contrast": _REAL,
    "Job/Noise": _REAL,
    "Job/Clipped Share": _REAL,
}
"""Every metric by name, in the order of their aliases: these are given by place, so new ones go to the end."""

ALIASES = {name: alias for alias, name in enumerate(TYPES, start=1)}
_REPORTED = {
    "Job/Area mm2": "area_mm2",
    "Job/Vertices": "vertices",
    "Job/Uncertainty mm": "uncertainty_mm",
    "Job/Thickness mm": "thickness_mm",
    "Job/Total ms": "total_ms",
}
_QUALITY = {
    "Job/Blur px": "blur_px",
    "Job/Level": "level",
    "Job/Contrast": "contrast",
    "Job/Noise": "noise",
    "Job/Clipped Share": "clipped_share",
}


class CellNow:
    """What a cell is like at a moment, but for its state and its jobs. outcomes: of jobs since the start."""

    def __init__(self, sources: DaemonSources, kept: Kept, page_url: str | None) -> None:
        """kept: since when recipes, calibration and version are as they are."""
        self._sources, self._kept, self._page_url = sources, kept, page_url
        self.outcomes: Counter[Outcome] = Counter()
        self._recipes: tuple[object, str] = (None, "")
        self._begun_s = time.monotonic()

    def values(self, dropped: int, now_ms: int) -> Values:
        """Each metric. dropped: jobs and changes that were let go untold."""
        recipes = self._sources.recipes()
        if recipes is not self._recipes[0]:
            self._recipes = (recipes, recipes_hash(recipes))
        values = values_now(self._sources, self.outcomes)
        calibration, version = values["Calibration/Hash"], str(values["Service/Version"])
        seen = self._kept.first_seen
        return values | {
            "Recipes/Hash": self._recipes[1],
            "Recipes/Since": seen("recipes", self._recipes[1], now_ms),
            "Calibration/Since": None if calibration is None else seen("calibration", str(calibration), now_ms),
            "Service/Since": seen("version", version, now_ms),
            "Service/Page": self._page_url,
            UPTIME: round(time.monotonic() - self._begun_s),
            DROPPED: dropped,
        }


def values_now(sources: DaemonSources, outcomes: Counter[Outcome]) -> Values:
    """All that the daemon's parts say now."""
    faults, warnings = sources.health.faults(), sources.health.warnings
    link, storage, archive = sources.link, sources.storage, sources.archive
    guard = sources.guard()
    made = None if guard is None else guard.record.created
    trip_s = None if link is None else link.reading.round_trip_s
    return {
        "Alarms/Count": len(faults),
        "Alarms/Texts": _lines(f"{part}: {_told(fault)}" for part, fault in faults.items()),
        "Warnings/Count": len(warnings),
        "Warnings/Texts": _lines(f"{part}: {text}" for part, text in warnings.items()),
        **{f"Counters/{str(outcome).title()}": outcomes[outcome] for outcome in Outcome},
        "Counters/Missed Triggers": sources.executor.missed,
        "Controller/Up": None if link is None else link.fault() is None,
        "Controller/Round Trip ms": None if trip_s is None else round(trip_s * 1000, 1),
        "Storage/Journal Free Bytes": None if storage is None else storage.free_bytes,
        "Storage/Archive Bytes": None if archive is None else archive.figures.bytes,
        "Calibration/Hash": None if guard is None else guard.record.digest,
        "Calibration/Made": None if made is None else milliseconds(made),
        "Calibration/Age days": None if guard is None or guard.age_days is None else round(guard.age_days, 2),
        "Calibration/Max Age days": None if guard is None else guard.limits.max_age_days,
        "Service/Version": sources.version,
    }


def job_values(job: Job) -> Values:
    """What is told of a settled job: its end and its figures."""
    report, quality = job.report, job.report.get("quality") or {}
    terms = job.terms
    return {
        "Job/Number": job.job_id,
        "Job/Taken": _moment(job.taken_at),
        "Job/Settled": _moment(job.settled_at),
        "Job/Outcome": None if job.outcome is None else str(job.outcome),
        "Job/Reason": None if job.reason is None else job.reason.label,
        "Job/Reason Code": int(job.reason or 0),
        "Job/Detail": None if job.detail is None else job.detail[:LONGEST_TEXT],
        "Job/Recipe": None if terms is None else terms.recipe.get("number"),
        "Job/Recipe Hash": None if terms is None else digest(terms.recipe),
        "Job/Calibration Hash": None if terms is None else terms.calibration,
        **{name: report.get(key) for name, key in _REPORTED.items()},
        **{name: quality.get(key) for name, key in _QUALITY.items()},
    }


def metrics_of(values: Values, at_ms: int, born_ms: int) -> list[Metric]:
    """As they were at a moment; historical where that was before the birth."""
    return [
        Metric(value, TYPES[name], alias=ALIASES[name], timestamp_ms=at_ms, historical=at_ms < born_ms)
        for name, value in values.items()
    ]


def recipes_hash(recipes: Mapping[int, Recipe]) -> str:
    """Of all recipes' whole settings: alike where two cells have the same."""
    return digest([recipes[number].model_dump(mode="json") for number in sorted(recipes)])


def digest(settings: Any) -> str:
    """SHA-256 of settings, as the journal makes it of a job's recipe."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()


def milliseconds(time: datetime) -> int:
    """Unix time, as Sparkplug tells it."""
    return round(time.timestamp() * 1000)


def _moment(text: str | None) -> int | None:
    return None if text is None else milliseconds(datetime.fromisoformat(text))


def _told(fault: Fault) -> str:
    return f"{int(fault.reason)} {fault.reason.label}: {fault.text}"


def _lines(texts: Any) -> str:
    return "\n".join(text.replace("\n", " ")[:LONGEST_TEXT] for text in texts)
