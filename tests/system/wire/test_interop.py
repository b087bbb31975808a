"""What our driver writes, on servers that others wrote, read back by a client that others wrote."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from drivers.controller import Page, ServiceBlock
from drivers.controller.mailbox.mailbox import MailboxLayout
from drivers.controller.modbus.client import ModbusController, ModbusRtuController, ModbusTcpController, SerialLine
from tests.support.controller.protocol_decoder import decode_contour, decode_service
from tests.support.controller.pty_line import PtyLine
from tests.support.interop.programs import TCP_SERVERS, libmodbus_rtu, mbpoll_reads

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
