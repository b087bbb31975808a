"""A Modbus TCP proxy that loses, cuts off and delays requests as a test tells it to."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from enum import Enum


class Fate(Enum):
    """What becomes of a request."""

    PASS = "passed on, and its reply passed back"
    LOSE_REQUEST = "never passed on"
    LOSE_REPLY = "done, but the reply is lost"
    CUT_BEFORE = "not passed on, and the client's connection ends"
    CUT_AFTER = "done, and the client's connection ends instead of a reply"
    LATE = "done only after `lateness_s`, also when the client has long gone; the reply is lost"


class FaultProxy:
    """Listens on a free loopback port and stands between a client and the server on `port` of loopback.

    fate: decides on each request, a whole Modbus TCP frame. Use as an async context manager.
    """

    def __init__(self, port: int, fate: Callable[[bytes], Fate], lateness_s: float = 0.05) -> None:
        self.fate = fate
        self.fates: list[Fate] = []
        self._target = port
        self._lateness_s = lateness_s
        self._tasks: set[asyncio.Task[None]] = set()

    @property
    def port(self) -> int:
        return self._server.sockets[0].getsockname()[1]

    async def __aenter__(self) -> FaultProxy:
        self._server = await asyncio.start_server(self._accept, "127.0.0.1", 0)
        return self

    async def __aexit__(self, *_: object) -> None:
        self._server.close()
        while self._tasks:
            for task in list(self._tasks):
                task.cancel()
            await asyncio.wait(self._tasks)
        await self._server.wait_closed()

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._keep(asyncio.create_task(self._carry(reader, writer)))

    def _keep(self, task: asyncio.Task[None]) -> None:
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        server_reader, server_writer = await asyncio.open_connection("127.0.0.1", self._target)
        try:
            while True:
                request = await _frame(reader)
                fate = self.fate(request)
                self.fates.append(fate)
                if fate is Fate.LATE:
                    self._keep(asyncio.create_task(self._deliver_late(request)))
                if fate in (Fate.PASS, Fate.LOSE_REPLY, Fate.CUT_AFTER):
                    server_writer.write(request)
                    reply = await _frame(server_reader)
                    if fate is Fate.PASS:
                        writer.write(reply)
                if fate in (Fate.CUT_BEFORE, Fate.CUT_AFTER):
                    return
        except (asyncio.IncompleteReadError, ConnectionError):
            return
        finally:
            writer.close()
            server_writer.close()

    async def _deliver_late(self, request: bytes) -> None:
        await asyncio.sleep(self._lateness_s)
        reader, writer = await asyncio.open_connection("127.0.0.1", self._target)
        try:
            writer.write(request)
            await _frame(reader)
        except (asyncio.IncompleteReadError, ConnectionError):
            return
        finally:
            writer.close()


async def _frame(reader: asyncio.StreamReader) -> bytes:
    head = await reader.readexactly(6)
    return head + await reader.readexactly(int.from_bytes(head[4:6], "big"))
