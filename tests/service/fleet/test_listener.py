"""The fleet's ear at a real broker: neither a damaged store nor another page of its name ends it."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from service.config.plant import Broker
from service.fleet.listener import Listener
from service.fleet.settings import Fleet
from service.fleet.store import Store
from tests.support.interop.mosquitto import Mosquitto
from tests.support.interop.said_cells import ready, said_cells
from tests.support.processes.processes import until


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Mosquitto]:
    broker = Mosquitto(tmp_path)
    broker.start()
    try:
        yield broker
    finally:
        broker.kill()


@contextmanager
def listening(broker: Mosquitto, store: Path) -> Iterator[Listener]:
    listener = Listener(Fleet(broker=Broker(port=broker.port)), Store(store))
    listener.start()
    try:
        yield listener
    finally:
        listener.close()


def states(listener: Listener) -> list[object]:
    return listener.look(lambda cell, _figures, _silent_s: cell.values.get("State/Name"))


def test_a_store_that_is_damaged_is_told_and_cells_are_heard_all_the_same(
    broker: Mosquitto, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("service.fleet.listener.FIGURES_S", 0.1)
    path = tmp_path / "fleet.sqlite"
    with listening(broker, path) as listener, said_cells(broker.port, {1: ready(1)}) as said:
        until(lambda: states(listener) == ["Ready"], what="the cell")
        with closing(sqlite3.connect(path)) as database:
            database.execute("DROP TABLE jobs")
        until(lambda: "fleet.sqlite: cannot be read: no such table" in caplog.text, what="the warning")
        broker.kill()  # what is added up without a connection, too
        until(lambda: not listener.connected, what="the end of the connection")
        broker.start()
        said.cells[1]["State/Name"] = "Halted"
        until(lambda: listener.connected, what="the next connection")
        until(lambda: said.born(1) or states(listener) == ["Halted"], what="the cell's new state")


def test_two_pages_of_one_name_leave_each_other_time_and_say_what_to_look_for(
    broker: Mosquitto, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with listening(broker, tmp_path / "one.sqlite"), listening(broker, tmp_path / "other.sqlite"):
        until(lambda: "is there another page with host_id combtrace-fleet?" in caplog.text, what="the warning")
