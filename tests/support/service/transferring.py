"""One transfer over a scripted controller, and what it made durable on its way."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress

import numpy as np

from drivers.controller.mailbox.pages import ContourMessage, Page, encode_pages, withdrawal
from service.link.link import Link, LinkSettings
from service.link.transfer import Transfer
from service.link.transfer_terms import (
    Lifetime,
    Outgoing,
    Settlement,
    TransferCounter,
    TransferSettings,
    TransferSteps,
    Validity,
)
from service.reasons import Reason
from tests.support.service.scripted_controller import ScriptedController

JOB, SESSION = 7, 9
VALIDITY = Validity(captured_at=60_000, valid_for=30_000)  # of `page`
QUICK = TransferSettings(ready_timeout_s=0.3, ack_timeout_s=0.1, max_repeats=3, poll_period_s=0.01)


def page(job_id: int = JOB, session: int = SESSION) -> Page:
    ring = np.array([[0, 0], [100_000, 0], [100_000, 50_000], [0, 50_000]])
    message = ContourMessage(job_id, (ring,), 5000, 200, 60_000, 1, False, False, 30_000, session, 5)
    (only,) = encode_pages(message, 1984, "big")
    return only


class Run:
    """One transfer and what it made durable on its way."""

    def __init__(
        self,
        controller: ScriptedController,
        link: Link,
        settings: TransferSettings,
        lifetime_s: float,
        pages: tuple[Page, ...],
        validity: Validity,
    ) -> None:
        self.controller, self.link = controller, link
        self.durable: list[str] = []
        self.transfer = Transfer(
            link,
            settings,
            TransferCounter(100),
            Outgoing(JOB, SESSION, pages, withdrawal(JOB, SESSION, "big"), validity),
            Lifetime(time.monotonic() + lifetime_s),
            TransferSteps(self._sending, self._withdrawing),
        )

    async def _sending(self) -> None:
        assert self.controller.count("write_page") == 0, "sent before it was durable"
        self.durable.append("sent")

    async def _withdrawing(self, reason: Reason) -> None:
        self.durable.append(f"withdraw {reason.label}")

    async def end(self, bound_s: float = 60.0) -> Settlement:
        return await asyncio.wait_for(self.transfer.run(), bound_s)


@asynccontextmanager
async def transferring(
    controller: ScriptedController,
    settings: TransferSettings = QUICK,
    lifetime_s: float = 5.0,
    pages: tuple[Page, ...] | None = None,
    validity: Validity = VALIDITY,
) -> AsyncIterator[Run]:
    link = Link(controller, LinkSettings(handshake=settings.handshake, poll_period_s=0.01, heartbeat_timeout_s=0.3))
    task = asyncio.ensure_future(link.run())
    try:
        yield Run(controller, link, settings, lifetime_s, pages or (page(),), validity)
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
