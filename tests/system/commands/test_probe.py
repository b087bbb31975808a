"""`combtrace probe` against three servers that others wrote, with a controller's program behind each."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from service.config.config_file import load_config
from service.daemon.lock import NameLock
from service.wiring.devices import controller_names
from tests.support.interop.programs import TCP_SERVERS
from tests.support.interop.shifted_program import program
from tests.support.processes.processes import combtrace

SAMPLES = Path(__file__).parents[3] / "service" / "samples"


def config(folder: Path, port: int, **controller: object) -> Path:
    file = folder / "config.yaml"
    keys = "".join(f", {key}: {value}" for key, value in controller.items())
    file.write_text(
        f"camera: {{kind: files, path: {SAMPLES}}}\ncalibration: {{file: {SAMPLES / 'calibration.yaml'}}}\n"
        f"controller: {{kind: modbus-tcp, port: {port}, timeout_s: 5{keys}}}\nservice: {{state_dir: state}}\n"
    )
    return file


@pytest.mark.parametrize(
    ("server", "shift", "order", "changes"),
    [
        ("libmodbus", 0, "little", ["word_order: little"]),
        ("pyModbusTCP", 1, "big", ["link_address: 1", "service_address: 17", "contour_address: 33"]),
        ("modbus-serial", 0, "big", []),
    ],
)
async def test_it_says_what_to_change(tmp_path: Path, server: str, shift: int, order: str, changes: list[str]) -> None:
    with TCP_SERVERS[server]() as (_, port):
        async with program(port, shift, order):
            said = await asyncio.to_thread(combtrace, "probe", "--write", "--config", config(tmp_path, port))
    assert said.stderr == ""
    assert said.returncode == (1 if changes else 0), said.stdout
    told = [line.strip().split("  # was")[0] for line in said.stdout.splitlines() if "  # was" in line]
    assert told == changes
    section = said.stdout.partition("\ncontroller:\n")[2]
    if changes:
        assert f"  kind: modbus-tcp\n  port: {port}\n" in section, "to paste it whole"
    assert ("FAULT" in said.stdout) == bool(changes)
    written = ("writing",) if shift else ("longest write", "writable", "test_echo")
    for part in ("round trip", "longest read", "readable", "heartbeat", *written):
        assert f" {part} " in said.stdout


async def test_nothing_is_written_while_a_service_of_this_machine_holds_the_controller(tmp_path: Path) -> None:
    file = config(tmp_path, 1)
    locks = [NameLock(name) for name in controller_names(load_config(file))]
    said = await asyncio.to_thread(combtrace, "probe", "--write", "--config", file)
    for lock in locks:
        lock.release()
    assert said.returncode == 2
    assert "nothing is written while a service runs here" in said.stderr


async def test_nothing_is_written_beside_the_process_that_is_only_observed(tmp_path: Path) -> None:
    said = await asyncio.to_thread(combtrace, "probe", "--write", "--config", config(tmp_path, 1, mode="observe"))
    assert said.returncode == 2
    assert "Probe without --write" in said.stderr


async def test_a_controller_that_is_not_there_is_told_in_one_line(tmp_path: Path) -> None:
    said = await asyncio.to_thread(combtrace, "probe", "--config", config(tmp_path, 1))
    assert said.returncode == 1
    assert "FAULT controller    127.0.0.1:1: no connection: " in said.stdout
    assert said.stderr == ""


async def test_what_is_to_be_changed_is_put_into_the_file_and_then_nothing_is(tmp_path: Path) -> None:
    with TCP_SERVERS["libmodbus"]() as (_, port):
        async with program(port, 500, "little"):
            file = config(tmp_path, port)
            first = await asyncio.to_thread(combtrace, "probe", "--write", "--apply", "--config", file)
            again = await asyncio.to_thread(combtrace, "probe", "--write", "--apply", "--config", file)
    assert (first.returncode, again.returncode) == (1, 0), first.stdout + again.stdout + again.stderr
    assert "Probe again" in first.stdout
    keys = ", word_order: little, link_address: 500, service_address: 516, contour_address: 532}"
    text = file.read_text().splitlines()[2]
    assert all(key in text for key in keys.strip(", }").split(", ")), text
