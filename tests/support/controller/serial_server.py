"""A serial server: one TCP client at a time, its bytes carried to and from a serial port, untouched."""

from __future__ import annotations

import asyncio
import contextlib
import os


class SerialServer:
    """Listens on a free loopback port in front of serial port `device`. Use as an async context manager."""

    def __init__(self, device: str) -> None:
        self._line = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._writer: asyncio.StreamWriter | None = None

    @property
    def port(self) -> int:
        return self._server.sockets[0].getsockname()[1]

    async def __aenter__(self) -> SerialServer:
        asyncio.get_running_loop().add_reader(self._line, self._from_line)
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.stop()

    async def stop(self) -> None:
        """Hang up and listen no more; a second call does nothing."""
        if self._line < 0:
            return
        asyncio.get_running_loop().remove_reader(self._line)
        os.close(self._line)
        self._line = -1
        self._server.close()
        if self._writer is not None:
            self._writer.close()
        await self._server.wait_closed()

    def _from_line(self) -> None:
        with contextlib.suppress(BlockingIOError):
            data = os.read(self._line, 4096)
            if self._writer is not None and not self._writer.is_closing():
                self._writer.write(data)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writer = writer
        with contextlib.suppress(ConnectionError):
            while data := await reader.read(4096):
                if self._line >= 0:
                    os.write(self._line, data)
        writer.close()
