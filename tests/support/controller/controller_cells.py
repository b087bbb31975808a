"""A driver of the Controller role and the server it talks to, for each way and each server that the suite runs over."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass

from drivers.controller.mailbox.layout import MailboxLayout
from drivers.controller.modbus.client import (
    ModbusController,
    ModbusRtuController,
    ModbusRtuOverTcpController,
    ModbusTcpController,
)
from drivers.controller.modbus.serial_line import SerialLine
from drivers.controller.simulated.controller import SimulatedController
from tests.support.controller.pty_line import PtyLine
from tests.support.controller.serial_server import SerialServer
from tests.support.interop.programs import libmodbus_rtu, libmodbus_tcp

PATIENT_S = 60.0  # longer than any test: what fails then did not fail by its time-out
WAYS = ("modbus-tcp", "modbus-rtu", "modbus-rtu-over-tcp")
SERVERS = ("simulated", "libmodbus")

Driver = Callable[..., ModbusController]
"""A new driver, not connected, from layout=, device_id= and timeout_s=."""


@dataclass(frozen=True)
class Cell:
    """One way to one server. end: the connection breaks as it does when the other side goes away."""

    way: str
    driver: Driver
    end: Callable[[], Awaitable[None]]
    simulated: SimulatedController | None
    line: PtyLine | None

    def clean(self) -> bool:
        """True unless a server that watches has seen something against the protocol."""
        return self.simulated is None or self.simulated.verdict.clean


@contextlib.asynccontextmanager
async def cell(way: str, server: str, layout: MailboxLayout) -> AsyncIterator[Cell]:
    """The server, running, and what makes drivers to it."""
    async with contextlib.AsyncExitStack() as stack:
        if way == "modbus-tcp":
            yield await _tcp_cell(stack, server, layout)
            return
        line = await stack.enter_async_context(PtyLine())
        simulated = None
        if server == "simulated":
            simulated = SimulatedController.on_serial(line.far, layout=layout, scan_s=0.001)
            await stack.enter_async_context(simulated)
        else:
            stack.enter_context(libmodbus_rtu(line.far))
        if way == "modbus-rtu":

            async def unplug() -> None:
                line.unplug_near()

            yield Cell(way, _driver(ModbusRtuController, SerialLine(line.near)), unplug, simulated, line)
            return
        gateway = await stack.enter_async_context(SerialServer(line.near))
        yield Cell(
            way,
            _driver(ModbusRtuOverTcpController, "127.0.0.1", gateway.port, baudrate=115_200),
            gateway.stop,
            simulated,
            line,
        )


async def _tcp_cell(stack: contextlib.AsyncExitStack, server: str, layout: MailboxLayout) -> Cell:
    if server == "simulated":
        simulated = await stack.enter_async_context(SimulatedController(layout=layout, scan_s=0.001))
        return Cell(
            "modbus-tcp", _driver(ModbusTcpController, "127.0.0.1", simulated.port), simulated.stop, simulated, None
        )
    process, port = stack.enter_context(libmodbus_tcp())

    async def kill() -> None:
        process.kill()

    return Cell("modbus-tcp", _driver(ModbusTcpController, "127.0.0.1", port), kill, None, None)


def _driver(kind: Callable[..., ModbusController], *where: object, **how: object) -> Driver:
    def make(layout: MailboxLayout | None = None, device_id: int = 1, timeout_s: float = PATIENT_S) -> ModbusController:
        return kind(*where, device_id=device_id, layout=layout, timeout_s=timeout_s, **how)

    return make
