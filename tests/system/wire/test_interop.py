"""What our driver writes, on servers that others wrote, read back by clients that others wrote; and theirs on ours."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient
from pymodbus.framer import FramerType

from drivers.controller import Page, ServiceBlock
from drivers.controller.mailbox.blocks import decode_link, encode_service
from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.modbus.client import (
    ModbusController,
    ModbusRtuController,
    ModbusRtuOverTcpController,
    ModbusTcpController,
)
from drivers.controller.modbus.serial_line import SerialLine
from drivers.controller.simulated.controller import SimulatedController
from tests.support.controller.protocol_decoder import decode_contour, decode_service
from tests.support.controller.pty_line import PtyLine
from tests.support.interop.programs import TCP_SERVERS, libmodbus_rtu, mbpoll_reads, pymodbus

VECTORS = Path(__file__).parents[3] / "docs" / "reference" / "golden-vectors.json"
GOLDEN: dict[str, Any] = json.loads(VECTORS.read_text(encoding="utf-8"))
CONTOURS = [contour for contour in GOLDEN["contours"] if contour["holes"]]
SERVICE = ServiceBlock(service_state=5, service_heartbeat=9, job_id=70_000, session_ack=9, owner=4711)


def layout_of(contour: dict[str, Any]) -> MailboxLayout:
    return MailboxLayout(payload_capacity=contour["payload_capacity"], word_order=contour["word_order"])


async def written_and_read_back(
    controller: ModbusController, contour: dict[str, Any], *where: str
) -> tuple[list[tuple[Sequence[int], Sequence[int]]], list[int]]:
    """The contour's pages and the service block, as mbpoll reads them after our driver wrote them."""
    layout = layout_of(contour)
    pages = []
    await controller.connect()
    await controller.write_service(SERVICE)
    for number, written in enumerate(contour["pages"], start=1):
        page = Page(tuple(written["header"]), tuple(written["payload"]))
        if not controller.connected:
            await controller.connect()
        await controller.write_transfer(0)
        await controller.write_page(page)
        assert await controller.read_page(len(page.payload)) == page
        await controller.write_transfer(number)
        await controller.close()  # on a serial line there is one client at a time
        length = 32 + len(page.payload)
        block = await asyncio.to_thread(mbpoll_reads, layout.contour_address, length, *where)
        assert block[0] == number
        pages.append((block[:32], block[32:]))
    return pages, await asyncio.to_thread(mbpoll_reads, layout.service_address, 16, *where)


def is_the_contour(pages: list[tuple[Sequence[int], Sequence[int]]], contour: dict[str, Any]) -> bool:
    rings = tuple(tuple(map(tuple, ring)) for ring in (contour["exterior"], *contour["holes"]))
    return decode_contour(pages, contour["word_order"]).rings == rings


@pytest.mark.parametrize("server", TCP_SERVERS)
@pytest.mark.parametrize("contour", CONTOURS, ids=lambda contour: f"{len(contour['pages'])}-{contour['word_order']}")
async def test_mbpoll_reads_the_contour_from_a_server_that_others_wrote(server: str, contour: dict[str, Any]) -> None:
    with TCP_SERVERS[server]() as (_, port):
        controller = ModbusTcpController("127.0.0.1", port, layout=layout_of(contour), timeout_s=30)
        pages, service = await written_and_read_back(controller, contour, "-p", str(port), "127.0.0.1")
    assert is_the_contour(pages, contour)
    read = decode_service(service, contour["word_order"])
    assert (read.job_id, read.owner, read.session_ack) == (70_000, 4711, 9)


async def test_mbpoll_reads_the_contour_from_libmodbus_over_a_serial_line() -> None:
    contour = CONTOURS[-1]
    async with PtyLine() as line:
        settings = SerialLine(line.near, 38_400)  # a pseudo-terminal has no parity
        with libmodbus_rtu(line.far, baudrate=38_400):
            controller = ModbusRtuController(settings, layout=layout_of(contour), timeout_s=30)
            options = ("-m", "rtu", "-b", "38400", "-P", "none", line.near)
            pages, _ = await written_and_read_back(controller, contour, *options)
    assert is_the_contour(pages, contour)


# --- pymodbus, by all three ways --------------------------------------------------------------------------------------


Client = AsyncModbusTcpClient | AsyncModbusSerialClient


async def read_by(client: Client, address: int, count: int) -> list[int]:
    """Registers as pymodbus's client reads them, in as few requests as the standard allows."""
    registers: list[int] = []
    while len(registers) < count:
        longest = min(125, count - len(registers))
        reply = await client.read_holding_registers(address + len(registers), count=longest)
        assert not reply.isError(), reply
        registers += reply.registers
    return registers


@asynccontextmanager
async def connected(client: Client) -> AsyncIterator[Client]:
    try:
        assert await client.connect()
        yield client
    finally:
        client.close()


def tcp_client(port: int, framer: FramerType) -> Client:
    return AsyncModbusTcpClient("127.0.0.1", port=port, framer=framer, timeout=30, retries=0)


def serial_client(device: str) -> Client:
    return AsyncModbusSerialClient(device, baudrate=115_200, timeout=30, retries=0)


async def written_by_us_and_read_by(client: Client, controller: ModbusController, contour: dict[str, Any]) -> bool:
    """True where `client` reads the contour's one page as our driver wrote it."""
    (written,) = contour["pages"]
    page = Page(tuple(written["header"]), tuple(written["payload"]))
    await controller.connect()
    await controller.write_transfer(0)
    await controller.write_page(page)
    assert await controller.read_page(len(page.payload)) == page
    await controller.write_transfer(1)
    await controller.close()  # on a serial line there is one client at a time
    async with connected(client):
        block = await read_by(client, layout_of(contour).contour_address, 32 + len(page.payload))
    return block[0] == 1 and is_the_contour([(block[:32], block[32:])], contour)


ONE_PAGE = next(contour for contour in CONTOURS if len(contour["pages"]) == 1)


async def test_pymodbus_holds_what_our_driver_writes_over_a_serial_line() -> None:
    async with PtyLine() as line:
        with pymodbus("rtu", line.far):
            ours = ModbusRtuController(SerialLine(line.near), layout=layout_of(ONE_PAGE), timeout_s=30)
            assert await written_by_us_and_read_by(serial_client(line.near), ours, ONE_PAGE)


async def test_pymodbus_holds_what_our_driver_writes_by_rtu_over_tcp() -> None:
    with pymodbus("rtu-over-tcp") as (_, port):
        ours = ModbusRtuOverTcpController("127.0.0.1", port, layout=layout_of(ONE_PAGE), timeout_s=30, baudrate=115_200)
        assert await written_by_us_and_read_by(tcp_client(port, FramerType.RTU), ours, ONE_PAGE)


async def pymodbus_is_served(client: Client, controller: SimulatedController) -> None:
    """What pymodbus's client writes into the simulated controller stands there, and it is answered."""
    async with connected(client), asyncio.timeout(60):
        while not decode_link(await read_by(client, 0, 16), "big").session:
            await asyncio.sleep(0.001)
        assert not (await client.write_registers(16, list(encode_service(SERVICE, "big")))).isError()
        read = decode_service(await read_by(client, 16, 16), "big")
        assert (read.job_id, read.owner, read.session_ack) == (70_000, 4711, 9)
        assert not (await client.write_register(32, 0)).isError()
        assert (await client.read_coils(0, count=1)).exception_code == 1
        assert (await client.read_holding_registers(5000, count=1)).exception_code == 2
    assert controller.registers(16, 16) == encode_service(SERVICE, "big")
    assert dict(controller.verdict.counts) == {"function-code": 1}


@pytest.mark.parametrize(("framing", "framer"), [("tcp", FramerType.SOCKET), ("rtu", FramerType.RTU)])
async def test_pymodbus_is_served_by_the_simulated_controller_over_tcp(framing: Any, framer: FramerType) -> None:
    async with SimulatedController(framing=framing, scan_s=0.001) as controller:
        await pymodbus_is_served(tcp_client(controller.port, framer), controller)


async def test_pymodbus_is_served_by_the_simulated_controller_on_a_serial_line() -> None:
    async with PtyLine() as line, SimulatedController.on_serial(line.far, scan_s=0.001) as controller:
        await pymodbus_is_served(serial_client(line.near), controller)
