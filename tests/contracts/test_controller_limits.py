"""Controllers that take little: short requests, and no FC6. Whole pages go there and are accepted, by each way."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

import numpy as np
import pytest

from drivers.controller import ControllerRefused
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import ContourMessage, Page, encode_pages, micrometres
from drivers.controller.modbus.client import (
    ModbusController,
    ModbusRtuController,
    ModbusRtuOverTcpController,
    ModbusTcpController,
)
from drivers.controller.modbus.requests import RequestLimits
from drivers.controller.modbus.serial_line import SerialLine
from drivers.controller.simulated.controller import SimulatedController
from drivers.controller.simulated.window import ServerLimits
from tests.support.controller.controller_cells import PATIENT_S, WAYS
from tests.support.controller.pty_line import PtyLine
from tests.support.controller.serial_server import SerialServer
from tests.support.interop.programs import libmodbus_tcp

LAYOUT = MailboxLayout(payload_capacity=400)
RING = np.array([[0, 0], [100, 0], [100, 50], [0, 50]], dtype=np.float64)
HOLES = [np.array([[5 * k, 10], [5 * k, 20], [5 * k + 3, 20]], dtype=np.float64) for k in range(1, 18)]


@contextlib.asynccontextmanager
async def pair(way: str, most: int, *, fc6: bool) -> AsyncIterator[tuple[ModbusController, SimulatedController]]:
    """A driver, connected, and a controller that takes so many registers in a request."""
    limits = ServerLimits(most, write_single=fc6)
    how = {
        "layout": LAYOUT,
        "timeout_s": PATIENT_S,
        "limits": RequestLimits(min(most, 123), most),
        "single_write": "fc6" if fc6 else "fc16",
    }
    async with contextlib.AsyncExitStack() as stack:
        driver: ModbusController
        if way == "modbus-tcp":
            there = await stack.enter_async_context(SimulatedController(layout=LAYOUT, scan_s=0.001, limits=limits))
            driver = ModbusTcpController("127.0.0.1", there.port, **how)
        else:
            line = await stack.enter_async_context(PtyLine())
            there = SimulatedController.on_serial(line.far, layout=LAYOUT, scan_s=0.001, limits=limits)
            await stack.enter_async_context(there)
            if way == "modbus-rtu":
                driver = ModbusRtuController(SerialLine(line.near), **how)
            else:
                gateway = await stack.enter_async_context(SerialServer(line.near))
                driver = ModbusRtuOverTcpController("127.0.0.1", gateway.port, baudrate=115_200, **how)
        await driver.connect()
        yield driver, there
        await driver.close()


def contour(session: int) -> tuple[Page, ...]:
    rings = tuple(micrometres(ring) for ring in (RING, *HOLES))
    area = 5000 - 15 * len(HOLES)
    return encode_pages(
        ContourMessage(1, rings, area, None, 0, 2, True, True, 0, session), LAYOUT.payload_capacity, "big"
    )


@pytest.mark.parametrize("fc6", [True, False])
@pytest.mark.parametrize("most", [16, 17, 20, 27])
@pytest.mark.parametrize("way", WAYS)
async def test_a_contour_goes_over_in_short_requests_and_is_accepted(way: str, most: int, fc6: bool) -> None:
    async with pair(way, most, fc6=fc6) as (driver, there), asyncio.timeout(60):
        while (link := await driver.read_link()).session == 0:
            await asyncio.sleep(0.001)
        assert (await driver.read_service()).owner == 0
        for transfer, page in enumerate(contour(link.session), start=1):
            await driver.write_transfer(0)
            await driver.write_page(page)
            assert await driver.read_page(len(page.payload)) == page
            await driver.write_transfer(transfer)
            while (link := await driver.read_link()).ack_transfer != transfer:
                await asyncio.sleep(0.001)
            assert link.ack_result == 1
        assert (link.last_job, link.last_result) == (1, 1)
        assert there.verdict.clean, there.verdict


@pytest.mark.parametrize("most", [16, 20])
async def test_it_is_the_same_against_a_server_that_others_wrote(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MOST_REGISTERS", str(most))
    monkeypatch.setenv("WITHOUT_FC6", "1")
    monkeypatch.setenv("ANSWER_AS", "255")
    with libmodbus_tcp() as (_, port):
        driver = ModbusTcpController(
            "127.0.0.1", port, 0, LAYOUT, PATIENT_S, RequestLimits(most, most), single_write="fc16"
        )
        await driver.connect()
        for page in contour(9):
            await driver.write_transfer(0)
            await driver.write_page(page)
            assert await driver.read_page(len(page.payload)) == page
            await driver.write_transfer(7)
        await driver.close()


async def test_a_controller_without_fc6_is_told_with_what_to_set() -> None:
    async with pair("modbus-tcp", 125, fc6=False) as (driver, _):
        driver.single_write = "fc6"
        with pytest.raises(ControllerRefused, match="single_write: fc16"):
            await driver.write_transfer(0)
