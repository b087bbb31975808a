"""Waiting for what another task brings about."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any


async def until(condition: Callable[[], Any], bound_s: float = 30.0) -> None:
    """Return when `condition` is true; fail after `bound_s`."""
    loop = asyncio.get_running_loop()
    give_up_at = loop.time() + bound_s
    while not condition():
        assert loop.time() < give_up_at, "it did not come"
        await asyncio.sleep(0.005)
