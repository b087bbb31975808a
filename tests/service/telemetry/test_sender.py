"""Telemetry of a wired daemon at a real Mosquitto, read by pysparkplug: births, deaths, data, outages, rebirths."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from paho.mqtt import publish

from service.state import State
from service.telemetry.cell_metrics import TYPES
from service.telemetry.payload import DataType, Metric, Payload, encoded
from tests.support.interop.mosquitto import Mosquitto
from tests.support.interop.programs import sparkplug_reader
from tests.support.interop.sparkplug_read import Read, faults
from tests.support.processes.wired_daemon import WiredDaemon, wired
from tests.support.service.waiting import until

NO_CONTROLLER = {"kind": "none"}


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Mosquitto]:
    broker = Mosquitto(tmp_path)
    broker.start()
    try:
        yield broker
    finally:
        broker.kill()


@contextmanager
def reader(broker: Mosquitto, folder: Path, *host: str) -> Iterator[Read]:
    with sparkplug_reader(broker.port, folder / "read.jsonl", *host):
        yield Read(folder / "read.jsonl")


def telling(broker: Mosquitto, **more: Any) -> dict[str, Any]:
    return {"triggers": [], "telemetry": {"port": broker.port, "node": "cell-1", **more}}


def command(broker: Mosquitto, name: str, value: bool | str) -> None:
    """As a host gives it."""
    metric = Metric(value, DataType.BOOLEAN if isinstance(value, bool) else DataType.STRING, name)
    payload = encoded(Payload(1, (metric,)), types=True)
    publish.single("spBv1.0/combtrace/NCMD/cell-1", payload, 1, hostname="127.0.0.1", port=broker.port)


async def jobs(cell: WiredDaemon, count: int) -> list[int]:
    return [(await cell.job()).job_id for _ in range(count)]


async def test_a_cell_is_born_tells_jobs_and_states_and_dies_once(broker: Mosquitto, tmp_path: Path) -> None:
    with reader(broker, tmp_path) as read:
        async with wired(tmp_path / "cell", NO_CONTROLLER, **telling(broker, page_url="http://cell-1:9770/")) as cell:
            await until(lambda: read.lines("NBIRTH"))
            numbers = await jobs(cell, 3)
            await until(lambda: read.values("Job/Number") == numbers)
            await until(lambda: read.values("Counters/Written")[-1:] == [3])
        await until(lambda: read.lines("NDEATH"))
    assert faults(read.lines()) == []
    assert len(read.lines("NDEATH")) == 1
    (birth,) = read.lines("NBIRTH")
    aliases = {one["name"]: one["alias"] for one in birth["metrics"] if one["alias"] is not None}
    assert aliases.keys() == TYPES.keys()
    assert len(set(aliases.values())) == len(aliases)
    told = {one["name"]: one["value"] for one in birth["metrics"]}
    assert told["Service/Page"] == "http://cell-1:9770/"
    assert told["Calibration/Hash"].startswith("sha256:")
    live = [one["value"] for one in read.told("State/Name") if not one["old"]]
    assert live[-7:] == [*["SingleExecution", "Ready"] * 3, "Halted"]
    assert {line["bytes"] < 3000 for line in read.lines("NBIRTH", "NDATA")} == {True}, "no contour has room in that"


async def test_jobs_of_an_outage_and_of_a_restart_in_it_arrive_as_historical(broker: Mosquitto, tmp_path: Path) -> None:
    with reader(broker, tmp_path) as read:
        async with wired(tmp_path / "cell", NO_CONTROLLER, **telling(broker)) as cell:
            await until(lambda: read.lines("NBIRTH"))
            numbers = await jobs(cell, 1)
            await until(lambda: read.values("Job/Number") == numbers)
            broker.kill()
            numbers += await jobs(cell, 3)
        async with wired(tmp_path / "cell", NO_CONTROLLER, **telling(broker)) as cell:
            numbers += await jobs(cell, 2)
            broker.start()
            await until(lambda: set(read.values("Job/Number")) == set(numbers))
            old = {one["value"] for one in read.told("Job/Number") if one["old"]}
            assert old >= set(numbers[1:])
    assert faults([line for line in read.lines() if "error" in line]) == []


async def test_a_host_may_ask_for_a_birth_and_for_nothing_else(broker: Mosquitto, tmp_path: Path) -> None:
    with reader(broker, tmp_path) as read:
        async with wired(tmp_path / "cell", NO_CONTROLLER, **telling(broker)) as cell:
            await until(lambda: read.lines("NBIRTH"))
            numbers = await jobs(cell, 1)
            for name, value in (
                ("State/Name", "Halted"),
                ("Node Control/Reboot", True),
                ("Node Control/Rebirth", False),
            ):
                command(broker, name, value)
            publish.single("spBv1.0/combtrace/NCMD/cell-1", b"\xff" * 50, hostname="127.0.0.1", port=broker.port)
            command(broker, "Node Control/Rebirth", True)
            await until(lambda: len(read.lines("NBIRTH")) == 2)
            numbers += await jobs(cell, 1)
            await until(lambda: read.values("Job/Number") == numbers)
            assert cell.parts.health.state is State.READY
    births = read.lines("NBIRTH")
    assert [one["metrics"][0]["value"] for one in births] == [0, 0], "the same life goes on"
    assert len(births) == 2
    assert faults(read.lines("NBIRTH", "NDATA", "NDEATH")) == []


async def test_nothing_is_told_before_the_host_that_is_waited_for_is_there(broker: Mosquitto, tmp_path: Path) -> None:
    with reader(broker, tmp_path) as bystander:
        settings = telling(broker, primary_host="control-room")
        async with wired(tmp_path / "cell", NO_CONTROLLER, **settings) as cell:
            numbers = await jobs(cell, 2)
            (tmp_path / "host").mkdir()
            with reader(broker, tmp_path / "host", "control-room") as read:
                await until(lambda: set(read.values("Job/Number")) == set(numbers))
            await until(lambda: bystander.lines("NDEATH"))
            numbers += await jobs(cell, 1)
        assert faults(bystander.lines()) == []
        assert numbers[-1] not in bystander.values("Job/Number")
        assert len(bystander.lines("NBIRTH")) == 1


async def test_two_cells_of_one_name_leave_each_other_time_and_say_what_to_look_for(
    broker: Mosquitto, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("WARNING", "combtrace.telemetry")
    async with (
        wired(tmp_path / "one", NO_CONTROLLER, **telling(broker)) as one,
        wired(tmp_path / "other", NO_CONTROLLER, **telling(broker)),
    ):
        await until(lambda: "is another cell named combtrace/cell-1, too?" in caplog.text)
        assert str((await one.job()).outcome) == "written"


async def test_two_names_that_are_alike_when_run_together_are_two_clients(broker: Mosquitto, tmp_path: Path) -> None:
    log = tmp_path / "mosquitto.log"
    async with (
        wired(tmp_path / "one", NO_CONTROLLER, **telling(broker, group="a-b", node="c")),
        wired(tmp_path / "other", NO_CONTROLLER, **telling(broker, group="a", node="b-c")),
    ):
        await until(lambda: log.read_text().count(" as combtrace-") >= 2)
        assert "already connected, closing old connection" not in log.read_text()
