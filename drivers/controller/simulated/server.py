"""The simulated controller's Modbus server: TCP, RTU over TCP, or RTU on a serial port, with scripted faults."""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import Callable
from contextlib import suppress

import serial

from drivers.controller.errors import ControllerUnavailable
from drivers.controller.simulated.exchange import Device, Exchange, Outlet
from drivers.controller.simulated.faults import FaultPlan
from drivers.controller.simulated.frames import QUIET_S, BadFrame, FramingName
from drivers.controller.simulated.line import LONGEST_RECEPTION, SerialEnd

RESET = struct.pack("ii", 1, 0)  # SO_LINGER: close by RST


class RegisterServer:
    """Serves `device` until `stop`. Late replies and late writes go on after a connection ended, not after `stop`."""

    def __init__(self, device: Device, framing: FramingName, faults: FaultPlan) -> None:
        self._device = device
        self._framing: FramingName = framing
        self._faults = faults
        self._timers: set[asyncio.TimerHandle] = set()
        self._clients: set[asyncio.Task[None]] = set()
        self._server: asyncio.Server | None = None
        self._line: SerialEnd | None = None
        self._outlet = Outlet(True, self._later)  # of all connections where there is a line behind them

    @property
    def port(self) -> int | None:
        """The TCP port that it listens on, None where it does not."""
        return int(self._server.sockets[0].getsockname()[1]) if self._server and self._server.sockets else None

    async def listen(self, host: str, port: int) -> None:
        """Listen on TCP; raise ControllerUnavailable."""
        try:
            self._server = await asyncio.start_server(self._accept, host, port)
        except (OSError, OverflowError) as error:
            raise _unavailable(f"{host}:{port}", error) from error

    def open_line(self, port: str, baudrate: int) -> None:
        """Serve on a serial port, 8N1; raise ControllerUnavailable."""
        try:
            line = serial.Serial(port, baudrate, timeout=0, write_timeout=0)
        except (OSError, ValueError) as error:  # a SerialException is an OSError
            raise _unavailable(f"serial port {port}", error) from error
        self._line = SerialEnd(line, lambda send: self._exchange(send, None))

    async def stop(self) -> None:
        """Close every connection and forget what was to come late."""
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()
        self._outlet.forget()
        if self._line is not None:
            self._line.close()
            self._line = None
        server, self._server = self._server, None
        if server is not None:
            server.close()
        clients = list(self._clients)
        for client in clients:
            client.cancel()
        if clients:
            await asyncio.wait(clients)
        if server is not None:
            await server.wait_closed()

    # --- inside -------------------------------------------------------------------------------------------------

    def _exchange(self, send: Callable[[bytes], None], reset: Callable[[], None] | None) -> Exchange:
        outlet = self._outlet if self._framing == "rtu" else Outlet(False, self._later)
        outlet.listen(send)
        return Exchange(self._device, self._framing, self._faults, self._later, outlet=outlet, reset=reset)

    def _later(self, seconds: float, act: Callable[[], None]) -> None:
        def run() -> None:
            self._timers.discard(timer)
            act()

        timer = asyncio.get_running_loop().call_later(seconds, run)
        self._timers.add(timer)

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._clients.add(task)
        task.add_done_callback(self._clients.discard)
        self._device.connection(True)
        # The task ends here whether it is cancelled or not; asyncio's streams would log a cancelled one as an error.
        try:
            with suppress(OSError, BadFrame, asyncio.CancelledError):
                await self._carry(reader, writer)
        finally:
            self._device.connection(False)
            writer.transport.abort()
            with suppress(OSError, asyncio.CancelledError):
                await writer.wait_closed()

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        def send(frame: bytes) -> None:
            if not writer.is_closing():
                writer.write(frame)

        def reset() -> None:
            connection: socket.socket = writer.get_extra_info("socket")
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
            writer.transport.abort()

        exchange = self._exchange(send, reset)
        while True:
            if self._framing == "rtu":
                try:
                    async with asyncio.timeout(QUIET_S):
                        data = await reader.read(LONGEST_RECEPTION)
                except TimeoutError:
                    exchange.quiet()
                    data = await reader.read(LONGEST_RECEPTION)
            else:
                data = await reader.read(LONGEST_RECEPTION)
            if not data:
                return
            exchange.receive(data)


def _unavailable(where: str, error: Exception) -> ControllerUnavailable:
    reason = getattr(error, "strerror", None) or error
    return ControllerUnavailable(f"cannot serve on {where} ({reason}). Check that it exists, is free, and is allowed")
