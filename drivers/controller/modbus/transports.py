"""The three ways to a controller: Modbus TCP, Modbus RTU on a serial port, RTU frames through a TCP serial server."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import secrets
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from drivers.controller.errors import ControllerUnavailable
from drivers.controller.modbus.framing import LAST_TRANSACTION, Framing, RtuFraming, TcpFraming
from drivers.controller.modbus.name_lookup import addresses_of
from drivers.controller.modbus.serial_line import SerialLine, open_serial

Descriptor = tuple[int, Callable[[], None]]
"""An open descriptor that does not block, and what closes it."""


@dataclass(frozen=True)
class LineTiming:
    """How fast bytes go, s. silence_s: what must lie between two frames. byte_s: one byte. echo: we hear ourselves."""

    silence_s: float = 0.0
    byte_s: float = 0.0
    echo: bool = False


class Transport(Protocol):
    """One way to the controller."""

    @property
    def name(self) -> str:
        """What people call it."""

    @property
    def timing(self) -> LineTiming:
        """How fast it is."""

    @property
    def serial(self) -> bool:
        """True where replies do not say which request they answer, so that a late one must be waited out."""

    @property
    def missing(self) -> str:
        """What to check when no reply comes."""

    @property
    def mismatch(self) -> str:
        """What to check when something comes that is no reply."""

    def lost(self, reason: str) -> str:
        """That the other end has gone, and what to check."""

    def framing(self, device_id: int) -> Framing:
        """The frames of a new connection."""

    async def open(self, timeout_s: float) -> Descriptor:
        """Open it; raise ControllerUnavailable."""


@dataclass(frozen=True)
class TcpTransport:
    """Modbus TCP. begin: the number before a connection's first transaction.

    By default another one each time: the late reply to an earlier connection's request is then none to this one's.
    """

    host: str
    port: int
    begin: Callable[[], int] = lambda: secrets.randbelow(LAST_TRANSACTION)

    serial = False
    missing = "Check cable and power, device_id, whether the controller runs, and timeout_s"
    mismatch = "Check device_id, what listens there, and for a second client"

    @property
    def name(self) -> str:
        """Host and port."""
        return f"{self.host}:{self.port}"

    @property
    def timing(self) -> LineTiming:
        """No pace of its own."""
        return LineTiming()

    def framing(self, device_id: int) -> Framing:
        """MBAP frames."""
        return TcpFraming(device_id, self.begin())

    async def open(self, timeout_s: float) -> Descriptor:
        """A new TCP connection."""
        return await _open_tcp(self.name, self.host, self.port, timeout_s, "the controller is on")

    def lost(self, reason: str) -> str:
        """See `Transport`."""
        return f"the controller closed the connection ({reason})"


@dataclass(frozen=True)
class RtuOverTcpTransport:
    """RTU frames in a TCP connection to a serial server. baudrate: of the line behind it, for silence and time-outs."""

    host: str
    port: int
    baudrate: int = 9600

    serial = True
    missing = "Check cables and power, device_id, the controller, the serial server's baud rate, parity, and timeout_s"
    mismatch = "Check the serial server's baud rate and parity, the line's termination, and for a second client"

    @property
    def name(self) -> str:
        """Host and port."""
        return f"{self.host}:{self.port}"

    @property
    def timing(self) -> LineTiming:
        """That of the line behind the serial server, with the longest characters that it may have."""
        line = SerialLine("", self.baudrate, "E", 1)
        return LineTiming(line.silence_s, line.byte_s)

    def framing(self, device_id: int) -> Framing:
        """RTU frames."""
        return RtuFraming(device_id)

    async def open(self, timeout_s: float) -> Descriptor:
        """A new TCP connection."""
        return await _open_tcp(self.name, self.host, self.port, timeout_s, "the serial server is on")

    def lost(self, reason: str) -> str:
        """See `Transport`."""
        return f"the serial server closed the connection ({reason})"


@dataclass(frozen=True)
class RtuTransport:
    """Modbus RTU on a serial port of this machine."""

    line: SerialLine

    serial = True
    missing = "Check the two wires and their order, power, device_id, the controller, baud rate, parity, and timeout_s"
    mismatch = "Check baud rate, parity, termination, and for a second client on the line"

    @property
    def name(self) -> str:
        """The port."""
        return self.line.port

    @property
    def timing(self) -> LineTiming:
        """That of the line."""
        return LineTiming(self.line.silence_s, self.line.byte_s, self.line.echo)

    def framing(self, device_id: int) -> Framing:
        """RTU frames."""
        return RtuFraming(device_id)

    async def open(self, timeout_s: float) -> Descriptor:
        """The port, locked against other programs; opening does not block."""
        return open_serial(self.line)

    def lost(self, reason: str) -> str:
        """See `Transport`."""
        return f"the port has gone ({reason}). Check that the adapter is plugged in"


_IN_PLAIN_WORDS = {
    errno.ECONNREFUSED: "the device is there and refuses, so nothing listens on this port",
    errno.EHOSTUNREACH: "no device answers to this address",
    errno.ENETUNREACH: "this machine has no way to that network",
}


async def _open_tcp(name: str, host: str, port: int, timeout_s: float, what_is_on: str) -> Descriptor:
    next_step = f"Check that {what_is_on}, the cable, host and port"
    try:
        async with asyncio.timeout(timeout_s):
            connected = await _connect(host, port)
    except TimeoutError as error:
        raise ControllerUnavailable(f"{name}: no connection in {timeout_s:g} s. {next_step}") from error
    except (OSError, UnicodeError) as error:
        plain = _IN_PLAIN_WORDS.get(getattr(error, "errno", None) or 0, str(error))
        raise ControllerUnavailable(f"{name}: no connection: {plain}. {next_step}") from error
    return connected.fileno(), connected.close


async def _connect(host: str, port: int) -> socket.socket:
    """A connected socket to the first of the host's addresses that answers; raise the last one's OSError."""
    loop = asyncio.get_running_loop()
    fault: OSError = OSError(f"{host} has no address")
    for family, kind, protocol, _, address in await addresses_of(host, port):
        with contextlib.ExitStack() as unless_connected:
            connecting = unless_connected.enter_context(socket.socket(family, kind, protocol))
            connecting.setblocking(False)
            connecting.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            try:
                await loop.sock_connect(connecting, address)
            except OSError as error:
                fault = error
                continue
            unless_connected.pop_all()
            return connecting
    raise fault
