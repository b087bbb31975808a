"""The simulated controller's Modbus server: TCP, RTU over TCP, or RTU on a serial port, with scripted faults."""

from __future__ import annotations

import asyncio
import os
import socket
import struct
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

import serial

from drivers.controller.errors import ControllerUnavailable
from drivers.controller.simulated_faults import Fault, FaultPlan, foreign
from drivers.controller.simulated_frames import QUIET_S, BadFrame, FramingName, Request, new_framing

LONGEST_RECEPTION = 4096
RESET = struct.pack("ii", 1, 0)  # SO_LINGER: close by RST
BROADCAST = 0


class Device(Protocol):
    """What stands behind the server."""

    def answer(self, request: Request) -> bytes | None:
        """Do the request; the PDU of its reply, None where it is for another device on the line."""

    def answer_late(self, request: Request) -> None:
        """Do a write long after its client gave it up."""

    def strike(self, request: Request) -> Fault | None:
        """The fault that befalls the request."""

    def unanswered(self, request: Request) -> None:
        """The request's reply never leaves."""

    def too_early(self, request: Request) -> None:
        """The request came on a connection on which the reply to the one before has not been sent."""

    def connection(self, up: bool) -> None:
        """A client came or went."""


class Outlet:
    """Where replies leave. On a serial line, or a serial server's, they leave in order, to whoever listens by then.

    late: hold a frame back, and on a line all that follow it, for so long.
    """

    def __init__(self, in_order: bool, later: Callable[[float, Callable[[], None]], None]) -> None:
        self._in_order = in_order
        self._later = later
        self._held: deque[bytes] = deque()
        self._listener: Callable[[bytes], None] = lambda _frame: None

    def listen(self, send: Callable[[bytes], None]) -> None:
        """From here on replies go to `send`."""
        self._listener = send

    def send(self, frame: bytes) -> None:
        """Send a frame, behind those that are held back."""
        if self._held:
            self._held.append(frame)
        else:
            self._listener(frame)

    def late(self, seconds: float, frame: bytes, sent: Callable[[], None]) -> None:
        """Send a frame so much later; `sent` is called then."""

        def release() -> None:
            sent()
            if not self._in_order:
                self._listener(frame)
                return
            held, self._held = self._held, deque()
            for waiting in held:
                self._listener(waiting)

        if self._held:  # it waits behind another late one as it is
            self._held.append(frame)
            sent()
            return
        if self._in_order:
            self._held.append(frame)
        self._later(seconds, release)


class Exchange:
    """Requests of one connection or line: done in order, befallen by faults, answered through `send`."""

    def __init__(
        self,
        device: Device,
        framing: FramingName,
        faults: FaultPlan,
        later: Callable[[float, Callable[[], None]], None],
        *,
        outlet: Outlet,
        reset: Callable[[], None] | None,
    ) -> None:
        self._device = device
        self._serial_frames = framing == "rtu"
        self._framing = new_framing(framing)
        self._faults = faults
        self._later = later
        self._outlet = outlet
        self._send = outlet.send
        self._reset = reset
        self._dead = False
        self._waiting = 0  # requests whose reply has not left

    def receive(self, data: bytes) -> None:
        """Take what came; raise BadFrame where it is no Modbus."""
        if self._dead:
            return
        for request in self._framing.feed(data):
            if self._waiting and self._reset is not None:
                self._device.too_early(request)
            if not self._silenced():
                self._serve(request)

    def _silenced(self) -> bool:
        return self._dead

    def quiet(self) -> None:
        """The line was silent for QUIET_S."""
        self._framing.quiet()

    def _serve(self, request: Request) -> None:
        fault = self._device.strike(request)
        if fault is None:
            self._reply(request, self._device.answer(request))
        else:
            self._befall(fault, request)

    def _reply(self, request: Request, pdu: bytes | None) -> None:
        if pdu is not None:
            self._send(self._framing.frame(request, pdu))

    # --- faults -------------------------------------------------------------------------------------------------

    def _befall(self, fault: Fault, request: Request) -> None:
        kind = fault.kind
        if kind in ("garbled-request", "garbled-reply") and not self._serial_frames:
            kind = "lost-request" if kind == "garbled-request" else "lost-reply"
        if kind in ("reset-before", "reset-after") and self._reset is None:
            kind = "lost-request" if kind == "reset-before" else "lost-reply"
        if kind == "exception":
            self._refuse(fault, request)
        elif kind in ("lost-request", "garbled-request", "reset-before", "half-open"):
            self._lose(request)
            if kind == "half-open":
                self._die(fault.delay_s)
        elif kind == "late-write":
            self._lose(request)
            if request.pdu[0] != 3:
                self._later(fault.delay_s, lambda: self._device.answer_late(request))
        else:
            self._spoil_reply(kind, fault, request, self._device.answer(request))
        if kind in ("reset-before", "reset-after") and self._reset is not None:
            self._reset()

    def _spoil_reply(self, kind: str, fault: Fault, request: Request, pdu: bytes | None) -> None:
        if pdu is None:
            return
        frame = self._framing.frame(request, pdu)
        if kind in ("lost-reply", "reset-after"):
            self._lose(request)
        elif kind == "garbled-reply":
            self._lose(request)
            self._send(self._faults.garbled(frame))
        elif kind == "foreign-reply":
            self._lose(request)
            self._send(self._framing.frame(request, foreign(pdu)))
        elif kind == "repeated-reply":
            self._send(frame)
            self._later(fault.delay_s, lambda: self._send(frame))
        else:
            self._waiting += 1
            self._outlet.late(fault.delay_s, frame, self._sent_late)

    def _sent_late(self) -> None:
        self._waiting -= 1

    def _refuse(self, fault: Fault, request: Request) -> None:
        self._send(self._framing.frame(request, bytes([request.pdu[0] | 0x80, fault.code])))
        if fault.code == 5 and request.pdu[0] != 3:
            self._device.unanswered(request)
            self._later(fault.delay_s, lambda: self._device.answer_late(request))

    def _lose(self, request: Request) -> None:
        self._waiting += 1
        self._device.unanswered(request)

    def _die(self, seconds: float) -> None:
        self._dead = True
        if self._reset is None:  # a serial line comes back by itself
            self._later(seconds, self._revive)

    def _revive(self) -> None:
        self._dead = False


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
        try:
            await self._carry(reader, writer)
        except (OSError, BadFrame):
            return
        except asyncio.CancelledError:
            if self._server is not None:
                raise
        finally:
            self._device.connection(False)
            writer.transport.abort()
            with suppress(OSError):
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


class SerialEnd:
    """A serial port in the event loop: what comes goes to an Exchange, what it sends goes out."""

    def __init__(self, line: serial.Serial, exchange: Callable[[Callable[[bytes], None]], Exchange]) -> None:
        self._line = line
        self._descriptor = line.fileno()
        os.set_blocking(self._descriptor, False)
        self._loop = asyncio.get_running_loop()
        self._exchange = exchange(self._send)
        self._out = b""
        self._silence: asyncio.TimerHandle | None = None
        self._loop.add_reader(self._descriptor, self._readable)

    def close(self) -> None:
        """Close the port."""
        self._loop.remove_reader(self._descriptor)
        self._loop.remove_writer(self._descriptor)
        if self._silence is not None:
            self._silence.cancel()
        self._line.close()

    def _readable(self) -> None:
        try:
            data = os.read(self._descriptor, LONGEST_RECEPTION)
        except BlockingIOError:
            return
        except OSError:  # the port has vanished; whoever plugs it in again starts the controller again
            self._loop.remove_reader(self._descriptor)
            return
        if self._silence is not None:
            self._silence.cancel()
        self._silence = self._loop.call_later(QUIET_S, self._exchange.quiet)
        self._exchange.receive(data)

    def _send(self, frame: bytes) -> None:
        self._out += frame
        self._writable()

    def _writable(self) -> None:
        try:
            sent = os.write(self._descriptor, self._out)
        except BlockingIOError:
            sent = 0
        except OSError:
            sent = len(self._out)
        self._out = self._out[sent:]
        if self._out:
            self._loop.add_writer(self._descriptor, self._writable)
        else:
            self._loop.remove_writer(self._descriptor)


def _unavailable(where: str, error: Exception) -> ControllerUnavailable:
    reason = getattr(error, "strerror", None) or error
    return ControllerUnavailable(f"cannot serve on {where} ({reason}). Check that it exists, is free, and is allowed")
