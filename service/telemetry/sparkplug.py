"""Topics and messages of a Sparkplug B edge node without devices: a cell is born and dies as a whole."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from service.telemetry.payload import DataType, Metric, Payload, PayloadError, Value, decoded, encoded
from service.telemetry.session import Message

NAMESPACE = "spBv1.0"
LARGEST_COMMAND = 20_000
BIRTH_COUNT, REBIRTH = "bdSeq", "Node Control/Rebirth"


def state_topic(host: str) -> str:
    """Where a host application says whether it is online."""
    return f"{NAMESPACE}/STATE/{host}"


def state_message(host: str, online: bool, at_ms: int) -> Message:
    """What it says there."""
    return Message(state_topic(host), json.dumps({"online": online, "timestamp": at_ms}).encode(), qos=1, retain=True)


def state_said(payload: bytes) -> tuple[bool, int] | None:
    """Whether a host is online, and its time, Unix ms; None where that is not what it says."""
    try:
        said = json.loads(payload)
        return bool(said["online"]), int(said["timestamp"])
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def rebirth_asked(payload: bytes) -> bool:
    """Whether a command asks for a birth; it is the one thing that any command may ask for.

    A long one is not looked at: reading it would take the interpreter from the jobs.
    """
    if len(payload) > LARGEST_COMMAND:
        return False
    try:
        metrics = decoded(payload).metrics
    except PayloadError:
        return False
    return any(metric.name == REBIRTH and metric.value is True for metric in metrics)


@dataclass
class Node:
    """An edge node. births: which of its connections this is, 0 to 255. seq: of its next message."""

    group: str
    name: str
    births: int
    seq: int = 0

    def topic(self, kind: str) -> str:
        """Where messages of a kind go."""
        return f"{NAMESPACE}/{self.group}/{kind}/{self.name}"

    def death(self, at_ms: int) -> Message:
        """That it has gone; the will too. QoS 1, so that the broker takes it before the connection ends."""
        count = Metric(self.births, DataType.INT64, BIRTH_COUNT, timestamp_ms=at_ms)
        return Message(self.topic("NDEATH"), encoded(Payload(at_ms, (count,)), types=True), qos=1)

    def birth(self, values: Mapping[str, Value | None], types: Mapping[str, DataType], at_ms: int) -> Message:
        """All metrics by name, with type and value; those after it name aliases, which are places in `types`."""
        own = (
            Metric(self.births, DataType.INT64, BIRTH_COUNT, timestamp_ms=at_ms),
            Metric(False, DataType.BOOLEAN, REBIRTH, timestamp_ms=at_ms),
        )
        metrics = (
            Metric(values.get(name), datatype, name, alias, at_ms)
            for alias, (name, datatype) in enumerate(types.items(), start=1)
        )
        self.seq = 0
        return self._numbered("NBIRTH", (*own, *metrics), at_ms, types=True)

    def data(self, metrics: Iterable[Metric], at_ms: int) -> Message:
        """Metrics that are new."""
        return self._numbered("NDATA", tuple(metrics), at_ms, types=False)

    def _numbered(self, kind: str, metrics: tuple[Metric, ...], at_ms: int, *, types: bool) -> Message:
        seq, self.seq = self.seq, (self.seq + 1) % 256
        return Message(self.topic(kind), encoded(Payload(at_ms, metrics, seq), types=types))
