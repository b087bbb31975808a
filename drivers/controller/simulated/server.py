"""The simulated controller's Modbus server: pymodbus's, over TCP, RTU over TCP, or RTU on a serial port.

The library listens, keeps the connections, and cuts and builds the frames. What it would do with a request in between
is not used, because it spoils what is to be observed: a request that comes before the reply to the one before has left
is lost or done twice, a half one is kept for ever, and what it cannot decode it answers as function code 0.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import Callable
from typing import Any

from pymodbus.framer import FramerRTU, FramerSocket, FramerType
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.server.base import ModbusBaseServer
from pymodbus.server.requesthandler import ServerRequestHandler
from pymodbus.transport import CommType

from drivers.controller.errors import ControllerUnavailable
from drivers.controller.simulated.exchange import Device, Exchange, Outlet
from drivers.controller.simulated.faults import FaultPlan
from drivers.controller.simulated.received import FramingName, ReceivedRequest

QUIET_S = 0.02  # a line silent for so long has ended its frame; t3.5 itself is below what an operating system can tell
LONGEST_RECEPTION = 1 << 18  # bytes, as asyncio reads them; the library drops all where more than one frame waits
RESET = struct.pack("ii", 1, 0)  # SO_LINGER: close by RST
NO_FRAME = (0, 0, 0, b"")


class FrameByFrame(FramerRTU):
    """The library's RTU frames, one at a time: by itself it drops what was read behind the first.

    It also tells the end of a frame whose function code is unknown to the library, by its CRC.
    """

    def decode(self, data: bytes) -> tuple[int, int, int, bytes]:
        """Bytes used, device id, 0, PDU; nothing used while the frame is incomplete, no PDU where its CRC is wrong."""
        if len(data) < self.MIN_SIZE:
            return NO_FRAME
        kind = self.decoder.lookupPduClass(data)
        if kind is None:
            right = self.check_CRC(data[:-2], int.from_bytes(data[-2:], "big"))
            return (len(data), data[0], 0, data[1:-2]) if right else NO_FRAME
        length = kind.calculateRtuFrameSize(data)
        return super().decode(data[:length]) if 0 < length <= len(data) else NO_FRAME


class ServedConnection(ServerRequestHandler):
    """One connection to the library's server, or its serial line: requests go to an Exchange, replies out by it."""

    def __init__(
        self, server: ModbusBaseServer, device: Device, attach: Callable[[ServedConnection], Exchange]
    ) -> None:
        super().__init__(server, None, None, None)  # type: ignore[no-untyped-call]
        self.max_buffer_size = LONGEST_RECEPTION
        self.on_line = self.comm_params.comm_type == CommType.SERIAL
        self._device = device
        self._attach = attach
        self._silence: asyncio.TimerHandle | None = None

    def callback_connected(self) -> None:
        """A client has come, or the port is open."""
        self._exchange = self._attach(self)
        if not self.on_line:
            self._device.connection(True)

    def callback_disconnected(self, exc: Exception | None) -> None:
        """It has gone."""
        if self._silence is not None:
            self._silence.cancel()
        if not self.on_line:
            self._device.connection(False)

    def write(self, frame: bytes) -> None:
        """Send a frame; nothing where the connection has ended."""
        if isinstance(self.transport, asyncio.WriteTransport) and not self.transport.is_closing():
            self.transport.write(frame)

    def reset(self) -> None:
        """End the connection by RST."""
        connection: socket.socket = self.transport.get_extra_info("socket")
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
        self.abort()

    def abort(self) -> None:
        """End the connection at once, whatever is unsent."""
        if isinstance(self.transport, asyncio.WriteTransport):
            self.transport.abort()

    def data_received(self, data: bytes) -> None:
        """Take what came, on RTU until the line falls silent."""
        if isinstance(self.framer, FramerRTU):
            if self._silence is not None:
                self._silence.cancel()
            self._silence = self.loop.call_later(QUIET_S, self._fall_silent)
        super().data_received(data)

    def callback_data(self, data: bytes, addr: tuple[Any, ...] | None = None) -> int:
        """Hand on the requests that are complete with `data`; return how many bytes they took."""
        used = 0
        while used < len(data) and self.transport is not None:
            if not self._may_begin(data[used:]):
                self.abort()
                return len(data)
            length, unit, transaction, pdu = self.framer.decode(data[used:])
            if not length:
                break
            used += length
            if not pdu:  # a wrong CRC: where the next frame begins, only a silence tells
                return len(data)
            self._exchange.receive(ReceivedRequest(unit, pdu, transaction))
        return used

    def _may_begin(self, data: bytes) -> bool:
        """False where `data` is no Modbus TCP, so that the connection cannot be followed; the library would wait on."""
        return isinstance(self.framer, FramerRTU) or (
            not any(data[2:4]) and (len(data) < 6 or 2 <= int.from_bytes(data[4:6], "big") <= FramerSocket.MAX_SIZE)
        )

    def _fall_silent(self) -> None:
        self.recv_buffer = b""


class _OurConnections(ModbusBaseServer):
    """What both servers of the library are given: our connections, and errors that tell why."""

    make: Callable[[ModbusBaseServer], ServedConnection]

    def callback_new_connection(self) -> ServedConnection:
        """A new connection's protocol."""
        return self.make(self)

    async def listen(self) -> bool:
        """Listen, or open the port; raise OSError, ValueError, OverflowError, where the library only logs."""
        self.is_listener = True
        made = await self.call_create()
        self.transport = made[0] if isinstance(made, tuple) else made
        return True


class _TcpServer(_OurConnections, ModbusTcpServer):
    """On TCP, with frames of either kind."""


class _LineServer(_OurConnections, ModbusSerialServer):
    """On a serial port."""


class RegisterServer:
    """Serves `device` until `stop`. Late replies and late writes go on after a connection ended, not after `stop`."""

    def __init__(self, device: Device, framing: FramingName, faults: FaultPlan) -> None:
        self._device = device
        self._framing: FramingName = framing
        self._faults = faults
        self._timers: set[asyncio.TimerHandle] = set()
        self._server: _TcpServer | _LineServer | None = None
        self._outlet = Outlet(True, self._later)  # of all connections where there is a line behind them

    @property
    def port(self) -> int | None:
        """The TCP port that it listens on, None where it does not."""
        listening = None if self._server is None else self._server.transport
        return int(listening.sockets[0].getsockname()[1]) if isinstance(listening, asyncio.Server) else None

    async def listen(self, host: str, port: int) -> None:
        """Listen on TCP; raise ControllerUnavailable."""
        framer = FramerType.RTU if self._framing == "rtu" else FramerType.SOCKET
        await self._serve(_TcpServer([], framer=framer, address=(host, port)), f"{host}:{port}")

    async def open_line(self, port: str, baudrate: int) -> None:
        """Serve on a serial port, 8N1; raise ControllerUnavailable."""
        await self._serve(_LineServer([], port=port, baudrate=baudrate, timeout=0), f"serial port {port}")
        await asyncio.sleep(0)  # the library takes the port into the loop in its next two rounds
        await asyncio.sleep(0)

    async def stop(self) -> None:
        """Close every connection and forget what was to come late."""
        for timer in self._timers:
            timer.cancel()
        self._timers.clear()
        self._outlet.forget()
        server, self._server = self._server, None
        if server is None:
            return
        listening = server.transport
        for connection in server.active_connections.values():
            if isinstance(connection, ServedConnection) and not connection.on_line:
                connection.abort()
        server.close()
        if isinstance(listening, asyncio.Server):
            await listening.wait_closed()

    # --- inside -------------------------------------------------------------------------------------------------

    async def _serve(self, server: _TcpServer | _LineServer, where: str) -> None:
        if self._framing == "rtu":
            server.framer = FrameByFrame
        server.make = lambda made_by: ServedConnection(made_by, self._device, self._attach)
        try:
            await server.listen()
        except (OSError, ValueError, OverflowError) as error:  # a SerialException is an OSError
            server.close()
            raise _unavailable(where, error) from error
        self._server = server

    def _attach(self, connection: ServedConnection) -> Exchange:
        outlet = self._outlet if self._framing == "rtu" else Outlet(False, self._later)
        outlet.listen(connection.write)
        reset = None if connection.on_line else connection.reset
        return Exchange(self._device, connection.framer, self._faults, self._later, outlet=outlet, reset=reset)

    def _later(self, seconds: float, act: Callable[[], None]) -> None:
        def run() -> None:
            self._timers.discard(timer)
            act()

        timer = asyncio.get_running_loop().call_later(seconds, run)
        self._timers.add(timer)


def _unavailable(where: str, error: Exception) -> ControllerUnavailable:
    reason = getattr(error, "strerror", None) or error
    return ControllerUnavailable(f"cannot serve on {where} ({reason}). Check that it exists, is free, and is allowed")
