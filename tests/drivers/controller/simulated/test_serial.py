"""The simulated controller on a real pseudo-terminal: Modbus RTU."""

from __future__ import annotations

import asyncio
import os
import struct
import tty
from collections.abc import AsyncIterator

import pytest

from drivers.controller import ControllerUnavailable
from drivers.controller.mailbox.blocks import ServiceBlock, encode_service
from drivers.controller.simulated.controller import SimulatedController
from tests.support.controller.rtu_frames import crc16

# --- Modbus RTU -------------------------------------------------------------------------------------------------------


class Line:
    """The client's end of a pseudo-terminal pair."""

    def __init__(self) -> None:
        self.near, self._far = os.openpty()
        tty.setraw(self._far)
        self.device = os.ttyname(self._far)
        os.set_blocking(self.near, False)

    def close(self) -> None:
        os.close(self.near)
        os.close(self._far)

    def send(self, unit: int, pdu: bytes) -> None:
        frame = bytes([unit]) + pdu
        os.write(self.near, frame + crc16(frame))

    async def receive(self, length: int) -> bytes:
        received = b""
        async with asyncio.timeout(60):
            while len(received) < length:
                try:
                    received += os.read(self.near, 512)
                except BlockingIOError:
                    await asyncio.sleep(0.001)
        return received


@pytest.fixture
async def line() -> AsyncIterator[Line]:
    made = Line()
    yield made
    made.close()


async def test_it_serves_modbus_rtu_on_a_serial_line(line: Line) -> None:
    async with SimulatedController.on_serial(line.device, scan_s=0.001) as controller:
        registers = encode_service(ServiceBlock(service_heartbeat=5), "big")
        line.send(1, struct.pack(">BHHB16H", 16, 16, 16, 32, *registers))
        reply = struct.pack(">BBHH", 1, 16, 16, 16)
        assert await line.receive(8) == reply + crc16(reply)
        assert controller.registers(16, 16) == registers
        line.send(1, struct.pack(">BHH", 3, 16, 16))
        reply = struct.pack(">BBB16H", 1, 3, 32, *registers)
        assert await line.receive(37) == reply + crc16(reply)
        assert controller.verdict.clean


async def test_on_a_serial_line_it_is_silent_to_requests_for_others(line: Line) -> None:
    async with SimulatedController.on_serial(line.device, scan_s=0.001):
        line.send(2, struct.pack(">BHH", 3, 0, 1))
        await asyncio.sleep(0.05)
        line.send(1, struct.pack(">BHH", 3, 2, 1))
        assert (await line.receive(7))[:2] == bytes([1, 3])


async def test_a_serial_port_that_does_not_exist_is_an_error_that_names_it() -> None:
    with pytest.raises(ControllerUnavailable, match="/dev/no-such-port"):
        await SimulatedController.on_serial("/dev/no-such-port").start()
