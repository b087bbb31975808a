"""Triggers that are no text: any byte on a serial line, or an edge of its CTS or DSR input. By pyserial.

The port may be this machine's, or `rfc2217://HOST:PORT` of a serial server in the network.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from typing import Literal, Protocol, cast

import serial

from drivers.trigger import TriggerUnavailable
from drivers.trigger.debounce import Burst, Edge, SteadyEdge
from drivers.trigger.serial import PORT_FAULTS, fault_text

Signal = Literal["cts", "dsr"]

CHUNK = 4096
LONGEST_WAIT_S = 0.25  # how long `close` may have to wait for whoever reads
# A level is looked at often enough to be seen a few times while it must hold; a USB adapter tells it every 1 to 16 ms.
LOOKS_A_HOLD = 4
SHORTEST_LOOK_S, LONGEST_LOOK_S = 0.001, 0.01
# A serial server that loses its power closes no connection: only what is to be answered finds that out.
ASK_SERVER_S = 5.0


class SerialBytes:
    """Any byte is a trigger; those that follow within `debounce_s` of each other belong to it."""

    def __init__(self, port: str, baudrate: int, debounce_s: float, *, now: Callable[[], float] = time.monotonic):
        self._port = _Port(port, baudrate, LONGEST_WAIT_S)
        self._debounce_s = debounce_s
        self._now = now
        self._burst = Burst(debounce_s)

    def open(self) -> None:
        """Open the port, dropping what was sent before; raise TriggerUnavailable. An open port stays as it is."""
        if self._port.open():
            self._burst = Burst(self._debounce_s)

    def wait(self, timeout_s: float) -> bool:
        """True as soon as a burst begins, False when `timeout_s`, or a little more, passed without one.

        Raises TriggerUnavailable.
        """
        give_up_at_s = self._now() + timeout_s
        while True:
            if self._port.received() and self._burst.heard(self._now()):
                return True
            if self._now() >= give_up_at_s:
                return False

    def close(self) -> None:
        """Let the port go; never raises."""
        self._port.close()


class SerialSignal:
    """An edge of an input line is a trigger, once the level after it has held for `debounce_s`."""

    def __init__(
        self,
        port: str,
        signal: Signal,
        edge: Edge,
        debounce_s: float,
        *,
        baudrate: int = 9600,
        now: Callable[[], float] = time.monotonic,
    ):
        self._port = _Port(port, baudrate, 0.0)
        self._signal: Signal = signal
        self._edge: Edge = edge
        self._debounce_s = debounce_s
        self._now = now
        self._steady = SteadyEdge(edge, debounce_s)
        self._look_s = min(max(debounce_s / LOOKS_A_HOLD, SHORTEST_LOOK_S), LONGEST_LOOK_S)

    def open(self) -> None:
        """Open the port; raise TriggerUnavailable, also where it has no such line. An open port stays as it is."""
        if self._port.open():
            self._steady = SteadyEdge(self._edge, self._debounce_s)
            self._port.level(self._signal)

    def wait(self, timeout_s: float) -> bool:
        """True as soon as the edge is complete, False when `timeout_s` passed without one; raise TriggerUnavailable."""
        give_up_at_s = self._now() + timeout_s
        self._port.received()  # this finds a lost port too: of a serial server the last level is remembered
        while True:
            if self._steady.level(self._port.level(self._signal), self._now()):
                return True
            if self._now() >= give_up_at_s:
                return False
            self._port.pause(self._look_s)

    def close(self) -> None:
        """Let the port go; never raises."""
        self._port.close()


class _Lines(Protocol):
    """What of pyserial's ports is used here; those in the network have it too."""

    rts: bool

    @property
    def in_waiting(self) -> int: ...
    @property
    def cts(self) -> bool: ...
    @property
    def dsr(self) -> bool: ...
    def read(self, size: int = 1, /) -> bytes: ...
    def close(self) -> None: ...


class _Port:
    """A serial port that is only listened to. One thread listens, `close` may come from any."""

    def __init__(self, name: str, baudrate: int, read_timeout_s: float) -> None:
        self._name = name
        self._read_timeout_s = read_timeout_s  # set once: pyserial settles the line anew at every change of it
        self._baudrate = baudrate
        self._port: _Lines | None = None
        self._lost = False
        self._in_network = "://" in name
        self._asked_at_s = 0.0
        self._closing = threading.Event()
        self._in_use = threading.Lock()

    def open(self) -> bool:
        """True where it was opened now, False where it was open; raise TriggerUnavailable."""
        if self._lost:
            self.close()
        if self._port is not None:
            return False
        self._closing.clear()
        try:
            exclusive = None if self._in_network else True  # an address has no lock to take
            port = serial.serial_for_url(self._name, self._baudrate, timeout=self._read_timeout_s, exclusive=exclusive)
        except PORT_FAULTS as error:
            raise TriggerUnavailable(
                f"{self._name}: cannot be opened at {self._baudrate} baud ({fault_text(error)}); expected a free "
                "serial port. Check its name, cable and permissions."
            ) from error
        self._port = cast(_Lines, port)
        self._asked_at_s = time.monotonic()
        return True

    def received(self) -> bool:
        """True where bytes came within the read time-out; they are thrown away."""
        with self._in_use:
            port = self._opened()
            try:
                self._ask_server(port)
                data = port.read(1)
                if data:
                    port.read(min(port.in_waiting, CHUNK))  # a flood never ends: what comes on is the next call's
            except PORT_FAULTS as error:
                raise self._lose(error) from error
            return bool(data)

    def _ask_server(self, port: _Lines) -> None:
        """Have a serial server answer now and then; RTS, which may feed the contact, stays as it is."""
        if self._in_network and time.monotonic() - self._asked_at_s > ASK_SERVER_S:
            port.rts = port.rts
            self._asked_at_s = time.monotonic()

    def level(self, signal: Signal) -> bool:
        """Whether an input line is asserted."""
        with self._in_use:
            port = self._opened()
            try:
                return bool(port.cts if signal == "cts" else port.dsr)
            except PORT_FAULTS as error:
                raise self._lose(error, f"{signal.upper()} cannot be read") from error

    def pause(self, duration_s: float) -> None:
        """Wait, but no longer than until the port is closed."""
        self._closing.wait(duration_s)

    def close(self) -> None:
        """Let it go; never raises."""
        self._closing.set()
        with self._in_use:
            port, self._port, self._lost = self._port, None, False
            if port is not None:
                with contextlib.suppress(*PORT_FAULTS):
                    port.close()

    def _opened(self) -> _Lines:
        if self._port is None or self._lost or self._closing.is_set():
            raise TriggerUnavailable(f"{self._name}: not open; expected open() before listening.")
        return self._port

    def _lose(self, error: BaseException, what: str = "was lost") -> TriggerUnavailable:
        self._lost = True
        return TriggerUnavailable(
            f"{self._name}: {what} ({fault_text(error)}); expected a port that stays and has this line. Check cable "
            "and device; it may come back."
        )
