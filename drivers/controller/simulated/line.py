"""The simulated controller's end of a serial line, in the event loop."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable

import serial

from drivers.controller.simulated.exchange import Exchange
from drivers.controller.simulated.frames import QUIET_S

LONGEST_RECEPTION = 4096


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
