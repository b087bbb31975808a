"""Triggers from outside that are no controller: serial ports, by lines of text, by any byte, or by a control line."""

from __future__ import annotations

from typing import Protocol


class TriggerError(Exception):
    """Base of all trigger errors. The message says what was seen, what was expected, and the next step."""


class TriggerUnavailable(TriggerError):
    """The port is not there, is busy, or has gone; opening again later may help."""


class LineTrigger(Protocol):
    """A two-way line of text. Blocking: the service gives it a thread of its own."""

    def open(self) -> None:
        """Open the port; raise TriggerUnavailable. Opening an open port does nothing."""

    def read_line(self, timeout_s: float) -> bytes | None:
        """The next line without its end, or None when `timeout_s` passed without one; raise TriggerUnavailable."""

    def write_line(self, text: str) -> None:
        """Send `text` (ASCII) and a line end; raise TriggerUnavailable."""

    def close(self) -> None:
        """Let the port go; never raises."""


class PulseTrigger(Protocol):
    """A one-way trigger that carries nothing but its moment. Blocking: the service gives it a thread of its own."""

    def open(self) -> None:
        """Open the port; raise TriggerUnavailable. Opening an open port does nothing."""

    def wait(self, timeout_s: float) -> bool:
        """True as soon as a job is asked for, False when `timeout_s` passed without; raise TriggerUnavailable."""

    def close(self) -> None:
        """Let the port go; never raises."""
