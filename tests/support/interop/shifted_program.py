"""A controller's program that keeps its blocks where it thinks they belong, on any Modbus server's registers."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator

from drivers.controller.modbus.client import ModbusTcpController
from drivers.controller.modbus.requests import read_registers, registers_of, stream_of, write_registers
from tests.support.controller.protocol_decoder import u32_from, words_of

LINK, SERVICE = 0, 16
SCAN_S = 0.01
FIRST_CLOCK = 70_000  # the higher half is not 0, as after a minute


@contextlib.asynccontextmanager
async def program(
    port: int,
    shift: int = 0,
    word_order: str = "big",
    *,
    alive: bool = True,
    through: ModbusTcpController | None = None,
) -> AsyncIterator[None]:
    """It runs on the server on loopback's `port`, its blocks `shift` registers higher than the protocol's default.

    alive: False for one that has forgotten heartbeat and clock. through: a client that suits the server.
    """
    client = through or ModbusTcpController("127.0.0.1", port, timeout_s=30)
    await client.connect()
    scanning = asyncio.create_task(_scan_for_ever(client, shift, word_order, alive))
    try:
        yield
    finally:
        scanning.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await scanning
        await client.close()


async def _scan_for_ever(client: ModbusTcpController, shift: int, word_order: str, alive: bool) -> None:
    beat = 0
    while True:
        beat = (beat + alive) & 0xFFFF
        (reply,) = await client.run([read_registers(SERVICE + shift, 16)])
        test_value = u32_from(registers_of(reply)[8:10], word_order)
        link = [0] * 16
        link[0], link[1], link[13] = 1, beat, 9
        link[8:10] = words_of((test_value + 1) & 0xFFFFFFFF, word_order)
        link[14:16] = words_of(FIRST_CLOCK + beat, word_order)
        await client.run([write_registers(LINK + shift, stream_of(link))])
        await asyncio.sleep(SCAN_S)
