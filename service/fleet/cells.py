"""What each cell has said last, put together from its Sparkplug messages; no clock, no connection."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from service.telemetry.payload import MOST_METRICS, Metric, Payload, PayloadError, Value, decoded
from service.telemetry.sparkplug import BIRTH_COUNT, NAMESPACE

MOST_CELLS = 1000
LONGEST_TEXT = 20_000
REBIRTH_GAP_S = 2.0  # between two wishes for a birth of the same cell
JOB, NUMBER, SETTLED = "Job/", "Job/Number", "Job/Settled"

Name = tuple[str, str]
"""Group and node."""


@dataclass
class Cell:
    """One cell. born: by a birth that was heard, and no death since. heard_s: when anything of it came; None where
    it is known of old only. values: of metrics by name, as they are now.
    """

    name: Name
    values: dict[str, Value | None] = field(default_factory=dict)
    heard_s: float | None = None
    heard_ms: int = 0
    born: bool = False
    births: Value | None = None
    seq: int = 0
    state_since_ms: int | None = None
    asked_s: float = -REBIRTH_GAP_S
    names: dict[int, str] = field(default_factory=dict)


@dataclass
class Heard:
    """What a message has brought. ask: for a birth, without one it is not understood. fresh: all is new."""

    name: Name
    jobs: list[dict[str, Value | None]] = field(default_factory=list)
    ask: bool = False
    fresh: bool = False


class Cells:
    """All cells by name, at most MOST_CELLS."""

    def __init__(self) -> None:
        self.by_name: dict[Name, Cell] = {}

    def forget_births(self) -> None:
        """On a new connection: what was said meanwhile is not known."""
        for cell in self.by_name.values():
            cell.born = False

    def take(self, topic: str, raw: bytes, now_s: float, now_ms: int) -> Heard | None:
        """What a message brings; None where it is none of a cell."""
        parts = topic.split("/")
        if len(parts) != 4 or parts[0] != NAMESPACE or parts[2] not in ("NBIRTH", "NDATA", "NDEATH"):
            return None
        name, kind = (parts[1], parts[3]), parts[2]
        try:
            payload = decoded(raw)
        except PayloadError:
            return None
        if name not in self.by_name and len(self.by_name) >= MOST_CELLS:
            return None
        cell = self.by_name.setdefault(name, Cell(name))
        if kind == "NDEATH":
            _dies(cell, payload)
            return Heard(name)
        cell.heard_s, cell.heard_ms = now_s, now_ms
        heard = Heard(name)
        if kind == "NBIRTH":
            _is_born(cell, payload)
            heard.fresh = True
        elif not cell.born or payload.seq != (cell.seq + 1) % 256:
            heard.ask = now_s - cell.asked_s >= REBIRTH_GAP_S
            cell.asked_s = now_s if heard.ask else cell.asked_s
            if not cell.born:  # its aliases mean nothing yet
                return heard
        cell.seq = payload.seq or 0
        _tell(cell, payload, heard)
        return heard


def _dies(cell: Cell, payload: Payload) -> None:
    count = next((metric.value for metric in payload.metrics if metric.name == BIRTH_COUNT), None)
    if cell.births is None or count == cell.births:  # else it is the death of a connection before this one
        cell.born = False
        cell.heard_s = None


def _is_born(cell: Cell, payload: Payload) -> None:
    cell.born = True
    cell.names = {one.alias: one.name for one in payload.metrics if one.alias is not None and one.name is not None}
    cell.births = next((one.value for one in payload.metrics if one.name == BIRTH_COUNT), None)


def _tell(cell: Cell, payload: Payload, heard: Heard) -> None:
    job: dict[str, Value | None] = {}
    for metric in payload.metrics:
        name = metric.name if metric.name is not None else cell.names.get(metric.alias or 0)
        if name is None:
            continue
        if name.startswith(JOB):
            job[name] = metric.value
        if not metric.historical:
            _now(cell, name, metric)
    if isinstance(job.get(NUMBER), int) and isinstance(job.get(SETTLED), int):
        heard.jobs.append(job)


def _now(cell: Cell, name: str, metric: Metric) -> None:
    """Keep it, within bounds: what a broker lets through may be anybody's, and without end."""
    if name not in cell.values and len(cell.values) >= MOST_METRICS:
        return
    if name == "State/Name" and (metric.value != cell.values.get(name) or cell.state_since_ms is None):
        cell.state_since_ms = metric.timestamp_ms
    cell.values[name] = metric.value[:LONGEST_TEXT] if isinstance(metric.value, str) else metric.value


def text(values: dict[str, Any], name: str) -> str:
    """A metric that is a text; "" where it is not known."""
    value = values.get(name)
    return value if isinstance(value, str) else ""


def number(values: dict[str, Any], name: str) -> float | None:
    """A metric that is a number; None where it is not known."""
    value = values.get(name)
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None
