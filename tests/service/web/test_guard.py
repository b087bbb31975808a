"""Whose requests the page answers, by the address that was called."""

from __future__ import annotations

import asyncio

import pytest
from starlette.types import Message, Receive, Scope, Send

from service.web.guard import Guard, plain_address


async def _served(_scope: Scope, _receive: Receive, send: Send) -> None:
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b""})


def status_of(called: str, host: str) -> int:
    """What a GET gets at a socket's address, under a host's name."""
    told: list[Message] = []

    async def send(message: Message) -> None:
        told.append(message)

    async def receive() -> Message:
        return {"type": "http.request", "body": b""}

    scope: Scope = {
        "type": "http",
        "method": "GET",
        "path": "/",
        "scheme": "http",
        "server": (called, 9770),
        "headers": [(b"host", host.encode())],
    }
    asyncio.run(Guard(_served, ["cutter.plant.example"])(scope, receive, send))
    return int(told[0]["status"])


@pytest.mark.parametrize(
    ("called", "host", "status"),
    [
        ("10.0.0.20", "10.0.0.20:9770", 200),
        ("::ffff:10.0.0.20", "10.0.0.20:9770", 200),  # page.host "::" takes both, and tells IPv4 so
        ("::ffff:127.0.0.1", "localhost:9770", 200),
        ("::ffff:10.0.0.20", "localhost:9770", 421),
        ("::ffff:10.0.0.20", "10.0.0.21:9770", 421),
        ("::1", "[::1]:9770", 200),
        ("fd00::20", "[FD00::20]:9770", 200),
        ("fd00::20", "cutter.plant.example", 200),
        ("10.0.0.20", "evil.example:9770", 421),
    ],
)
def test_it_answers_to_the_address_that_was_called_and_to_its_names(called: str, host: str, status: int) -> None:
    assert status_of(called, host) == status


def test_a_visitor_from_ipv4_is_noted_by_the_address_people_know() -> None:
    assert [plain_address(one) for one in ("::ffff:10.0.0.7", "10.0.0.7", "fd00::7", "::ffff:1")] == [
        "10.0.0.7",
        "10.0.0.7",
        "fd00::7",
        "::ffff:1",
    ]
