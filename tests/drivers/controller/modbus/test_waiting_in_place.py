"""Replies taken without a turn of the event loop, and what happens to those that are late.

The other end keeps messages apart, so replies can lie ready before they are asked for: nothing here depends on time.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from collections.abc import AsyncIterator, Iterator

import pytest

from drivers.controller import ControllerUnavailable
from drivers.controller.modbus.reply_waiting import InPlaceWaiting
from drivers.controller.modbus.request_queue import RequestQueue
from drivers.controller.modbus.requests import read_registers, registers_of
from drivers.controller.modbus.transports import TcpTransport

READ = read_registers(0, 1)


@pytest.fixture
def far() -> Iterator[tuple[socket.socket, socket.socket]]:
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    near.setblocking(False)
    with near, far:
        yield near, far


@pytest.fixture
async def connection(
    far: tuple[socket.socket, socket.socket], monkeypatch: pytest.MonkeyPatch
) -> AsyncIterator[RequestQueue]:
    monkeypatch.setattr(InPlaceWaiting, "worth", lambda *_: True)
    near, _ = far
    opened = RequestQueue(TcpTransport("there", 502, begin=lambda: 0), (near.fileno(), near.close), 1, 5.0)
    yield opened
    opened.end(ControllerUnavailable("the test is over"))


def says(end: socket.socket, transaction: int, pdu: bytes) -> None:
    end.send(struct.pack(">HHHB", transaction, 0, len(pdu) + 1, 1) + pdu)


def value(number: int) -> bytes:
    return struct.pack(">BBH", 3, 2, number)


async def test_a_prompt_reply_takes_no_turn_of_the_event_loop(
    connection: RequestQueue, far: tuple[socket.socket, socket.socket]
) -> None:
    says(far[1], 1, value(7))
    turns: list[int] = []
    asyncio.get_running_loop().call_soon(turns.append, 1)
    (reply,) = await connection.run([READ])
    assert registers_of(reply) == (7,)
    assert turns == []


async def test_a_row_of_prompt_replies_lets_the_event_loop_turn_once_before_it(
    connection: RequestQueue, far: tuple[socket.socket, socket.socket]
) -> None:
    for number in (1, 2, 3, 4):
        says(far[1], number, value(number))
    row = asyncio.ensure_future(connection.run([READ] * 3))
    other = asyncio.ensure_future(connection.run([READ]))
    assert [registers_of(reply) for reply in await row] == [(1,), (3,), (4,)]
    assert registers_of((await other)[0]) == (2,)


async def test_a_reply_that_is_late_comes_through_the_event_loop(
    connection: RequestQueue, far: tuple[socket.socket, socket.socket]
) -> None:
    asyncio.get_running_loop().call_later(0.001, says, far[1], 1, value(7))
    (reply,) = await connection.run([READ])
    assert registers_of(reply) == (7,)


async def test_a_row_goes_on_in_place_after_a_late_reply(
    connection: RequestQueue, far: tuple[socket.socket, socket.socket]
) -> None:
    def late_then_two() -> None:
        for number in (1, 2, 3):
            says(far[1], number, value(number))

    asyncio.get_running_loop().call_later(0.001, late_then_two)
    assert [registers_of(reply) for reply in await connection.run([READ] * 3)] == [(1,), (2,), (3,)]


async def test_the_other_end_going_away_meanwhile_is_an_error(
    connection: RequestQueue, far: tuple[socket.socket, socket.socket]
) -> None:
    far[1].close()
    with pytest.raises(ControllerUnavailable, match="there:502"):
        await connection.run([READ])


async def test_a_glance_gives_the_reply_that_is_there(
    connection: RequestQueue, far: tuple[socket.socket, socket.socket]
) -> None:
    says(far[1], 1, value(7))
    assert connection.at_once(READ) == value(7)


async def test_a_glance_without_a_reply_gives_none_and_its_late_reply_is_no_others(
    connection: RequestQueue, far: tuple[socket.socket, socket.socket]
) -> None:
    assert connection.at_once(READ) is None
    asking = asyncio.ensure_future(connection.run([READ]))
    await asyncio.sleep(0)
    says(far[1], 1, value(1))
    says(far[1], 2, value(2))
    assert registers_of((await asking)[0]) == (2,)


@pytest.mark.parametrize("pdu", [b"\x83\x02", b"\x83\x0b", b"\x10\x00\x00\x00\x01"])
async def test_a_glance_that_is_refused_or_answered_with_nonsense_gives_none(
    connection: RequestQueue, far: tuple[socket.socket, socket.socket], pdu: bytes
) -> None:
    says(far[1], 1, pdu)
    assert connection.at_once(READ) is None


async def test_a_glance_does_not_jump_the_queue(
    connection: RequestQueue, far: tuple[socket.socket, socket.socket]
) -> None:
    asking = asyncio.ensure_future(connection.run([READ]))
    await asyncio.sleep(0)
    assert connection.at_once(READ) is None
    says(far[1], 1, value(1))
    assert registers_of((await asking)[0]) == (1,)
    assert len(far[1].recv(100)) == 12  # one request, and no other behind it
    with pytest.raises(BlockingIOError):
        far[1].recv(100, socket.MSG_DONTWAIT)


async def test_a_glance_on_a_connection_that_has_ended_gives_none(connection: RequestQueue) -> None:
    connection.end(ControllerUnavailable("gone"))
    assert connection.at_once(READ) is None
