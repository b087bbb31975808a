"""A serial line: its settings, its times, and its open port."""

from __future__ import annotations

import contextlib
import errno
import os
import termios
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import serial
import serial.rs485

from drivers.controller.errors import ControllerUnavailable

# MODBUS over Serial Line V1.02, 2.5.1.1: 3.5 characters, above 19,200 baud fixed so that it can be kept by software.
SILENCE_CHARACTERS = 3.5
FASTEST_COUNTED_BAUDRATE = 19_200
SHORTEST_SILENCE_S = 0.00175

# Beside its own exception, an OSError, pyserial lets these through: from termios, and where a setting is refused.
_FAULTS = (OSError, ValueError, NotImplementedError, termios.error)


@dataclass(frozen=True)
class Rs485:
    """A transceiver that the kernel's driver switches by RTS. delays: between RTS and the first, the last and RTS."""

    rts_level_for_tx: bool = True
    rts_level_for_rx: bool = False
    delay_before_tx_s: float = 0.0
    delay_before_rx_s: float = 0.0


@dataclass(frozen=True)
class SerialLine:
    """A serial port and how characters go over it: 8 data bits.

    rs485: for a transceiver that the kernel must switch; None where there is none, or where it switches itself.
    echo: what is sent comes back first, as it does on two wires with a receiver that stays on.
    """

    port: str
    baudrate: int = 115_200
    parity: Literal["N", "E", "O"] = "N"
    stop_bits: Literal[1, 2] = 1
    rs485: Rs485 | None = None
    echo: bool = False

    @property
    def byte_s(self) -> float:
        """Time of one character: start, 8 bits, parity, stop."""
        return (9 + (self.parity != "N") + self.stop_bits) / self.baudrate

    @property
    def silence_s(self) -> float:
        """t3.5: the shortest silence between two frames."""
        if self.baudrate > FASTEST_COUNTED_BAUDRATE:
            return SHORTEST_SILENCE_S
        return SILENCE_CHARACTERS * self.byte_s


def open_serial(line: SerialLine) -> tuple[int, Callable[[], None]]:
    """The open port's descriptor, which does not block, and what closes it; raise ControllerUnavailable."""
    try:
        port = serial.Serial(
            line.port,
            line.baudrate,
            parity=line.parity,
            stopbits=line.stop_bits,
            timeout=0,
            write_timeout=0,
            exclusive=True,
        )
    except _FAULTS as error:
        raise ControllerUnavailable(
            f"{line.port}: cannot be opened at {line.baudrate} baud {line.parity} {line.stop_bits} ({_reason(error)}), "
            "expected a free serial port. Check its name, that it is plugged in, permissions, and for a second program"
        ) from error
    try:
        if line.rs485 is not None:
            port.rs485_mode = serial.rs485.RS485Settings(
                line.rs485.rts_level_for_tx,
                line.rs485.rts_level_for_rx,
                False,
                line.rs485.delay_before_tx_s,
                line.rs485.delay_before_rx_s,
            )
        port.reset_input_buffer()
    except _FAULTS as error:
        _release(port)
        raise ControllerUnavailable(
            f"{line.port}: cannot be set up ({_reason(error)}). Take out rs485 where the adapter switches by itself"
        ) from error
    return port.fileno(), lambda: _release(port)


def _release(port: serial.Serial) -> None:
    """Close it, dropping what is unsent: closing would otherwise wait until it has gone out, with the whole loop."""
    with contextlib.suppress(*_FAULTS):
        port.reset_output_buffer()
    with contextlib.suppress(*_FAULTS):
        port.close()


def _reason(error: BaseException) -> str:
    """What went wrong, in words, without pyserial's nested numbers."""
    number = getattr(error, "errno", None)
    if number is None and isinstance(error.__context__, termios.error):
        number = error.__context__.args[0]
    if number in (errno.EAGAIN, errno.EBUSY):
        return "in use by another program"
    return {
        errno.ENOENT: "there is no such port",
        errno.ENOTTY: "no serial port, or one that cannot do this",
        errno.EINVAL: "the port cannot do this baud rate, parity or stop bits",
    }.get(number or 0) or (os.strerror(number) if number else str(error))
