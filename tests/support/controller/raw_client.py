"""A simulated controller, and a client that does as it is told."""

from __future__ import annotations

import asyncio
import struct

import numpy as np

from drivers.controller.mailbox.pages import ContourMessage, Page, encode_pages
from drivers.controller.simulated.controller import SimulatedController

SQUARE = np.array([[0, 0], [100_000, 0], [100_000, 100_000], [0, 100_000]])
SESSION = 9


class Client:
    """A Modbus TCP client of a few lines, which does as it is told and not as the protocol asks."""

    def __init__(self, port: int) -> None:
        self.port = port

    async def __aenter__(self) -> Client:
        self.reader, self.writer = await asyncio.open_connection("127.0.0.1", self.port)
        return self

    async def __aexit__(self, *_: object) -> None:
        self.writer.close()
        await self.writer.wait_closed()

    async def ask(self, pdu: bytes, unit: int = 1) -> bytes:
        self.writer.write(struct.pack(">HHHB", 1, 0, len(pdu) + 1, unit) + pdu)
        head = await self.reader.readexactly(7)
        return await self.reader.readexactly(int.from_bytes(head[4:6], "big") - 1)

    async def read(self, address: int, count: int) -> tuple[int, ...]:
        reply = await self.ask(struct.pack(">BHH", 3, address, count))
        return struct.unpack(f">{count}H", reply[2:])

    async def write_one(self, address: int, value: int) -> None:
        assert (await self.ask(struct.pack(">BHH", 6, address, value)))[0] == 6

    async def write(self, address: int, *values: int) -> bytes:
        count = len(values)
        return await self.ask(struct.pack(f">BHHB{count}H", 16, address, count, 2 * count, *values))

    async def write_page(self, page: Page, transfer: int) -> None:
        """The steps of a transfer, as the protocol wants them; returns when it is answered."""
        registers = [*page.header, *page.payload]
        await self.write_one(32, 0)
        await self.write(33, *registers)
        await self.write_one(32, transfer)
        await self.until_answered(transfer)

    async def until_answered(self, transfer: int) -> None:
        async with asyncio.timeout(60):
            while (await self.read(6, 1))[0] != transfer:
                await asyncio.sleep(0.001)

    async def until_started(self, no_longer: int = 0) -> None:
        """Return when there is a session, other than `no_longer`."""
        async with asyncio.timeout(60):
            while (await self.read(13, 1))[0] in (0, no_longer):
                await asyncio.sleep(0.001)


def page(**changes: object) -> Page:
    values: dict[str, object] = {
        "job_id": 1,
        "rings_um": (SQUARE,),
        "area_mm2": 10_000,
        "session": SESSION,
        "trigger": 0,
    }
    values |= changes
    message = ContourMessage(
        uncertainty_um=None, captured_at=0, recipe=1, simulated=True, aligned=False, valid_for_ms=0, **values
    )
    return encode_pages(message, 1984, "big")[0]


def simulated(**options: object) -> SimulatedController:
    return SimulatedController(**{"scan_s": 0.001, "session_source": lambda: SESSION, **options})
