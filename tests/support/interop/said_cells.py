"""Cells that only say what cells say: births, jobs and beats of many, on one connection, for a fleet page to show."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion

from service.telemetry.cell_metrics import ALIASES, TYPES, UPTIME, Values
from service.telemetry.payload import Metric
from service.telemetry.session import Message
from service.telemetry.sparkplug import Node

BEAT_S = 1.0
DAY_MS = 86_400_000


def now_ms() -> int:
    return round(time.time() * 1000)


def ready(number: int, **more: Any) -> Values:
    """A cell that is well."""
    values: Values = {
        "State/Name": "Ready",
        "State/Code": 5,
        "State/Reason Code": 0,
        "Alarms/Count": 0,
        "Alarms/Texts": "",
        "Warnings/Texts": "",
        "Counters/Missed Triggers": 0,
        "Counters/Not Sent": 0,
        UPTIME: 1,
        "Calibration/Hash": f"sha256:{number:064x}",
        "Calibration/Age days": 12.5,
        "Calibration/Max Age days": 0.0,
        "Recipes/Hash": "ab" * 32,
        "Service/Version": "0.2.0",
        "Service/Page": f"http://cell-{number}:9770/",
        "Job/Number": 7,
        "Job/Settled": now_ms() - 60_000,
        "Job/Outcome": "accepted",
        "Job/Uncertainty mm": 0.08,
        "Job/Blur px": 1.1,
    }
    return values | {name.replace("__", "/").replace("_", " "): value for name, value in more.items()}


class SaidCells:
    """Cells by number, each with what it was born with; those in `quiet` say nothing more."""

    def __init__(self, client: paho.Client, cells: dict[int, Values]) -> None:
        self._client = client
        self.nodes = {number: Node("plant", f"cell-{number}", 0) for number in cells}
        self.cells = cells
        self.quiet: set[int] = set()
        self._lock = threading.Lock()

    def _say(self, message: Message) -> None:
        self._client.publish(message.topic, message.payload, message.qos, message.retain)

    def born(self, number: int) -> None:
        """As after each connection."""
        with self._lock:
            self._say(self.nodes[number].birth(self.cells[number], TYPES, now_ms()))

    def say(self, number: int, values: Values, at_ms: int | None = None, *, old: bool = False) -> None:
        """Metrics that are new."""
        at_ms = now_ms() if at_ms is None else at_ms
        metrics = [Metric(value, TYPES[name], None, ALIASES[name], at_ms, old) for name, value in values.items()]
        with self._lock:
            self._say(self.nodes[number].data(metrics, now_ms()))

    def dies(self, number: int) -> None:
        """As its will says."""
        self.quiet.add(number)
        with self._lock:
            self._say(self.nodes[number].death(now_ms()))

    def beat(self) -> None:
        """One of each that is not quiet."""
        for number in self.nodes.keys() - self.quiet:
            self.say(number, {UPTIME: 2})


@contextmanager
def said_cells(port: int, cells: dict[int, Values]) -> Iterator[SaidCells]:
    """All born, and beating; born again whenever a host asks one for it."""
    client = paho.Client(CallbackAPIVersion.VERSION2, "said-cells")
    said = SaidCells(client, cells)
    stop = threading.Event()

    def asked(_client: paho.Client, _data: Any, message: paho.MQTTMessage) -> None:
        number = int(message.topic.rpartition("-")[2])
        if number not in said.quiet:
            said.born(number)

    def beats() -> None:
        while not stop.wait(BEAT_S):
            said.beat()

    client.on_message = asked
    client.connect("127.0.0.1", port)
    client.subscribe("spBv1.0/plant/NCMD/+", 1)
    client.loop_start()
    beating = threading.Thread(target=beats)
    beating.start()
    try:
        for number in cells:
            said.born(number)
        yield said
    finally:
        stop.set()
        beating.join()
        client.disconnect()
        client.loop_stop()
