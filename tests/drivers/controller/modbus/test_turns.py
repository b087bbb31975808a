"""Who goes first on one connection: on a slow line a heartbeat must not wait for a page."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from drivers.controller.mailbox.blocks import ServiceBlock
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.mailbox.pages import Page
from drivers.controller.modbus.client import LONGEST_EXCHANGE_S, ModbusRtuController
from drivers.controller.modbus.request_queue import MOST_SINGLE_IN_A_ROW
from drivers.controller.modbus.requests import RequestLimits
from drivers.controller.modbus.serial_line import SerialLine
from tests.support.controller.line_server import LineServer
from tests.support.controller.pty_line import PtyLine

PATIENT_S = 60.0
LAYOUT = MailboxLayout()
PAGE = Page((1, 0, 1, 1, 1, 1, 0, *(0,) * 24), (5,) * 1602)


@pytest.fixture
async def line() -> AsyncIterator[PtyLine]:
    async with PtyLine() as opened:
        yield opened


@pytest.fixture
async def server(line: PtyLine) -> AsyncIterator[LineServer]:
    async with LineServer(line.far) as started:
        yield started


@pytest.fixture
async def controller(line: PtyLine, server: LineServer) -> AsyncIterator[ModbusRtuController]:
    driver = ModbusRtuController(SerialLine(line.near, 19_200), timeout_s=PATIENT_S)
    await driver.connect()
    server.requests.clear()
    yield driver
    await driver.close()


def of_a_page(request: bytes) -> bool:
    return request[1] == 16 and int.from_bytes(request[2:4], "big") > LAYOUT.contour_address


async def test_a_heartbeats_three_requests_go_one_after_the_other_while_a_page_waits(
    controller: ModbusRtuController, server: LineServer
) -> None:
    page = asyncio.ensure_future(controller.write_page(PAGE))
    await asyncio.sleep(0)  # its first request is on its way, or waits for the line's silence
    await controller.read_link()
    await controller.read_service()
    await controller.write_service(ServiceBlock())
    went = "".join("P" if of_a_page(request) else "h" for request in server.requests)
    assert not page.done()
    assert went in ("hhh", "Phhh", "hhhP", "PhhhP")
    await page


async def test_single_requests_do_not_hold_a_page_up_for_ever(
    controller: ModbusRtuController, server: LineServer
) -> None:
    async def ask() -> None:
        while True:
            await controller.read_link()

    asking = [asyncio.ensure_future(ask()) for _ in range(3)]
    await controller.write_page(PAGE)
    for task in asking:
        task.cancel()
    await asyncio.wait(asking)
    went = "".join("P" if of_a_page(request) else "h" for request in server.requests)
    waited = went.strip("h").split("P")
    assert max(map(len, waited)) == MOST_SINGLE_IN_A_ROW
    assert went.count("P") > 10


@pytest.mark.parametrize(("baudrate", "parity"), [(2400, "N"), (4800, "N"), (9600, "E"), (9600, "N"), (19_200, "E")])
def test_one_request_of_a_page_takes_a_slow_line_no_longer_than_a_heartbeat_can_wait(
    baudrate: int, parity: str
) -> None:
    line = SerialLine("", baudrate, parity)  # type: ignore[arg-type]
    limits = ModbusRtuController(line).limits
    longest = max(9 + 2 * limits.write + 8, 8 + 5 + 2 * limits.read) * line.byte_s
    shortest_there_is = 17 + 2 * 32
    assert longest <= max(LONGEST_EXCHANGE_S, shortest_there_is * line.byte_s)
    assert limits == RequestLimits() or longest > LONGEST_EXCHANGE_S - 4 * line.byte_s, "and not much shorter than that"


def test_a_fast_line_is_used_as_far_as_the_controller_goes() -> None:
    assert ModbusRtuController(SerialLine("", 115_200)).limits == RequestLimits()
    shorter = RequestLimits(write=50, read=33)
    assert ModbusRtuController(SerialLine("", 9600), limits=shorter).limits == shorter
