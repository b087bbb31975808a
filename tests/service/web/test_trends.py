"""How much of trends is asked for at once, held by the endpoints themselves."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path
from typing import Any

import pytest
from starlette.requests import Request

from service.records.journal import Journal
from service.web.commands import RequestRefused
from service.web.trends.endpoints import AGAIN_S, MOST_WAITING, TrendEndpoints


async def test_beyond_the_most_that_may_wait_one_is_refused_and_each_that_ends_makes_room(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    Journal(path).close()
    pages: Any = None  # what is made here is no page
    endpoints = TrendEndpoints(path, pages)
    request = Request({"type": "http", "query_string": b"hours=1", "headers": []})
    held = threading.Event()

    def made(_history: object) -> str:
        assert held.wait(60)
        return "made"

    waiting = [asyncio.create_task(endpoints._made(request, made)) for _ in range(MOST_WAITING)]
    await asyncio.sleep(0)
    with pytest.raises(RequestRefused, match="are being answered already") as refused:
        await endpoints._made(request, made)
    assert (refused.value.status, refused.value.again_s) == (503, AGAIN_S)
    held.set()
    assert await asyncio.gather(*waiting) == ["made"] * MOST_WAITING
    assert await endpoints._made(request, made) == "made"
    endpoints.close()
