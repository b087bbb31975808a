"""The cutting machine's controller: a role, one attempt a call, and what is thrown when an attempt fails."""

from __future__ import annotations

from typing import Protocol

from drivers.controller.errors import (
    ContourTooLarge,
    ControllerError,
    ControllerNonsense,
    ControllerRefused,
    ControllerTimeout,
    ControllerUnavailable,
    MailboxError,
)
from drivers.controller.mailbox.blocks import LinkBlock, ServiceBlock
from drivers.controller.mailbox.pages import Page

__all__ = [
    "ContourTooLarge",
    "Controller",
    "ControllerError",
    "ControllerNonsense",
    "ControllerRefused",
    "ControllerTimeout",
    "ControllerUnavailable",
    "LinkBlock",
    "MailboxError",
    "Page",
    "ServiceBlock",
]


class Controller(Protocol):
    """The controller's registers. asyncio; requests of several tasks are put in a queue, one in flight.

    After ControllerUnavailable (and its heirs) the connection is closed; `connect` opens a new one.
    So it is after a request was cancelled: its reply may still come and must not be taken for another's.
    """

    @property
    def connected(self) -> bool:
        """True while requests can be tried."""

    async def connect(self) -> None:
        """Open a new connection, closing an old one first; raise ControllerUnavailable.

        It returns when no reply to a request on an earlier connection can be taken for one on this.
        """

    async def close(self) -> None:
        """Close the connection; never raises."""

    async def read_link(self) -> LinkBlock:
        """The controller's block, one FC3 of 16 registers."""

    def glance(self) -> LinkBlock | None:
        """The same where it can be had at once, holding the event loop for milliseconds at most; else None."""

    async def read_service(self) -> ServiceBlock:
        """The service's own block as the controller holds it, one FC3 of 16 registers."""

    async def write_service(self, block: ServiceBlock) -> None:
        """Write the service's block whole, one FC16."""

    async def write_transfer(self, transfer: int) -> None:
        """Write the commit register alone."""

    async def write_page(self, page: Page) -> None:
        """Write part block, payload and header without the commit register, in as few FC16 as the limit allows."""

    async def read_page(self, payload_length: int, part_length: int = 0) -> Page:
        """Read header without the commit register, `payload_length` registers of payload and the part block's back."""
