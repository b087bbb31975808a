"""A link that runs over a scripted controller."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress

from service.link.link import Link, LinkSettings
from tests.support.service.scripted_controller import ScriptedController

QUICK = LinkSettings(poll_period_s=0.01, heartbeat_timeout_s=0.15)


@asynccontextmanager
async def linked(controller: ScriptedController, settings: LinkSettings = QUICK) -> AsyncIterator[Link]:
    link = Link(controller, settings)
    task = asyncio.ensure_future(link.run())
    try:
        yield link
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
