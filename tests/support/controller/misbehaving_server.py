"""A hand-made Modbus TCP server that answers as a test tells it to: rightly, wrongly, late, in part, or not at all."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Awaitable, Callable


def right_reply(request: bytes, value: int = 0) -> bytes:
    """The reply that the standard asks for: FC3 gives registers of `value`, FC6 and FC16 echo."""
    function_code = request[7]
    if function_code == 3:
        count = int.from_bytes(request[10:12], "big")
        pdu = bytes([3, 2 * count]) + struct.pack(">H", value) * count
    else:
        pdu = request[7:12]
    return request[:4] + (len(pdu) + 1).to_bytes(2, "big") + request[6:7] + pdu


def exception_reply(request: bytes, code: int) -> bytes:
    """The exception response with `code`."""
    return request[:4] + b"\x00\x03" + request[6:7] + bytes([request[7] | 0x80, code])


class MisbehavingServer:
    """Listens on a free loopback port. `behave` gets each request and its connection's writer."""

    def __init__(self) -> None:
        self.behave: Callable[[bytes, asyncio.StreamWriter], Awaitable[None]] = self.behave_well
        self.value = 0
        self.requests: list[bytes] = []
        self.open_connections = 0
        self.connections = 0
        self._writers: list[asyncio.StreamWriter] = []

    async def behave_well(self, request: bytes, writer: asyncio.StreamWriter) -> None:
        """Answer as the standard asks."""
        writer.write(right_reply(request, self.value))

    async def be_silent(self, request: bytes, writer: asyncio.StreamWriter) -> None:
        """No reply at all."""

    async def asked(self) -> bool:
        """True from the first request on."""
        return bool(self.requests)

    def reply_with(self, reply: Callable[[bytes], bytes]) -> None:
        """Answer each request with `reply` of it."""

        async def behave(request: bytes, writer: asyncio.StreamWriter) -> None:
            writer.write(reply(request))

        self.behave = behave

    @property
    def port(self) -> int:
        return self._server.sockets[0].getsockname()[1]

    def say(self, data: bytes) -> None:
        """Send bytes that nobody asked for on the newest connection."""
        self._writers[-1].write(data)

    async def __aenter__(self) -> MisbehavingServer:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        return self

    async def __aexit__(self, *_: object) -> None:
        self._server.close()
        for writer in self._writers:
            writer.close()
        while self.open_connections:
            await asyncio.sleep(0.001)
        await self._server.wait_closed()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.open_connections += 1
        self.connections += 1
        self._writers.append(writer)
        try:
            while True:
                head = await reader.readexactly(6)
                request = head + await reader.readexactly(int.from_bytes(head[4:6], "big"))
                self.requests.append(request)
                await self.behave(request, writer)
        except (asyncio.IncompleteReadError, ConnectionError):
            writer.close()
        finally:
            self.open_connections -= 1
