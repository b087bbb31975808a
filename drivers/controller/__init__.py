"""The cutting machine's controller: a role, one attempt a call, and what is thrown when an attempt fails."""

from __future__ import annotations

from typing import Protocol

from drivers.controller.mailbox import LinkBlock, Page, ServiceBlock


class ControllerError(Exception):
    """Base of all controller errors. The message says what was seen, what was expected, and the next step."""


class ControllerUnavailable(ControllerError):
    """No connection, or it was lost: the request may have been done, may not, or may be done later."""


class ControllerTimeout(ControllerUnavailable):
    """No matching reply within the time-out: the request may have been done, may not, or may be done later."""


class ControllerRefused(ControllerError):
    """The controller answered with a Modbus exception; `code` is its exception code."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class ControllerNonsense(ControllerUnavailable):
    """A reply that does not match its request (class, unit, address, count): nothing on this connection counts."""


class Controller(Protocol):
    """The controller's registers. asyncio; requests of several tasks are put in a queue, one in flight.

    After ControllerUnavailable (and its heirs) the connection is closed; `connect` opens a new one.
    """

    @property
    def connected(self) -> bool:
        """True while requests can be tried."""

    async def connect(self) -> None:
        """Open a new connection, closing an old one first; raise ControllerUnavailable."""

    async def close(self) -> None:
        """Close the connection; never raises."""

    async def read_link(self) -> LinkBlock:
        """The controller's block, one FC3 of 16 registers."""

    async def read_service(self) -> ServiceBlock:
        """The service's own block as the controller holds it, one FC3 of 16 registers."""

    async def write_service(self, block: ServiceBlock) -> None:
        """Write the service's block whole, one FC16."""

    async def write_transfer(self, transfer: int) -> None:
        """Write the commit register alone, FC6."""

    async def write_page(self, page: Page) -> None:
        """Write payload and header without the commit register, in as few FC16 as the limit allows."""

    async def read_page(self, payload_length: int) -> Page:
        """Read header without the commit register and `payload_length` registers of payload back."""
