"""A line trigger on a serial port, by pyserial."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import termios
import threading
import time
from collections import deque
from collections.abc import Callable

import serial

from drivers.trigger import TriggerUnavailable
from drivers.trigger.lines import LineSplitter

# Noise at plugging in leaves a line begun; a command that comes hours later must not become its end.
SILENCE_ENDS_LINE_S = 10.0
CHUNK = 256
LINE_END = b"\r\n"

# Beside its own exception, an OSError, pyserial lets these through: from termios, and where a setting is refused.
PORT_FAULTS = (OSError, ValueError, NotImplementedError, termios.error)


class SerialLineTrigger:
    """Lines of ASCII over a serial port, 8N1, no flow control; the port is locked against other programs.

    One thread reads, any may write; `close` may come from any thread and ends a read or write that waits.
    """

    def __init__(
        self,
        port: str,
        baudrate: int,
        *,
        write_timeout_s: float = 1.0,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._name = port
        self._baudrate = baudrate
        self._write_timeout_s = write_timeout_s
        self._now = now
        self._port: serial.Serial | None = None
        self._lost = False
        self._reading = threading.Lock()
        self._writing = threading.Lock()
        self._splitter = LineSplitter()
        self._lines: deque[bytes] = deque()
        self._heard_at_s = 0.0

    def open(self) -> None:
        """Open the port, dropping what was sent before; raise TriggerUnavailable. An open port stays as it is."""
        if self._lost:
            self.close()
        if self._port is not None:
            return
        try:
            port = serial.Serial(
                self._name, self._baudrate, timeout=0, write_timeout=self._write_timeout_s, exclusive=True
            )
        except PORT_FAULTS as error:
            raise TriggerUnavailable(
                f"{self._name}: cannot be opened at {self._baudrate} baud ({fault_text(error)}); expected a free "
                "serial port. Check its name, cable and permissions."
            ) from error
        self._splitter = LineSplitter()
        self._lines.clear()
        self._lost = False
        self._port = port

    def read_line(self, timeout_s: float) -> bytes | None:
        """The next line without its end, None when `timeout_s` passed without one.

        At most 81 bytes; 81 are the beginning of a line beyond 80. Raises TriggerUnavailable.
        """
        deadline_s = self._now() + timeout_s
        with self._reading:
            while not self._lines:
                left_s = deadline_s - self._now()
                self._receive(self._opened(), max(0.0, left_s))
                if left_s <= 0.0 and not self._lines:
                    return None
            return self._lines.popleft()

    def write_line(self, text: str) -> None:
        """Send `text` and CR LF; raise TriggerUnavailable. `text` is one line of ASCII, else ValueError."""
        if not text.isascii() or not text.isprintable():
            raise ValueError(f"{text!r} is no line of printable ASCII")
        with self._writing:
            port = self._opened()
            try:
                port.write(text.encode("ascii") + LINE_END)
            except PORT_FAULTS as error:
                raise self._lose(error) from error
            self._still_open(port)

    def close(self) -> None:
        """Let the port go; never raises. Closing a closed port does nothing."""
        port, self._port, self._lost = self._port, None, False
        if port is None:
            return
        with contextlib.suppress(*PORT_FAULTS):
            port.cancel_read()
            port.cancel_write()
        # Both have been woken; the descriptor must not be reused while one of them still looks at it.
        with self._reading, self._writing, contextlib.suppress(*PORT_FAULTS):
            port.close()

    def _opened(self) -> serial.Serial:
        if self._port is None or self._lost:
            raise TriggerUnavailable(f"{self._name}: not open; expected open() before reading and writing.")
        return self._port

    def _still_open(self, port: serial.Serial) -> None:
        if self._port is not port:
            raise TriggerUnavailable(f"{self._name}: was closed while it was in use; expected it to stay open.")

    def _receive(self, port: serial.Serial, timeout_s: float) -> None:
        """Take in what has come, or wait for it until `timeout_s` has passed."""
        try:
            port.timeout = timeout_s
            data = port.read(1)
            if data:
                data += port.read(min(port.in_waiting, CHUNK))
        except PORT_FAULTS as error:
            raise self._lose(error) from error
        self._still_open(port)
        if not data:
            return
        if self._now() - self._heard_at_s > SILENCE_ENDS_LINE_S:
            self._splitter.drop()
        self._heard_at_s = self._now()
        self._lines.extend(self._splitter.feed(data))

    def _lose(self, error: BaseException) -> TriggerUnavailable:
        """Give the port up: after a fault half a line may be on its way, and nothing more is to be trusted."""
        self._lost = True
        return TriggerUnavailable(
            f"{self._name}: was lost ({fault_text(error)}); expected it to stay. Check cable and device; "
            "it may come back."
        )


def fault_text(error: BaseException) -> str:
    """What went wrong, in words, without pyserial's nested numbers."""
    number = getattr(error, "errno", None)
    nested = re.search(r"\((\d+), '", str(error))  # of termios, which pyserial only quotes
    if number is None and nested:
        number = int(nested[1])
    if number == errno.ENOTTY:
        return "it is no serial port"
    if number in (errno.EAGAIN, errno.EBUSY):
        return "in use by another program"
    return os.strerror(number) if number else str(error)
