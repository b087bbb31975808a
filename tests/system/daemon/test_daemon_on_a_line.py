"""A whole daemon over each way to the controller: it goes on after the line was cut, and says what is wrong with it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from drivers.controller.simulated.controller import SimulatedController
from service.reasons import Outcome
from service.state import State
from tests.support.controller.pty_line import PtyLine
from tests.support.controller.serial_server import SerialServer
from tests.support.processes.wired_daemon import wired
from tests.support.service.waiting import until


def rtu(port: str) -> dict[str, object]:
    return {"kind": "modbus-rtu", "port": port, "poll_period_s": 0.02}


async def test_a_job_over_a_serial_port_is_accepted(tmp_path: Path) -> None:
    async with PtyLine() as line, SimulatedController.on_serial(line.far) as controller:
        async with wired(tmp_path, rtu(line.near)) as daemon:
            assert (await daemon.job()).outcome is Outcome.ACCEPTED
        assert controller.verdict.counts == {}


async def test_a_job_over_a_serial_server_is_accepted(tmp_path: Path) -> None:
    async with (
        PtyLine() as line,
        SimulatedController.on_serial(line.far),
        SerialServer(line.near) as server,
        wired(tmp_path, {"kind": "modbus-rtu-over-tcp", "port": server.port}) as daemon,
    ):
        assert (await daemon.job()).outcome is Outcome.ACCEPTED


async def test_a_serial_port_that_is_pulled_out_and_put_back_is_found_and_taken_up_again(tmp_path: Path) -> None:
    plug = tmp_path / "ttyUSB0"
    async with PtyLine() as line, SimulatedController.on_serial(line.far):
        plug.symlink_to(line.near)
        async with wired(tmp_path, rtu(str(plug))) as daemon:
            assert (await daemon.job()).outcome is Outcome.ACCEPTED
            plug.unlink()
            line.unplug_near()
            await until(lambda: daemon.parts.health.state is State.ERROR)
            assert daemon.reason.startswith("152")
            await until(lambda: "ttyUSB0" in daemon.reason)
            async with PtyLine() as another, SimulatedController.on_serial(another.far):
                plug.symlink_to(another.near)
                assert (await daemon.job()).outcome is Outcome.ACCEPTED


@pytest.mark.parametrize(
    ("kind", "expected"), [("absent", "there is no such port"), ("a file", "no serial port"), ("a folder", "")]
)
async def test_what_is_no_serial_port_is_told_as_such(tmp_path: Path, kind: str, expected: str) -> None:
    port = tmp_path / "port"
    if kind == "a file":
        port.touch()
    elif kind == "a folder":
        port.mkdir()
    async with wired(tmp_path, rtu(str(port))) as daemon:
        await until(lambda: daemon.parts.health.state is State.ERROR)
        assert daemon.reason.startswith("152")
        assert str(port) in daemon.reason
        assert expected in daemon.reason


async def test_a_serial_port_that_another_program_holds_is_told_as_busy_and_taken_once_it_is_free(
    tmp_path: Path,
) -> None:
    import fcntl

    async with PtyLine() as line, SimulatedController.on_serial(line.far):
        other = os.open(line.near, os.O_RDWR | os.O_NOCTTY)
        fcntl.flock(other, fcntl.LOCK_EX)
        async with wired(tmp_path, rtu(line.near)) as daemon:
            await until(lambda: daemon.parts.health.state is State.ERROR)
            assert "lock" in daemon.reason or "busy" in daemon.reason or "in use" in daemon.reason
            os.close(other)
            await daemon.ready()


async def test_a_controller_that_goes_and_comes_back_is_error_with_its_reason_and_ready_again(tmp_path: Path) -> None:
    controller = SimulatedController()
    await controller.start()
    port = controller.port
    async with wired(tmp_path, {"kind": "modbus-tcp", "port": port}) as daemon:
        await daemon.ready()
        await controller.stop()
        await until(lambda: daemon.parts.health.state is State.ERROR)
        await until(lambda: "no connection" in daemon.reason)
        async with SimulatedController(port=port):
            assert (await daemon.job()).outcome is Outcome.ACCEPTED
