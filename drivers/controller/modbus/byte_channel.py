"""Bytes to and from a file descriptor that does not block: a socket, a serial port, a pseudo-terminal."""

from __future__ import annotations

import asyncio
import os
import select
import time
from collections.abc import Callable

from drivers.controller.modbus.reply_waiting import SPIN_S, Spinning

# A reply has at most 260 bytes. asyncio's own transports ask for 256 KiB at each read: 10 µs more a request.
CHUNK = 4096


class ByteChannel:
    """One open descriptor in the running event loop, from here to `close`.

    release: closes the descriptor; called once. received: gets bytes as they come.
    lost: is told once why the other end has gone, and must call `close`.
    """

    def __init__(
        self,
        descriptor: int,
        release: Callable[[], None],
        received: Callable[[bytes], None],
        lost: Callable[[str], None],
    ) -> None:
        self._descriptor = descriptor
        self._release = release
        self._received = received
        self._lost = lost
        self._unsent = b""
        self._closed = False
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(descriptor, self._read)
        self._spinning = Spinning()
        self._poll = select.poll()
        self._poll.register(descriptor, select.POLLIN)

    def write(self, data: bytes) -> None:
        """Send `data` as the other end takes it."""
        if self._closed:
            return
        try:
            sent = os.write(self._descriptor, data) if not self._unsent else 0
        except (BlockingIOError, InterruptedError):
            sent = 0
        except OSError as error:
            self._lost(_reason(error))
            return
        if sent == len(data):
            return
        if not self._unsent:
            self._loop.add_writer(self._descriptor, self._write_rest)
        self._unsent += data[sent:]

    def wait(self, longest_s: float) -> bool:
        """True where something came within `longest_s`, which the receiver has by then. It holds the event loop."""
        if self._closed or self._unsent:
            return False
        if not (self._spinning.worth() and self._spun()) and not self._poll.poll(1000 * longest_s):
            return False
        self._read()
        return True

    def _spun(self) -> bool:
        poll, monotonic = self._poll.poll, time.monotonic
        until = monotonic() + SPIN_S
        while not (came := bool(poll(0))) and monotonic() < until:
            pass
        self._spinning.ended(came)
        return came

    def close(self) -> None:
        """Forget what is unsent and let the descriptor go; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        self._unsent = b""
        self._loop.remove_reader(self._descriptor)
        self._loop.remove_writer(self._descriptor)
        self._release()

    def _read(self) -> None:
        try:
            data = os.read(self._descriptor, CHUNK)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            self._lost(_reason(error))
            return
        if data:
            self._received(data)
        else:
            self._lost("end of stream")

    def _write_rest(self) -> None:
        try:
            sent = os.write(self._descriptor, self._unsent)
        except (BlockingIOError, InterruptedError):
            return
        except OSError as error:
            self._lost(_reason(error))
            return
        self._unsent = self._unsent[sent:]
        if not self._unsent:
            self._loop.remove_writer(self._descriptor)


def _reason(error: OSError) -> str:
    return error.strerror or str(error)
