"""Errors of the controller's drivers.

ControllerError
├── ControllerUnavailable    no connection, or it was lost
│   ├── ControllerTimeout    no matching reply in time
│   └── ControllerNonsense   a reply that does not match its request
├── ControllerRefused        a Modbus exception: the controller says no
└── MailboxError             values that the mailbox cannot hold
    └── ContourTooLarge      more rings or vertices than its pages can carry
"""

from __future__ import annotations


class ControllerError(Exception):
    """Base of all controller errors. The message says what was seen, what was expected, and the next step."""


class ControllerUnavailable(ControllerError):
    """No connection, or it was lost: the request may have been done, may not, or may be done later."""


class ControllerTimeout(ControllerUnavailable):
    """No matching reply within the time-out: the request may have been done, may not, or may be done later.

    Also the exceptions 5 (acknowledge) and 11 (gateway target did not respond), which say just that.
    """


class ControllerRefused(ControllerError):
    """The controller answered with a Modbus exception, so it did not do it; `code` is its exception code."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class ControllerNonsense(ControllerUnavailable):
    """A reply that does not match its request (class, unit, address, count): nothing on this connection counts.

    answered_as: the device id that it came from, where all that is wrong so far is that it is another one.
    """

    def __init__(self, message: str, answered_as: int | None = None) -> None:
        super().__init__(message)
        self.answered_as = answered_as


class MailboxError(ControllerError):
    """A value that the mailbox cannot hold: its name, what was seen, the range."""


class ContourTooLarge(MailboxError):
    """More rings, vertices or pages than the mailbox can carry (reject reason 130)."""
