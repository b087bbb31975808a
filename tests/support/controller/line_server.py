"""A Modbus RTU server of a few lines, which answers when and what a test tells it to."""

from __future__ import annotations

import asyncio
import contextlib
import os
import struct
from collections.abc import Callable

from tests.support.controller.rtu_frames import frame


class LineServer:
    """Answers on the serial port `device`, in the order of the requests. Use as an async context manager.

    delays_s: how long the next replies take, one after the other; then none. A reply shows the registers as they were
        when its request came.
    behind: requests whose replies are kept back until later ones come.
    reply: makes the bytes to send of a request and its right reply, both whole frames.
    """

    def __init__(self, device: str, device_id: int = 1) -> None:
        self.registers = [0] * 10_000
        self.requests: list[bytes] = []
        self.delays_s: list[float] = []
        self.behind = 0
        self._kept: list[bytes] = []
        self.reply: Callable[[bytes, bytes], bytes] = lambda request, right: right
        self._device_id = device_id
        self._line = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._received = b""
        self._replies: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()

    async def __aenter__(self) -> LineServer:
        asyncio.get_running_loop().add_reader(self._line, self._read)
        self._answering = asyncio.create_task(self._answer())
        return self

    async def __aexit__(self, *_: object) -> None:
        asyncio.get_running_loop().remove_reader(self._line)
        self._answering.cancel()
        await asyncio.wait([self._answering])
        os.close(self._line)

    def say(self, data: bytes) -> None:
        """Send bytes that nobody asked for."""
        os.write(self._line, data)

    def _read(self) -> None:
        with contextlib.suppress(BlockingIOError):
            self._received += os.read(self._line, 4096)
        while len(self._received) >= 8:
            length = 9 + self._received[6] if self._received[1] == 16 else 8
            if len(self._received) < length:
                return
            request, self._received = self._received[:length], self._received[length:]
            self.requests.append(request)
            self._kept.append(self.reply(request, self._right(request)))
            while len(self._kept) > self.behind:
                self._replies.put_nowait((self.delays_s.pop(0) if self.delays_s else 0.0, self._kept.pop(0)))

    def _right(self, request: bytes) -> bytes:
        function_code, address, count = struct.unpack_from(">BHH", request, 1)
        if function_code == 3:
            values = self.registers[address : address + count]
            body = struct.pack(f">BBB{count}H", self._device_id, 3, 2 * count, *values)
        else:
            values = struct.unpack_from(f">{count}H", request, 7) if function_code == 16 else (count,)
            self.registers[address : address + len(values)] = values
            body = request[:6]
        return frame(body)

    async def _answer(self) -> None:
        while True:
            delay_s, data = await self._replies.get()
            await asyncio.sleep(delay_s)
            os.write(self._line, data)
